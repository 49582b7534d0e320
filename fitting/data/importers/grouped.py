"""Thousands that are grouped, and fields in which a mark may group thousands or divide decimals."""

import re

from .grid import Grid
from .numerals import CellNumber, decimal_evidence, like_a_number

_EITHER = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")


def say_grouped(grid: Grid, decimal: str) -> None:
    """Report that thousands were grouped, with an example.

    Args:
        grid: table with its cells as text.
        decimal: decimal mark with which its numbers were read.
    """
    mark = "," if decimal == "." else r"\."
    texts = (t for cells in grid.cells for t in cells if not isinstance(t, CellNumber) and like_a_number(t))
    asked = "check: " if decimal == "," and not any("," in text for text in texts) else ""
    spaced = r"['’ \u00a0\u2009\u202f]"
    grouped = re.compile(rf"[+-]?\d{{1,3}}(?:(?:{mark}\d{{3}})+|(?:{spaced}\d{{3}})+)(?:[.,]\d*)?")
    for row, cells in zip(grid.rows, grid.cells, strict=True):
        for text in cells:
            if not isinstance(text, CellNumber) and grouped.fullmatch(text):
                grid.notices.append(f"{asked}thousands are grouped: {text!r} in row {row}")
                return


def doubt_groups(grid: Grid, decimal: str) -> None:
    """Note the columns in which `2,345` may be 2.345 or 2345, because other fields are written otherwise.

    In a text file, such a field proves nothing beside fields with decimals, unless one has both marks
    (`1,234.5`). In a workbook, a text beside cells that are numbers needs another text that proves its mark.
    The grid is changed in place.

    Args:
        grid: table with its cells as text.
        decimal: decimal mark with which its numbers were read.
    """
    texts = [text for cells in grid.cells for text in cells if not isinstance(text, CellNumber)]
    if not any("," in text or "." in text for text in texts):
        return
    proven = any(decimal_evidence(text) for text in texts)
    for column in range(grid.values.shape[1]):
        fields = [
            (row, cells[column])
            for row, cells in zip(grid.rows, grid.cells, strict=True)
            if column < len(cells) and cells[column]
        ]
        written = [(row, text) for row, text in fields if not isinstance(text, CellNumber)]
        if len(written) < len(fields):
            doubtful = [] if proven else [f for f in written if _EITHER.fullmatch(f[1]) and "," in f[1]]
        else:
            doubtful = _beside_decimals(written, decimal)
        if doubtful:
            row, text = doubtful[0]
            label = repr(grid.headings[column].text) if grid.headings else f"column {column + 1}"
            grid.troubles[column] = (
                f"{text!r} in row {row} of {label} may be {text.replace(',', '.')} or"
                f" {re.sub('[.,]', '', text)}, which the other fields do not tell"
            )
            grid.trouble_rows[column] = frozenset(row for row, _ in doubtful)


def _beside_decimals(written: list[tuple[int, str]], decimal: str) -> list[tuple[int, str]]:
    """Fields with one group of thousands and no decimals, beside fields of which none shows both marks."""
    other = "," if decimal == "." else "."
    group = re.compile(rf"[+-]?[1-9]\d{{0,2}}{re.escape(other)}\d{{3}}")
    doubtful = [(row, text) for row, text in written if group.fullmatch(text)]
    if not doubtful:
        return []
    with_decimals = any(decimal in t and other not in t and like_a_number(t) for _, t in written)
    proven = any(decimal in t and other in t or t.count(other) > 1 for _, t in written)
    return doubtful if with_decimals and not proven else []
