"""Magnitudes that a constant or a dimension can have. One outside is written in another unit than is stated.

Most limits are a decade wider than what is known of such specimens, so that no unusual one is refused. A
factor of 1000 (MPa for GPa, mm for m) from an ordinary value leads outside, and so do kelvin for degC.
"""

from collections.abc import Mapping
from typing import NamedTuple

from .. import units


class Limits(NamedTuple):
    """Magnitudes that a quantity can have, in internal units.

    Attributes:
        least, most: limits of what is possible.
        usual: limits of what is usual; a unit that leads there is probably meant.
    """

    least: float
    most: float
    usual: tuple[float, float]


_MODULUS = Limits(1e9, 5e11, (1e10, 1.2e11))  # nitinol: 20 to 90 GPa
_SHEAR = Limits(1.5e8, 2e11, (1e9, 5e10))  # effective ones of springs; priors of unknown alloys from 0.2 GPa
_RUBBER = Limits(1e2, 1e8, (1e3, 1e7))  # shear moduli: gels 1 kPa, stiff rubbers some MPa
_STRESS = Limits(0.0, 1e9, (0.0, 2e7))  # coefficients of a law, which may be small or negative
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
        "T_mid": Limits(-200.0, 230.0, (-100.0, 150.0)),  # nitinol -100 to 120 degC
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
        "wire_diameter": Limits(5e-6, 2e-2, (2e-5, 2e-3)),
        "mandrel_diameter": Limits(2e-5, 0.2, (2e-4, 2e-2)),
        "initial_pitch": Limits(5e-6, 0.1, (2e-5, 1e-2)),
        "gauge_length": Limits(5e-4, 10.0, (5e-3, 0.5)),
        "diameter": Limits(5e-6, 0.5, (5e-5, 5e-2)), "thickness": Limits(1e-5, 0.5, (1e-4, 5e-2)),
        "span": _LONG, "depth": Limits(1e-5, 0.5, (1e-4, 5e-2)),
    },
    "area": {"area": Limits(1e-12, 0.1, (1e-8, 1e-3))},
}  # fmt: skip
"""Limits by dimension and name; those of a coefficient or a strain are of its magnitude."""
_PROPOSED = ("kPa", "MPa", "GPa", "mm", "um", "m", "degC", "K", "ohm/m", "percent", "mm2", "m2")
"""Units that a message proposes, in its order."""


def implausible(name: str, dimension: str, written: float, unit: str) -> str:
    """Reason why a number cannot be, and what would be right; empty for a possible one.

    Args:
        name: name of the constant or dimension.
        dimension: its dimension.
        written: the number as it is written.
        unit: its written unit.
    """
    limits = LIMITS.get(dimension, {}).get(name.rpartition(".")[2])
    if limits is None:
        return ""
    if limits.least <= _size(written, unit, limits) <= limits.most:
        return ""
    first, last = limits.usual
    meant = [other for other in _alike(unit) if first <= _size(written, other, limits) <= last]
    shown = next((u for u in _alike(unit) if 0.01 <= units.from_si(limits.usual[0], u) < 1e3), unit)
    lies = " to ".join(f"{units.from_si(end, shown):.6g}" for end in (limits.least, limits.most))
    ways = " or ".join(units.amount(f"{written:.6g}", other) for other in meant)
    likely = f"; did you mean {ways}?" if meant else ""
    stated = units.amount(f"{written:.6g}", unit)
    return f"{stated} cannot be, {name} lies in {units.amount(lies, shown)}{likely}"


def _alike(unit: str) -> list[str]:
    """Proposed units of the dimension of a unit."""
    return [other for other in _PROPOSED if units.dimension_of(other) == units.dimension_of(unit)]


def _size(written: float, unit: str, limits: Limits) -> float:
    value = float(units.to_si(written, unit))
    return abs(value) if limits in (_STRESS, _STRAIN) else value
