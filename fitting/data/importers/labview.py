"""LabVIEW's measurement files (.lvm), which state units and the clock above their headings."""

from dataclasses import replace

from .grid import Grid
from .spelling import Heading, may_be_unit, unit_name

X, UNITS_ROW, DIMENSION_ROW = "X_Value", "Y_Unit_Label", "X_Dimension"
"""Heading of the first column; first fields of the rows of units and of the first column's dimension."""


def with_stated_units(grid: Grid) -> Grid:
    """A table whose headings have the units that a LabVIEW file states above it, and its clock."""
    if not grid.headings or grid.headings[0].text != X:
        return grid
    stated = {row[0]: row[1:] for row in grid.preamble if row}
    units = stated.get(UNITS_ROW, [])
    headings = list(grid.headings)
    if any(text.casefold() == "time" for text in stated.get(DIMENSION_ROW, [])):
        headings[0] = Heading(X, "time", "s")
    for column, text in enumerate(units, 1):
        if column < len(headings) and headings[column].unit is None and text and may_be_unit(text):
            headings[column] = replace(headings[column], unit=unit_name(text))
    if headings == grid.headings:
        return grid
    said = ", ".join(f"{h.text!r} in {h.unit}" for h in headings if h.unit)
    return replace(grid, headings=headings, notices=[*grid.notices, f"as the LabVIEW file states: {said}"])
