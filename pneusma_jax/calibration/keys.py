"""Known keys of each kind of table, their dimensions, and the required ones.

This is the file to change when a law gains a constant.
"""

from collections.abc import Iterable, Mapping

from .. import units

STATUSES = ("printed", "corrected", "reconstructed", "assumed", "fitted")
KINDS = ("alloy", "silicone", "actuator")
SILICONE_TESTS = ("standard_tension", "bulk_compression", "tube_tension", "tube_buckling", "needle_buckling")
SIDES = tuple(f"side_{k}" for k in range(1, 9))
SIDE_WORDS = ("spring", "fibre", "none")
SECTIONS = {  # dimensions of each kind of cross-section; a polygon's outer line is an outline
    "annulus": ("outer_diameter", "wall_thickness"),
    "semicircle": ("outer_diameter", "wall_thickness"),
    "rectangle": ("width", "height", "wall_thickness"),
    "polygon": (),
}
ORIENTATIONS = {  # direction of gravity in the base frame of `kinematics`: z from base to tip, side 1 at +y
    "vertical_base_down": (0.0, 0.0, -1.0),  # clamped below, tip up
    "vertical_base_up": (0.0, 0.0, 1.0),  # hangs
    "horizontal": (0.0, -1.0, 0.0),  # side 1 uppermost
}
BENDING = ("planar", "free")


def _numbered(stem: str, count: int) -> list[str]:
    return [f"{stem}_{i}" for i in range(1, count + 1)]


_GROUPS: dict[str, dict[str, list[str]]] = {
    "alloy": {
        "number": [
            *_numbered("beta", 3), *_numbered("ka", 3), *_numbered("km", 3), "a", "b", "c", "a_mean",
            "b_mean", "gamma_max", "gamma_L", "eps_L", "poisson_ratio",
            "gR_amplitude", "gR_slope", "gR_shift", "gR_decay",
        ],
        "resistance per length": ["rho_mean", "rho_span", "alpha_1", "alpha_2"],
        "pressure": ["G_m", "G_a", "E_m", "E_a"],
        units.TEMPERATURE: ["T_mid", "T_ambient"],
        units.TEMPERATURE_DIFFERENCE: ["T_width"],
        "density": ["density"],
        "heat capacity": ["heat_capacity"],
        "heat transfer coefficient": ["convection"],
    },
    "silicone": {
        "pressure": [
            *(f"{test}.{key}" for test in SILICONE_TESTS for key in _numbered("p", 8)),
            *_numbered("p", 8), *_numbered("mu", 4), "c_10", "c_20", "c_30", "mu", "mu_printed",
            "minimum_slope",
        ],
        "number": [
            *(f"{test}.strain_{end}" for test in SILICONE_TESTS for end in ("min", "max")),
            *_numbered("alpha", 4), "j_m", "strain_min", "strain_max",
            "blend_half_width", "clip_min", "clip_max", "silicone_stiffness",
        ],
        "density": ["density"],
    },
    "actuator": {
        "length": [
            "outer_diameter", "wall_thickness", "length", "wire_diameter", "mandrel_diameter",
            "initial_pitch", "free_length", "attached_length", "width", "height",
            *_numbered("x", len(SIDES)), *_numbered("y", len(SIDES)), "tip_x", "tip_y",
        ],
        "number": ["active_coils", "prestrain"],
        "stiffness": ["fibre_stiffness"],
        "angle": [*_numbered("angle", len(SIDES)), "bending_plane"],
        "mass": ["tip_mass"],
        "acceleration": ["gravity_x", "gravity_y", "gravity_z"],
        "force": ["tip_force_x", "tip_force_y", "tip_force_z"],
    },
}  # fmt: skip
# closed lines of vertices, for each kind of table
OUTLINES: dict[str, tuple[str, ...]] = {"alloy": (), "silicone": (), "actuator": ("outer_line", "bore_line")}

# key -> dimension, for each kind; a number in a nested table has a dotted key
QUANTITIES: dict[str, dict[str, str]] = {
    kind: {key: dimension for dimension, keys in groups.items() for key in keys}
    for kind, groups in _GROUPS.items()
}
POSITIVE = frozenset({
    "outer_diameter", "wall_thickness", "length", "wire_diameter", "mandrel_diameter", "initial_pitch",
    "active_coils", "free_length", "attached_length", "fibre_stiffness", "density", "heat_capacity",
    "convection", "width", "height", "G_m", "G_a", "E_m", "E_a", "gamma_max", "T_width", "blend_half_width",
    "silicone_stiffness", "c",
})  # fmt: skip

