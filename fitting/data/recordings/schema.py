"""What a recording may hold: the columns of each kind, the keys of its sidecar, default tolerances.

Tables only; the checks that use them are in `columns.py`, `sidecar.py` and `checks.py`, nominal values of the
geometry in `nominal.py`.
"""

import re
from dataclasses import dataclass

KINDS = ("spring", "wire", "elastomer", "tube", "actuator")
ROLES = ("fit", "validation")


@dataclass(frozen=True)
class Columns:
    """The columns of one kind, by canonical name (unit after the last underscore; none for plain numbers).

    Attributes:
        required: must all be there.
        optional: understood when there.
        one_of: at least one must be there (empty: no such rule).
        outputs: what the model can predict, the rest being what drives it.
    """

    required: tuple[str, ...]
    optional: tuple[str, ...] = ()
    one_of: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()

    @property
    def known(self) -> tuple[str, ...]:
        """Every column that this kind understands."""
        return tuple(dict.fromkeys(self.required + self.one_of + self.optional))


COLUMNS = {
    "spring": Columns(
        required=("time_s", "elongation_mm", "force_N"),
        one_of=("resistance_ohm", "temperature_degC"),  # either tells the phase
        optional=("current_A", "setpoint_ohm"),
        outputs=("force_N", "resistance_ohm"),
    ),
    "wire": Columns(
        required=("time_s", "strain", "stress_MPa"),
        optional=("temperature_degC", "resistance_ohm"),
        outputs=("strain", "stress_MPa"),
    ),
    "elastomer": Columns(
        required=("strain", "stress_kPa"), optional=("time_s", "cycle"), outputs=("stress_kPa",)
    ),
    "tube": Columns(required=("time_s", "pressure_kPa", "length_mm"), outputs=("length_mm",)),
    "actuator": Columns(
        required=("time_s", "pressure_kPa"),
        one_of=("curvature_1pm", "bend_angle_deg", "length_mm"),
        optional=(
            *(f"resistance_{k}_ohm" for k in (1, 2, 3)),
            *(f"current_{k}_A" for k in (1, 2, 3)),
            "temperature_degC",
            "bend_direction_deg",
        ),
        outputs=("curvature_1pm", "bend_angle_deg", "length_mm", "bend_direction_deg"),
    ),
}

ZEROS = {"elastomer": ("strain", "stress_kPa")}
"""Columns whose zero a fit can find, by kind: the table `[zero]` holds one standard deviation of each."""
PLAIN = frozenset({"strain", "cycle"})  # canonical columns that carry no unit


def quantity_and_unit(name: str) -> tuple[str, str]:
    """Split a canonical column name into its quantity and its unit ("1" for a plain number)."""
    if name in PLAIN:
        return name, "1"
    quantity, _, unit = name.rpartition("_")
    return quantity, unit


DESIGNS = ("pneusma1", "pneusma2", "pneuflex_s", "pneuflex_t", "pneuflex_w", "triad")
ORIENTATIONS = ("vertical_base_down", "vertical_base_up", "horizontal")
LAWS = ("polynomial", "neo_hookean", "yeoh", "gent", "ogden")

# Numbers of the [geometry] table: canonical key -> (smallest value, may it equal that value?).
GEOMETRY_NUMBERS = {
    "outer_diameter_mm": (0.0, False),
    "wall_thickness_mm": (0.0, False),
    "length_mm": (0.0, False),
    "wire_diameter_mm": (0.0, False),
    "mandrel_diameter_mm": (0.0, False),
    "initial_pitch_mm": (0.0, False),
    "active_coils": (0.0, False),
    "free_length_mm": (0.0, False),
    "attached_length_mm": (0.0, False),
    "prestrain": (0.0, True),
    "cycles_before": (0.0, True),
    "tip_to_base_clearance_deg": (0.0, False),
}
GEOMETRY_WITHOUT_UNIT = frozenset({"active_coils", "prestrain", "cycles_before"})
# Words of the [geometry] table: key -> allowed words (None: a name or a path, checked where it is loaded).
GEOMETRY_WORDS = {
    "design": DESIGNS,
    "orientation": ORIENTATIONS,
    "law": LAWS,
    "alloy": None,
    "material": None,
}
GEOMETRY_KEYS = (*GEOMETRY_NUMBERS, *GEOMETRY_WORDS)


def geometry_unit(key: str) -> str:
    """Unit of a number of the [geometry] table."""
    return "1" if key in GEOMETRY_WITHOUT_UNIT else quantity_and_unit(key)[1]


ALLOY_PARAMETERS = (
    *(f"{family}_{k}" for family in ("beta", "ka", "km") for k in (1, 2, 3)),
    *("rho_mean", "rho_span", "alpha_1", "alpha_2", "a", "b", "G_m", "G_a", "gamma_L", "gamma_max"),
    *("gR_amplitude", "gR_slope", "gR_shift", "gR_decay"),
    *("E_m", "E_a", "eps_L", "T_mid", "T_width"),
)
MATERIAL_PARAMETERS = (
    *(f"p_{k}" for k in range(1, 6)),
    *("mu", "c_10", "c_20", "c_30", "j_m"),
    *(f"{family}_{k}" for family in ("mu", "alpha") for k in (1, 2, 3)),
)
TOLERANCE_KEYS = (
    *GEOMETRY_NUMBERS,
    *ALLOY_PARAMETERS,
    *(key for key in MATERIAL_PARAMETERS if key not in ALLOY_PARAMETERS),
    "silicone_stiffness",
)
# Used where no [tolerance] table is given; a table that is given is complete.
TOLERANCE_DEFAULTS = {
    **{key: 0.02 for key in GEOMETRY_NUMBERS if re.search(r"(diameter|length|pitch)_mm$", key)},
    "wall_thickness_mm": 0.03,
    "G_m": 0.05,
    "G_a": 0.05,
    "gamma_L": 0.03,
    "silicone_stiffness": 0.05,
    **{key: 0.003 for key in ("rho_mean", "rho_span", "alpha_1", "alpha_2")},
    "a": 0.02,
    "b": 0.02,
}

SIDECAR_KEYS = (
    "kind", "role", "specimen", "real", "source", "noise", "geometry", "tolerance", "constant", "zero",
)  # fmt: skip
CAMPAIGN_KEYS = ("title", "tolerance", "geometry", "constant", "zero")
NOT_STATED = "not stated"  # what a sidecar says of a citation or licence that nobody gave
