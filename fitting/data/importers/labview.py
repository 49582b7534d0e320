"""LabVIEW's measurement files (.lvm), which state units and the clock above their headings."""

from dataclasses import replace

from .grid import Grid
from .spelling import Heading, may_be_unit, same_unit, unit_name

X, UNITS_ROW, DIMENSION_ROW = "X_Value", "Y_Unit_Label", "X_Dimension"
"""Heading of the first column; first fields of the rows of units and of the first column's dimension."""


def with_stated_units(grid: Grid) -> Grid:
    """A table whose headings have the units that a LabVIEW file states above it, and its clock."""
    if not grid.headings or grid.headings[0].text != X:
        return grid
    stated = {row[0]: row for row in grid.preamble if row}
    units, dimensions = stated.get(UNITS_ROW, []), stated.get(DIMENSION_ROW, [])
    headings, notices = list(grid.headings), []
    first = [c for c, heading in enumerate(headings) if heading.text == X]
    for column, following in zip(first, [*first[1:], len(headings)], strict=True):
        named = {text.casefold() for text in dimensions[column + 1 : following] if text}
        if named == {"time"}:
            headings[column] = Heading(X, "time", "s")
        elif "time" in named:
            notices.append(f"check: {X!r} is of several dimensions ({', '.join(sorted(named))}): no clock")
    for column, text in enumerate(units):
        if not 0 < column < len(headings) or not text or not may_be_unit(text):
            continue
        own = headings[column].unit
        if own is None:
            headings[column] = replace(headings[column], unit=unit_name(text))
        elif not same_unit(own, text):
            notices.append(
                f"check: the heading {headings[column].text!r} states {own}, and the row {UNITS_ROW} {text}:"
                f" {own} was taken; --unit QUANTITY={unit_name(text)} takes the other"
            )
    pairs = zip(headings, grid.headings, strict=True)
    said = ", ".join(f"{new.text!r} in {new.unit}" for new, old in pairs if new != old)
    notices += [f"as the LabVIEW file states: {said}"] if said else []
    return replace(grid, headings=headings, notices=[*grid.notices, *notices]) if notices else grid
