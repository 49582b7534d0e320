"""Finding the table of numbers in a raw file: delimiter, decimal mark, preamble, header, stray rows."""

import itertools
import math
import re
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pneusma_jax.units import UNITS

from ..recordings.table import refuse
from .raw import RawFile, delimiters

_BLANK = re.compile(r"\*+|-+|n/?a|nan|null|none|#n/?a", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?\d{1,3}(\.\d{3})+(,\d*)?([eE][+-]?\d+)?")  # 1.021,5 where commas are decimal
_WITH_UNIT = re.compile(r"^(?P<name>.*?)\s*[,;:]?\s*[(\[](?P<unit>[^()\[\]]*)[)\]]\s*$")
LEAST_ROWS = 3  # fewer rows of numbers are not a table

# How instruments write units, where it differs from the package's names.
_SPELLINGS = {
    "": "1", "-": "1", "–": "1", "/": "1", "1": "1", "mm/mm": "1", "m/m": "1", "in/in": "1", "%": "percent",
    "c": "degC", "°c": "degC", "deg c": "degC", "degc": "degC", "celsius": "degC", "f": "degF", "°f": "degF",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "mins": "min", "minutes": "min",
    "hr": "h", "hrs": "h", "hours": "h", "inch": "in", "inches": "in", "newton": "N", "newtons": "N",
    "ohms": "ohm", "ohm": "ohm", "kpa": "kPa", "psi": "psi", "bar": "bar",
    "ω": "ohm", "Ω": "ohm", "n/mm^2": "N/mm2", "n/mm²": "N/mm2", "n/mm2": "N/mm2", "°": "deg",
    "amps": "A", "volts": "V", "lb": "lbf", "lbs": "lbf", "µm": "um",
}  # fmt: skip


@dataclass(frozen=True)
class Heading:
    """A column's name and unit as its header gives them; the unit is None where the header is silent."""

    text: str
    name: str
    unit: str | None


@dataclass
class Grid:
    """The table of numbers of a raw file.

    Attributes:
        headings: one per column, or none if the file has no header.
        values: shape (rows, columns), NaN where a field is blank.
        rows: line of the file (from 1) of each row.
        preamble: fields of the lines before the header.
        notices: delimiter, decimal mark, rows dropped and why.
    """

    headings: list[Heading]
    values: np.ndarray
    rows: list[int]
    preamble: list[list[str]]
    notices: list[str] = field(default_factory=list)


def parse_heading(text: str) -> Heading:
    """Split `Load (N)`, `Strain [-]` or `force_mN` into name and unit; the name in lower case."""
    found = _WITH_UNIT.match(text)
    if found:
        return Heading(text, _plain(found["name"]), unit_name(found["unit"]))
    stem, underscore, suffix = text.rpartition("_")
    if underscore and stem and suffix in UNITS and not suffix.isdigit():
        return Heading(text, _plain(stem), suffix)
    return Heading(text, _plain(text), None)


def _plain(name: str) -> str:
    return re.sub(r"[\s_]+", " ", name).strip(' "').lower()


def unit_name(text: str) -> str:
    """The package's name of a unit as an instrument writes it; unchanged if it has none."""
    text = text.strip()
    if text in UNITS and text not in _SPELLINGS:
        return text
    return _SPELLINGS.get(text, _SPELLINGS.get(text.lower(), text))


def to_number(text: str, decimal: str) -> float | None:
    """Number of a field; NaN if it is blank (`****`, `-`, `NaN`, nothing), None if it is text."""
    if not text or _BLANK.fullmatch(text):
        return math.nan
    if decimal == ",":
        if "." in text and not _GROUPED.fullmatch(text):
            return None
        text = text.replace(".", "").replace(",", ".")
    if not _NUMBER.fullmatch(text):
        return None
    return float(text.replace("d", "e").replace("D", "e"))


@dataclass(frozen=True)
class Sample:
    """What a format is recognised by: the raw file and the table of numbers in it, found once."""

    raw: RawFile

    @cached_property
    def grid(self) -> Grid | None:
        """The table of numbers, or None if the file holds none."""
        return find_grid(self.raw)

    @cached_property
    def head(self) -> str:
        """First lines, as text."""
        return self.raw.head()

    def require_grid(self) -> Grid:
        """The table of numbers.

        Raises:
            InputError: if the file holds none.
        """
        if self.grid is None:
            raise refuse(
                self.raw.path, f"no table of numbers (at least {LEAST_ROWS} rows) was found in this file"
            )
        return self.grid

    def headerless(self, columns: int) -> bool:
        """Whether the file is nothing but this many columns of numbers, without header or preamble."""
        grid = self.grid
        return (
            grid is not None and not grid.headings and not grid.preamble and grid.values.shape[1] == columns
        )


def find_grid(raw: RawFile) -> Grid | None:
    """The table of numbers, with the delimiter and decimal mark that make it largest; None if none does."""
    best: tuple[int, Grid] | None = None  # a grid, and how many numbers it holds
    for delimiter in delimiters(raw):
        for decimal in (".",) if delimiter in (",", "") else (".", ","):
            grid = _grid_with(raw, delimiter, decimal)
            held = 0 if grid is None else int(np.isfinite(grid.values).sum())
            if held > (best[0] if best else 0):
                best = (held, grid)
    return None if best is None else best[1]


def _grid_with(raw: RawFile, delimiter: str, decimal: str) -> Grid | None:
    fields = raw.fields(delimiter)
    parsed = [_numeric_row(row, decimal) for row in fields]
    run = _first_run(parsed, fields)
    if not run:
        return None
    start, named = run[0], max(_last_number(parsed[i]) for i in run)
    header, top = _header_above(fields, start, named)
    width = max(len(header), *(len(parsed[i]) for i in run))
    header += [""] * (width - len(header)) if header else []
    if width == 1 and delimiter not in (" ", ""):
        return None
    filled = [i for i in range(start, len(fields)) if fields[i]]
    keep = [i for i in filled if parsed[i] is not None and len(parsed[i]) <= width]
    dropped = sorted(set(filled) - set(keep))
    if len(dropped) > len(keep):
        return None
    values = np.full((len(keep), width), math.nan)
    for k, i in enumerate(keep):
        values[k, : len(parsed[i])] = [math.nan if x is None else x for x in parsed[i]]
    names = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "white space", "": "cells of a sheet"}
    notices = [f"{len(keep)} rows of {width} columns, separated by {names[delimiter]}"]
    notices += ["decimal commas"] if decimal == "," else []
    if dropped:
        where = ", ".join(str(i + 1) for i in dropped[:3]) + (", ..." if len(dropped) > 3 else "")
        notices.append(f"{len(dropped)} rows below the header are not numbers and were dropped (row {where})")
    headings = [parse_heading(text) for text in header]
    notices += _text_notices([(i, fields[i], parsed[i]) for i in keep], headings, width)
    preamble = [row for row in fields[:top] if row]
    return Grid(headings, values, [i + 1 for i in keep], preamble, notices)


