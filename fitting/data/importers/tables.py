"""Detection of the tables of numbers on a page: preamble, header, units below it, stray rows."""

import itertools
import math
import re

import numpy as np

from pneusma_jax.units import UNITS

from .grid import Grid
from .numerals import to_number
from .raw import Page
from .separators import LEAST_ROWS, best_reading, numeric_row
from .spelling import unit_name
from .texts import read_texts
from .words import heading_of, meaning

# Names of columns that are also spelled like units.
_NAMES_TOO = ("strain", "ratio", "t", "f", "r", "i", "temp")
_SEPARATORS = {
    ",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "white space", "": "cells of a sheet",
}  # fmt: skip


def find_grids(page: Page) -> list[Grid]:
    """The tables of numbers of a page, in order: one below the other where headers repeat.

    The delimiter and the decimal mark are those with which most fields are numbers.
    """
    reading = best_reading(page)
    if reading is None:
        return []
    delimiter, decimal, doubtful = reading
    fields = page.fields(delimiter)
    parsed = [numeric_row(row, decimal) for row in fields]
    grids = []
    for begin, end in _blocks(fields, parsed):
        grid = _grid_of(fields, parsed, begin, end, delimiter, decimal)
        if grid is None:
            continue
        if page.hidden:
            grid.notices.append(
                f"check: sheet {page.name!r} is hidden in the workbook; --sheet NAME reads another one alone"
            )
        if doubtful:
            grid.notices.append(
                f"check: {doubtful!r} was read with a decimal comma; if commas group thousands here: --scale"
                " QUANTITY=1000"
            )
        grids.append(grid)
    return grids


def words_for_numbers(page: Page) -> str:
    """Reason why a page with headings of quantities holds no table: a column of words below them. Empty
    otherwise."""
    for delimiter in ("",) if page.is_sheet else (",", ";", "\t", "|"):
        fields = page.fields(delimiter)
        for at, header in enumerate(fields):
            named = [c for c, text in enumerate(header) if text and meaning(heading_of(text)) is not None]
            body = [(i + 1, row) for i, row in enumerate(fields) if i > at and len(row) == len(header)]
            if len(named) < 2 or len(body) < LEAST_ROWS:
                continue
            for column in named:
                texts = [(i, row[column]) for i, row in body if to_number(row[column], ".") is None]
                texts = [(i, text) for i, text in texts if to_number(text, ",") is None]
                if 2 * len(texts) > len(body):
                    i, text = texts[0]
                    label = repr(header[column])
                    return (
                        f"{len(texts)} of {len(body)} fields of {label} are no numbers ({text!r} in row {i})"
                    )
    return ""


def _blocks(fields: list[list[str]], parsed: list[list | None]) -> list[tuple[int, int]]:
    """Lines of each table with the lines above it. A new table begins below a row of headings."""
    blocks = []
    begin = 0
    run = _first_run(parsed, fields, 0)
    while run:
        header = _header_above(fields, run[0], max(_last_number(parsed[i]) for i in run), begin)[0]
        end, at = len(fields), run[-1] + 1
        following: list[int] = []
        while at < len(fields):
            if parsed[at] is not None or not fields[at]:
                at += 1
                continue
            following = _first_run(parsed, fields, at)
            if not following:
                break
            named = max(_last_number(parsed[i]) for i in following)
            other, _ = _header_above(fields, following[0], named, at)
            if other and _is_header(other, header):
                end = at
                break
            at, following = following[-1] + 1, []
        blocks.append((begin, end))
        begin, run = end, following
    return blocks


def _is_header(other: list[str], first: list[str]) -> bool:
    """True if a row above numbers is a header: the first one again, or one that names two quantities."""
    if [text.casefold() for text in other] == [text.casefold() for text in first]:
        return True
    return sum(meaning(heading_of(text)) is not None for text in other) >= 2


def _grid_of(
    fields: list[list[str]], parsed: list[list | None], begin: int, end: int, delimiter: str, decimal: str
) -> Grid | None:
    run = _first_run(parsed[:end], fields, begin)
    if not run:
        return None
    start, named = run[0], max(_last_number(parsed[i]) for i in run)
    header, top = _header_above(fields, start, named, begin)
    width, stated = max(len(header), *(len(parsed[i]) for i in run)), len(header)
    header += [""] * (width - len(header)) if header else []
    if width == 1 and delimiter not in (" ", ""):
        return None
    filled = [i for i in range(start, end) if fields[i]]
    keep = [i for i in filled if parsed[i] is not None and len(parsed[i]) <= width]
    dropped = sorted(set(filled) - set(keep))
    if len(dropped) > len(keep):
        return None
    values = np.full((len(keep), width), math.nan)
    for k, i in enumerate(keep):
        values[k, : len(parsed[i])] = [math.nan if x is None else x for x in parsed[i]]
    notices = [f"{len(keep)} rows of {width} columns, separated by {_SEPARATORS[delimiter]}"]
    notices += ["decimal commas"] if decimal == "," else []
    if dropped:
        where = ", ".join(str(i + 1) for i in dropped[:3]) + (", ..." if len(dropped) > 3 else "")
        notices.append(f"{len(dropped)} rows below the header are not numbers and were dropped (row {where})")
    notices += _surplus_fields_warning(fields, keep, stated)
    grid = Grid(
        headings=[heading_of(text) for text in header],
        values=values,
        rows=[i + 1 for i in keep],
        preamble=[row for row in fields[begin:top] if row],
        notices=notices,
        cells=[fields[i] for i in keep],
    )
    read_texts(grid, [parsed[i] for i in keep])
    return grid


