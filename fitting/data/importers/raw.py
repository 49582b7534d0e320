"""A raw laboratory file as rows of text fields, for any encoding, delimiter or spreadsheet."""

import csv
import hashlib
import io
import re
import warnings
import zipfile
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pneusma_jax.errors import reason_of
from pneusma_jax.late import Late

from ..recordings.table import ZIP, bytes_of, unusable
from .matlab import is_matlab_or_hdf5, sheets_of
from .number_formats import Display, as_text, display_of, one_unit
from .other_workbooks import other_sheets, other_workbook
from .workbook_marks import sheet_remarks

openpyxl = Late("openpyxl")  # takes 70 ms to load, and most files are text

# Time, displacement, force, strain, ...: words that show in which code a text is that is in no other one.
_CODES = {
    "gb18030": ("时间", "位移", "力", "应变", "应力", "温度", "变形"),
    "shift_jis": ("時間", "変位", "試験力", "荷重", "ストローク", "応力", "ひずみ", "温度"),
    "cp949": ("시간", "변위", "하중", "응력", "변형률", "온도"),
    "cp1251": ("время", "сила", "усилие", "нагрузка", "деформация", "перемещение", "удлинение"),
    "cp1250": ("siła", "wydłużenie", "odkształcenie", "naprężenie"),
}


# First bytes of files that are no tables.
_OTHERS = {
    b"%PDF": "a PDF",
    b"\x1f\x8b": "a gzip archive",
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
    b"{": "a JSON file",
    b"<?xml": "an XML file",
    b"<html": "a web page (some programs call it .xls)",
    b"<!DOCTYPE": "a web page (some programs call it .xls)",
}


@dataclass(frozen=True)
class Page:
    """One sheet of a workbook, or the whole of a text file.

    Attributes:
        name: name of the sheet; empty for text.
        lines: lines of text.
        rows: cells as text by row, without trailing empty ones; None for text.
        hidden: true if the workbook hides the sheet.
        remarks: sentences about what it shows beside its values, such as hidden rows.
        units: unit with which all numbers of a column are displayed, by column.
        thousands: displayed number per number of the cell, by row and column, where it is displayed in
            thousands. The cells hold the number itself.
        doubtful: two units that the numbers of a column may be in, and how they are displayed, by column.
    """

    name: str
    lines: list[str]
    rows: list[list[str]] | None = None
    hidden: bool = False
    remarks: tuple[str, ...] = ()
    units: dict[int, str] = field(default_factory=dict)
    thousands: dict[tuple[int, int], float] = field(default_factory=dict)
    doubtful: dict[int, tuple[str, ...]] = field(default_factory=dict)

    @property
    def is_sheet(self) -> bool:
        """True if it has cells rather than lines."""
        return self.rows is not None

    @property
    def count(self) -> int:
        """Number of its lines."""
        return len(self.lines) if self.rows is None else len(self.rows)

    def fields(self, delimiter: str, picked: Iterable[int] | None = None) -> list[list[str]]:
        """Rows split at a delimiter (a space: at white space), all or selected ones. A sheet's rows ignore
        the delimiter."""
        if self.rows is not None:
            return self.rows if picked is None else [self.rows[i] for i in picked]
        lines = self.lines if picked is None else [self.lines[i] for i in picked]
        return [split_line(line, delimiter) for line in lines]

    def head(self, count: int = 60) -> str:
        """First lines (or rows) as one text, to recognise a file by."""
        if self.rows is not None:
            return "\n".join("\t".join(row) for row in self.rows[:count])
        return "\n".join(self.lines[:count])