def _numeric_row(row: list[str], decimal: str) -> list[float | None] | None:
    """Numbers of a row (None where a field is text), or None if it is mostly text or blank: no data."""
    numbers = [to_number(text, decimal) for text in row]
    texts = sum(x is None for x in numbers)
    real = sum(x is not None and not math.isnan(x) for x in numbers)
    return None if real == 0 or 2 * texts >= len(row) or (texts and real < 2) else numbers


def _text_notices(kept: list[tuple[int, list[str], list]], headings: list[Heading], width: int) -> list[str]:
    """Say which columns are text, and which single fields of the others were not numbers."""
    notices = []
    for column in range(width):
        texts = [
            (i, row[column]) for i, row, numbers in kept if column < len(numbers) and numbers[column] is None
        ]
        label = repr(headings[column].text) if headings else str(column + 1)
        if 2 * len(texts) > len(kept):
            notices.append(f"column {label} is text and was left out")
        elif texts:
            i, text = texts[0]
            notices.append(
                f"{len(texts)} fields of column {label} are not numbers ({text!r} in row {i + 1}): missing"
            )
    return notices


def _first_run(parsed: list[list | None], fields: list[list[str]]) -> list[int]:
    """First run of rows of numbers, empty if there is none; blank lines do not break it.

    Rows may be shorter than others, where their last fields are empty, but not less than half as wide.
    """
    run: list[int] = []
    for i, row in enumerate(parsed):
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


def _header_above(fields: list[list[str]], start: int, named: int) -> tuple[list[str], int]:
    """Names of the columns and the row they stand in: the nearest filled row above, if it names every column.

    A row of units alone (`(s);(mm);(N)`, or `s;mm;N`) under a row of names is joined to it.

    Args:
        fields: of the whole file.
        start: first row of numbers.
        named: columns that need a name.
    """
    above = [i for i in range(start - 1, -1, -1) if fields[i]][:2]
    if not above:
        return [], start
    top, units = above[0], []
    if len(above) == 2 and all(map(_is_unit, fields[top])) and not any(map(_is_unit, fields[above[1]])):
        top, units = above[1], fields[top]
    if len(fields[top]) < max(named, 2):
        return [], start
    pairs = itertools.zip_longest(fields[top], units, fillvalue="")
    return [f"{name} ({unit.strip('()[]')})" if unit else name for name, unit in pairs], top


def _is_unit(text: str) -> bool:
    """Whether a field is a unit alone: `(kPa)`, `[-]`, `mm`, or nothing."""
    return not text or bool(re.fullmatch(r"[(\[].*[)\]]", text)) or unit_name(text) in UNITS
