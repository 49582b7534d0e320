"""Splitting of a table that holds several tests: by a column of names, by groups of columns, or at
restarts."""

import re
from collections.abc import Sequence

import numpy as np

from .grid import Grid
from .separators import LEAST_ROWS
from .words import SPECIMEN_WORDS, TEST_WORDS, meaning

_MOST_PARTS = 60
_RESTART = 0.05  # Maximum distance from its start at which a test restarts, as part of the drive's range
_SAME = 0.005  # Maximum rounding of one measurement in two units, as part of the largest value
_OUTPUTS = ("stress", "true_stress", "force")
_DRIVERS = ("strain", "true_strain", "stretch", "elongation", "pressure")
_ID_COLUMN = re.compile(
    rf"^(?P<word>{'|'.join((*SPECIMEN_WORDS, *TEST_WORDS))})\s*(?:label|name|id|i"
    rf" d|designation|no\.?|number|nr\.?|#)?$|^id$"
)


Part = tuple[str, Grid, bool]
"""Title of a test, its table, and a flag that is true if the title names a specimen of its own."""


def split(grid: Grid) -> list[Part]:
    """Tests of a table; one without a title where it holds only one."""
    for cut in (_by_column, _by_groups, _by_restart):
        parts = cut(grid)
        if len(parts) > 1:
            return parts
    return [("", grid, True)]


def _by_column(grid: Grid) -> list[Part]:
    """Rows by the specimen that a column names, where every specimen has enough rows."""
    for column, heading in enumerate(grid.headings):
        found = _ID_COLUMN.match(heading.name)
        if found is None or meaning(heading) is not None:
            continue
        texts = [cells[column] if column < len(cells) else "" for cells in grid.cells]
        names = list(dict.fromkeys(text for text in texts if text))
        rows = {name: [i for i, text in enumerate(texts) if text == name] for name in names}
        if not 1 < len(names) <= _MOST_PARTS or min(map(len, rows.values())) < LEAST_ROWS:
            continue
        own = (found["word"] or "id") not in TEST_WORDS
        others = [c for c in range(len(grid.headings)) if c != column]
        word = heading.name.split()[0]
        return [
            (
                name if not re.fullmatch(r"[\d.]+", name) else f"{word} {name.removesuffix('.0')}",
                _own_notices(grid, rows[name], others),
                own,
            )
            for name in names
        ]
    return []


def _own_notices(grid: Grid, rows: Sequence[int], columns: Sequence[int]) -> Grid:
    part = grid.part(rows, columns)
    part.notices = [f"{len(part.rows)} of {text}" if k == 0 else text for k, text in enumerate(part.notices)]
    return part


def _by_groups(grid: Grid) -> list[Part]:
    """Columns by their specimen, where stress or load occurs several times."""
    means = [meaning(heading) for heading in grid.headings]
    by_word: dict[tuple[str, int], list[int]] = {}
    for column, means_of in enumerate(means):
        if means_of is not None and not np.isnan(grid.values[:, column]).all():
            members = by_word.setdefault((means_of.quantity, means_of.rank), [])
            if not any(_same_in_another_unit(grid, column, other) for other in members):
                members.append(column)
    repeated = {key: columns for key, columns in by_word.items() if len(columns) > 1}
    outputs = [key for key in repeated if key[0] in _OUTPUTS] or [
        key for key in repeated if key[0] == "strain" and not any(other[0] in _OUTPUTS for other in by_word)
    ]
    if not outputs or not any(key[0] in (*_DRIVERS, "temperature") for key in by_word):
        return []
    groups, named = _groups(grid, means, repeated, by_word[outputs[0]])
    if not 1 < len(groups) <= _MOST_PARTS:
        return []
    once = [columns[0] for key, columns in by_word.items() if key not in repeated]
    assigned = {*once, *(c for columns in groups.values() for c in columns)}
    aside = [h.text for c, h in enumerate(grid.headings) if c not in assigned and h.text.strip()]
    parts = []
    for name, columns in groups.items():
        rows = [i for i in range(len(grid.rows)) if np.isfinite(grid.values[i, columns]).any()]
        if len(rows) >= LEAST_ROWS:
            part = _own_notices(grid, rows, sorted([*once, *columns]))
            if aside:
                part.notices.append(f"columns of no specimen, left aside: {', '.join(map(repr, aside))}")
            parts.append((name if named else f"specimen {name}", part, True))
    return parts


