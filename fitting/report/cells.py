"""Formatting of numbers as cells of tables and words of sentences.

None stands for a number that does not apply and gives an empty text. A computed number that is not finite is
never silent: it reads `n/a` or `infinite`.
"""

import math

from fitting.inference.numbers import number
from fitting.inference.parameters import format_estimate

MOST_DIGITS = 15
"""Maximum number of significant digits: those of a double."""


def percent(fraction: float | None) -> str:
    """A fraction in percent, with its sign `%`; from 100 % on without decimals."""
    if fraction is None or not math.isfinite(fraction):
        return number(fraction)
    return f"{100.0 * fraction:{'.2g' if abs(fraction) < 0.995 else '.0f'}} %"


def digits_apart(*numbers: float, least: int = 4) -> int:
    """Number of significant digits that tell numbers apart: two of half the distance between the extremes."""
    width = 0.5 * (max(numbers) - min(numbers))
    size = max(map(abs, numbers))
    if not (math.isfinite(size) and width > 0.0):
        return least
    return min(max(least, math.floor(math.log10(size)) - math.floor(math.log10(width)) + 2), MOST_DIGITS)


def told_apart(*numbers: float, least: int = 4) -> list[str]:
    """Texts of numbers with as many digits as tell them apart; see `digits_apart`."""
    digits = digits_apart(*numbers, least=least)
    return [number(one, f".{digits}g") for one in numbers]


def with_half_width(value: float, half: float, decimals: int) -> str:
    """A number with the half-width of its interval: one digit of the width at least.

    Args:
        value: number to format.
        half: half-width of its interval.
        decimals: minimum number of decimals.
    """
    if math.isfinite(half) and half > 0.0:
        decimals = min(max(decimals, -math.floor(math.log10(half))), MOST_DIGITS)
    return f"{number(value, f'.{decimals}f')} ± {number(half, f'.{decimals}f')}"


def with_error(value: float, sd: float | None) -> str:
    """A number with its standard error, in the digits that the error supports.

    Args:
        value: number to format.
        sd: standard error; None or zero where no error belongs to the number, NaN where it is unknown.
    """
    if not math.isfinite(value):
        return number(value)
    if sd is None or sd == 0.0:
        return format_estimate(value)
    if not math.isfinite(sd):
        return f"{format_estimate(value)} ± {number(sd)}"
    return format_estimate(value, sd).replace("+/-", "±")


def relative(value: float, sd: float | None) -> str:
    """A standard error in percent of its number; empty where one of them is unknown."""
    known = sd is not None and math.isfinite(sd) and sd > 0.0 and math.isfinite(value) and value != 0.0
    return f"{number(100.0 * abs(sd / value), '.2g')} %" if known else ""


def with_unit(name: str, unit: str) -> str:
    """A name with its unit in brackets; a pure number (`1`) has none."""
    return name if unit in ("1", "") else f"{name} [{unit}]"
