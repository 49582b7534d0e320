"""Numbers by which loggers mark a missing reading: all nines, ends of a converter's range, or huge ones."""

import re

import numpy as np

from pneusma_jax.errors import counted

from .grid import Grid

HUGE = 1e30
"""Minimum magnitude that no reading reaches in any unit. Instruments mark overflow by 1e37 or 9.9e37."""
ENDS = (
    -999.25,
    *(2.0**bits - 1.0 for bits in (15, 16, 23, 31, 32)),
    *(-(2.0**bits) for bits in (15, 16, 23, 31, 32)),
)
"""Numbers that mean no reading: that of well logs, and the ends of converters of 16, 24 and 32 bits."""
LONGEST_QUOTED = 24
"""Maximum number of characters of a number that a notice quotes."""
APART = 100.0
"""Minimum distance from all other numbers, in ranges of these, at which a whole number is no reading."""


def drop_marks(grid: Grid) -> None:
    """Remove the marks for a missing reading that lie far from every other number; ask about the nearer ones.

    A number that is too large for double precision, such as `1e400`, is a mark in any place.

    A mark is far if it lies farther from all others than these from each other. One that lies outside the
    others, by more than their largest step, is kept and reported. The grid is changed in place.
    """
    for column in range(grid.values.shape[1]):
        values = grid.values[:, column]
        _drop_infinite(grid, column)
        finite = values[np.isfinite(values)]
        distinct = np.unique(finite)
        marks = [*filter(_is_mark, distinct[_may_be_mark(distinct)]), *_far_ends(distinct)]
        others = np.sort(finite[~np.isin(finite, marks)])
        if not marks or others.size < 2:
            continue
        label = _label(grid, column)
        for value in dict.fromkeys(marks):
            where = values == value
            count = int(where.sum())
            found = f"{value:.10g} in {counted(count, 'row')} of {label} (first in row"
            found = f"check: {found} {grid.rows[int(np.argmax(where))]})"
            gap = float(np.min(np.abs(others - value)))
            if gap > np.ptp(others):
                said = (
                    f"{found} lies farther from all others than these from each other: taken as a mark for no"
                    " reading, so missing"
                )
                values[where] = np.nan
            elif not others[0] <= value <= others[-1] and gap > float(np.diff(others).max()):
                said = (
                    f"{found} lies apart from all others and was kept; if it marks no reading, leave these"
                    " fields empty"
                )
            else:
                continue
            grid.notices.append(said)
            grid.marked[said] = column


def _label(grid: Grid, column: int) -> str:
    return repr(grid.headings[column].text) if grid.headings else f"column {column + 1}"


def _drop_infinite(grid: Grid, column: int) -> None:
    """Remove the numbers of a column that are too large for double precision, and report them."""
    where = np.flatnonzero(np.isinf(grid.values[:, column]))
    if not where.size:
        return
    text = grid.texts(column)[where[0]]
    text = text if len(text) <= LONGEST_QUOTED else text[:LONGEST_QUOTED] + " ..."
    grid.notices.append(
        f"check: {text!r} in {counted(where.size, 'row')} of {_label(grid, column)} (first in row"
        f" {grid.rows[where[0]]}) is beyond double precision: taken as a mark for no reading,"
        " so missing"
    )
    grid.values[where, column] = np.nan


def _may_be_mark(values: np.ndarray) -> np.ndarray:
    """True for numbers whose whole part is all nines, and for those that are marks in themselves."""
    whole = np.floor(np.abs(values)) + 1.0
    power = np.round(np.log10(whole))
    return (whole == 10.0**power) & (power >= 2.0) | (np.abs(values) >= HUGE) | np.isin(values, ENDS)


def _is_mark(value: float) -> bool:
    """True if a number consists of two or more nines, is the end of a converter's range, or exceeds any
    physical reading."""
    nines = bool(re.fullmatch(r"-?99+(\.9+|\.0*)?", f"{value:.10g}"))
    return nines or abs(value) >= HUGE or value in ENDS


def _far_ends(distinct: np.ndarray) -> list[float]:
    """The least and the largest number, if it is whole and lies farther from all others than a hundred times
    their range.

    Args:
        distinct: sorted numbers, each once.
    """
    if distinct.size < 3:
        return []
    ends = (distinct[0], distinct[1] - distinct[0], distinct[1:]), (
        distinct[-1], distinct[-1] - distinct[-2], distinct[:-1],
    )  # fmt: skip
    return [float(v) for v, gap, rest in ends if v == np.round(v) and gap / APART > rest[-1] - rest[0] > 0.0]