def _surplus_fields_warning(fields: list[list[str]], rows: list[int], stated: int) -> list[str]:
    """Warning where a few rows have more fields than there are headings. A surplus comma shifts numbers."""
    longer = [i for i in rows if len(fields[i]) > stated] if stated else []
    if not longer or 2 * len(longer) > len(rows):
        return []
    row, count = longer[0], len(longer)
    return [
        f"check: {count} row{'s have' if count > 1 else ' has'} more fields than the {stated} headings (row"
        f" {row + 1}: {len(fields[row])} fields); if a mark too many moved its numbers, mend it in the file"
    ]


def few_numbers(page: Page) -> str:
    """Reason why a page with headings of quantities holds no table: too few rows of numbers. Empty
    otherwise."""
    for delimiter in ("",) if page.is_sheet else (",", ";", "\t", "|"):
        fields = page.fields(delimiter)
        for at, header in enumerate(fields):
            named = [text for text in header if text and meaning(heading_of(text)) is not None]
            if len(named) >= 2:
                count = sum(any(to_number(t, ".") is not None and t for t in row) for row in fields[at + 1 :])
                if count < LEAST_ROWS:
                    count_text = f"{count} row{'s' * (count != 1)} of numbers" if count else "no numbers"
                    return (
                        f"below the headings {', '.join(map(repr, named))} stand {count_text}; a table needs"
                        f" {LEAST_ROWS}"
                    )
    return ""


def _first_run(parsed: list[list | None], fields: list[list[str]], begin: int) -> list[int]:
    """First run of rows of numbers from a line on, empty if there is none; blank lines do not break it.

    Rows may be shorter than others, where their last fields are empty, but not less than half as wide.
    """
    run: list[int] = []
    for i in range(begin, len(parsed)):
        row = parsed[i]
        if not fields[i]:
            continue
        if row is not None and (not run or 2 * len(row) > len(parsed[run[0]]) > len(row) / 2):
            run.append(i)
            continue
        if len(run) >= LEAST_ROWS:
            break
        run = [] if row is None else [i]
    return run if len(run) >= LEAST_ROWS else []


def _last_number(row: list[float | None]) -> int:
    """Number of fields up to the last one that is a number."""
    return max(i + 1 for i, x in enumerate(row) if x is not None and not math.isnan(x))


def _header_above(fields: list[list[str]], start: int, named: int, floor: int) -> tuple[list[str], int]:
    """Names of the columns and the row they stand in: the nearest filled row above, if it names every column.

    A row of units alone (`(s);(mm);(N)`, or `s;mm;N`) under a row of names is joined to it. A row that leaves
    the last columns without a name is a header if it names two quantities.

    Args:
        fields: fields of the whole page by row.
        start: index of the first row of numbers.
        named: number of columns that need a name.
        floor: index of the first row that belongs to this table.
    """
    above = [i for i in range(start - 1, floor - 1, -1) if fields[i]][:2]
    if not above:
        return [], start
    top, units = above[0], []
    if (
        len(above) == 2
        and all(map(_is_unit, fields[top]))
        and not any(_is_unit(t) and t for t in fields[above[1]])
    ):
        top, units = above[1], fields[top]
    names = _uncommented(fields[top])
    if len(names) < max(named, 2) and sum(meaning(heading_of(text)) is not None for text in names) < 2:
        return [], start
    pairs = itertools.zip_longest(names, units, fillvalue="")
    return [f"{name} ({unit.strip('()[]')})" if unit else name for name, unit in pairs], top


def _uncommented(names: list[str]) -> list[str]:
    """A row of headings without a leading comment mark."""
    if names and names[0] in ("#", "%", "//", "#:"):
        return names[1:]
    return [re.sub(r"^[#%]\s*", "", names[0]), *names[1:]] if names else names


def _is_unit(text: str) -> bool:
    """True if a field is a unit alone: `(kPa)`, `[-]`, `mm`, or nothing."""
    if text.casefold() in _NAMES_TOO:
        return False
    return not text or bool(re.fullmatch(r"[(\[].*[)\]]", text)) or unit_name(text) in UNITS
