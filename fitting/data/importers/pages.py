"""Tables below each other that are one test: pages of a log that repeats its headings, and logs that begin
with the newest row."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import counted

from .grid import Grid
from .names import first_few
from .sizes import sizes_in
from .words import meaning

MOST_STARTS = 6
"""Number of tables of one test whose first rows a notice lists."""
MOVED = 0.1
"""Minimum distance of a table's last reading from its first one, as part of the range."""
MOST_STEPS = 3.0
"""Maximum time between two pages of one log, in steps of its clock; of other columns, in median steps."""


def clock_column(grid: Grid) -> int | None:
    """Column of the clock that a table's headings name; None without one."""
    found = [(m.rank, c) for c, m in enumerate(map(meaning, grid.headings)) if m and m.quantity == "time"]
    filled = [(rank, c) for rank, c in found if np.isfinite(grid.values[:, c]).sum() > 1]
    return min(filled)[1] if filled else None


def oldest_first(grid: Grid) -> Grid:
    """A table in the order of its clock, where that goes back in every row."""
    column = clock_column(grid)
    if column is None:
        return grid
    time = grid.values[:, column]
    steps = np.diff(time[np.isfinite(time)])
    if steps.size < 2 or not (np.all(steps <= 0.0) and np.any(steps < 0.0)):
        return grid
    label = grid.headings[column].text
    values, origins = grid.values[::-1].copy(), dict(grid.origins)
    if column in origins:
        first = float(np.nanmin(values[:, column]))
        values[:, column] -= first
        origins[column] += first
    said = f"check: {label!r} goes back in every row, so the rows were read from the last to the first"
    return replace(
        grid, values=values, rows=grid.rows[::-1], cells=grid.cells[::-1], origins=origins, breaks={},
        notices=[*grid.notices, said],
    )  # fmt: skip


def joined_pages(grids: Sequence[Grid], named: Sequence[bool]) -> list[Grid]:
    """Tables in which one with the headings of the table above, whose clock goes on, is added to that one.

    The newest page may be the first one.

    Args:
        grids: tables of a page, in order.
        named: true for each table above which a specimen or its sizes are stated.
    """
    found: list[Grid] = []
    starts: list[list[int]] = []
    for grid, other in zip(grids, named, strict=True):
        both = None if other or not found else _one_test(found[-1], grid)
        if both is not None:
            found[-1] = both
            starts[-1].append(min(grid.rows))
        else:
            asked = (_other_headings, _without_clock, _perhaps_paused)
            said = next((text for ask in asked if found and (text := ask(found[-1], grid))), "")
            if said and not other:
                grid = replace(grid, notices=[*grid.notices, said])
            found.append(grid)
            starts.append([])
    return [_said(grid, rows) if rows else grid for grid, rows in zip(found, starts, strict=True)]


def states_a_specimen(grid: Grid, label: str) -> bool:
    """True if a label or sizes of a specimen stand above a table."""
    return bool(label or sizes_in(grid.preamble))


def _moved(grid: Grid, first: Grid, column: int) -> np.ndarray:
    """Times of a table on the clock of the first one."""
    apart = 0.0
    if column in grid.origins and column in first.origins:
        apart = grid.origins[column] - first.origins[column]
    return grid.values[:, column] + apart


def _one_test(above: Grid, below: Grid) -> Grid | None:
    """Two tables as one, in the order of their clock; None where it does not go on from one to the other."""
    column = clock_column(above)
    texts = [[heading.text for heading in grid.headings] for grid in (above, below)]
    if column is None or texts[0] != texts[1] or above.values.shape[1] != below.values.shape[1]:
        return None
    for first, second in ((above, below), (below, above)):
        times = _moved(second, first, column)
        if _goes_on(first.values[:, column], times):
            both = _both(first, second, column, times)
            return replace(both, preamble=above.preamble, notices=_notices(above, below))
    return None


def _perhaps_paused(above: Grid, below: Grid) -> str:
    """Question about a table in whose first row a column that moved goes on after a pause; or none."""
    pause = _pause(above, below)
    if pause is None:
        return ""
    goes_on, moved = _columns_go_on(above, below), _columns_moved(above)
    names = [
        repr(above.headings[c].text)
        for c in np.flatnonzero(goes_on & moved)
        if (means := meaning(above.headings[c])) is not None and means.quantity not in ("time", "cycle")
    ]
    if not names:
        return ""
    verb = "goes" if len(names) == 1 else "go"
    return (
        f"check: {' and '.join(names)} {verb} on from the table above to row {min(below.rows)}, and the clock"
        f" {pause:g} later: read as a test of its own, which begins at rest. If both are one test, delete the"
        " headings between them"
    )


