"""Finding the tables of numbers in a raw file: delimiter, decimal mark, preamble, header, stray rows."""

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pneusma_jax.units import UNITS

from .numerals import clock_seconds, decimal_evidence, like_a_clock, like_a_number, to_number
from .raw import Page, RawFile
from .spelling import Heading, unit_name
from .words import heading_of, meaning

LEAST_ROWS = 3  # fewer rows of numbers are not a table
_SAMPLED = 1000  # lines from which the delimiter and the decimal mark are told
_NAMES_TOO = (
    "strain",
    "ratio",
    "t",
    "f",
    "r",
    "i",
    "temp",
)  # names of columns, though units are called so, too
_DAY_S = 86400.0
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "white space", "": "cells of a sheet"}


@dataclass
class Grid:
    """A table of numbers of a raw file.

    Attributes:
        headings: one per column, or none if the file has no header.
        values: shape (rows, columns), NaN where a field is blank.
        rows: line of the file (from 1) of each row.
        preamble: fields of the lines before the header.
        notices: delimiter, decimal mark, rows dropped and why.
        cells: the fields of each row as text.
        troubles: by column, why its numbers cannot be trusted; a sentence without subject.
    """

    headings: list[Heading]
    values: np.ndarray
    rows: list[int]
    preamble: list[list[str]]
    notices: list[str] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)
    troubles: dict[int, str] = field(default_factory=dict)

    def part(self, rows: Sequence[int] | slice, columns: Sequence[int] | None = None) -> "Grid":
        """Some rows and columns of it, as a table of their own."""
        picked = list(range(len(self.rows)))[rows] if isinstance(rows, slice) else list(rows)
        chosen = list(range(self.values.shape[1])) if columns is None else list(columns)
        return Grid(
            headings=[self.headings[c] for c in chosen] if self.headings else [],
            values=self.values[np.ix_(picked, chosen)],
            rows=[self.rows[i] for i in picked],
            preamble=self.preamble,
            notices=list(self.notices),
            cells=[[self.cells[i][c] if c < len(self.cells[i]) else "" for c in chosen] for i in picked],
            troubles={k: self.troubles[c] for k, c in enumerate(chosen) if c in self.troubles},
        )


def find_grids(raw: RawFile, page: Page) -> list[Grid]:
    """The tables of numbers of a page, in order: one below the other where headers repeat.

    The delimiter and the decimal mark are those with which most fields are numbers.
    """
    reading = _best_reading(raw, page)
    if reading is None:
        return []
    delimiter, decimal = reading
    fields = page.fields(delimiter)
    parsed = [numeric_row(row, decimal) for row in fields]
    grids = []
    for begin, end in _blocks(fields, parsed):
        grid = _grid_of(fields, parsed, begin, end, delimiter, decimal)
        if grid is not None:
            grids.append(grid)
    return grids


def _best_reading(raw: RawFile, page: Page) -> tuple[str, str] | None:
    """Delimiter and decimal mark with which most fields of a sample of lines are numbers, fewest text."""
    best: tuple[float, tuple[str, str]] | None = None
    pure = False
    for delimiter in ("",) if page.is_sheet else (",", ";", "\t", " "):
        fields = _sample(page, delimiter)
        if delimiter == " " and pure:
            continue  # a file that another mark divides into columns; spaces may group its thousands
        scores = {}
        for decimal in (".", ","):
            rows = [
                (row, numeric_row(row, decimal, "point" if delimiter == "," else "any")) for row in fields
            ]
            rows = [(row, numbers) for row, numbers in rows if numbers is not None]
            wide = max((len(row) for row, _ in rows), default=0)
            if len(rows) < LEAST_ROWS or (wide == 1 and delimiter not in (" ", "")):
                continue
            held = sum(x is not None and not math.isnan(x) for _, numbers in rows for x in numbers)
            texts = sum(
                x is None and not like_a_clock(text)
                for row, numbers in rows
                for x, text in zip(numbers, row, strict=True)
            )
            scores[decimal] = (held - texts, rows)
            pure = pure or (2 * texts <= held and wide > 1)
        if not scores:
            continue
        most = max(score for score, _ in scores.values())
        tied = [decimal for decimal, (score, _) in scores.items() if score == most]
        decimal = tied[0] if len(tied) == 1 else _decimal_of([row for row, _ in scores["."][1]])
        if best is None or most > best[0]:
            best = (most, (delimiter, decimal))
    return best[1] if best and best[0] > 0 else None


