"""A table as data, and as text in aligned columns: the one formatter of tables."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

WIDTH = 100
"""Number of columns of a text for the terminal."""
NARROWEST = 24
"""Minimum width of a column of a text table whose cells are wrapped."""
MOSTLY = 0.7
"""Minimum share of numbers among the cells of a column that is aligned to the right."""
_NUMERIC = re.compile(r"\(?[+-]?\.?\d.*|n/a|-?infinite|-")
"""Pattern of cells that make their column numeric: aligned to the right."""


@dataclass(frozen=True)
class Cell:
    """A cell of a table with a note or a mark.

    Attributes:
        text: text of the cell.
        note: second line, in small print.
        tone: mark: `good`, `fair`, `bad`, or empty.
    """

    text: str
    note: str = ""
    tone: str = ""


@dataclass(frozen=True)
class Table:
    """Texts in rows and columns.

    Attributes:
        header: names of the columns.
        rows: cells, as many in each row as in the header.
        note: remark on the table, in a sentence or two.
        chosen: index of the row to emphasise.

    Raises:
        ValueError: if a row has another number of cells than the header.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str | Cell]]
    note: str = ""
    chosen: int | None = None

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.header):
                raise ValueError(f"Argument `rows` must have {len(self.header)} cells each, but one is {row}")


def table_text(table: Table, indent: int = 2, width: float = WIDTH) -> str:
    """Text of a table in aligned columns: numbers to the right, words to the left, long words wrapped.

    Args:
        table: table to write; the chosen row is marked with an asterisk.
        indent: number of blanks before every row.
        width: number of columns of the terminal; infinite where a row must stay a line.
    """
    rows = [list(table.header), *([_plain_cell(cell) for cell in row] for row in table.rows)]
    right = numeric_columns(table)
    widths = _widths(rows, right, width - indent)
    lines = []
    for k, row in enumerate(rows):
        mark = "* ".rjust(indent) if k and k - 1 == table.chosen and indent > 1 else " " * indent
        for line in _row_lines(row, widths, right):
            lines.append(mark + line)
            mark = " " * indent
    return "\n".join(line.rstrip() for line in lines if line.strip())


def numeric_columns(table: Table) -> list[bool]:
    """True for each column of numbers, which is aligned to the right. The first column is always false.

    A column of numbers may have a word or two, such as `cold` in place of a fraction.
    """
    columns = zip(*([_plain_cell(cell) for cell in row] for row in table.rows), strict=True)
    found = [_of_numbers([cell for cell in column if cell]) for column in columns]
    return [False, *found[1:]] if found else [False] * len(table.header)


def _of_numbers(cells: Sequence[str]) -> bool:
    return sum(bool(_NUMERIC.fullmatch(cell)) for cell in cells) >= MOSTLY * max(len(cells), 1)


def _plain_cell(cell: str | Cell) -> str:
    if isinstance(cell, str):
        return cell
    return f"{cell.text} ({cell.note})" if cell.note else cell.text


def _widths(rows: Sequence[Sequence[str]], right: Sequence[bool], room: float) -> list[int]:
    """Widths of columns. Columns of words shrink, the widest first, until the rows fit or none is wide."""
    columns = list(zip(*rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    least = [max([NARROWEST, *(len(word) for cell in column for word in cell.split())]) for column in columns]
    while sum(widths) + 2 * (len(widths) - 1) > room:
        shrinkable = [i for i, width in enumerate(widths) if width > least[i] and not right[i]]
        if not shrinkable:
            break
        widths[max(shrinkable, key=lambda i: widths[i])] -= 1
    return widths


def _row_lines(row: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> Iterable[str]:
    """A row as one line, or as several where words are wrapped; a name without blanks stays whole."""
    wrapped = [textwrap.wrap(cell, width, break_long_words=False) or [""]
               if len(cell) > width else [cell] for cell, width in zip(row, widths, strict=True)]  # fmt: skip
    for k in range(max(map(len, wrapped))):
        cells = [lines[k] if k < len(lines) else "" for lines in wrapped]
        yield "  ".join(
            cell.rjust(width) if to_the_right else cell.ljust(width)
            for cell, width, to_the_right in zip(cells, widths, right, strict=True)
        )
