"""Detection of where a table of numbers begins, and of the names of its columns."""

import itertools
import math
import re
from typing import NamedTuple

from .numerals import like_a_number
from .separators import LEAST_ROWS
from .spelling import first_unit, may_be_unit, parse_heading, same_unit
from .words import meaning_of

# Names of columns, though units are called so, too.
_NAMES_TOO = ("strain", "ratio", "t", "f", "r", "i", "temp")

MOST_SPOILT = 5
"""Maximum number of rows with words among their numbers right below the headings."""
Rows = list[list[str]]
Parsed = list[list | None]


class Start(NamedTuple):
    """The beginning of a table.

    Attributes:
        run: indices of its first rows of numbers.
        header: names of its columns; empty without a header.
        top: index of the row of names; of the first row of numbers without a header.
    """

    run: list[int]
    header: list[str]
    top: int


def first_table(fields: Rows, parsed: Parsed, begin: int) -> Start | None:
    """Beginning of the first table from a row on; None if there is none.

    Remarks between the header and the run of numbers are passed over, with the rows of numbers above them.
    """
    run = _first_run(parsed, fields, begin)
    if not run:
        return None
    named = max(_last_number(parsed[i]) for i in run)
    header, top = header_above(fields, run[0], named, begin)
    if not header:
        earlier = _rows_above_remarks(fields, parsed, run, begin)
        header, top = header_above(fields, earlier[0], named, begin) if earlier else (header, top)
        run = [*earlier, *run] if header else run
    if not header and (spoilt := _spoilt_rows(fields, run[0], begin)):
        header, top = header_above(fields, spoilt[0], named, begin)
        run = [*spoilt, *run] if header else run
    return Start(run, header, top)


def names_quantities(row: list[str]) -> int:
    """Number of fields that name a quantity."""
    return sum(bool(text) and meaning_of(text) is not None for text in row)


def _first_run(parsed: Parsed, fields: Rows, begin: int) -> list[int]:
    """First run of rows of numbers from a row on, empty if there is none; blank rows do not break it.

    Rows may be shorter than others, where their last fields are empty. One that is more than twice as wide
    as those above begins another run.
    """
    run: list[int] = []
    width = 0
    for i in range(begin, len(parsed)):
        row = parsed[i]
        if not fields[i]:
            continue
        if row is not None and (not run or 2 * width > len(row)):
            run.append(i)
            width = max(width, len(row))
            continue
        if len(run) >= LEAST_ROWS:
            break
        run, width = ([], 0) if row is None else ([i], len(row))
    return run if len(run) >= LEAST_ROWS else []


def _rows_above_remarks(fields: Rows, parsed: Parsed, run: list[int], floor: int) -> list[int]:
    """Rows of numbers between a run and a row above that names two quantities; remarks may divide them."""
    width = max(len(fields[i]) for i in run)
    found: list[int] = []
    for i in range(run[0] - 1, floor - 1, -1):
        if parsed[i] is not None:
            if len(fields[i]) != width:
                return []
            found.insert(0, i)
        elif names_quantities(fields[i]) >= 2:
            return found
    return []


def _spoilt_rows(fields: Rows, start: int, floor: int) -> list[int]:
    """Rows of numbers and words, such as marks of an overload, between a row of headings and the first row of
    numbers; empty where there are none."""
    found: list[int] = []
    for i in range(start - 1, max(floor, start - 1 - MOST_SPOILT) - 1, -1):
        if names_quantities(fields[i]) >= 2:
            return found
        if len(fields[i]) != len(fields[start]) or not any(map(like_a_number, fields[i])):
            return []
        found.insert(0, i)
    return []


def _last_number(row: list[float | None] | None) -> int:
    """Number of fields up to the last one that is a number; 0 without any."""
    filled = (i + 1 for i, x in reversed([*enumerate(row or [])]) if x is not None and not math.isnan(x))
    return next(filled, 0)


def header_above(fields: Rows, start: int, named: int, floor: int) -> tuple[list[str], int]:
    """Names of the columns and the row they stand in: the nearest filled row above, if it names every column.

    A row of units alone (`(s);(mm);(N)`, or `s;mm;N`) under a row of names is joined to it. A row that leaves
    the last columns without a name is a header if it names two quantities.

    Args:
        fields: fields of the whole page by row.
        start: index of the first row of numbers.
        named: number of columns that need a name.
        floor: index of the first row that belongs to this table.
    """
    above = [i for i in range(start - 1, floor - 1, -1) if fields[i] and not _is_rule(fields[i])][:2]
    if not above:
        return [], start
    top, units = above[0], []
    if (
        len(above) == 2
        and (all(map(_is_unit, fields[top])) or _mostly_units(fields[top], fields[above[1]]))
        and not any(_is_unit(t) and t for t in fields[above[1]] if len(t) > 2)
    ):
        top, units = above[1], [text if _is_unit(text) else "" for text in fields[top]]
    names = _uncommented(fields[top])
    quantities = names_quantities(names)
    if quantities < 2 and (len(names) < max(named, 2) or any(t and like_a_number(t) for t in names)):
        return [], start
    pairs = itertools.zip_longest(names, units, fillvalue="")
    return [_with_unit(name, unit.strip("()[]")) for name, unit in pairs], top


def _is_rule(row: list[str]) -> bool:
    """True for a line that is drawn between headings and numbers: `-----`, `|---|---|`, `====`."""
    return all(re.fullmatch(r"[-=+:_*~\s]{3,}|", text) for text in row) and any(row)


def _mostly_units(row: list[str], above: list[str]) -> bool:
    """True if most fields of a row are units, and the row above it names quantities that it does not name."""
    units = sum(bool(text) and _is_unit(text) for text in row)
    below = len(row) == len(above) and 2 * units > len(row)
    return below and names_quantities(row) < 2 <= names_quantities(above)


def _with_unit(name: str, unit: str) -> str:
    """A name with the unit below it, unless it states that unit itself."""
    own = name if may_be_unit(name) and name else parse_heading(name).unit
    unit = "-" if unit == "1" else unit  # a number behind a unit would count columns
    return name if not unit or (own is not None and same_unit(own, unit)) else f"{name} ({unit})"


def two_units(header: list[str]) -> list[str]:
    """Notices about headings that state one unit, and another one after it, as in a row of units below."""
    said = []
    for text in header:
        before, taken = first_unit(text), parse_heading(text).unit
        if before is not None and taken is not None and not same_unit(str(before.unit), taken):
            said.append(
                f"check: the heading {before.text!r} states {before.unit}, and {taken} stands after it or in"
                f" the row of units: {taken} was taken; --unit QUANTITY={before.unit} takes the other"
            )
    return said


def _uncommented(names: list[str]) -> list[str]:
    """A row of headings without a leading comment mark."""
    if names and names[0] in ("#", "%", "//", "#:"):
        return names[1:]
    return [re.sub(r"^[#%]\s*", "", names[0]), *names[1:]] if names else names


def _is_unit(text: str) -> bool:
    """True if a field is a unit alone: `(kPa)`, `[-]`, `mm`, or nothing."""
    if text.casefold() in _NAMES_TOO:
        return False
    return not text or bool(re.fullmatch(r"[(\[].*[)\]]", text)) or may_be_unit(text)