REQUIRED_TEXT = ("schema", "name", "kind")
TEXT = {
    "alloy": (*REQUIRED_TEXT, "description", "citation", "caution"),
    "silicone": (*REQUIRED_TEXT, "description", "citation", "caution", "law"),
    "actuator": (
        *REQUIRED_TEXT, "description", "citation", "caution", "material", "alloy", "section", "orientation",
        "bending", *SIDES,
    ),
}  # fmt: skip
# words that a text of a table may be; the rest is free
WORDS: dict[str, dict[str, Iterable[str]]] = {
    "actuator": {
        "section": SECTIONS, "orientation": ORIENTATIONS, "bending": BENDING,
        **{side: SIDE_WORDS for side in SIDES},
    },
}  # fmt: skip

# constants that a table may leave out where it has another: which, value, unit, and why
DEFAULTS: dict[str, tuple[str, float, str, str]] = {
    "c": ("a", 1.0, "1", "Eq. 2.41, which has no second exponent")
}

_DETWINNING = [*_numbered("beta", 3), *_numbered("ka", 3)]
_SPRING_ALLOY = [
    *_DETWINNING, "rho_mean", "rho_span", *_numbered("km", 3), "alpha_1", "alpha_2", "a", "b", "gamma_max",
    "G_m", "G_a", "gamma_L", "poisson_ratio", "gR_amplitude", "gR_slope", "gR_shift", "gR_decay",
    "T_mid", "T_width", "density", "heat_capacity", "convection",
]  # fmt: skip
_WIRE_ONLY, _SPRING_ONLY = ["E_m", "E_a", "eps_L"], ["G_m", "G_a", "gamma_L"]
_SPRING_GEOMETRY = [
    "wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length", "attached_length",
    "prestrain",
]  # fmt: skip
LAWS = {
    "regularised": [
        *(f"{test}.{key}" for test in ("standard_tension", "needle_buckling") for key in _numbered("p", 5)),
        "blend_half_width", "clip_min", "clip_max", "minimum_slope",
    ],
    "polynomial": _numbered("p", 5),
    "neo_hookean": ["mu"],
    "yeoh": ["c_10", "c_20", "c_30"],
    "gent": ["mu", "j_m"],
    "ogden": ["mu_1", "alpha_1"],
}  # fmt: skip


def nested_tables(kind: str) -> set[str]:
    """Names of the tables inside a table of this kind."""
    return {key.split(".")[0] for key in QUANTITIES[kind] if "." in key}


def required_quantities(kind: str, present: Iterable[str], text: Mapping[str, str]) -> list[str]:
    """Quantities that a table cannot do without, given what else is in it.

    Args:
        kind: `alloy`, `silicone` or `actuator`.
        present: names of the given quantities. An alloy with any of `E_m`, `E_a`, `eps_L` is a straight
            wire's. It needs a spring's constants only if it has one of `G_m`, `G_a`, `gamma_L`. A silicone
            test that has one number needs all of its own.
        text: the strings of the table, already checked: `law` of a silicone, sides of a design.

    Returns:
        Names, in the order of the documentation.
    """
    present = set(present)
    if kind == "alloy":
        if not present & set(_WIRE_ONLY):
            return _SPRING_ALLOY
        wire = [*_DETWINNING, *_WIRE_ONLY, "T_mid", "T_width"]
        return wire + (_SPRING_ALLOY if present & set(_SPRING_ONLY) else [])
    if kind == "silicone":
        tests = [test for test in SILICONE_TESTS if any(key.startswith(f"{test}.") for key in present)]
        domains = [f"{test}.strain_{end}" for test in tests for end in ("min", "max")]
        return LAWS[text["law"]] + domains + _lower_coefficients(present)
    has_springs = "spring" in (text.get(side) for side in SIDES)
    section = SECTIONS[text.get("section", "annulus")]
    return [*section, "length", *(_SPRING_GEOMETRY if has_springs else [])]


def other_alloy(name: str, present: Iterable[str]) -> str | None:
    """Words on an alloy of another kind of specimen than the one that needs a key; None for any other table.

    Args:
        name: key that is missing.
        present: names of the given quantities.
    """
    of_wire, of_spring = (bool(set(present) & set(own)) for own in (_WIRE_ONLY, _SPRING_ONLY))
    if of_spring and not of_wire and name in _WIRE_ONLY:
        return f"this is an alloy of springs, but one of straight wires is needed here (it lacks {name!r})"
    if of_wire and not of_spring and name in _SPRING_ALLOY:
        return f"this is an alloy of straight wires, but one of springs is needed here (it lacks {name!r})"
    return None


def _lower_coefficients(present: set[str]) -> list[str]:
    """A polynomial with a coefficient p_n needs p_1 to p_(n-1) too."""
    needed = []
    for key in present:
        stem, _, number = key.rpartition("_")
        if stem.split(".")[-1] == "p":
            needed += [f"{stem}_{i}" for i in range(1, int(number))]
    return sorted(set(needed))
