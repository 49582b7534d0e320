"""Splitting of a table by names of specimens: those of a column, or of lines between the rows."""

import re
from collections.abc import Sequence

from .grid import Grid
from .separators import LEAST_ROWS
from .words import LOT_WORDS, SPECIMEN_WORDS, TEST_WORDS, meaning

_CALLED = r"(?:label|name|id|i\.? ?d\.?|designation|no\.?|number|nr\.?|#)"
_ID_COLUMN = re.compile(
    rf"^(?P<word>{'|'.join((*SPECIMEN_WORDS, *LOT_WORDS, *TEST_WORDS))})\s*{_CALLED}?$|^id$", re.IGNORECASE
)
_NAMED = "|".join((*SPECIMEN_WORDS, "prüfling", "probekörper", "test", "run", "versuch", "essai"))
# A line that names a specimen: `Specimen 2`, `Sample B-7`, `Test run: slow`.
_LINE = re.compile(
    rf"^[#*\s]*(?P<word>{_NAMED})(?: run)?\s*{_CALLED}?\s*"
    r"(?:[:=#,;]\s*(?P<named>\S.{0,40})|\s(?P<short>\d[\w.-]*|[A-Za-z]|[A-Za-z]*[-_]?\d[\w.-]*))[*\s]*$",
    re.IGNORECASE,
)


Part = tuple[str, Grid, bool]
"""Title of a test, its table, and a flag that is true if the title names a specimen of its own."""


def by_column(grid: Grid) -> list[Part]:
    """Rows by the specimen that a column names.

    A name stands for the rows below it, where each name is written once. A column most of whose names have
    fewer rows than a test counts rows; it names no specimens.
    """
    for column, heading in enumerate(grid.headings):
        found = _ID_COLUMN.match(heading.name)
        if found is None or meaning(heading) is not None:
            continue
        texts, said = _filled_down(grid, column)
        rows: dict[str, list[int]] = {}
        for i, text in enumerate(texts):
            rows.setdefault(text, []).append(i)
        unnamed = rows.pop("", [])
        long = {name: members for name, members in rows.items() if len(members) >= LEAST_ROWS}
        if len(rows) < 2 or 2 * sum(map(len, long.values())) < len(texts):
            continue
        label = repr(heading.text)
        said += [
            f"check: {name!r} of {label} has {len(members)} row{'s' * (len(members) > 1)} (row"
            f" {grid.rows[members[0]]}), fewer than a test needs, and was left out"
            for name, members in rows.items()
            if name not in long
        ]
        if unnamed:
            said.append(
                f"check: {len(unnamed)} rows without a name in {label} were left out (row"
                f" {grid.rows[unnamed[0]]})"
            )
        others = [c for c in range(len(grid.headings)) if c != column]
        word = heading.name.split()[0]
        own = (found["word"] or "id").lower() not in TEST_WORDS
        return [
            (
                name if not re.fullmatch(r"[\d.]+", name) else f"{word} {name.removesuffix('.0')}",
                _of_column(grid, members, others, label, said),
                own,
            )
            for name, members in long.items()
        ]
    return []


def _filled_down(grid: Grid, column: int) -> tuple[list[str], list[str]]:
    """Names in a column by row, and a notice where a name was taken for the empty fields below it."""
    texts = [cells[column] if column < len(cells) else "" for cells in grid.cells]
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


def _of_column(
    grid: Grid, rows: Sequence[int], columns: Sequence[int], label: str, said: Sequence[str]
) -> Grid:
    """Rows of one specimen; notices about the column that names it are of no more use."""
    part = grid.cut(rows, columns)
    stale = (f"column {label} is text and was left out", f"fields of column {label} are not numbers")
    part.notices = [text for text in part.notices if not any(words in text for words in stale)]
    part.notices += said
    return part


def label_in(row: Sequence[str]) -> tuple[str, bool] | None:
    """Name that a line states for the rows below it, and true if it is a specimen's; None for other lines."""
    cells = [cell.strip().strip('"') for cell in row if cell.strip().strip('"')]
    if not 1 <= len(cells) <= 3:
        return None
    found = _LINE.match(cells[0] if len(cells) == 1 else f"{cells[0].rstrip(':= ')}: {' '.join(cells[1:])}")
    if found is None:
        return None
    return found["named"] or cells[0].strip("*# "), found["word"].lower() not in TEST_WORDS


def by_lines(grid: Grid) -> list[Part]:
    """Rows split where a line between them names a specimen or a test."""
    named = {at: next(filter(None, map(label_in, lines)), None) for at, lines in grid.breaks.items()}
    cuts = sorted(at for at, label in named.items() if label is not None)
    if not cuts:
        return []
    first = next(filter(None, map(label_in, reversed(grid.preamble))), ("first rows", True))
    shared = [row for row in grid.preamble if label_in(row) is None]
    parts, short = [], []
    for begin, end in zip([0, *cuts], [*cuts, len(grid.rows)], strict=True):
        title, own = named.get(begin) or first
        if end - begin < LEAST_ROWS:
            short.append(
                f"check: {title!r} has {end - begin} rows (row {grid.rows[begin]}), fewer than a test needs,"
                " and was left out"
            )
            continue
        part = grid.cut(range(begin, end), range(grid.values.shape[1]))
        part.preamble = [*grid.breaks[begin], *shared] if begin else grid.preamble
        parts.append((title, part, own))
    for _, part, _ in parts:
        part.notices += short
    return parts
