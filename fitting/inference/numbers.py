"""Text of numbers in sentences and tables.

A computed number that is not finite is never silent: it reads `n/a` or `infinite`.
"""

import math

UNKNOWN = "n/a"
"""Text of an unknown number (NaN)."""
LARGE = 1e6
"""Minimum of numbers that are written with a power of ten."""


def number(value: float | None, form: str = ".3g") -> str:
    """Text of a number. Large ones have no power of ten: `6660`, not `6.66e+03`.

    Args:
        value: number, or None for an empty text.
        form: Python format; three significant digits by default.
    """
    if value is None:
        return ""
    if math.isfinite(value):
        text = format(value, form)
        return format(float(text), ".0f") if "e+" in text and abs(value) < LARGE else text
    return UNKNOWN if math.isnan(value) else ("infinite" if value > 0.0 else "-infinite")
