"""Detection of where a table of numbers begins, and of the names of its columns."""

import itertools
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..recordings.unusual import KELVIN
from .numerals import like_a_number
from .separators import LEAST_ROWS
from .spelling import dimension, first_unit, may_be_unit, parse_heading, same_unit
from .words import meaning_of

# Names of columns, though units are called so, too.
_NAMES_TOO = ("strain", "ratio", "t", "f", "r", "i", "temp")

MOST_BELOW = 3
"""Maximum number of rows of units and remarks between the headings and the numbers."""
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
        remarks: indices of the rows between names and numbers that are more than units.
    """

    run: list[int]
    header: list[str]
    top: int
    remarks: Sequence[int] = ()


class Header(NamedTuple):
    """A row of names above numbers.

    Attributes:
        names: names of the columns with their units; empty without a header.
        top: index of its row; of the first row of numbers without a header.
        remarks: indices of the rows between it and the numbers that are more than units.
    """

    names: list[str]
    top: int
    remarks: Sequence[int] = ()


def first_table(fields: Rows, parsed: Parsed, begin: int, end: int | None = None) -> Start | None:
    """Beginning of the first table from a row on, and before another one; None if there is none.

    Remarks between the header and the run of numbers are passed over, with the rows of numbers above them.
    """
    run = _first_run(parsed, fields, begin, len(parsed) if end is None else end)
    if not run:
        return None
    named = max(_last_number(parsed[i]) for i in run)
    header = header_above(fields, run[0], named, begin)
    if not header.names and (earlier := _rows_above_remarks(fields, parsed, run, begin)):
        header = header_above(fields, earlier[0], named, begin)
        run = [*earlier, *run] if header.names else run
    if not header.names and (spoilt := _spoilt_rows(fields, run[0], begin)):
        header = header_above(fields, spoilt[0], named, begin)
        run = [*spoilt, *run] if header.names else run
    if not header.names and (short := _short_rows(fields, parsed, run[0], begin, named)):
        header = header_above(fields, short[0], named, begin)
        run = [*short, *run] if header.names else run
    return Start(run, *header)


def names_quantities(row: list[str]) -> int:
    """Number of fields that name a quantity."""
    return sum(bool(text) and meaning_of(text) is not None for text in row)


def _first_run(parsed: Parsed, fields: Rows, begin: int, end: int) -> list[int]:
    """First run of rows of numbers between two rows, empty if there is none; blank rows do not break it.

    Rows may be shorter than others, where their last fields are empty. One that is more than twice as wide
    as those above begins another run.
    """
    run: list[int] = []
    width = 0
    for i in range(begin, end):
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


def _short_rows(fields: Rows, parsed: Parsed, start: int, floor: int, named: int) -> list[int]:
    """Rows right below a row of headings whose last fields are empty; none where there are no such rows.

    The headings name two quantities, or have a word for every one of the `named` columns. The first number
    of each row is no larger than that of the row below. A number of rows is larger than a first time.
    """
    found: list[int] = []
    for i in range(start - 1, max(floor, start - 1 - MOST_SPOILT) - 1, -1):
        row, below = parsed[i], parsed[found[0] if found else start]
        if row is None:
            words = [text for text in fields[i] if text and not like_a_number(text)]
            return found if names_quantities(fields[i]) >= 2 or len(words) == len(fields[i]) >= named else []
        if not below or row[0] is None or below[0] is None or not row[0] <= below[0]:
            return []
        found.insert(0, i)
    return []


def _last_number(row: list[float | None] | None) -> int:
    """Number of fields up to the last one that is a number; 0 without any."""
    filled = (i + 1 for i, x in reversed([*enumerate(row or [])]) if x is not None and not math.isnan(x))
    return next(filled, 0)


def header_above(fields: Rows, start: int, named: int, floor: int) -> Header:
    """Names of the columns and the row they stand in: the nearest filled row above, if it names every column.

    A row of units alone (`(s);(mm);(N)`, or `s;mm;N`) under a row of names is joined to it. A row that leaves
    the last columns without a name is a header if it names two quantities. So is one further above, where the
    rows below it name less: units, and remarks about the columns.

    Args:
        fields: fields of the whole page by row.
        start: index of the first row of numbers.
        named: number of columns that need a name.
        floor: index of the first row that belongs to this table.
    """
    filled = (i for i in range(start - 1, floor - 1, -1) if fields[i] and not _is_rule(fields[i]))
    above = [*itertools.islice(filled, MOST_BELOW + 1)]
    if not above:
        return Header([], start)
    units_alone = len(above) > 1 and all(map(_is_unit, fields[above[0]]))
    place = 1 if units_alone and not has_units(fields[above[1]]) else 0
    if names_quantities(_uncommented(fields[above[place]], named)) < 2:
        place = next((k for k, i in enumerate(above) if _names_all(fields[i], named)), place)
        place = place if all(_is_about_columns(fields[i]) for i in above[:place]) else 0
    top, below = above[place], above[:place]
    names = _uncommented(fields[top], named + _is_counted(fields[start:], fields[top]))
    names = _with_words_above(names, fields, top, floor)
    few = len(names) < max(named, 2) or any(t and like_a_number(t) for t in names)
    if names_quantities(names) < 2 and few:
        return Header([], start)
    row = next((i for i in reversed(below) if has_units(fields[i])), None)
    units = [] if row is None else [text if _is_unit(text) else "" for text in fields[row]]
    pairs = itertools.zip_longest(names, units, fillvalue="")
    joined = [_with_unit(name, unit.strip("()[]")) for name, unit in pairs]
    return Header(joined, top, [i for i in reversed(below) if i != row or numbered(fields[i])])


def _with_words_above(names: list[str], fields: Rows, top: int, floor: int) -> list[str]:
    """Headings in which a unit alone has the quantity above it, as beside merged cells.

    A row above that holds a number states something of the test (`Temperature,25`) and heads no column.
    """
    row = next((i for i in range(top - 1, max(floor, top - 2) - 1, -1) if fields[i]), None)
    filled = [text for text in fields[row] if text] if row is not None else []
    if row is None or len(filled) < 2 or any(map(like_a_number, filled)) or not names_quantities(filled):
        return names
    if any(text[:1].isdigit() or like_a_number(text) for text in fields[row]):
        return names
    joined = list(names)
    for column, (own, above) in enumerate(zip(names, fields[row], strict=False)):
        if not above or not own or not _is_unit(own) or meaning_of(own) is not None:
            continue
        whole = f"{above} ({own.strip('()[]')})"
        if meaning_of(whole) is not None:
            joined[column] = whole
    return joined


def _names_all(row: list[str], named: int) -> bool:
    """True if a row is as wide as the numbers below it, and names two quantities."""
    return len(row) >= named and names_quantities(_uncommented(row, named)) >= 2


def _is_about_columns(row: list[str]) -> bool:
    """True for a row of units or remarks below headings: no numbers, and no headings with units."""
    if any(text and like_a_number(text) for text in row):
        return False
    return has_units(row) or all(parse_heading(text).unit is None for text in row)


def has_units(row: list[str]) -> bool:
    """True if more than half of the filled fields of a row are units."""
    filled = [text for text in row if text]
    return 2 * sum(map(_is_unit, filled)) > len(filled)


def numbered(row: list[str]) -> list[str]:
    """Fields of a row below headings that are no units and hold a number: it may be a factor, as in `x10`."""
    return [text for text in row if re.search(r"\d", text) and not may_be_unit(text.strip("()[]"))]


def _is_rule(row: list[str]) -> bool:
    """True for a line that is drawn between headings and numbers: `-----`, `|---|---|`, `====`."""
    return all(re.fullmatch(r"[-=+:_*~\s]{3,}|", text) for text in row) and any(row)


def _with_unit(name: str, unit: str) -> str:
    """A name with the unit below it, unless it states that unit itself."""
    own = name if name and _is_unit(name) else parse_heading(name).unit
    unit = "-" if unit == "1" else unit  # a number behind a unit would count columns
    return name if not unit or (own is not None and same_unit(own, unit)) else f"{name} ({unit})"


def two_units(header: list[str], own: list[str]) -> tuple[list[str], dict[int, tuple[str, ...]]]:
    """Headings that state one unit, and another one after it.

    Args:
        header: names of the columns, with the units of a row below them.
        own: names of the columns as they stand in their row.

    Returns:
        Notices about those whose second unit counts. It stands in the row of units, is of another dimension,
        or differs in its prefix alone, as in `Current_A (mA)`. And both units of those that contradict
        themselves, by column.
    """
    said: list[str] = []
    contradictions: dict[int, tuple[str, ...]] = {}
    for column, text in enumerate(header):
        before, taken = first_unit(text), parse_heading(text).unit
        if before is None or before.unit is None or taken is None or same_unit(before.unit, taken):
            continue
        prefixed = before.unit.endswith(taken) or taken.endswith(before.unit)
        if text in own and dimension(before.unit) == dimension(taken) and not prefixed:
            contradictions[column] = before.unit, taken
            continue
        said.append(
            f"check: the heading {before.text!r} states {before.unit}, and {taken} stands after it or in"
            f" the row of units. {taken} was taken; --unit QUANTITY={before.unit} takes the other"
        )
    return said, contradictions


_THERMOCOUPLE = re.compile(r"thermo(?:couple|element)|\btype k\b|\btc\b", re.IGNORECASE)


def is_type_k(heading: str, units: Sequence[str], values: np.ndarray) -> bool:
    """True where the K of a heading in degC is the type of a thermocouple, and no kelvin.

    Its name says so, or some of the temperatures are none of a test in kelvin.

    Args:
        heading: text of the heading.
        units: the two units that it may state.
        values: temperatures of its column.
    """
    if tuple(units) != ("K", "degC"):
        return False
    known = values[np.isfinite(values)]
    return bool(_THERMOCOUPLE.search(heading) or np.any((known < KELVIN[0]) | (known > KELVIN[1])))


_MARKS = ("#", "%", "//", "#:")


def _is_counted(rows: Rows, names: list[str]) -> bool:
    """True if the first column counts the rows, and the last heading names no quantity: it may be empty."""
    firsts = [row[0] for row in rows[:LEAST_ROWS] if row]
    counts = any(firsts == [str(k + begin) for k in range(len(firsts))] for begin in (0, 1))
    return bool(names) and names[0] in _MARKS and counts and meaning_of(names[-1]) is None


def _uncommented(names: list[str], named: int) -> list[str]:
    """A row of headings without a leading comment mark.

    A mark alone in the first field heads a column, such as that of the row numbers, where the numbers below
    have a field for it.
    """
    if names and names[0] in _MARKS:
        return names if len(names) <= named else names[1:]
    return [re.sub(r"^[#%]\s*", "", names[0]), *names[1:]] if names else names


_FACTOR = re.compile(r"[(\[]\s*[x×*]\s*[\d.,eE^+-]+\s*[)\]]")


def _is_unit(text: str) -> bool:
    """True if a field is a unit alone: `(kPa)`, `[-]`, `mm`, or nothing."""
    if text.casefold() in _NAMES_TOO or _FACTOR.fullmatch(text):
        return False
    return not text or bool(re.fullmatch(r"[(\[].*[)\]]", text)) or may_be_unit(text)
