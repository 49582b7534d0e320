"""Splitting of a table by names of specimens: those of a column, or of lines between the rows."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from pneusma_jax.errors import counted

from .grid import Grid
from .separators import LEAST_ROWS
from .spelling import Heading
from .words import LOT_WORDS, SPECIMEN_WORDS, TEST_WORDS, meaning

_LABEL = r"(?:label|name|id|i\.? ?d\.?|designation|no\.?|number|nr\.?|#)"
_ID_COLUMN = re.compile(
    rf"^(?P<word>{'|'.join((*SPECIMEN_WORDS, *LOT_WORDS, *TEST_WORDS))})\s*{_LABEL}?$|^id$", re.IGNORECASE
)
_NAMING_WORDS = "|".join((*SPECIMEN_WORDS, "prüfling", "probekörper", "test", "run", "versuch", "essai"))
# A line that names a specimen: `Specimen 2`, `Sample B-7`, `Test run: slow`.
_LINE = re.compile(
    rf"^[#*\s]*(?P<word>{_NAMING_WORDS})(?: run)?\s*{_LABEL}?\s*"
    r"(?:[:=#,;]\s*(?P<named>\S.{0,40})|\s(?P<short>\d[\w.-]*|[A-Za-z]|[A-Za-z]*[-_]?\d[\w.-]*))[*\s]*$",
    re.IGNORECASE,
)


class Part(NamedTuple):
    """One test of a table that may hold several.

    Attributes:
        title: title of the test; empty where the table holds only one.
        grid: its rows and columns.
        own_specimen: true if the title names a specimen of its own, rather than a further test of one.
    """

    title: str
    grid: Grid
    own_specimen: bool


def names_specimens(heading: Heading) -> bool:
    """True if a heading is that of a column of names of specimens or tests."""
    return bool(_ID_COLUMN.match(heading.name))


def too_short(title: str, count: int, row: int | None = None) -> str:
    """Notice about a part with too few rows for a test.

    Args:
        title: title of the part.
        count: number of its rows.
        row: line number in the file of its first row, if it is to be named.
    """
    place = "" if row is None else f" (row {row})"
    return f"check: {title} has {counted(count, 'row')}{place}, fewer than a test needs, and was left out"


def by_column(grid: Grid) -> list[Part]:
    """Tests by the specimen that a column names.

    Where each name is written once, it holds for the empty fields below it. A column may have fewer rows for
    most of its names than a test needs. It then numbers rows and names no specimens.
    """
    for column, heading in enumerate(grid.headings):
        found = _ID_COLUMN.match(heading.name)
        if found is None or meaning(heading) is not None:
            continue
        texts, notices = _filled_down(grid, column)
        rows: dict[str, list[int]] = {}
        for i, text in enumerate(texts):
            rows.setdefault(text, []).append(i)
        unnamed = rows.pop("", [])
        long = {name: members for name, members in rows.items() if len(members) >= LEAST_ROWS}
        if len(rows) < 2 or 2 * sum(map(len, long.values())) < len(texts):
            continue
        label = repr(heading.text)
        notices += [
            too_short(f"{name!r} of {label}", len(members), grid.rows[members[0]])
            for name, members in rows.items()
            if name not in long
        ]
        if unnamed:
            notices.append(
                f"check: {counted(len(unnamed), 'row')} without a name in {label}"
                f" {'was' if len(unnamed) == 1 else 'were'} left out (row"
                f" {grid.rows[unnamed[0]]})"
            )
        others = [c for c in range(len(grid.headings)) if c != column]
        word = heading.name.split()[0]
        own_specimen = (found["word"] or "id").lower() not in TEST_WORDS
        return [
            Part(
                name if not re.fullmatch(r"[\d.]+", name) else f"{word} {name.removesuffix('.0')}",
                _of_specimen(grid, members, others, label, notices),
                own_specimen,
            )
            for name, members in long.items()
        ]
    return []


def _filled_down(grid: Grid, column: int) -> tuple[list[str], list[str]]:
    """Name of every row from a column, and a notice if empty fields got the name above them."""
    texts = grid.texts(column)
    names = [text for text in texts if text]
    once = len(set(names)) == len(names) and 2 * len(names) < len(texts)
    if not once or len(names) < 2:
        return texts, []
    filled, last = [], ""
    for text in texts:
        last = text or last
        filled.append(last)
    label = repr(grid.headings[column].text)
    return filled, [f"each name in {label} was taken for the rows below it, whose fields are empty"]


def _of_specimen(
    grid: Grid, rows: Sequence[int], columns: Sequence[int], label: str, notices: Sequence[str]
) -> Grid:
    """Rows of one specimen with further notices, and without those about the column that names it."""
    part = grid.cut(rows, columns)
    obsolete = (f"column {label} is text and was left out", f"fields of column {label} are not numbers")
    part.notices = [text for text in part.notices if not any(words in text for words in obsolete)]
    part.notices += notices
    return part


def label_of_line(row: Sequence[str]) -> tuple[str, bool] | None:
    """Title that a line gives the rows below it, and true if it names a specimen; None for other lines."""
    cells = [cell.strip().strip('"') for cell in row if cell.strip().strip('"')]
    if not 1 <= len(cells) <= 3:
        return None
    found = _LINE.match(cells[0] if len(cells) == 1 else f"{cells[0].rstrip(':= ')}: {' '.join(cells[1:])}")
    if found is None:
        return None
    return found["named"] or cells[0].strip("*# "), found["word"].lower() not in TEST_WORDS


def by_lines(grid: Grid) -> list[Part]:
    """Tests that begin where a line between the rows names a specimen or a test."""
    labels = {at: next(filter(None, map(label_of_line, lines)), None) for at, lines in grid.breaks.items()}
    cuts = sorted(at for at, label in labels.items() if label is not None)
    if not cuts:
        return []
    first = next(filter(None, map(label_of_line, reversed(grid.preamble))), ("first rows", True))
    shared = [row for row in grid.preamble if label_of_line(row) is None]
    parts, notices = [], []
    for begin, end in zip([0, *cuts], [*cuts, len(grid.rows)], strict=True):
        title, own_specimen = labels.get(begin) or first
        if end - begin < LEAST_ROWS:
            notices.append(too_short(repr(title), end - begin, grid.rows[begin]))
            continue
        rows = grid.cut(range(begin, end), range(grid.values.shape[1]))
        rows.preamble = [*grid.breaks[begin], *shared] if begin else grid.preamble
        parts.append(Part(title, rows, own_specimen))
    for part in parts:
        part.grid.notices += notices
    return parts
