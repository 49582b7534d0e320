"""The CSV half of a recording as text: comments, one header row, cells, and the file's own row numbers."""

import csv
import io
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pneusma_jax.errors import InputError, counted, shortened


def unusable(path: Path | str, what: str, row: int | None = None, column: str | None = None) -> InputError:
    """The error for unusable input, in a fixed order: file, row, column, problem, remedy.

    A word of the problem that has hundreds of letters, such as a damaged heading, is told by its ends.
    """
    place = [str(path)]
    place += [] if row is None else [f"row {row}"]
    place += [] if column is None else [f"column {column}"]
    return InputError(f"{', '.join(place)}: {shortened(' '.join(what.split()))}")


def first_of(errors: list[InputError]) -> InputError:
    """The first of several files' errors, with the number of the others, in one line."""
    more = len(errors) - 1
    return InputError(f"{errors[0]}" + (f" (and {counted(more, 'more file')})" if more else ""))


@dataclass
class Table:
    """Cells of a CSV file as text.

    Attributes:
        path: path of the file.
        comments: lines before the header, without `#`.
        header: column names as written.
        header_row: line number in the file (from 1) of the header.
        rows: line number in the file (from 1) of each data row.
        cells: text by column name; each list has one entry per row.
        notices: sentences about ignored content.
    """

    path: Path
    comments: list[str]
    header: list[str]
    header_row: int
    rows: list[int]
    cells: dict[str, list[str]]
    notices: list[str] = field(default_factory=list)


def read_table(path: Path) -> Table:
    """Read the text of a CSV file.

    Args:
        path: CSV file in UTF-8, with commas, one header row, comments (`#`) before it.

    Raises:
        InputError: if the file is missing, empty or not text, has no rows, or has a malformed header. Also
            for two columns of one name, or a row with another number of fields.
    """
    lines = list(io.StringIO(_read_text(path), newline=None))
    comments: list[str] = []
    start = 0
    while start < len(lines) and (lines[start].startswith("#") or not lines[start].strip()):
        if lines[start].strip():
            comments.append(lines[start][1:].strip())
        start += 1
    if start == len(lines):
        raise unusable(path, "the file is empty; a header row and data rows are needed")
    reader = csv.reader(lines[start:], strict=True)
    try:
        header = [name.strip() for name in next(reader)]
        _check_header(path, header, start + 1)
        records = [(start + reader.line_num, record) for record in reader]
    except csv.Error as error:
        raise unusable(
            path, f"this is not a comma-separated row ({error})", row=start + reader.line_num
        ) from None
    table = Table(path, comments, header, start + 1, [], {name: [] for name in header})
    _fill(table, records)
    _drop_nameless(table)
    return table


def bytes_of(path: Path) -> bytes:
    """Content of a file.

    Raises:
        InputError: if it does not exist or cannot be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise unusable(path, "there is no such file") from None
    except OSError as error:
        raise unusable(path, f"the file cannot be read ({error.strerror})") from None


def _read_text(path: Path) -> str:
    raw = bytes_of(path)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if raw.startswith((ZIP, OLE)):
            raise unusable(
                path, "this is a workbook, not a CSV; `pneusma import` makes recordings of its sheets"
            ) from None
        row = raw[: error.start].count(b"\n") + 1
        raise unusable(
            path,
            "this is not UTF-8 text; save it as UTF-8, or bring a raw file in with `pneusma import`",
            row=row,
        ) from None


def _check_header(path: Path, header: list[str], row: int) -> None:
    if len(header) == 1 and any(mark in header[0] for mark in ";\t"):
        mark = "semicolons" if ";" in header[0] else "tabs"
        raise unusable(
            path,
            f"columns are separated by {mark}, not commas; `pneusma import` makes a recording of such a file",
            row,
        )
    if all(_is_number(name) for name in header if name) and any(header):
        raise unusable(path, "this row holds numbers where the names of the columns belong", row)
    for name in header:
        if name and header.count(name) > 1:
            raise unusable(path, "this column is there twice; keep one", row, name)


def _fill(table: Table, records: list[tuple[int, list[str]]]) -> None:
    last = max((i for i, (_, record) in enumerate(records) if record), default=-1)
    blank = 0
    comments: list[int] = []
    width = len(table.header)
    columns: list[list[str]] = [[] for _ in table.header]
    for row, record in records[: last + 1]:
        if not record:
            blank += 1
            continue
        if record[0].startswith("#"):
            comments.append(row)
            continue
        if len(record) != width:
            hint = (
                "the decimal mark must be a point"
                if len(record) > width
                else "`pneusma import` makes a recording of a raw file"
            )
            fields = counted(len(record), "field")
            raise unusable(table.path, f"{fields} where the header has {width}; {hint}", row)
        table.rows.append(row)
        for cells, text in zip(columns, record, strict=True):
            cells.append(text.strip())
    if not table.rows:
        raise unusable(table.path, "there is a header but no row of data below it")
    table.cells = dict(zip(table.header, columns, strict=True))
    if comments:
        said = f"{counted(len(comments), 'comment')} between the rows skipped (row {comments[0]})"
        table.notices.append(said)
    if blank:
        table.notices.append(f"{counted(blank, 'blank line')} between the rows skipped")


def _drop_nameless(table: Table) -> None:
    if "" not in table.header:
        return
    if table.header.count("") > 1 or any(table.cells[""]):
        raise unusable(table.path, f"column {table.header.index('') + 1} has no name; name it or remove it")
    del table.cells[""]
    table.header.remove("")
    table.notices.append("an empty column without a name was left out")


ZIP, OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
"""First bytes of workbooks: `.xlsx`, `.xlsb` and `.ods`, and `.xls`."""
_RAW = re.compile(r"[-+−]?\d+(?:[.\s]\d{3})*,\d+(?:e[-+]?\d+)?|\d+(?::\d\d)+(?:[.,]\d+)?", re.IGNORECASE)
"""Numbers with a decimal comma, and readings of a clock."""


def numbers(table: Table, name: str) -> np.ndarray:
    """Column as numbers, NaN where the field is empty (or says nan).

    Args:
        table: text of the CSV.
        name: name of a column of its header.

    Returns:
        Array of shape (rows,).

    Raises:
        InputError: at the first field that is not a finite number, with its row.
    """
    values = np.empty(len(table.rows))
    for i, text in enumerate(table.cells[name]):
        try:
            values[i] = parse_number(text)
        except ValueError:
            raw = _RAW.fullmatch(text.strip())
            advice = "`pneusma import` reads such files" if raw else (
                "leave the field empty if the sample is missing"
            )
            raise unusable(
                table.path, f"{text[:40]!r} is not a number; {advice}", table.rows[i], name
            ) from None  # fmt: skip
    return values


def parse_number(text: str) -> float:
    """Number of a field: NaN if empty or `nan`.

    Raises:
        ValueError: if it is not a finite decimal number (Python's `1_000` and `inf` are not).
    """
    if not text or text.lower() == "nan":
        return math.nan
    value = float(text)
    if "_" in text or not math.isfinite(value):
        raise ValueError(text)
    return value


def _is_number(text: str) -> bool:
    try:
        parse_number(text)
    except ValueError:
        return False
    return True
