"""Rows of zeros at the end of a table, which a logger wrote as it ran on without its instruments."""

from dataclasses import replace

import numpy as np

from .grid import Grid
from .other_headings import quantity_by_word
from .separators import LEAST_ROWS
from .spelling import Heading
from .words import meaning

RAN_ON = "did the logger run on without its instruments?"
LEAST_ZERO = 3
"""Minimum number of rows of zeros under a clock that goes on. A test that returns to rest has one or two."""
FELL = 0.2
"""Minimum reading above such rows, over the largest of its column [1]. A test that is unloaded is slow. It is
also the maximum reading where the drive is least that may be one at rest."""


def without_rows_of_zeros(grid: Grid, drive: int | None = None) -> Grid:
    """A table without rows of zeros at its end whose clock is zero, too; others there are asked about.

    Rows of zeros under a clock that goes on may be a specimen at rest. They are asked about where a column
    falls to them from far, and where no such rows stand elsewhere. Nothing is asked where every column is
    near zero while the drive is, because a specimen at rest reads so, too. Rows without a time are dropped
    without a question.

    Args:
        grid: table of one test, or of several.
        drive: column of the quantity that is driven, from 0; None if it is not known.
    """
    clocks = [c for c, heading in enumerate(grid.headings) if _is_clock(heading)]
    counts, time = _counts(grid), grid.values[:, clocks]
    values = np.delete(grid.values, [*clocks, *counts], axis=1)
    zero = np.all(~(np.abs(values) > 0.0), axis=1) & np.any(values == 0.0, axis=1)
    kept = _rows_before(zero & np.all(time == 0.0, axis=1)) if clocks else len(zero)
    if LEAST_ROWS <= kept < len(zero) and np.any(time[kept - 1] > np.maximum(time[0], 0.0)):
        cut = replace(grid.cut(slice(0, kept)), breaks={k: v for k, v in grid.breaks.items() if k < kept})
        were = "It was" if len(zero) - kept == 1 else "They were"
        cut.notices.append(f"{_said(grid, kept)}, the clock included: {RAN_ON} {were} left out")
        return cut
    kept = _rows_before(zero)
    if not LEAST_ROWS <= kept <= len(zero) - LEAST_ZERO or np.sum(zero[:kept]) >= LEAST_ZERO:
        return grid
    if (clocks and np.isnan(time[kept:]).all()) or (
        drive is not None and _at_rest(grid.values[:kept], drive, [*clocks, *counts])
    ):
        return grid
    above = np.nan_to_num(np.abs(values[:kept]))
    if np.any(above[-1] > FELL * np.max(above, axis=0)):
        beside = " but the clock" if clocks else " but the count of rows" if counts else ""
        said = f"{_said(grid, kept)}{beside}, and the row above is not"
        asked = f"{said}: {RAN_ON} Then delete them in the file"
        grid.notices += [asked] if asked not in grid.notices else []
    return grid


def _rows_before(last: np.ndarray) -> int:
    """Number of rows before those at the end that are true; all rows if the last one is false."""
    return len(last) - int(np.argmin(last[::-1])) if not last.all() else 0


def _at_rest(values: np.ndarray, drive: int, aside: list[int]) -> bool:
    """True if all columns fall with the drive to near zero, so that zeros may be a specimen at rest.

    Where the drive is least, each column is compared with its largest reading. A drive that never came near
    zero excuses as much of the others.

    Args:
        values: numbers of the table above the rows of zeros, shape (rows, columns).
        drive: column of the driven quantity, from 0.
        aside: columns that are no readings.
    """
    sizes = np.abs(values)
    least = int(np.argmin(np.nan_to_num(sizes[:, drive], nan=np.inf)))
    driven = float(sizes[least, drive] / (np.nan_to_num(sizes[:, drive]).max() or 1.0))
    others = np.nan_to_num(np.delete(sizes, [drive, *aside], axis=1))
    return bool(np.all(others[least] <= (FELL + driven) * others.max(axis=0, initial=0.0)))


def _said(grid: Grid, kept: int) -> str:
    first, last = grid.rows[kept], grid.rows[-1]
    rows = f"row {last} at the end is" if first == last else f"rows {first} to {last} at the end are"
    return f"check: {rows} zero in every column"


def _is_clock(heading: Heading) -> bool:
    means = meaning(heading)
    return means is not None and means.quantity == "time"


def _counts(grid: Grid) -> list[int]:
    """Columns that count the rows: each number is one more than the one above it.

    The heading of such a column names no quantity and no unit, for a strain may rise by 1 %, too.
    """
    if len(grid.values) < 2:
        return []
    steady = np.flatnonzero(np.all(np.diff(grid.values, axis=0) == 1.0, axis=0))
    return [int(c) for c in steady if grid.headings and _names_nothing(grid.headings[c])]


def _names_nothing(heading: Heading) -> bool:
    return heading.unit is None and meaning(heading) is None and quantity_by_word(heading) is None
