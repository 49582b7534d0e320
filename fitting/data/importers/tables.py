"""Detection of the tables of numbers on a page: preamble, header, units below it, stray rows."""

import math
import re
from collections import Counter

import numpy as np

from pneusma_jax.errors import counted

from .cut_off import cut_off
from .grid import Grid
from .headers import (
    Parsed,
    Rows,
    Start,
    first_table,
    is_type_k,
    names_quantities,
    two_units,
)
from .lines import Lines
from .numbered_columns import numbers_as_headings
from .raw import Page
from .separators import LEAST_ROWS, best_reading, numeric_row
from .size_tables import count_of_sizes
from .summaries import counts_columns, statistics_rows, unlabelled_statistics
from .table_notices import (
    all_longer,
    dropped_rows,
    label_of,
    longer_rows,
    other_units,
    rows_between,
    statistics_by_numbers,
    statistics_told,
)
from .texts import read_texts
from .words import heading_of

_SEPARATORS = {
    ",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "white space",
}  # fmt: skip


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
    lines = Lines(page, delimiter, decimal, fields, parsed, {})
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


def _grid_of(lines: Lines, begin: int, end: int) -> Grid | None:
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
    keep, uneven = _without_gaps(lines, keep, width, bool(header))
    notices, contradictions = two_units(header, fields[top])
    contradictions |= lines.page.doubtful
    notices += rows_between(fields, remarks)
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
        *(["decimal commas"] if lines.decimal == "," else []), *notices, *uneven, *beside,
        *dropped_rows(lines, keep, dropped, width), *statistics_told(lines, begin, top, end),
    ]  # fmt: skip
    whole = lines.page.is_sheet or _heads_all(lines, top, width)
    longer = [] if whole else [i for i in keep if len(fields[i]) > stated > 0]
    doubt = all_longer(lines, longer, len(keep), stated) if 2 * len(longer) > len(keep) else ""
    if longer and not doubt:
        notices.append(longer_rows(fields, longer, stated))
    grid = Grid(
        headings=[heading_of(text) for text in header],
        values=_numbers(parsed, keep, width),
        rows=[i + 1 for i in keep],
        preamble=[row for row in fields[begin:top] if row],
        notices=notices,
        cells=[fields[i] for i in keep],
        doubt=doubt or other_units(fields, header, keep, dropped),
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


def _without_gaps(lines: Lines, keep: list[int], width: int, named: bool) -> tuple[list[int], list[str]]:
    """Rows without those that have fewer fields than headings, where white space divides the fields.

    An absent field leaves no mark there, so that the others may stand under another heading. The last row is
    left to `cut_off`. Most rows being short, their last fields are taken to be empty, which is said.

    Args:
        lines: the page.
        keep: rows of numbers.
        width: number of columns.
        named: true if the table has headings.
    """
    fields = lines.fields
    short = [i for i in keep if len(fields[i]) < width] if lines.delimiter == " " and named else []
    inner = [i for i in short if i != keep[-1]]
    if not inner:
        return keep, []
    rows, first = counted(len(inner), "row has", "rows have"), " ".join(fields[inner[0]])
    said = (
        f"check: {rows} fewer fields than the {width} headings (row {inner[0] + 1}: {first[:40]!r}), and"
        " white space divides them"
    )
    if 2 * len(inner) > len(keep):
        return keep, [f"{said}: the last headings were taken to be those without a field"]
    were = "was" if len(inner) == 1 else "were"
    left = [i for i in keep if i not in {*inner}]
    return left, [f"{said}, so no field has a sure heading: {were} left out"]


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
    labels = {i: label for i in said if (label := label_of(fields[i]))}
    left = [i for k, i in enumerate(keep) if k not in summed.rows] if summed.sure else keep
    return left, [statistics_by_numbers(said, labels, summed.sure)]


def _numbers(parsed: Parsed, keep: list[int], width: int) -> np.ndarray:
    """Numbers of some rows, NaN where a field is blank or holds words, shape (rows, width)."""
    values = np.full((len(keep), width), math.nan)
    for k, i in enumerate(keep):
        row = parsed[i] or []
        values[k, : len(row)] = [math.nan if x is None else x for x in row]
    return values


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


def _beside(lines: Lines, filled: list[int], width: int) -> list[str]:
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


def _breaks(fields: Rows, keep: list[int], dropped: list[int]) -> dict[int, Rows]:
    """Lines of text above a row of numbers, by the position of that row in the table."""
    places = np.searchsorted(keep, dropped)
    found: dict[int, Rows] = {}
    for place, i in zip(places, dropped, strict=True):
        if 0 < place < len(keep):
            found.setdefault(int(place), []).append(fields[i])
    return found


def _heads_all(lines: Lines, top: int, width: int) -> bool:
    """True if the row of headings has a field, though an empty one, above every column."""
    return lines.delimiter != " " and lines.page.lines[top].count(lines.delimiter) + 1 >= width
