"""Workbooks of other formats than .xlsx, by the library calamine: .xls, .xlsb and .ods.

Calamine gives values without their number formats, and says nothing of hidden rows. Every sheet gets a remark
on that. A file is read first by a process of its own, under a limit of memory. Such a file may state millions
of repeated cells in some bytes, and a library that runs out of memory ends its process.
"""

import io
import zipfile
import zlib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pneusma_jax.errors import reason_of
from pneusma_jax.late import Late

from ..first_reading import fault_of_reading
from ..recordings.table import OLE, ZIP, unusable
from .numerals import CellNumber

calamine = Late("python_calamine")

ENDINGS = (".xls", ".xlsb", ".ods")
EXTRA = "pip install 'pneusma-jax[workbooks]' (in a clone: .venv/bin/pip install -e '.[workbooks]')"
"""Command that installs the library."""
_ODS = b"application/vnd.oasis.opendocument.spreadsheet"


def other_workbook(content: bytes) -> str:
    """Ending of the format of a workbook other than .xlsx, by its content; empty for other files."""
    if content.startswith(OLE):
        return ".xls"
    if not content.startswith(ZIP):
        return ""
    if content[30:].startswith(b"mimetype" + _ODS):  # first, as it is in a damaged file, too
        return ".ods"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            names = set(packed.namelist())
            if "mimetype" in names:  # packed again by another program
                with packed.open("mimetype") as said:
                    return ".ods" if said.read(len(_ODS)) == _ODS else ""
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, OSError, RuntimeError):
        return ""
    return ".xlsb" if "xl/workbook.bin" in names else ""


def is_read() -> bool:
    """True if the library is installed."""
    return find_spec("python_calamine") is not None


def other_sheets(path: Path, content: bytes) -> list[tuple[str, bool, list[list[str]], str]]:
    """Name, mark of a hidden one, cells as text, and remark of every sheet.

    Args:
        path: file, for messages.
        content: its bytes.

    Raises:
        InputError: without the library, for a damaged file, and for one that needs too much memory.
    """
    ending = other_workbook(content)
    if not is_read():
        what = f"this is a workbook in the format {ending}"
        raise unusable(path, f"{what}; save it as .xlsx or .csv, or {EXTRA}")
    if fault := fault_of_reading("workbook", content):
        what = f"this workbook cannot be read ({fault})"
        raise unusable(path, f"{what}; save the sheet that is wanted as .csv")
    try:
        book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(content))
        about = {sheet.name: sheet for sheet in book.sheets_metadata}
        sheets = {name: book.get_sheet_by_name(name) for name in book.sheet_names}
        cells = {name: sheet.to_python(skip_empty_area=False) for name, sheet in sheets.items()}
    except Exception as error:  # errors of the library, of zip and of XML
        raise unusable(
            path, f"this is not an {ending} workbook that can be read ({reason_of(error)})"
        ) from None
    shown = calamine.SheetVisibleEnum.Visible
    return [
        (name, about[name].visible != shown, [[_text(cell) for cell in row] for row in rows], _remark(ending))
        for name, rows in cells.items()
    ]


def _remark(ending: str) -> str:
    return (
        f"number formats of {ending} are not read. A cell that shows 5 % is taken as 0.05, and a hidden row "
        "as all others. If the file has any, save it as .xlsx"
    )


def _text(value: Any) -> str:
    """Text of a cell, as that of an .xlsx is written."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53:
        value = int(value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return CellNumber(str(value))
    return str(value).strip()
