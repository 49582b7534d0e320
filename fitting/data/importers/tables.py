"""Detection of the tables of numbers on a page: preamble, header, units below it, stray rows."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneusma_jax.errors import counted

from .cut_off import cut_off
from .grid import Grid
from .headers import (
    Parsed,
    Rows,
    Start,
    first_table,
    has_units,
    is_type_k,
    names_quantities,
    numbered,
    two_units,
)
from .numbered_columns import numbers_as_headings
from .numerals import like_a_number
from .raw import Page
from .separators import LEAST_ROWS, best_reading, numeric_row
from .size_tables import count_of_sizes
from .spelling import may_be_unit, parse_heading, same_unit
from .summaries import counts_columns, statistics_rows, unlabelled_statistics
from .texts import read_texts
from .words import heading_of

_SEPARATORS = {
    ",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "white space",
}  # fmt: skip
_CHANGES = re.compile(
    r"\b(?:re-?)?(?:zero(?:ed|ing)?|tared?|balanc(?:ed|ing)|range|gain|scale|units?|calibrat\w*|offset|"
    r"tariert|nullabgleich|messbereich)\b",
    re.IGNORECASE,
)
"""Words of a remark after which the numbers below it may count otherwise."""
NO_NUMBERS = "numbers and"
"""Words of the notice on lines of text below the headings, which quotes some of them."""
_LISTED = 3
"""Number of left-out rows that a notice shows."""


@dataclass
class _Lines:
    """A page as rows of fields, with the numbers in them.

    Attributes:
        page: the page.
        delimiter: character between the fields.
        decimal: decimal mark.
        fields: fields of each row; none of a row of statistics.
        parsed: numbers of each row; None where it is no row of numbers.
        statistics: fields of the rows of statistics, by index.
    """

    page: Page
    delimiter: str
    decimal: str
    fields: Rows
    parsed: Parsed
    statistics: dict[int, list[str]]


def find_grids(page: Page) -> list[Grid]:
    """The tables of numbers of a page, in order: one below the other where headers repeat.

    The delimiter and the decimal mark are those with which most fields are numbers.
    """
    reading = best_reading(page)
    if reading is None:
        return []
    delimiter, decimal, doubtful = reading
    fields = list(page.fields(delimiter))
    parsed: Parsed = [numeric_row(row, decimal) for row in fields]
    if delimiter == " ":
        _split_at_wide_gaps(page, fields, parsed)
    lines = _Lines(page, delimiter, decimal, fields, parsed, {})
    for i in statistics_rows(fields, parsed):
        lines.statistics[i] = fields[i]
        fields[i], parsed[i] = [], None
    grids = []
    for begin, end in _blocks(fields, parsed):
        grid = _grid_of(lines, begin, end)
        if grid is None:
            continue
        if page.hidden:
            grid.notices.append(
                f"check: sheet {page.name!r} is hidden in the workbook; --sheet NAME reads another one alone"
            )
        grid.notices += [f"check: {text}" for text in page.remarks]
        if doubtful:
            grid.notices.append(
                f"check: {doubtful!r} was read with a decimal comma; if commas group thousands here: --scale"
                " QUANTITY=1000"
            )
        grids.append(grid)
    return grids


def _split_at_wide_gaps(page: Page, fields: Rows, parsed: Parsed) -> None:
    """Divide headings at two spaces or more where that, and no single space, gives one for each number."""
    width = Counter(len(row) for row in parsed if row is not None).most_common(1)[0][0]
    for i, row in enumerate(fields):
        if parsed[i] is None and len(row) > width > 1:
            wide = re.split(r"\s{2,}|\t", page.lines[i].strip())
            fields[i] = wide if len(wide) == width else row


def _examples(fields: Rows | dict[int, list[str]], rows: list[int]) -> str:
    """First words of some rows, or their first field, with the number of the row."""
    texts = []
    for i in rows[:_LISTED]:
        words = [t for t in fields[i] if t and not like_a_number(t)] or fields[i]
        texts.append(f"{words[0][:40]!r} (row {i + 1})")
    return ", ".join(texts) + (", ..." if len(rows) > _LISTED else "")


def _blocks(fields: Rows, parsed: Parsed) -> list[tuple[int, int]]:
    """Lines of each table with the lines above it. A new table begins below a row of headings."""
    blocks = []
    begin = 0
    table = first_table(fields, parsed, 0)
    while table:
        end, at = len(fields), table.run[-1] + 1
        following: Start | None = None
        while at < len(fields):
            if parsed[at] is not None or not fields[at]:
                at += 1
                continue
            following = first_table(fields, parsed, at)
            if following is None:
                break
            if following.header and _is_header(following.header, table.header):
                end = at
                break
            at, following = following.run[-1] + 1, None
        blocks.append((begin, end))
        begin, table = end, following
    return blocks


def _is_header(other: list[str], first: list[str]) -> bool:
    """True if a row above numbers is a header: the first one again, or one of two quantities or sizes."""
    again = [t.casefold() for t in other] == [t.casefold() for t in first]
    return again or names_quantities(other) >= 2 or count_of_sizes(other) >= 2


def _grid_of(lines: _Lines, begin: int, end: int) -> Grid | None:
    """The table in some lines of a page; None if there is none."""
    fields, parsed = lines.fields, lines.parsed
    table = first_table(fields, parsed, begin, end)
    if table is None:
        return None
    run, header, top, remarks = table
    width, stated = max(len(header), _columns(parsed, run, bool(header))), len(header)
    header += [""] * (width - len(header)) if header else []
    if width == 1 and lines.delimiter not in (" ", ""):
        return None
    filled = [i for i in range(run[0], end) if fields[i]]
    beside = _beside(lines, filled, width)
    keep = [i for i in filled if 0 < len(parsed[i] or []) <= width]
    dropped = sorted(set(filled) - set(keep))
    if len(dropped) > len(keep):
        return None
    notices, contradictions = two_units(header, fields[top])
    contradictions |= lines.page.doubtful
    notices += _between(fields, remarks)
    if counts_columns(fields, keep):
        notices.append(f"check: row {keep[0] + 1} only counts the columns and was left out")
        keep = keep[1:]
    values = _numbers(parsed, keep, width)
    notices += _thermocouples(header, contradictions, values)
    keep, told_by_numbers = _without_statistics(fields, keep, values)
    notices += told_by_numbers
    if cut := cut_off(lines.page, fields, keep, lines.delimiter, header, lines.decimal):
        notices.append(cut.said)
        keep = keep[:-1] if cut.spoilt else keep
    apart = f"separated by {_SEPARATORS[lines.delimiter]}" if lines.delimiter else "in cells of a sheet"
    described = f"{counted(width, 'column')}, {apart}"
    notices = [
        f"{counted(len(keep), 'row')} of {described}",
        *(["decimal commas"] if lines.decimal == "," else []), *notices, *beside,
        *_dropped(lines, keep, dropped, width), *_statistics(lines, top, end),
    ]  # fmt: skip
    whole = lines.page.is_sheet or _heads_all(lines, top, width)
    longer = [] if whole else [i for i in keep if len(fields[i]) > stated > 0]
    doubt = _all_longer(lines, longer, len(keep), stated) if 2 * len(longer) > len(keep) else ""
    if longer and not doubt:
        notices.append(_longer(fields, longer, stated))
    grid = Grid(
        headings=[heading_of(text) for text in header],
        values=_numbers(parsed, keep, width),
        rows=[i + 1 for i in keep],
        preamble=[row for row in fields[begin:top] if row],
        notices=notices,
        cells=[fields[i] for i in keep],
        doubt=doubt or _other_units(fields, header, keep, dropped),
        contradictions=contradictions,
        breaks=_breaks(fields, keep, dropped),
        described=described,
        decimal=lines.decimal,
        below=[fields[i] for i in dropped if i > keep[-1] and parsed[i] is None],
    )
    if not header and (asked := numbers_as_headings(grid.values, grid.rows, grid.cells)):
        grid.notices.append(asked)
    read_texts(grid, [parsed[i] or [] for i in keep], lines.decimal)
    return grid


def _between(fields: Rows, remarks: Sequence[int]) -> list[str]:
    """A notice about rows between the headings and the numbers, which were left aside."""
    if not remarks:
        return []
    telling = {i: numbered(fields[i]) or fields[i] for i in remarks}
    asked = any(numbered(row) or names_quantities(row) for row in telling.values())
    return [
        f"{'check: ' if asked else ''}rows between the headings and the numbers were left aside:"
        f" {_examples(telling, [*remarks])}{'; a factor in them is not applied' if asked else ''}"
    ]


def _thermocouples(
    header: list[str], contradictions: dict[int, tuple[str, ...]], values: np.ndarray
) -> list[str]:
    """Take columns whose K is a type of thermocouple from the contradictions, with a notice each.

    Args:
        header: headings.
        contradictions: units that a heading and another row state, by column; changed in place.
        values: numbers, shape (rows of numbers, columns).
    """
    named = [c for c, units in contradictions.items() if is_type_k(header[c], units, values[:, c])]
    for column in named:
        del contradictions[column]
    return [
        f"check: {header[column]!r} was taken in degC, and its K as a name or a type of thermocouple"
        for column in named
    ]


def _statistics(lines: _Lines, top: int, end: int) -> list[str]:
    """A notice about labelled rows of statistics of a table, which were left out."""
    told = [i for i in lines.statistics if top <= i < end]
    if not told:
        return []
    return [
        f"check: {counted(len(told), 'row of statistics was', 'rows of statistics were')} left out:"
        f" {_examples(lines.statistics, told)}"
    ]


def _without_statistics(fields: Rows, keep: list[int], values: np.ndarray) -> tuple[list[int], list[str]]:
    """Rows of a table without those that are surely statistics of all others, and notices about these.

    Args:
        fields: rows of text.
        keep: rows of numbers.
        values: their numbers, shape (rows of numbers, columns).
    """
    summed = unlabelled_statistics(values, [fields[i] for i in keep])
    if not summed.rows:
        return keep, []
    said = {keep[k]: name for k, name in summed.rows.items()}
    labels = {i: label for i in said if (label := _label_of(fields[i]))}
    left = [i for k, i in enumerate(keep) if k not in summed.rows] if summed.sure else keep
    return left, [_of_all_others(said, labels, summed.sure)]


def _numbers(parsed: Parsed, keep: list[int], width: int) -> np.ndarray:
    """Numbers of some rows, NaN where a field is blank or holds words, shape (rows, width)."""
    values = np.full((len(keep), width), math.nan)
    for k, i in enumerate(keep):
        row = parsed[i] or []
        values[k, : len(row)] = [math.nan if x is None else x for x in row]
    return values


def _label_of(row: list[str]) -> str:
    """First word of a row, such as `Overall`; empty where there is none."""
    return next((text for text in row if re.search(r"[^\W\d_]{2}", text) and not like_a_number(text)), "")


def _of_all_others(rows: dict[int, str], labels: dict[int, str], sure: bool) -> str:
    """Warning about rows that were told as statistics by their numbers alone.

    Args:
        rows: name of the statistic by row.
        labels: label by row that has one, which no known word is.
        sure: true if the rows were left out.
    """
    label = {i: f", labelled {text!r}" for i, text in labels.items()}
    named = ", ".join(f"{name} (row {i + 1}{label.get(i, '')})" for i, name in rows.items())
    which = "" if labels else " without a label"
    if not sure:
        may = counted(len(rows), f"row{which}", f"rows{which}")
        return f"check: {may} may be statistics of all others, but were read as measurements: {named}"
    are = counted(len(rows), f"row{which} is a statistic", f"rows{which} are statistics")
    were = "was" if len(rows) == 1 else "were"
    return f"check: {are} of all others and {were} left out: {named}"


def _columns(parsed: Parsed, run: list[int], named: bool) -> int:
    """Number of columns of a table: up to its widest row; without headings, up to its last long column.

    A long column has enough rows for a table. Cells of a shorter one stand beside the table.
    """
    rows = [parsed[i] or [] for i in run]
    width = max(map(len, rows))
    if named or len(rows) <= LEAST_ROWS:
        return width
    while width > 1 and sum(len(row) >= width for row in rows) < LEAST_ROWS:
        width -= 1
    return width


def _beside(lines: _Lines, filled: list[int], width: int) -> list[str]:
    """Cut cells that stand apart at the side of a table off its rows. A notice names them.

    At least one empty column divides them from the table, and they are too few to be a table themselves.
    """
    fields, parsed = lines.fields, lines.parsed
    apart = [i for i in filled if len(parsed[i] or []) > width and not fields[i][width]]
    if not 0 < len(apart) < LEAST_ROWS:
        return []
    cells = [f"{text[:40]!r} (row {i + 1})" for i in apart for text in fields[i][width:] if text]
    for i in apart:
        fields[i], parsed[i] = fields[i][:width], numeric_row(fields[i][:width], lines.decimal)
    return [f"cells apart from the table were left aside: {', '.join(cells)}"]


def _dropped(lines: _Lines, keep: list[int], dropped: list[int], width: int) -> list[str]:
    """Notices about rows below the header that were not read: remarks, rows of numbers with words or too
    many fields."""
    fields = lines.fields
    wider = [i for i in dropped if len(lines.parsed[i] or []) > width]
    rest = [i for i in dropped if i not in wider]
    mixed = [i for i in rest if len(fields[i]) > 1 and any(map(like_a_number, fields[i]))]
    remarks = [i for i in rest if i not in mixed]
    notices = []
    if wider:
        notices.append(
            f"check: {counted(len(wider), 'row has', 'rows have')} more fields than the {width} columns and"
            f" {'was' if len(wider) == 1 else 'were'} dropped:"
            f" {_examples(fields, wider)}"
        )
    inside = [i for i in remarks if i < keep[-1] and _CHANGES.search(" ".join(fields[i]))]
    remarks_mark = "check: " if inside else ""
    for rows, mark in ((remarks, remarks_mark), (mixed, "check: ")):
        if rows:
            what = "row below the header is not", "rows below the header are not"
            count = counted(len(rows), *what)
            were = "was" if len(rows) == 1 else "were"
            notices.append(f"{mark}{count} {NO_NUMBERS} {were} dropped: {_examples(fields, rows)}")
    below = [i for i in keep if remarks and i > remarks[-1]]
    if 0 < len(below) < LEAST_ROWS:
        numbers = ", ".join(str(i + 1) for i in below)
        notices.append(
            f"check: the rows below {_examples(fields, remarks[-1:])} were read as measurements (row"
            f" {numbers}); delete them in the file if they sum up the others"
        )
    return notices


def _breaks(fields: Rows, keep: list[int], dropped: list[int]) -> dict[int, Rows]:
    """Lines of text above a row of numbers, by the position of that row in the table."""
    places = np.searchsorted(keep, dropped)
    found: dict[int, Rows] = {}
    for place, i in zip(places, dropped, strict=True):
        if 0 < place < len(keep):
            found.setdefault(int(place), []).append(fields[i])
    return found


def _other_units(fields: Rows, header: list[str], keep: list[int], dropped: list[int]) -> str:
    """Reason to refuse a table with a row of units among its numbers that are not those of the headings."""
    for i in dropped:
        if not keep[0] < i < keep[-1] or not has_units(fields[i]):
            continue
        for heading, text in zip(header, fields[i], strict=False):
            unit, own = text.strip("()[] "), parse_heading(heading).unit
            if own is not None and unit and may_be_unit(unit) and not same_unit(own, unit):
                return (
                    f"row {i + 1} among the numbers states the unit {unit!r}, and the heading {heading!r}"
                    " another one. Write all rows in one unit, or a table with headings of its own below"
                )
    return ""


def _heads_all(lines: _Lines, top: int, width: int) -> bool:
    """True if the row of headings has a field, though an empty one, above every column."""
    return lines.delimiter != " " and lines.page.lines[top].count(lines.delimiter) + 1 >= width


def _longer(fields: Rows, longer: list[int], stated: int) -> str:
    """Warning where a few rows have more fields than there are headings. A surplus comma shifts numbers."""
    row, count = longer[0], len(longer)
    return (
        f"check: {counted(count, 'row has', 'rows have')} more fields than the {stated} headings (row"
        f" {row + 1}: {len(fields[row])} fields). If a mark too many moved its numbers, mend it in the file"
    )


def _all_longer(lines: _Lines, longer: list[int], rows: int, stated: int) -> str:
    """Reason to refuse a table most of whose rows have more fields than there are headings."""
    row, fields = longer[0], lines.fields
    said = (
        f"{len(longer)} of {rows} rows have more fields than the {stated} headings (row {row + 1}:"
        f" {len(fields[row])} fields, {lines.delimiter.join(fields[row])[:40]!r})"
    )
    if lines.delimiter == "," and not any("." in text for i in longer for text in fields[i]):
        return (
            f"{said}: commas both separate the fields and mark decimals; export the file with semicolons or"
            " tabs between the fields, or with decimal points"
        )
    return f"{said}, so no column is known to belong to its heading; write a heading above every column"
