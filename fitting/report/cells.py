"""Formatting of numbers as cells of tables and words of sentences.

None stands for a number that does not apply and gives an empty text. A computed number that is not finite is
never silent: it reads `n/a` or `infinite`.
"""

import math

from fitting.inference.numbers import number
from fitting.inference.parameters import format_estimate


def percent(fraction: float | None) -> str:
    """A fraction in percent, with its sign `%`; from 100 % on without decimals."""
    if fraction is None or not math.isfinite(fraction):
        return number(fraction)
    return f"{100.0 * fraction:{'.2g' if abs(fraction) < 0.995 else '.0f'}} %"


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
    return f"{100.0 * abs(sd / value):.2g} %" if known else ""


def with_unit(name: str, unit: str) -> str:
    """A name with its unit in brackets; a pure number (`1`) has none."""
    return name if unit in ("1", "") else f"{name} [{unit}]"