def _sample(page: Page, delimiter: str) -> list[list[str]]:
    """Fields of the first lines and of lines all over the rest."""
    count = page.count
    first = min(count, _SAMPLED // 2)
    step = max(1, (count - first) // (_SAMPLED // 2))
    return page.fields(delimiter, [*range(first), *range(first, count, step)])


def _decimal_of(rows: list[list[str]]) -> str:
    """The decimal mark that more fields prove; a comma where they hold commas and nothing is proved."""
    proofs = [proof for row in rows for text in row if (proof := decimal_evidence(text)) is not None]
    if proofs:
        return "," if proofs.count(",") > proofs.count(".") else "."
    marks = "".join(text for row in rows for text in row)
    return "," if "," in marks and "." not in marks else "."


def numeric_row(row: list[str], decimal: str, spaced: str = "any") -> list[float | None] | None:
    """Numbers of a row (None where a field is text), or None if it is mostly text or blank: no data.

    A field of digits whose marks cannot be read, or of a date, is no text: its row is data.
    """
    numbers = [to_number(text, decimal, spaced) for text in row]
    texts = sum(
        x is None and not like_a_number(text) and not like_a_clock(text)
        for x, text in zip(numbers, row, strict=True)
    )
    real = sum(x is not None and not math.isnan(x) for x in numbers)
    return None if real == 0 or 2 * texts >= len(row) or (texts and real < 2) else numbers


def _blocks(fields: list[list[str]], parsed: list[list | None]) -> list[tuple[int, int]]:
    """Lines of each table with what stands above it: a new one begins below a row of headings."""
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
    """Whether a row above numbers is a header: the first one again, or one that names two quantities."""
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
    width = max(len(header), *(len(parsed[i]) for i in run))
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
    grid = Grid(
        headings=[heading_of(text) for text in header],
        values=values,
        rows=[i + 1 for i in keep],
        preamble=[row for row in fields[begin:top] if row],
        notices=notices,
        cells=[fields[i] for i in keep],
    )
    _grouped_notice(grid)
    _percent_signs(grid)
    _read_texts(grid, [parsed[i] for i in keep])
    return grid


def _grouped_notice(grid: Grid) -> None:
    """Say that thousands were grouped, with an example."""
    for row, cells in zip(grid.rows, grid.cells, strict=True):
        for text in cells:
            if re.fullmatch(
                r"[+-]?\d{1,3}([.,'’ \u00a0\u2009\u202f]\d{3})+[.,]\d*|[+-]?\d{1,3}(['’"
                r" \u00a0\u2009\u202f]\d{3})+",
                text,
            ):
                grid.notices.append(f"thousands are grouped: {text!r} in row {row}")
                return


def _percent_signs(grid: Grid) -> None:
    """Take the unit of columns whose fields end in a percent sign from there."""
    for column, heading in enumerate(grid.headings):
        signs = sum(cells[column].endswith("%") for cells in grid.cells if column < len(cells))
        if signs and heading.unit in (None, "1", "percent"):
            grid.headings[column] = Heading(heading.text, heading.name, "percent", heading.zero)
            filled = sum(bool(cells[column]) for cells in grid.cells if column < len(cells))
            if signs < filled:
                grid.troubles[column] = (
                    f"{signs} of {filled} fields of {heading.text!r} end in a percent sign and the others do"
                    " not"
                )
            grid.notices.append(f"fields of column {heading.text!r} end in a percent sign: taken as percent")


def _read_texts(grid: Grid, parsed: list[list[float | None]]) -> None:
    """Clocks among columns of text; which columns are text; which fields of the others are no numbers."""
    for column in range(grid.values.shape[1]):
        texts = [
            (row, cells[column])
            for row, cells, numbers in zip(grid.rows, grid.cells, parsed, strict=True)
            if column < len(numbers) and numbers[column] is None
        ]
        if not texts:
            continue
        label = repr(grid.headings[column].text) if grid.headings else str(column + 1)
        seconds = clock_seconds([cells[column] if column < len(cells) else "" for cells in grid.cells])
        if seconds is not None and (not grid.headings or _may_be_clock(grid.headings[column])):
            grid.values[:, column] = _past_midnight(np.array(seconds))
            if grid.headings:
                old = grid.headings[column]
                grid.headings[column] = Heading(old.text, "time" if meaning(old) is None else old.name, "s")
            grid.notices.append(f"column {label} is a clock ({texts[0][1]!r}), read as seconds")
            continue
        filled = int(np.isfinite(grid.values[:, column]).sum()) + len(texts)
        numberlike = [(row, text) for row, text in texts if like_a_number(text)]
        if 2 * len(texts) > filled:
            grid.notices.append(f"column {label} is text and was left out")
            grid.troubles[column] = (
                f"{len(texts)} of {filled} fields of {label} are no numbers ({texts[0][1]!r} in row"
                f" {texts[0][0]})"
            )
        else:
            row, text = texts[0]
            grid.notices.append(
                f"{len(texts)} fields of column {label} are not numbers ({text!r} in row {row}): missing"
            )
        if numberlike and 2 * len(texts) <= filled:
            row, text = numberlike[0]
            grid.troubles[column] = (
                f"{text!r} in row {row} of {label} cannot be told: its marks are not those of the other"
                " numbers"
            )


def _may_be_clock(heading: Heading) -> bool:
    means = meaning(heading)
    return (means is not None and means.quantity == "time") or bool(
        re.search(r"time|zeit|clock|temps|uhr", heading.name)
    )


def _past_midnight(seconds: np.ndarray) -> np.ndarray:
    """A clock of the day counted on past midnight."""
    filled = np.isfinite(seconds)
    days = np.cumsum(np.diff(seconds[filled], prepend=seconds[filled][0]) < -_DAY_S / 2.0)
    counted = seconds.copy()
    counted[filled] += _DAY_S * days
    return counted


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
        fields: of the whole page.
        start: first row of numbers.
        named: columns that need a name.
        floor: first row that belongs to this table.
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
    """A row of headings without the mark of a comment before it."""
    if names and names[0] in ("#", "%", "//", "#:"):
        return names[1:]
    return [re.sub(r"^[#%]\s*", "", names[0]), *names[1:]] if names else names


def _is_unit(text: str) -> bool:
    """Whether a field is a unit alone: `(kPa)`, `[-]`, `mm`, or nothing."""
    if text.casefold() in _NAMES_TOO:
        return False
    return not text or bool(re.fullmatch(r"[(\[].*[)\]]", text)) or unit_name(text) in UNITS
