"""Units and prefixes that stand in cells or in their number format, not in the heading.

Handheld instruments write `3.214 Ω`, loggers write `1.2k`, and sheets display a number in thousands.
"""

import itertools
import math
import re
from collections import Counter
from dataclasses import dataclass, replace

from pneusma_jax.errors import counted
from pneusma_jax.units import UNITS, find_unit

from ..recordings.columns import convert
from .no_table import headers_of
from .number_formats import times
from .numerals import CellNumber, to_number
from .prefixed_numbers import may_have_prefixes, without_prefixes
from .prefixed_numbers import said as sentence_on_prefixes
from .raw import Page
from .rounding import shortest
from .separators import LEAST_ROWS
from .spelling import WEIGHTS, is_unit, parse_heading, same_unit, unit_name
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
        body = {i: row for i, row in enumerate(fields) if i > at and len(row) == len(header)}
        columns = {
            c: _column_of({i: row[c] for i, row in body.items() if row[c]}, text)
            for c, text in enumerate(header)
        }
        known = {c: found for c, found in columns.items() if found is not None}
        if known:
            return _stripped(page, fields, at, known)
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
            notices.append(sentence_on_prefixes(text, texts, plain, [i + 1 for i in below]))
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
    rows, notices = [list(row) for row in page.rows], []
    own: dict[int, str] = {}
    names: dict[int, str] = {}
    for _, at in headers_of(page):
        own = _stated(page.rows, at) | own
        names = dict(enumerate(page.rows[at])) | names
        for column, unit in page.units.items():
            text = rows[at][column] if column < len(rows[at]) else ""
            if column not in own and meaning_of(f"{text} ({unit})") is not None:
                rows[at][column] = f"{text} ({unit})"
                notices.append(f"the unit of {text!r} is {unit}, with which its cells are displayed")
    doubtful: dict[int, tuple[str, ...]] = {}
    for column in sorted({*page.units} | {column for _, column in page.thousands}):
        factors = {factor for (_, c), factor in page.thousands.items() if c == column}
        unit, stated = page.units.get(column, ""), own.get(column)
        if stated is None or (unit and same_unit(stated, unit)):
            for i, c in page.thousands:
                if c == column:
                    rows[i][c] = times(CellNumber(rows[i][c]), page.thousands[i, c])
            if factors:
                notices.append(_in_thousands(column, "as displayed"))
        elif unit and all(_is_multiple(unit, stated, 1.0 / factor) for factor in factors or {1.0}):
            continue
        elif smaller := _smaller(unit or stated, factors):
            doubtful[column] = smaller, unit_name(stated), f"in {unit or 'thousands'}"
        elif unit:
            notices.append(
                f"check: the heading {names.get(column, '')!r} states {stated}, but its cells are displayed"
                f" in {unit}: {stated} was taken; --unit QUANTITY={unit} takes the other"
            )
        else:
            how = "as the cells hold them; --scale QUANTITY=0.001 takes those displayed"
            notices.append(_in_thousands(column, how))
    return replace(page, rows=rows, doubtful=doubtful), notices


def _in_thousands(column: int, how: str) -> str:
    """Notice on a column that is displayed in thousands: how its numbers were read."""
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
    if found is None or "%" in found["unit"] or not is_unit(found["unit"]):
        return None
    is_number = any(to_number(found["number"].strip(), mark) is not None for mark in ".,")
    return found if is_number else None


_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?!\d)")


@dataclass(frozen=True)
class _Column:
    """A column of numbers with units.

    Attributes:
        unit: unit of the column: that of its heading, or of most fields.
        units: unit of each field that has one, or stands below a heading that states one, by row.
    """

    unit: str
    units: dict[int, str]

    @property
    def is_mixed(self) -> bool:
        """True if its fields are in several units."""
        return any(unit != self.unit for unit in self.units.values())


def _column_of(texts: dict[int, str], heading: str) -> _Column | None:
    """A column that is headed by a quantity and whose fields have units; None for any other.

    Fields without a unit are in that of the heading. Several units must be of one dimension. Words among the
    fields are left to whoever reads the numbers, if most fields have a unit.

    Args:
        texts: fields that are not empty, by row.
        heading: text of the heading.
    """
    found = {i: parts for i, text in texts.items() if (parts := _parts(text)) is not None}
    own = parse_heading(heading).unit
    bare = [i for i, text in texts.items() if i not in found and _is_number(text)]
    if len(found) + len(bare) < LEAST_ROWS or not found or (bare and own is None):
        return None
    if 2 * (len(found) + len(bare)) <= len(texts) or (own is not None and not is_unit(own)):
        return None
    units = {i: _force_of(parts["unit"]) for i, parts in found.items()}
    mixed = len({*units.values()}) > 1 or (bare and {*units.values()} != {unit_name(str(own))})
    if not mixed:
        unit = unit_name(next(iter(found.values()))["unit"])
        if own is not None and not same_unit(own, unit):
            return None
        units = dict.fromkeys(units, unit)
    else:
        unit = _force_of(own) if own is not None else max(units.values(), key=[*units.values()].count)
        units |= dict.fromkeys(bare, unit)
    named = heading if own is not None else f"{heading} ({unit})"
    one = len({find_unit(each).dimension for each in (unit, *units.values())}) == 1
    return _Column(unit, units) if one and meaning_of(named) is not None else None


def _force_of(unit: str) -> str:
    """A unit's name; a mass stands for its weight, since both may be in one column."""
    name = unit_name(unit)
    return WEIGHTS.get(name, name)


def _is_number(text: str) -> bool:
    value = to_number(text.strip(), "."), to_number(text.strip(), ",")
    return any(one is not None and not math.isnan(one) for one in value)


def _stripped(
    page: Page, fields: list[list[str]], at: int, columns: dict[int, _Column]
) -> tuple[Page, list[str]]:
    """A page without the units behind the numbers of some columns, and notices about these."""
    header, said = fields[at], []
    rows = [list(row) for row in fields]
    for column, found in columns.items():
        if parse_heading(header[column]).unit is None:
            rows[at][column] = f"{header[column]} ({found.unit})"
        commas = [text for i in found.units if re.search(r"\d,\d", text := fields[i][column])]
        points = any(re.search(r"\d\.\d", fields[i][column]) for i in found.units)
        if found.is_mixed and commas and not points and all(map(_GROUPED.match, commas)):
            return page, []  # thousands or decimals: their sizes are not compared across units
        for i, unit in found.units.items():
            parts = _parts(fields[i][column])
            text = parts["number"].strip() if parts else fields[i][column].strip()
            if found.is_mixed:
                number = to_number(text, "," if commas and not points else ".")
                if number is None:
                    return page, []
                text = CellNumber(f"{float(shortest(convert(number, unit, found.unit))):.15g}")
            rows[i][column] = text
        if found.is_mixed:
            counts = Counter(found.units.values())
            listed = ", ".join(f"{counted(n, 'row')} in {unit}" for unit, n in counts.items())
            said.append(
                f"check: {header[column]!r} is in several units ({listed}): all are converted to {found.unit}"
            )
    stated = [f"{header[c]!r} in {found.unit}" for c, found in columns.items() if not found.is_mixed]
    plain = [f"fields are numbers with their unit: {', '.join(stated)}"] if stated else []
    return replace(page, lines=[], rows=rows), [*plain, *said]
