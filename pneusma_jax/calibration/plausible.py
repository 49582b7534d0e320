"""Magnitudes that a constant or a dimension can have. One far outside may be written in another unit.

Most limits are a decade wider than what is known of such specimens. A factor of 1000 (MPa for GPa, mm for m)
from an ordinary value leads outside. A number is refused only where it is ordinary in that other unit.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from .. import units
from .records import Quantity


class Limits(NamedTuple):
    """Magnitudes that a quantity can have, in internal units.

    Attributes:
        least, most: limits of what is to be expected; nothing within them is asked about.
        usual: limits of what is usual; a unit that leads there is probably meant.
    """

    least: float
    most: float
    usual: tuple[float, float]


_MODULUS = Limits(1e9, 5e11, (1e10, 1.2e11))  # nitinol: 20 to 90 GPa
_SHEAR = Limits(1.5e8, 2e11, (2.5e9, 5e10))  # of springs; priors of unknown alloys from 0.2 GPa
_RUBBER = Limits(1e2, 1e8, (1e3, 1e7))  # shear moduli: gels 1 kPa, stiff rubbers some MPa
_STRESS = Limits(0.0, 1e10, (0.0, 1e9))  # coefficients of a law, which may be small or negative
_PER_LENGTH = Limits(1e-2, 1e5, (0.5, 2e3))  # 0.9 microohm m; wires of 25 um have 1800 ohm/m, of 1 mm 1.1
_WIDE = Limits(5e-4, 1.0, (2e-3, 0.1))
_LONG = Limits(1e-3, 20.0, (5e-3, 1.0))
_STRAIN = Limits(0.0, 20.0, (0.0, 3.0))

LIMITS: Mapping[str, Mapping[str, Limits]] = {
    "pressure": {
        **dict.fromkeys(("E_m", "E_a"), _MODULUS),
        **dict.fromkeys(("G_m", "G_a"), _SHEAR),
        **dict.fromkeys(("mu", "mu_printed", "c_10"), _RUBBER),
        **dict.fromkeys(("c_20", "c_30", "minimum_slope"), _STRESS),
        **dict.fromkeys((f"mu_{k}" for k in range(1, 5)), _STRESS),
        **dict.fromkeys((f"p_{k}" for k in range(1, 9)), _STRESS),
    },
    "resistance per length": dict.fromkeys(("rho_mean", "alpha_1"), _PER_LENGTH),
    units.TEMPERATURE: {
        "T_mid": Limits(-200.0, 700.0, (-100.0, 150.0)),  # nitinol -100 to 120 degC; NiTiPd and NiTiPt hotter
        "T_ambient": Limits(-100.0, 200.0, (0.0, 50.0)),
    },
    "number": {
        "gamma_L": Limits(1e-4, 1.0, (0.01, 0.3)),
        "gamma_max": Limits(1e-4, 1.0, (0.01, 0.5)),
        "eps_L": Limits(1e-4, 0.5, (0.005, 0.15)),
        "poisson_ratio": Limits(0.0, 0.5, (0.2, 0.5)),
        "prestrain": Limits(0.0, 1.0, (0.0, 0.5)),
        **dict.fromkeys(("strain_min", "strain_max", "clip_min", "clip_max"), _STRAIN),
    },
    "density": {"density": Limits(100.0, 3e4, (900.0, 9e3))},
    "length": {
        "outer_diameter": _WIDE, "width": _WIDE, "height": _WIDE,
        "wall_thickness": Limits(1e-5, 0.1, (1e-4, 1e-2)),
        **dict.fromkeys(("length", "free_length", "attached_length"), _LONG),
        "wire_diameter": Limits(5e-6, 2e-2, (5e-5, 2e-3)),
        "mandrel_diameter": Limits(2e-5, 0.2, (2e-4, 2e-2)),
        "initial_pitch": Limits(5e-6, 0.1, (5e-5, 1e-2)),
        "gauge_length": Limits(5e-4, 10.0, (5e-3, 0.5)),
        "diameter": Limits(5e-6, 0.5, (5e-5, 5e-2)), "thickness": Limits(1e-5, 0.5, (1e-4, 5e-2)),
        "span": _LONG, "depth": Limits(1e-5, 0.5, (1e-4, 5e-2)),
    },
    "area": {"area": Limits(1e-12, 0.1, (1e-8, 1e-3))},
}  # fmt: skip
"""Limits by dimension and name; those of a coefficient or a strain are of its magnitude."""
_PROPOSED = (
    "kPa", "MPa", "GPa", "mm", "um", "m", "degC", "K", "ohm/m", "percent", "mm2", "m2", "g/cm3", "kg/m3",
)  # fmt: skip
"""Units that a message proposes, in its order."""


def implausible(name: str, dimension: str, written: float, unit: str) -> str:
    """Reason why a number is in another unit, and what would be right; empty where no other one convinces.

    Another unit convinces where the number is usual in it, and far from usual in the stated one.

    Args:
        name: name of the constant or dimension.
        dimension: its dimension.
        written: the number as it is written.
        unit: its written unit.
    """
    limits = _limits_of(name, dimension)
    if limits is None or _is_possible(written, unit, limits):
        return ""
    first, last = limits.usual
    meant = [
        other
        for other in _alike(unit)
        if first <= _size(written, other, limits) <= last
        if _outside(_size(written, unit, limits), limits) >= _far(unit, other)
    ]
    if not meant:
        return ""
    ways = " or ".join(units.amount(f"{written:.6g}", other) for other in meant)
    stated = units.amount(f"{written:.6g}", unit)
    return f"{stated} cannot be, {_told(name, limits, unit, meant)}; did you mean {ways}?"


def unusual(name: str, dimension: str, written: float, unit: str) -> str:
    """Question about a number that is far from usual, where no other unit convinces; empty otherwise.

    Args:
        name, dimension, written, unit: as in `implausible`.
    """
    limits = _limits_of(name, dimension)
    if limits is None or written == 0.0 or _is_possible(written, unit, limits):
        return ""
    if implausible(name, dimension, written, unit):
        return ""
    stated = units.amount(f"{written:.6g}", unit)
    return f"{stated} is unusual, {_told(name, limits, unit, _alike(unit))} mostly; is the unit right?"


def questions(quantities: Mapping[str, Quantity]) -> list[str]:
    """Questions about numbers of a table that are far from usual, each with the number's name.

    Args:
        quantities: quantities of the table by name.
    """
    asked = []
    for name, quantity in quantities.items():
        written, unit = float(units.from_si(quantity.value, quantity.unit)), quantity.unit
        if why := unusual(name, units.dimension_of(unit), written, unit):
            asked.append(f"{name}: {why}")
    return asked


def _limits_of(name: str, dimension: str) -> Limits | None:
    return LIMITS.get(dimension, {}).get(name.rpartition(".")[2])


def _is_possible(written: float, unit: str, limits: Limits) -> bool:
    return limits.least <= _size(written, unit, limits) <= limits.most


def _told(name: str, limits: Limits, unit: str, others: Sequence[str]) -> str:
    """Words on where a quantity lies, in the written unit where that makes numbers of few digits."""
    shown = next((u for u in (unit, *others) if 1e-3 <= abs(units.from_si(limits.usual[1], u)) < 1e6), unit)
    lies = " to ".join(f"{units.from_si(end, shown):.6g}" for end in (limits.least, limits.most))
    return f"{name} lies in {units.amount(lies, shown)}"


FAR = 100.0
"""Minimum factor outside the usual range at which a unit with another prefix convinces. Films, gels and fine
tubes lie nearer. Where two units differ by less than 1000, a tenth of their ratio is enough."""


def _far(unit: str, other: str) -> float:
    one, two = (units.UNITS[u] for u in (unit, other))
    if one.offset != two.offset:
        return 0.0  # degC and kelvin
    ratio = max(one.factor, two.factor) / min(one.factor, two.factor)
    return min(FAR, ratio / 10.0)


def _outside(size: float, limits: Limits) -> float:
    """Factor by which a positive size lies outside the usual range."""
    first, last = limits.usual
    if size <= 0.0:
        return math.inf
    return (1.0 + 1e-9) * max(size / last, first / size)


def _alike(unit: str) -> list[str]:
    """Proposed units of the dimension of a unit."""
    return [other for other in _PROPOSED if units.dimension_of(other) == units.dimension_of(unit)]


def _size(written: float, unit: str, limits: Limits) -> float:
    value = float(units.to_si(written, unit))
    return abs(value) if limits in (_STRESS, _STRAIN) else value
