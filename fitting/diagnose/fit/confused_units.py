"""Units that people confuse, and the factors by which a column in the wrong one is off."""

import itertools
import re

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.notes import joined
from pneusma_jax.units import UNITS, find_unit

from ..settings import DEFAULT

INSTRUMENTS = DEFAULT.instruments
SHARE = DEFAULT.share
SPRING = re.compile(r"_([12])(?=_|$)")
"""Number of a spring in a canonical column."""
_LENGTHS = (("mm", "cm", "in", "m", "um"),)
CONFUSED: dict[str, tuple[tuple[str, ...], ...]] = {
    "pressure": (("kPa", "bar", "psi", "mbar", "MPa"), ("kPa", "kgf/cm2"), ("kPa", "mmHg", "inHg", "cmH2O")),
    "stress": (("kPa", "psi", "MPa", "ksi", "GPa"), ("MPa", "kgf/mm2"), ("kPa", "kgf/cm2")),
    "strain": (("1", "%"),), "time": (("s", "ms", "min", "h"),), "length": _LENGTHS, "elongation": _LENGTHS,
    "force": (("N", "mN", "kN", "lbf", "gf", "kgf"),), "bend_angle": (("deg", "rad"),),
    "curvature": (("1/m", "1/cm", "1/mm", "1/in"),), "resistance": (("ohm", "mohm", "kohm"),),
    "current": (("A", "mA", "uA"),),
}  # fmt: skip
"""Units of which a file may state one where another of the same group is meant, by quantity. A canonical
column no longer has the stated unit. So psi that were read as bar are off by 1/14.5, which is no ratio to
kPa."""


def confused_pairs(column: str) -> list[tuple[float, str, str]]:
    """Ratio of each unit that may be meant to each that may be stated, and both names.

    Args:
        column: canonical column, with the number of its spring or without.

    Returns:
        Pairs whose ratio is one of units that are confused, see `Instruments.confused_units`.
    """
    found = []
    for group in CONFUSED.get(SPRING.sub("", schema.quantity_and_unit(column)[0]), ()):
        for meant, stated in itertools.permutations(group, 2):
            ratio = find_unit(meant).factor / find_unit(stated).factor
            if _are_confused(ratio) and (ratio, meant, stated) not in found:
                found.append((ratio, meant, stated))
    return found


def _are_confused(ratio: float) -> bool:
    least, most = INSTRUMENTS.confused_units
    return least <= max(ratio, 1.0 / ratio) <= most * (1.0 + SHARE.same)


def differ_less(one: float, other: float, share: float) -> bool:
    """True if two factors differ by less than a share, in their logarithm."""
    return bool(abs(np.log(one / other)) <= share)


_WORDS = {"1": "fractions"}


def units_of(column: str, factor: float) -> str:
    """Units between which a factor leads, such as `psi read as bar`; empty where it is none of such a pair.

    Pairs whose ratio differs too little for a refitted model to tell are named, too, the nearest first. So is
    a decimal point in another place, unless such a pair differs by that power of ten itself.

    Args:
        column: canonical column.
        factor: number by which its readings are multiplied [1].
    """
    if factor < 0.0:
        return ""
    near = [
        (ratio, f"{_WORDS.get(meant, meant)} read as {_WORDS.get(stated, stated)}")
        for ratio, meant, stated in confused_pairs(column)
        if differ_less(ratio, factor, SHARE.alike)
    ]
    ten = float(10.0 ** np.round(np.log10(factor)))
    is_pair = any(differ_less(ten, ratio, SHARE.same) for ratio, _ in near)
    if near and not is_pair and differ_less(ten, factor, SHARE.alike):
        near.append((ten, "a slip of the decimal point"))
    near.sort(key=lambda one: not differ_less(one[0], factor, SHARE.same))
    return joined([words for _, words in near], "or")


def factors_of(column: str) -> list[float]:
    """Factors by which a column in another unit than is stated would be off, and -1 [1].

    They are ratios between units that are confused, those of the column's unit to others of its dimension,
    and powers of ten. Of ratios that are nearly equal the first in this order counts, yet every power of ten
    does. The largest and its inverse come first.

    Args:
        column: canonical column.
    """
    unit, most = find_unit(schema.quantity_and_unit(column)[1]), INSTRUMENTS.confused_units[1]
    ratios = [ratio for ratio, _, _ in confused_pairs(column)]
    ratios += [other.factor / unit.factor for other in UNITS.values() if other.dimension == unit.dimension]
    tens = 10.0 ** np.arange(1.0, np.floor(np.log10(most)) + 1.0)
    found: list[float] = []
    for ratio in (*tens, *(max(r, 1.0 / r) for r in ratios)):
        shares = [SHARE.same if known in tens else SHARE.alike for known in found]
        known_apart = (not differ_less(ratio, *one) for one in zip(found, shares, strict=True))
        if _are_confused(ratio) and all(known_apart):
            found.append(float(ratio))
    found.sort(reverse=True)
    return [*(factor for ratio in found for factor in (ratio, 1.0 / ratio)), -1.0]
