"""Rows of zeros at the end of a table, which a logger wrote as it ran on without its instruments."""

from dataclasses import replace

import numpy as np

from .grid import Grid
from .separators import LEAST_ROWS
from .spelling import Heading
from .words import meaning

RAN_ON = "did the logger run on without its instruments?"
LEAST_ZERO = 3
"""Minimum number of rows of zeros under a clock that goes on. A test that returns to rest has one or two."""
FELL = 0.2
"""Minimum reading above such rows, over the largest of its column [1]. A test that is unloaded is slow."""


def without_rows_of_zeros(grid: Grid) -> Grid:
    """A table without rows of zeros at its end whose clock is zero, too; others there are asked about.

    Rows of zeros under a clock that goes on may be a specimen at rest. They are asked about where a column
    falls to them from far, and where no such rows stand elsewhere.

    Args:
        grid: table of one test, or of several.
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


def _said(grid: Grid, kept: int) -> str:
    first, last = grid.rows[kept], grid.rows[-1]
    rows = f"row {last} at the end is" if first == last else f"rows {first} to {last} at the end are"
    return f"check: {rows} zero in every column"


def _is_clock(heading: Heading) -> bool:
    means = meaning(heading)
    return means is not None and means.quantity == "time"


def _counts(grid: Grid) -> list[int]:
    """Columns that count the rows: each number is one more than the one above it."""
    if len(grid.values) < 2:
        return []
    return [int(c) for c in np.flatnonzero(np.all(np.diff(grid.values, axis=0) == 1.0, axis=0))]
