"""Schema of a recording: the columns of each kind, the keys of its sidecar, default tolerances.

This module holds tables only. `columns.py`, `sidecar.py` and the modules behind `checks.py` use them.
Nominal values of the geometry are in `nominal.py`, the kinds themselves in `kinds.py`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

ROLES = ("fit", "validation")
IGNORED = "kept and ignored"
"""End of the notice on a column that no kind of recording has."""


@dataclass(frozen=True)
class Columns:
    """The columns of one kind, by canonical name (unit after the last underscore; none for plain numbers).

    Attributes:
        required: columns that must all be present.
        optional: columns that are used if present.
        one_of: columns of which at least one must be present (empty: no such rule).
        outputs: columns that the model can predict; the others drive it.
    """

    required: tuple[str, ...]
    optional: tuple[str, ...] = ()
    one_of: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()

    @property
    def known(self) -> tuple[str, ...]:
        """Every column that this kind understands."""
        return tuple(dict.fromkeys(self.required + self.one_of + self.optional))


class FileEvidence(Protocol):
    """Evidence of a CSV file without a sidecar about its kind."""

    held: frozenset[str]
    """Quantities that have a column or a constant."""

    def unit(self, quantity: str) -> str:
        """Unit in which a quantity is written; empty if unstated."""

    def largest(self, quantity: str) -> float:
        """Largest magnitude of a quantity; 0 without readings."""


Rule = tuple[str, Callable[[np.ndarray], np.ndarray], str]
"""A rule for values: the prefix of its columns, a function that marks wrong values, and a description of
right ones."""


@dataclass(frozen=True)
class Farthest:
    """Magnitudes of a plain number that are rather percent, where the name of its column states no unit.

    Attributes:
        refused: least magnitude that is refused.
        asked: least magnitude that is asked about.
    """

    refused: float
    asked: float


@dataclass(frozen=True)
class Kind:
    """Schema of the recordings of one kind of specimen. `kinds.py` has those of the project.

    Attributes:
        name: value of `kind` in a sidecar.
        columns: columns of the CSV file.
        nominal: function from the stated `[geometry]` to the nominal values of all keys of this kind.
        evidence_of: function from a CSV file without a sidecar to the reason why it is of this kind, in a few
            words. It returns None for any other file, and always for a kind that only a sidecar states.
        either: two columns, of which the steadier one drives the specimen and the other is predicted. It is
            empty if inputs and outputs are always the same columns.
        ranges: rules for values that only this kind has.
        farthest: what is too far for a column without a unit in its name, by canonical column.
        zeros: columns whose zero a fit can find; the table `[zero]` holds the standard deviation of each.
        geometry: keys of `[geometry]` that only this kind has, as in `GEOMETRY_NUMBERS`.
        channels: quantities that a protocol may prescribe; empty if no protocol is for this kind.
        needed: column of the channel that every protocol prescribes.
        numbered: true if a protocol's channels of heat carry the number of a spring, as for actuators.
        responses: pairs of a driving column and one that responds to it, the usual pair first.
        pulled: true if grips move the specimen and a load cell tells its force or stress: the first pair.
        bears: stress beyond which it is asked whether the specimen bears it, in the unit of its column, and
            its matter; None where no stress is recorded.
        sizes: keys of `[geometry]` that the lines of a raw file may state; empty for a cross-section and a
            gauge length, and for an actuator, which has its design's.
        identified: key of `[geometry]` that is `"fit"` where a raw file names no table; empty for none.
        assumed: keys of `[geometry]` whose words are the source's where nobody states them.
    """

    name: str
    columns: Columns
    nominal: Callable[[Mapping[str, Any]], dict[str, Any]]
    evidence_of: Callable[[FileEvidence], str | None] = lambda header: None
    either: tuple[str, ...] = ()
    ranges: tuple[Rule, ...] = ()
    farthest: Mapping[str, Farthest] = field(default_factory=dict)
    zeros: tuple[str, ...] = ()
    geometry: Mapping[str, tuple[float, bool]] = field(default_factory=dict)
    channels: tuple[str, ...] = ()
    needed: str = ""
    numbered: bool = False
    responses: tuple[tuple[str, str], ...] = ()
    pulled: bool = False
    bears: tuple[float, str] | None = None
    sizes: tuple[str, ...] = ()
    identified: str = ""
    assumed: tuple[str, ...] = ()

    @property
    def strained(self) -> bool:
        """True if files hold strain and stress, not elongation and force."""
        return "strain" in self.columns.known

    @property
    def pull(self) -> tuple[str, ...]:
        """Columns of position and force of a specimen that is pulled; empty for any other."""
        return self.responses[0] if self.pulled else ()


KINDS: dict[str, Kind] = {}
"""Every kind of recording by its name, in the order in which they were registered."""


def register(kind: Kind) -> Kind:
    """Register a kind of recording; files of it can then be read and written.

    Raises:
        ValueError: if its name, or a key of its geometry, is taken by another meaning.
    """
    if KINDS.setdefault(kind.name, kind) is not kind:
        raise ValueError(f"The kind {kind.name!r} is registered already.")
    for key, bounds in kind.geometry.items():
        if GEOMETRY_NUMBERS.setdefault(key, bounds) != bounds:
            raise ValueError(f"The geometry key {key!r} is taken with other bounds.")
    return kind


PLAIN = frozenset({"strain", "cycle"})  # canonical columns that carry no unit


def quantity_and_unit(name: str) -> tuple[str, str]:
    """Split a canonical column name into its quantity and its unit ("1" for a plain number)."""
    if name in PLAIN:
        return name, "1"
    quantity, _, unit = name.rpartition("_")
    return quantity, unit


def column_of(kind: str, quantity: str) -> str | None:
    """Canonical column of a quantity of a kind: `length_mm` of `length`; None if there is none."""
    known = KINDS[kind].columns.known
    return next((name for name in known if quantity_and_unit(name)[0] == quantity), None)


def names_quantity(key: str, canonical: str) -> bool:
    """True if a key names the quantity of a column or size, in any unit: `length_in` that of `length_mm`."""
    quantity, _ = quantity_and_unit(canonical)
    return key == quantity or (key.startswith(quantity + "_") and "_" not in key[len(quantity) + 1 :])


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


def with_zeros() -> list[str]:
    """Kinds of recordings with zeros that a fit can find."""
    return [name for name, kind in KINDS.items() if kind.zeros]


def geometry_keys() -> tuple[str, ...]:
    """Every key of the [geometry] table."""
    return (*GEOMETRY_NUMBERS, *GEOMETRY_WORDS)


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


def tolerance_keys() -> tuple[str, ...]:
    """Every key of the [tolerance] table."""
    material = (key for key in MATERIAL_PARAMETERS if key not in ALLOY_PARAMETERS)
    return (*GEOMETRY_NUMBERS, *ALLOY_PARAMETERS, *material, "silicone_stiffness")


# Defaults without a [tolerance] table; a stated table is complete.
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
    "noise_includes_rounding",
)  # fmt: skip
CAMPAIGN_KEYS = ("title", "tolerance", "geometry", "noise", "constant", "zero", "noise_includes_rounding")
NOT_STATED = "not stated"  # Text of a sidecar for an unknown citation or licence
IMPORTED = "raw_file"  # Key of `[source]` that only import writes
CLOCK, COUNTED = "clock", "rows counted"
"""Key of `[source]`, and its word where `time_s` only counts the rows of a file without clock."""
