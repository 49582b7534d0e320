"""Columns whose every field is a number with its unit, as handheld instruments write them: `3.214 Ω`."""

import itertools
import re
from dataclasses import replace

from .no_table import headers_of
from .raw import Page
from .separators import LEAST_ROWS
from .spelling import is_unit, parse_heading, same_unit, unit_name
from .words import meaning_of

_NUMBER = r"(?P<number>[+-]?[\d.,' \u00a0\u202f]*\d(?:[eE][+-]?\d+)?)"
_WITH_UNIT = re.compile(_NUMBER + r"\s*(?P<unit>[^\d\s.,+'-][^\s,]{0,8})")
SEARCHED = 60
"""Number of first rows in which a number with a unit shows that a page may have such columns."""


def without_units(page: Page) -> tuple[Page, list[str]]:
    """A page whose columns of numbers with one unit hold the numbers alone, and the unit in their heading.

    Returns:
        The page, unchanged where there is no such column, and notices.
    """
    for fields, at in headers_of(page):
        header = fields[at]
        rows = (fields[i] for i in range(at + 1, len(fields)))
        below = (row for row in rows if len(row) == len(header))
        first = list(itertools.islice(below, SEARCHED))
        if len(first) < LEAST_ROWS or not any(_parts(text) for row in first for text in row):
            continue
        body = [*first, *below]
        units = {c: _unit_of([row[c] for row in body], text) for c, text in enumerate(header)}
        if any(units.values()):
            return _stripped(page, fields, at, {c: unit for c, unit in units.items() if unit})
    return page, []


def with_displayed_units(page: Page) -> tuple[Page, list[str]]:
    """A sheet whose headings state the units with which it displays the numbers below them.

    Returns:
        The page, unchanged where every heading states its own, and notices.
    """
    if not page.units or page.rows is None:
        return page, []
    rows, said = [list(row) for row in page.rows], []
    for _, at in headers_of(page):
        for column, unit in page.units.items():
            text = rows[at][column] if column < len(rows[at]) else ""
            own = parse_heading(text).unit
            if own is None and meaning_of(f"{text} ({unit})") is not None:
                rows[at][column] = f"{text} ({unit})"
                said.append(f"the unit of {text!r} is {unit}, with which its cells are displayed")
            elif own is not None and not same_unit(own, unit):
                said.append(
                    f"check: the heading {text!r} states {own}, but its cells are displayed in {unit}: {own}"
                    f" was taken; --unit QUANTITY={unit} takes the other"
                )
    return replace(page, rows=rows), said


def _parts(text: str) -> re.Match[str] | None:
    """A number and a unit with a letter or a sign of its own; None for other texts."""
    found = _WITH_UNIT.fullmatch(text.strip())
    return found if found and "%" not in found["unit"] and is_unit(found["unit"]) else None


def _unit_of(texts: list[str], heading: str) -> str:
    """The one unit of all filled fields of a column that is headed by a quantity; empty without one."""
    found = [_parts(text) for text in texts if text]
    units = {unit_name(one["unit"]) for one in found if one}
    own = parse_heading(heading).unit
    if len(found) < LEAST_ROWS or not all(found) or len(units) != 1:
        return ""
    (unit,) = units
    fits = own is None or same_unit(own, unit)
    named = heading if own is not None else f"{heading} ({unit})"
    return unit if fits and meaning_of(named) is not None else ""


def _stripped(page: Page, fields: list[list[str]], at: int, units: dict[int, str]) -> tuple[Page, list[str]]:
    header = fields[at]
    rows = [list(row) for row in fields]
    for column, unit in units.items():
        if parse_heading(header[column]).unit is None:
            rows[at][column] = f"{header[column]} ({unit})"
        for row in rows[at + 1 :]:
            found = _parts(row[column]) if column < len(row) else None
            if found:
                row[column] = found["number"].strip()
    said = ", ".join(f"{header[column]!r} in {unit}" for column, unit in units.items())
    return replace(page, lines=[], rows=rows), [f"fields are numbers with their unit: {said}"]