def _pause(above: Grid, below: Grid) -> float | None:
    """Time from the last row of a table to the first of one with the same headings, by its clock; None where
    it is not later, or there is no clock."""
    column = clock_column(above)
    texts = [[heading.text for heading in grid.headings] for grid in (above, below)]
    if column is None or texts[0] != texts[1] or above.values.shape[1] != below.values.shape[1]:
        return None
    if len(above.values) < 2 or not len(below.values):
        return None
    pause = float(_moved(below, above, column)[0] - above.values[-1, column])
    return pause if pause > 0.0 else None


def _columns_go_on(above: Grid, below: Grid) -> np.ndarray:
    """True for columns that go on from the last row of the table above, and for the clock."""
    steps = _by_column(np.median, np.abs(np.diff(above.values, axis=0)))
    goes_on = np.abs(below.values[0] - above.values[-1]) <= MOST_STEPS * steps
    column = clock_column(above)
    if column is not None:
        goes_on[column] = True
    return goes_on


def _columns_moved(above: Grid) -> np.ndarray:
    """True for columns that do not end where they began."""
    return np.abs(above.values[-1] - above.values[0]) > MOVED * _by_column(np.ptp, above.values)


def _by_column(measure: Callable[[np.ndarray], float], values: np.ndarray) -> np.ndarray:
    """A number of every column's known values, shape (columns,); NaN of a column without any."""
    known = [column[np.isfinite(column)] for column in values.T]
    return np.array([measure(column) if column.size else np.nan for column in known])


def _other_headings(above: Grid, below: Grid) -> str:
    """Question about a table whose clock goes on from the one above, under headings that differ; or none."""
    columns = clock_column(above), clock_column(below)
    texts = [[heading.text for heading in grid.headings] for grid in (above, below)]
    if None in columns or texts[0] == texts[1] or above.values.shape[1] != below.values.shape[1]:
        return ""
    before, after = (grid.values[:, column] for grid, column in zip((above, below), columns, strict=True))
    if not _goes_on(before, after):
        return ""
    one, two = next(pair for pair in zip(*texts, strict=True) if pair[0] != pair[1])
    return (
        f"check: the clock goes on from the table above to row {min(below.rows)}, but a heading is {two!r}"
        f" and was {one!r}. So it was read as a test of its own. If both are one test, give them the same"
        " headings and units"
    )


def _without_clock(above: Grid, below: Grid) -> str:
    """Question about a table without a clock, in whose first row every column goes on from the table above.

    Nothing is asked where that table ends as it began: the next one may be another loop.
    """
    texts = [[heading.text for heading in grid.headings] for grid in (above, below)]
    if clock_column(above) is not None or not texts[0] or texts[0] != texts[1]:
        return ""
    if above.values.shape[1] != below.values.shape[1] or len(above.values) < 2 or not len(below.values):
        return ""
    if not (_columns_go_on(above, below).all() and _columns_moved(above).any()):
        return ""
    return (
        f"check: every column goes on from the table above to row {min(below.rows)}, and there is no clock:"
        " read as a test of its own. If both are one test, delete the headings between them"
    )


def _goes_on(before: np.ndarray, after: np.ndarray) -> bool:
    """True if times go on from others within a few of their steps."""
    before, after = before[np.isfinite(before)], after[np.isfinite(after)]
    if before.size < 2 or after.size < 1:
        return False
    step = float(np.median(np.abs(np.diff(before))))
    return bool(0.0 < after[0] - before[-1] <= MOST_STEPS * step)


def _both(first: Grid, second: Grid, column: int, times: np.ndarray) -> Grid:
    """Rows of one table and of another one, whose times in a column are on the clock of the first."""
    values = second.values.copy()
    values[:, column] = times
    moved = {place + len(first.rows): lines for place, lines in second.breaks.items()}
    return replace(
        first,
        values=np.vstack([first.values, values]),
        rows=[*first.rows, *second.rows],
        cells=[*first.cells, *second.cells],
        troubles={**second.troubles, **first.troubles},
        trouble_rows={},
        doubt=first.doubt or second.doubt,
        contradictions={**second.contradictions, **first.contradictions},
        breaks={**first.breaks, **moved},
    )


def _notices(above: Grid, below: Grid) -> list[str]:
    return [*above.notices, *(text for text in below.notices[1:] if text not in above.notices)]


def _said(grid: Grid, starts: Sequence[int]) -> Grid:
    rows = first_few(starts, MOST_STARTS)
    said = (
        f"check: {counted(len(starts) + 1, 'table')} with the same headings were read as one test, because"
        f" its clock goes on from one to the next (row {rows})"
    )
    return replace(
        grid, notices=[f"{counted(len(grid.rows), 'row')} of {grid.described}", *grid.notices[1:], said]
    )
