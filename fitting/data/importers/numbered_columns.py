"""Lists above a table that name its columns by number: `Sig1 Time (min)`, `Column 2: Force (N)`."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .grid import Grid
from .separators import LEAST_ROWS
from .spelling import narrow
from .words import heading_of, meaning

_LINE = re.compile(
    r"^[#%!*\s]*(?:sig|signal|col|column|spalte|colonne|columna|ch|channel|kanal|canal|voie|列)?[\s._]*"
    r"(?P<number>\d{1,2})\s*(?:[:=.)\-]\s*|\s)(?P<name>[^\W\d].*)$",
    re.IGNORECASE,
)
AS_HEADINGS = "are these its headings"
"""Words of the question whether a first row of numbers names the columns."""
LEAST_NAMED = 2
"""Minimum number of listed columns that name a quantity, as of a row of headings."""


def with_numbered_headings(grid: Grid) -> Grid:
    """A table without headings whose columns a list above it names by their numbers; others are unchanged.

    The list has a line for each column, in order, from 0 or 1. A `check:` quotes it.
    """
    if grid.headings:
        return grid
    lines = [(" ".join(cell for cell in row if cell)) for row in grid.preamble]
    found = [(line, match) for line in lines if (match := _LINE.match(narrow(line)))]
    count = grid.values.shape[1]
    for begin in range(len(found) - count + 1):
        part = found[begin : begin + count]
        numbers = [int(match["number"]) for _, match in part]
        if numbers not in ([*range(count)], [*range(1, count + 1)]):
            continue
        headings = [heading_of(match["name"].strip()) for _, match in part]
        if sum(meaning(heading) is not None for heading in headings) >= LEAST_NAMED:
            said = ", ".join(repr(line) for line, _ in part)
            notice = f"check: the columns are named by the list above the table: {said}"
            return replace(grid, headings=headings, notices=[*grid.notices, notice])
    return grid


def numbers_as_headings(values: np.ndarray, rows: Sequence[int], cells: Sequence[Sequence[str]]) -> str:
    """Question whether the first row of a table without headings names its columns by numbers; or none.

    Its first field is empty, as that of no other row. All its numbers are farther from those below than
    these are from each other: wavelengths, speeds or set points above readings.

    Args:
        values: numbers of the table, NaN where a field is no number, shape (rows, columns).
        rows: line number in the file of each row.
        cells: fields of each row as text.
    """
    if len(values) < 1 + LEAST_ROWS or values.shape[1] < 1 + LEAST_NAMED or "".join(cells[0][:1]).strip():
        return ""
    first, below = values[0, 1:], values[1:, 1:]
    if np.isnan(values[1:, 0]).any() or not np.isfinite(first).all() or np.isnan(below).all(axis=0).any():
        return ""
    apart = np.nanmin(np.abs(below - first), axis=0)
    if not np.all(apart > np.nanmax(below, axis=0) - np.nanmin(below, axis=0)):
        return ""
    numbers = ", ".join(text.strip() for text in cells[0][1:])
    return (
        f"check: row {rows[0]} has no first field, and its numbers ({numbers}) are far from all below:"
        f" {AS_HEADINGS}? If they are: --rows {rows[1]}: leaves that row out. Or write names in their place"
    )
