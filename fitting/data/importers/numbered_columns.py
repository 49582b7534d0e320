"""Lists above a table that name its columns by number: `Sig1 Time (min)`, `Column 2: Force (N)`."""

import re
from dataclasses import replace

from .grid import Grid
from .spelling import narrow
from .words import heading_of, meaning

_LINE = re.compile(
    r"^[#%!*\s]*(?:sig|signal|col|column|spalte|colonne|columna|ch|channel|kanal|canal|voie|列)?[\s._]*"
    r"(?P<number>\d{1,2})\s*(?:[:=.)\-]\s*|\s)(?P<name>[^\W\d].*)$",
    re.IGNORECASE,
)
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
