"""A column of units beside a column of numbers, as instruments write that change their range in a test."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import counted
from pneusma_jax.units import find_unit

from ..recordings.columns import convert
from .grid import Grid
from .spelling import WEIGHTS, is_unit, plain, unit_name

WORDS = ("unit", "units", "einheit", "unité", "unidad")
"""Headings of a column of units."""


def with_units_of_rows(grid: Grid) -> Grid:
    """A table whose numbers are in one unit a column, where a column of units stands to the right of them.

    Several units of one dimension are converted to that of most rows, and a notice says so. Units of several
    dimensions, or rows without one, make the column doubtful (`Grid.troubles`).

    Args:
        grid: table as it was read.
    """
    found = [c for c in range(1, grid.values.shape[1]) if _is_of_units(grid, c)]
    for column in found:
        if column - 1 not in found and np.isfinite(grid.values[:, column - 1]).any():
            grid = _with_units(grid, column - 1, column)
    return grid


def _texts(grid: Grid, column: int) -> list[str]:
    return [text.strip("()[]") for text in grid.texts(column)]


def _is_of_units(grid: Grid, column: int) -> bool:
    """True if every filled field of a column names a unit, and its heading is the word for one or its fields
    have letters."""
    texts = {text for text in _texts(grid, column) if text}
    if not texts or not grid.headings or np.isfinite(grid.values[:, column]).any():
        return False
    named = bool({*plain(grid.headings[column].text).split()} & {*WORDS})
    return all(is_unit(text) for text in texts) and (named or not grid.headings[column].text.strip())


def _with_units(grid: Grid, column: int, beside: int) -> Grid:
    """A table with a column of numbers in the units that another column names row by row."""
    heading, texts = grid.headings[column], _texts(grid, beside)
    rows = [k for k in range(len(texts)) if np.isfinite(grid.values[k, column])]
    units = [_known(texts[k]) for k in rows]
    label, own = repr(heading.text), repr(grid.headings[beside].text or f"column {beside + 1}")
    if "" in units:
        row = grid.rows[rows[units.index("")]]
        return _doubtful(grid, column, f"column {label} has no unit in row {row}, where {own} is empty")
    kinds = dict.fromkeys(units)
    if len({find_unit(unit).dimension for unit in kinds}) > 1:
        return _doubtful(
            grid, column, f"column {label} is in units of several kinds, {', '.join(kinds)}, by {own}"
        )
    most = max(kinds, key=units.count)
    values = grid.values.copy()
    for k, unit in zip(rows, units, strict=True):
        values[k, column] = convert(values[k, column], unit, most)
    headings = [replace(h, unit=most) if c == column else h for c, h in enumerate(grid.headings)]
    notices = [*_without(grid.notices, own), _said(units, label, own, most)]
    by_row = {*grid.by_row, column}
    return replace(grid, headings=headings, values=values, notices=notices, by_row=by_row)


def _known(text: str) -> str:
    """A unit's name; a mass stands for its weight, since both may be in one column."""
    unit = unit_name(text) if text else ""
    return WEIGHTS.get(unit, unit)


def _said(units: Sequence[str], label: str, own: str, most: str) -> str:
    if set(units) == {most}:
        return f"{label} is in {most}, as {own} says in every row"
    parts = ", ".join(f"{counted(units.count(unit), 'row')} in {unit}" for unit in dict.fromkeys(units))
    return f"check: {own} states the unit of {label} row by row ({parts}): all are converted to {most}"


def _without(notices: Sequence[str], own: str) -> list[str]:
    """Notices without the one that a column of units is text."""
    return [text for text in notices if not (own in text and "is text and was left out" in text)]


def _doubtful(grid: Grid, column: int, why: str) -> Grid:
    rows = {c: found for c, found in grid.trouble_rows.items() if c != column}
    return replace(grid, troubles={**grid.troubles, column: why}, trouble_rows=rows)
