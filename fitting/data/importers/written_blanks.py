"""Fields that are written to be missing: errors of a spreadsheet, `NaN`, `-`, `n/a`."""

import numpy as np

from pneusma_jax.errors import counted

from .grid import Grid
from .names import first_few
from .numerals import is_blank, is_spreadsheet_error

MOST_MARKS = 3
"""Number of different texts of a column that a notice shows."""
MOST_COLUMNS = 6
"""Maximum number of columns without errors of a spreadsheet that have a notice of their own."""


def say_written_blanks(grid: Grid) -> None:
    """Report the fields of each column of numbers that are written to be missing.

    An error of a spreadsheet, such as `#DIV/0!`, is to be looked at: a formula went wrong. The grid is
    changed in place.
    """
    told, further = 0, []
    for column in range(grid.values.shape[1]):
        if not np.isfinite(grid.values[:, column]).any():
            continue
        found: dict[str, list[int]] = {}
        for row, text in zip(grid.rows, grid.texts(column), strict=True):
            if text and is_blank(text):
                found.setdefault(text, []).append(row)
        if not found:
            continue
        count = sum(map(len, found.values()))
        label = grid.headings[column].text if grid.headings else ""
        place = f"column {label!r}" if label else f"column {column + 1}"
        marks = (
            f"{text!r} in row {rows[0]}" + (f" and {counted(len(rows) - 1, 'more row')}" if rows[1:] else "")
            for text, rows in found.items()
        )
        asked = "check: " if any(map(is_spreadsheet_error, found)) else ""
        told += not asked
        if not asked and told > MOST_COLUMNS:
            further.append(f"{place.removeprefix('column ')} {count}")
            continue
        grid.notices.append(
            f"{asked}{counted(count, 'field')} of {place} {'is' if count == 1 else 'are'} written as missing"
            f" ({first_few(marks, MOST_MARKS)})"
        )
    if further:
        grid.notices.append(f"fields of further columns are written as missing: {', '.join(further)}")
