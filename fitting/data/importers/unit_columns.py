"""Columns that state the unit of each row: `Load | Unit`, with `mN` in some rows and `N` in others."""

import re
from collections import Counter

import numpy as np

from pneusma_jax.units import find_unit

from ..recordings.columns import convert
from .grid import Grid
from .spelling import Heading, is_unit, plain, unit_name

_UNIT = re.compile(r"\b(units?|einheit|unité|unite|unidad)\b")


def take_unit_columns(grid: Grid) -> None:
    """Give each column the unit that a column of units states, and convert its rows to one, in place.

    The column of units belongs to the one that its heading names (`Load unit`), else to the one on its left.
    """
    for column, heading in enumerate(grid.headings):
        texts = [cells[column].strip("()[] ") if column < len(cells) else "" for cells in grid.cells]
        filled = [text for text in texts if text]
        if not filled or not _UNIT.search(heading.name) and heading.name or not all(map(is_unit, filled)):
            continue
        owner = _owner(grid, column)
        if owner is None or not any(c.isalpha() or c in "%°" for text in filled for c in text):
            continue
        grid.unit_columns[owner] = column
        _convert(grid, owner, texts)


def _owner(grid: Grid, column: int) -> int | None:
    """Column of numbers that a column of units belongs to."""
    rest = plain(_UNIT.sub(" ", grid.headings[column].name))
    named = [c for c, h in enumerate(grid.headings) if rest and h.name == rest]
    owner = named[0] if named else column - 1
    return owner if owner >= 0 and np.isfinite(grid.values[:, owner]).any() else None


def _convert(grid: Grid, owner: int, texts: list[str]) -> None:
    """Rows of a column in one unit, the first that is stated."""
    old = grid.headings[owner]
    values = grid.values[:, owner]
    units = [unit_name(text) if text else (old.unit or "") for text in texts]
    first = next(unit for unit in units if unit)
    counts = Counter(unit for unit, value in zip(units, values, strict=True) if np.isfinite(value))
    bare = [
        row
        for row, unit, value in zip(grid.rows, units, values, strict=True)
        if not unit and np.isfinite(value)
    ]
    label = repr(grid.headings[grid.unit_columns[owner]].text or f"column {grid.unit_columns[owner] + 1}")
    dimensions = {find_unit(unit).dimension for unit in counts if unit}
    if bare or len(dimensions) > 1:
        why = f"row {bare[0]} has none" if bare else f"{', '.join(counts)} are not of one quantity"
        grid.troubles[owner] = f"the units of {old.text!r} stand in {label}, but {why}"
        return
    grid.values[:, owner] = [
        float(convert(v, u, first)) if u else v for v, u in zip(values, units, strict=True)
    ]
    grid.headings[owner] = Heading(old.text, old.name, first, old.zero)
    said = ", ".join(f"{unit} in {count} rows" for unit, count in counts.items())
    grid.notices.append(f"the unit of {old.text!r} stands in {label}: {said}")