def _same_in_another_unit(grid: Grid, column: int, other: int) -> bool:
    """True if two columns are one measurement in two units, rather than those of two specimens."""
    if grid.headings[column].unit == grid.headings[other].unit:
        return False
    first, second = grid.values[:, other], grid.values[:, column]
    finite = np.isfinite(first) & np.isfinite(second)
    if not finite.any() or not np.abs(first[finite]).max() > 0.0:
        return False
    scale = float(first[finite] @ second[finite]) / float(first[finite] @ first[finite])
    rest = float(np.abs(second[finite] - scale * first[finite]).max())
    return rest <= _SAME * float(np.abs(second[finite]).max())


def _groups(
    grid: Grid, means: list, repeated: dict[tuple[str, int], list[int]], outputs: list[int]
) -> tuple[dict[str, list[int]], bool]:
    """Columns of each group by its name, and the origin of the names: titles above, tags, or order."""
    columns = sorted(c for members in repeated.values() for c in members)
    spans = _titles(grid)
    titles = {c: spans[c] for c in columns if c in spans}
    if len(titles) == len(columns) and len({titles[c] for c in outputs}) == len(outputs):
        return {
            t: [c for c in columns if titles[c] == t] for t in dict.fromkeys(titles[c] for c in columns)
        }, True
    tags = {c: means[c].tag for c in columns}
    if len({tags[c] for c in outputs}) == len(outputs):
        order = list(dict.fromkeys(tags[c] for c in outputs))
        names = {tag: tag or "0" for tag in order}
        named = all(re.search(r"[a-z]", name) for name in names.values())
        if all(tags[c] in names for c in columns):
            return {names[tag]: [c for c in columns if tags[c] == tag] for tag in order}, named
    counts = {len(members) for members in repeated.values()}
    if len(counts) == 1:
        (count,) = counts
        return {str(k + 1): [members[k] for members in repeated.values()] for k in range(count)}, False
    return {}, False


def _titles(grid: Grid) -> dict[int, str]:
    """Titles above groups of columns, by column: the row above the headings, with its gaps filled."""
    row = grid.preamble[-1] if grid.preamble else []
    if len({cell for cell in row if cell}) < 2:
        return {}
    spans, last = {}, ""
    for column in range(len(grid.headings)):
        last = row[column] if column < len(row) and row[column] else last
        if last:
            spans[column] = last
    return spans


def _by_restart(grid: Grid) -> list[Part]:
    """Rows split where the clock and the drive of the test both restart, and no count of cycles explains
    it."""
    means = [meaning(heading) for heading in grid.headings]
    column = {m.quantity: c for c, m in reversed(list(enumerate(means))) if m is not None}
    driver = next((column[name] for name in _DRIVERS if name in column), None)
    if "time" not in column or driver is None or "cycle" in column:
        return []
    time, drive = grid.values[:, column["time"]], grid.values[:, driver]
    reach = float(np.nanmax(drive) - np.nanmin(drive)) if np.isfinite(drive).any() else 0.0
    length = float(np.nanmax(time) - np.nanmin(time)) if np.isfinite(time).any() else 0.0
    if not reach > 0.0 or not length > 0.0:
        return []
    back = np.diff(time) < 0.0
    anew = (time[1:] - time[0] <= _RESTART * length) & (np.abs(drive[1:] - drive[0]) <= _RESTART * reach)
    cuts = [0, *(int(i) + 1 for i in np.flatnonzero(back & anew)), len(time)]
    parts = [range(a, b) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]
    if len(parts) < 2 or len(parts) > _MOST_PARTS or min(map(len, parts)) < LEAST_ROWS:
        return []
    return [
        (f"test {k}", _own_notices(grid, rows, range(grid.values.shape[1])), False)
        for k, rows in enumerate(parts, start=1)
    ]
