"""Columns whose every field is a number with its unit, as handheld instruments write them: `3.214 Ω`."""

import itertools
import math
import re
from dataclasses import replace

from pneusma_jax.units import UNITS

from .no_table import headers_of
from .number_formats import times
from .numerals import CellNumber
from .prefixed_numbers import may_have_prefixes, said, without_prefixes
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


def without_prefixes_of_numbers(page: Page) -> tuple[Page, list[str]]:
    """A page whose numbers with a prefix and no unit (`1.2k`, `3R32`) are plain numbers.

    Returns:
        The page, unchanged where there is no such column, and notices.
    """
    if not may_have_prefixes(page):
        return page, []
    for fields, at in headers_of(page):
        header = fields[at]
        below = [i for i in range(at + 1, len(fields)) if len(fields[i]) == len(header)]
        rows, notices = [list(row) for row in fields], []
        for column, text in enumerate(header):
            texts = [fields[i][column] for i in below]
            commas = any(re.fullmatch(r"[+-]?\d+,\d+[^\d\s]?", field) for field in texts)
            plain = without_prefixes(texts, text, "," if commas else ".")
            if plain is None:
                continue
            for i, field in zip(below, plain, strict=True):
                rows[i][column] = field
            notices.append(said(text, texts, plain, [i + 1 for i in below]))
        if notices:
            return replace(page, lines=[], rows=rows), notices
    return page, []


def with_displayed_units(page: Page) -> tuple[Page, list[str]]:
    """A sheet whose headings state the units with which it displays the numbers below them.

    Number and unit come from one place. A column in thousands is read as displayed where its heading states
    no unit, or the displayed one. It is read as the cells hold it where both say the same.

    Returns:
        The page, unchanged where every heading states its own, and notices.
    """
    if page.rows is None or not (page.units or page.thousands):
        return page, []
    rows, said = [list(row) for row in page.rows], []
    own: dict[int, str] = {}
    names: dict[int, str] = {}
    for _, at in headers_of(page):
        own = _stated(page.rows, at) | own
        names = dict(enumerate(page.rows[at])) | names
        for column, unit in page.units.items():
            text = rows[at][column] if column < len(rows[at]) else ""
            if column not in own and meaning_of(f"{text} ({unit})") is not None:
                rows[at][column] = f"{text} ({unit})"
                said.append(f"the unit of {text!r} is {unit}, with which its cells are displayed")
    doubtful: dict[int, tuple[str, ...]] = {}
    for column in sorted({*page.units} | {column for _, column in page.thousands}):
        factors = {factor for (_, c), factor in page.thousands.items() if c == column}
        unit, stated = page.units.get(column, ""), own.get(column)
        if stated is None or (unit and same_unit(stated, unit)):
            for i, c in page.thousands:
                if c == column:
                    rows[i][c] = times(CellNumber(rows[i][c]), page.thousands[i, c])
            if factors:
                said.append(_read(column, "as displayed"))
        elif unit and all(_is_multiple(unit, stated, 1.0 / factor) for factor in factors or {1.0}):
            continue
        elif smaller := _smaller(unit or stated, factors):
            doubtful[column] = smaller, unit_name(stated), f"in {unit or 'thousands'}"
        elif unit:
            said.append(
                f"check: the heading {names.get(column, '')!r} states {stated}, but its cells are displayed"
                f" in {unit}: {stated} was taken; --unit QUANTITY={unit} takes the other"
            )
        else:
            how = "as the cells hold them; --scale QUANTITY=0.001 takes those displayed"
            said.append(_read(column, how))
    return replace(page, rows=rows, doubtful=doubtful), said


def _read(column: int, how: str) -> str:
    return f"check: the sheet displays numbers of column {column + 1} in thousands; they were read {how}"


def _smaller(unit: str, factors: set[float]) -> str:
    """Unit of cells that are displayed in another one, in thousands; empty where none is known."""
    if len(factors) != 1:
        return ""
    (factor,) = factors
    return min((name for name in UNITS if _is_multiple(unit, name, 1.0 / factor)), key=len, default="")


def _stated(rows: list[list[str]], at: int) -> dict[int, str]:
    """Units that a row of headings states by column, or the row below it."""
    below = rows[at + 1] if at + 1 < len(rows) else []
    found = {c: unit for c, text in enumerate(rows[at]) if (unit := parse_heading(text).unit) is not None}
    return {c: text.strip("()[] ") for c, text in enumerate(below) if _unit_alone(text)} | found


def _unit_alone(text: str) -> bool:
    return bool(text) and not isinstance(text, CellNumber) and is_unit(text.strip("()[] "))


def _is_multiple(large: str, small: str, factor: float) -> bool:
    """True if one unit is another one times a factor."""
    one, other = UNITS.get(unit_name(large)), UNITS.get(unit_name(small))
    if one is None or other is None or one.dimension != other.dimension or one.offset or other.offset:
        return False
    return math.isclose(one.factor, factor * other.factor)


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
    stated = ", ".join(f"{header[column]!r} in {unit}" for column, unit in units.items())
    return replace(page, lines=[], rows=rows), [f"fields are numbers with their unit: {stated}"]
