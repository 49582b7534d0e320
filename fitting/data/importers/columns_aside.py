"""Columns of a file that become no quantity: named one by one, and compared where they have one heading."""

import shlex

import numpy as np

from pneusma_jax.units import UNITS

from .dates import may_be_clock
from .grid import Grid
from .making import Channel
from .spelling import unit_name
from .words import meaning

ROUNDING = 0.005
"""Maximum difference of one measurement in two units, as part of the largest value."""


def say_aside(grid: Grid, channels: dict[str, Channel]) -> list[str]:
    """Notices about the columns that no channel takes.

    A column whose heading names the same as that of a taken one is compared with it.
    """
    taken = {channel.column: quantity for quantity, channel in channels.items()}
    notices, aside = [], []
    for column, heading in enumerate(grid.headings):
        known = column in taken or column in grid.read_along or column - 1 in grid.by_row
        if known or not heading.text.strip():
            continue
        twin = next((other for other in taken if other >= 0 and _same_name(grid, column, other)), None)
        other = next((one for one in taken if one >= 0 and _numbered_like(grid, column, one)), None)
        if twin is None and other is not None:
            notices.append(_one_of_two(grid, column, other, taken[other]))
            continue
        if twin is None:
            aside.append(repr(heading.text))
        else:
            notices.append(_compared(grid, column, twin, taken[twin]))
    if "time" not in channels:
        clocks = [h for h in grid.headings if may_be_clock(h) and repr(h.text) in aside]
        notices += [
            f"check: {h.text!r} was left aside, and nothing else is a clock: if it is one, --map"
            f" time={shlex.quote(h.text)}"
            for h in clocks
        ]
        aside = [text for text in aside if text not in {repr(h.text) for h in clocks}]
    if aside:
        notices.append(f"columns left aside: {', '.join(aside)} (--map QUANTITY=COLUMN takes one)")
    return notices


def _same_name(grid: Grid, column: int, other: int) -> bool:
    first, second = grid.headings[other], grid.headings[column]
    if first.text.casefold() == second.text.casefold():
        return True
    means = meaning(first), meaning(second)
    if None in means or means[0] != means[1]:
        return False
    return first.unit == second.unit or _factor(first.unit, second.unit) is not None


def _numbered_like(grid: Grid, column: int, other: int) -> bool:
    """True if two headings name one quantity by one word, and differ by a number: `Strain 1`, `Strain 2`."""
    one, two = (meaning(grid.headings[c]) for c in (column, other))
    if one is None or two is None or one.tag == two.tag:
        return False
    same = (one.quantity, one.rank) == (two.quantity, two.rank)
    unit = grid.headings[column].unit == grid.headings[other].unit
    return same and unit and bool(np.isfinite(grid.values[:, column]).any())


def _one_of_two(grid: Grid, column: int, other: int, quantity: str) -> str:
    """Notice about a column whose heading differs by a number from that of a taken one."""
    first, second = grid.values[:, other], grid.values[:, column]
    there = np.isfinite(first) & np.isfinite(second)
    labels = [repr(grid.headings[c].text) for c in (column, other)]
    most = np.abs(first - second)[there].max() if there.any() else np.nan
    apart = f", from which it differs by up to {most:.4g}" if there.any() else ""
    return (
        f"check: {labels[0]} was left aside, and {labels[1]} taken{apart}; --map {quantity}={column + 1}"
        " takes the other; a mean of both needs a column of its own"
    )


def _factor(unit: str | None, other: str | None) -> float | None:
    """Factor from one unit to another of its dimension; None where they are not of one."""
    names = [unit_name(text or "?") for text in (other, unit)]
    units = [UNITS.get(name) for name in names]
    if None in units or units[0].dimension != units[1].dimension or units[0].dimension == "temperature":
        return None
    return units[0].factor / units[1].factor


def _compared(grid: Grid, column: int, other: int, quantity: str) -> str:
    """Notice about two columns with one heading."""
    first, second = grid.values[:, other], grid.values[:, column]
    units = [grid.headings[c].unit for c in (other, column)]
    if units[0] != units[1]:
        second = second * _factor(*units)
    both = f"{grid.headings[column].text!r} (column {column + 1}) is named as column {other + 1}"
    there = np.isfinite(first) & np.isfinite(second)
    if not np.isfinite(second).any():
        return f"{both}, but has no number in it, and was left aside"
    apart = float(np.abs(first - second)[there].max()) if there.any() else float("nan")
    rounding = ROUNDING * float(np.abs(first[there]).max()) if there.any() and units[0] != units[1] else 0.0
    if apart <= rounding and np.array_equal(np.isfinite(first), np.isfinite(second)):
        return f"{both} and repeats it: left aside"
    how = f"differs from it by up to {apart:.4g}" if there.any() else "is filled in other rows"
    return (
        f"check: {both} and {how}: column {other + 1} was taken; --map {quantity}={column + 1} takes the"
        " other"
    )
