"""LabVIEW's measurement files (.lvm), which state units and the clock above their headings."""

import itertools
from dataclasses import replace

import numpy as np

from .grid import Grid
from .spelling import Heading, may_be_unit, same_unit, unit_name

X, UNITS_ROW, DIMENSION_ROW, STEP_ROW = "X_Value", "Y_Unit_Label", "X_Dimension", "Delta_X"
"""Heading of the first column; first fields of the rows of units, and of its dimension and its step."""
STATED = (UNITS_ROW, DIMENSION_ROW, STEP_ROW)
"""First fields of the rows that headings and clock are taken from."""


def with_stated_units(grid: Grid) -> Grid:
    """A table whose headings have the units that a LabVIEW file states above it, and its clock."""
    stated = {row[0]: row for row in grid.preamble if row}
    units, dimensions, steps = (stated.get(name, []) for name in (UNITS_ROW, DIMENSION_ROW, STEP_ROW))
    if not grid.headings or not (units or dimensions):
        return grid
    if grid.headings[0].text != X:  # `X_Columns No`: without the clock, the first column is that of a channel
        units, dimensions = units[1:], []
    headings, notices = list(grid.headings), []
    first = [c for c, heading in enumerate(headings) if heading.text == X]
    if all(np.isnan(grid.values[:, column]).all() for column in first):
        first, dimensions = [], []  # `X_Columns No` with a heading of the empty first column
    for column, following in itertools.pairwise([*first, len(headings)]):
        named = {text.casefold() for text in dimensions[column + 1 : following] if text}
        if named == {"time"}:
            headings[column] = Heading(X, "time", "s")
        elif "time" in named:
            notices.append(f"check: {X!r} is of several dimensions ({', '.join(sorted(named))}): no clock")
    for column, text in enumerate(units):
        if column >= len(headings) or text == UNITS_ROW or not text or not may_be_unit(text):
            continue
        own = headings[column].unit
        if own is None:
            headings[column] = replace(headings[column], unit=unit_name(text))
        elif not same_unit(own, text):
            notices.append(
                f"check: the heading {headings[column].text!r} states {own}, and the row {UNITS_ROW} {text}:"
                f" {own} was taken; --unit QUANTITY={unit_name(text)} takes the other"
            )
    if not first and steps[1:] and len({*filter(None, steps[1:])}) == 1:
        notices.append(f"check: the file has no clock, and states a step ({STEP_ROW}): --interval {steps[1]}")
    pairs = zip(headings, grid.headings, strict=True)
    said = ", ".join(f"{new.text!r} in {new.unit}" for new, old in pairs if new != old)
    notices += [f"as the LabVIEW file states: {said}"] if said else []
    return replace(grid, headings=headings, notices=[*grid.notices, *notices]) if notices else grid