@dataclass(frozen=True)
class RawFile:
    """Bytes of a file, and their interpretation as text or as sheets of cells.

    Attributes:
        path: path of the file.
        content: bytes of the file.
    """

    path: Path
    content: bytes

    @property
    def sha256(self) -> str:
        """SHA-256 of the bytes, so that an import can be traced to its file."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def is_workbook(self) -> bool:
        """True for a workbook of any format."""
        return self.content.startswith(ZIP) or bool(self.other)

    @cached_property
    def other(self) -> str:
        """Ending of the format of a workbook other than .xlsx; empty for other files."""
        return other_workbook(self.content)

    @cached_property
    def pages(self) -> list[Page]:
        """Filled sheets of a workbook in order, tables of a file of MATLAB, or the one page of a text.

        Raises:
            InputError: if the file is none of these, or a workbook without a filled sheet.
        """
        if is_matlab_or_hdf5(self.content):
            found = sheets_of(self.path, self.content)
            return [Page(sheet.name, [], sheet.rows, remarks=tuple(sheet.remarks)) for sheet in found]
        if not self.is_workbook:
            return [Page("", self._lines())]
        return filled(self.path, _other_pages(self) if self.other else _read_sheets(self))

    def _lines(self) -> list[str]:
        for start, what in _OTHERS.items():
            if self.content.startswith(start):
                raise unusable(self.path, f"this is {what}, not a table of text; export it as .csv or .xlsx")
        # A logger that loses its power leaves the rest of a block empty.
        content = re.sub(rb"\0{4,}\Z", b"", self.content)
        if b"\0" in content:  # letters of two bytes, of which the last one lost its half
            content += b"\0" * (len(content) % 2)
        text = _decode(content)
        if "\0" in text:
            raise unusable(self.path, "this is neither text nor an Excel workbook; export it as .csv")
        text = text.replace("\ufeff", "")  # the mark of the code, where files were put one behind the other
        return _joined(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))


def open_raw(path: str | Path) -> RawFile:
    """Read the bytes of a file.

    Raises:
        InputError: if it does not exist, cannot be read or is empty.
    """
    path = Path(path)
    content = bytes_of(path)
    if not content.strip():
        raise unusable(path, "the file is empty")
    return RawFile(path, content)


def _decode(content: bytes) -> str:
    """Text in UTF-8, UTF-16, another code in which headings are readable, or else Windows Latin (degree
    signs)."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    if content.count(0) > len(content) // 3:  # UTF-16 without its mark: every other byte is zero
        odd = content[1::2].count(0) > content[::2].count(0)
        return content.decode("utf-16-le" if odd else "utf-16-be", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        pass
    for code, words in _CODES.items():
        text = content.decode(code, errors="ignore")
        if len(text.encode(code)) == len(content) and any(word in text.lower() for word in words):
            return text
    return content.decode("cp1252", errors="replace")


_LONGEST_FIELD = 8  # lines that one quoted field may have
_OPENS = re.compile(r'(?:^|[,;\t|])\s*"(?:[^"]|"")*$')
_CLOSES = re.compile(r'^(?:[^"]|"")*"\s*(?:$|[,;\t|])')


def _joined(lines: list[str]) -> list[str]:
    """Lines in which a quoted field that holds line breaks is on one line; its further lines become empty.

    A field is joined where a quotation mark opens it at a delimiter and the next one, a few lines below,
    closes it at another. A stray mark, such as that of inches, does neither.
    """
    done = list(lines)
    i = 0
    while i < len(done):
        while done[i].count('"') % 2 and _OPENS.search(done[i]):
            below = range(i + 1, min(i + _LONGEST_FIELD, len(lines)))
            end = next((k for k in below if '"' in done[k]), None)
            if end is None or not _CLOSES.match(done[end]):
                break
            done[i] = " ".join(part.strip() for part in done[i : end + 1] if part.strip())
            done[i + 1 : end + 1] = [""] * (end - i)
        i += 1
    return done


def split_line(line: str, delimiter: str) -> list[str]:
    """Fields of one line, stripped, without the empty ones that trailing delimiters leave.

    Every line is split on its own, so that one stray quotation mark cannot swallow the lines below it. Some
    machines quote a whole line, with doubled quotes inside; such a line is unpacked first.
    """
    if delimiter == " ":
        return _split_at_spaces(line)
    fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    if len(fields) == 1 and line.startswith('"') and delimiter in fields[0]:
        fields = next(csv.reader([fields[0]], delimiter=delimiter, skipinitialspace=True), [])
    fields = [field.strip() for field in fields]
    while fields and not fields[-1]:
        fields.pop()
    return fields


_QUOTED_WORDS = re.compile(r'\s*(?:"[^"]*"|[^\s"]+)(?:\s+(?:"[^"]*"|[^\s"]+))*\s*')


def _split_at_spaces(line: str) -> list[str]:
    """Fields between spaces; a field in quotation marks may hold some: `"Time (s)" "Stress (kPa)"`."""
    if '"' not in line or not _QUOTED_WORDS.fullmatch(line):
        return line.split()
    return [quoted.strip() or bare for quoted, bare in re.findall(r'"([^"]*)"|([^\s"]+)', line)]


def _cell_text(cell: Any, displays: dict[tuple[int, int], Display]) -> str:
    """Text of a cell; the way a number is displayed is added to the others.

    A cell in a percent format holds a hundredth of the displayed number, which is its text.
    """
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        display = display_of(str(cell.number_format))
        displays[cell.row - 1, cell.column - 1] = display
        return as_text(value, display)
    return str(value).strip()


def formulas_without_values(raw: RawFile, sheet: str | None = None, rows: Collection[int] = ()) -> str:
    """Reason why cells with formulas are empty: no program computed them. Empty for other files.

    Args:
        raw: raw file.
        sheet: name of the only sheet to look at; all sheets by default.
        rows: numbers of the rows to look at, from 1; all rows by default.
    """
    if not raw.is_workbook or raw.other:
        return ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        books = [
            openpyxl.load_workbook(io.BytesIO(raw.content), read_only=True, data_only=computed)
            for computed in (False, True)
        ]
    wanted = set(rows)
    for written, computed in zip(*(book.worksheets for book in books), strict=True):
        if sheet is not None and written.title != sheet:
            continue
        found = [
            (formula.coordinate, formula.value)
            for formulas, values in zip(written.iter_rows(), computed.iter_rows(), strict=False)
            for formula, value in zip(formulas, values, strict=False)
            if str(formula.value).startswith("=") and value.value is None
            if not wanted or formula.row in wanted
        ]
        if found:
            count = f"{len(found)} formulas" if len(found) > 1 else "a formula"
            return (
                f"sheet {written.title!r} holds {count} that no program has computed"
                f" ({found[0][0]}: {found[0][1]!r}); open it in a spreadsheet program and save it"
            )
    return ""


MOST_UNPACKED = 512 * 2**20
"""Maximum number of bytes that a workbook may unpack to. Ten columns of a full sheet (2^20 rows) have 400
MiB."""


def _check_size(raw: RawFile) -> None:
    """Refuse a workbook that was packed to exhaust the memory. Zipfile unpacks no more than is stated here.

    Raises:
        InputError: if its parts together are too large.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(raw.content)) as packed:
            size = sum(part.file_size for part in packed.infolist())
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError):
        return  # the reader of the file reports the error
    if size > MOST_UNPACKED:
        raise unusable(
            raw.path,
            f"this workbook unpacks to {size / 2**20:,.0f} MiB, but {MOST_UNPACKED // 2**20} MiB is the most "
            "that is read; save the sheet that is wanted as .csv",
        )


def _page_of(sheet: Any) -> Page:
    """Cells of a sheet as text. The stated size of the sheet is not trusted; cells are counted."""
    sheet.reset_dimensions()
    displays: dict[tuple[int, int], Display] = {}
    rows = [[_cell_text(cell, displays) for cell in row] for row in sheet.iter_rows()]
    ways: dict[int, set[Display]] = {}
    for (_, column), display in displays.items():
        ways.setdefault(column, set()).add(display)
    units = {column: unit for column, found in ways.items() if (unit := one_unit(found))}
    thousands = {place: display.factor for place, display in displays.items() if display.factor < 1.0}
    return Page(
        sheet.title, [], rows, sheet.sheet_state != "visible", units=units, thousands=thousands
    )


def _other_pages(raw: RawFile) -> list[Page]:
    """Sheets of a workbook in another format than .xlsx."""
    _check_size(raw)
    found = other_sheets(raw.path, raw.content)
    return [Page(name, [], rows, hidden, (remark,)) for name, hidden, rows, remark in found]


def _read_sheets(raw: RawFile) -> list[Page]:
    _check_size(raw)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and extensions that do not touch the numbers
            book = openpyxl.load_workbook(io.BytesIO(raw.content), read_only=True, data_only=True)
            sheets = [_page_of(sheet) for sheet in book.worksheets]
            book.close()
            remarks = sheet_remarks(raw.content, [(page.name, page.rows or []) for page in sheets])
            sheets = [replace(p, remarks=(*p.remarks, *remarks.get(p.name, ()))) for p in sheets]
    except Exception as error:  # of zip, XML or styles: a damaged workbook can end anywhere in there
        raise unusable(
            raw.path, f"this is not an Excel workbook that can be read ({reason_of(error)})"
        ) from None
    return sheets


def filled(path: Path, sheets: list[Page]) -> list[Page]:
    """Sheets with a filled cell, their rows without trailing empty ones.

    Raises:
        InputError: if there is none.
    """
    pages = []
    for page in sheets:
        for row in page.rows or ():
            while row and not row[-1]:
                row.pop()
        if any(page.rows or ()):
            pages.append(page)
    if not pages:
        raise unusable(path, "the workbook has no filled sheet")
    return pages
