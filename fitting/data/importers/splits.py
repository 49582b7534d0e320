"""Splitting of a table that holds several tests: by a column of names, by lines between the rows, by groups
of columns, or at restarts."""

import re

import numpy as np

from .columns_aside import ROUNDING
from .grid import Grid
from .separators import LEAST_ROWS
from .split_by_name import Part, by_column, by_lines
from .words import meaning

_RESTART = 0.05  # Maximum distance from its start at which a test restarts, as part of the drive's range
_OUTPUTS = ("stress", "true_stress", "force")
_DRIVERS = ("strain", "true_strain", "stretch", "elongation", "pressure")


def split(grid: Grid) -> list[Part]:
    """Tests of a table; one without a title where it holds only one."""
    for cut in (by_column, by_lines, _by_groups, _by_restart):
        parts = cut(grid)
        if parts:
            return parts
    _say_begun_anew(grid)
    return [("", grid, True)]


def _say_begun_anew(grid: Grid) -> None:
    """Warn where a test seems to begin anew below a line without numbers, or at another word of a column of
    words."""
    drive = _driver(grid)
    if drive is None:
        return
    reach = float(np.nanmax(drive) - np.nanmin(drive))
    anew = np.abs(drive - drive[0]) <= _RESTART * reach
    fell = np.abs(np.diff(drive, prepend=drive[0])) > 0.5 * reach
    again = np.flatnonzero(anew & fell)
    for i in again:
        if grid.rows[i] - grid.rows[i - 1] > 1:
            lines = [" ".join(filter(None, line)) for line in grid.breaks.get(int(i), [])]
            line = f"the line {lines[-1][:60]!r}" if lines else "an empty line"
            grid.notices.append(
                f"check: below {line} the test begins anew (row {grid.rows[i]}), read as one test; if"
                " that is another specimen, write its name into that line (Specimen 2)"
            )
            return
    for column, heading in enumerate(grid.headings):
        texts = [cells[column] if column < len(cells) else "" for cells in grid.cells]
        changes = [i for i in range(1, len(texts)) if texts[i] != texts[i - 1]]
        words = sum(bool(re.search(r"[^\W\d]", text)) for text in texts)
        if changes and set(changes) <= set(again) and 2 * words > len(texts) and meaning(heading) is None:
            names = ", ".join(map(repr, dict.fromkeys(texts)))
            grid.notices.append(
                f"check: the test begins anew (row {grid.rows[changes[0]]}) where {heading.text!r} changes"
                f" ({names[:80]}), read as one test; if these are specimens, call that column Specimen"
            )
            return


def _driver(grid: Grid) -> np.ndarray | None:
    """Values of what drives the test; None where it is absent or does not move."""
    means = [meaning(heading) for heading in grid.headings]
    column = {m.quantity: c for c, m in reversed(list(enumerate(means))) if m is not None}
    found = next((column[name] for name in _DRIVERS if name in column), None)
    if found is None:
        return None
    values = grid.values[:, found]
    there = np.isfinite(values)
    if there.sum() < 2 * LEAST_ROWS or not np.ptp(values[there]) > 0.0:
        return None
    filled = np.interp(np.arange(values.size), np.flatnonzero(there), values[there])
    return filled


def _by_groups(grid: Grid) -> list[Part]:
    """Columns by their specimen, where stress or load occurs several times."""
    means = [meaning(heading) for heading in grid.headings]
    held: dict[tuple[str, int], list[int]] = {}
    for column, means_of in enumerate(means):
        if means_of is not None and not np.isnan(grid.values[:, column]).all():
            members = held.setdefault((means_of.quantity, means_of.rank), [])
            if not any(_same_in_another_unit(grid, column, other) for other in members):
                members.append(column)
    repeated = {key: columns for key, columns in held.items() if len(columns) > 1}
    outputs = [key for key in repeated if key[0] in _OUTPUTS] or [
        key for key in repeated if key[0] == "strain" and not any(other[0] in _OUTPUTS for other in held)
    ]
    if not outputs or not any(key[0] in (*_DRIVERS, "temperature") for key in held):
        return []
    groups, named = _groups(grid, means, repeated, held[outputs[0]])
    if len(groups) < 2:
        return []
    once = [columns[0] for key, columns in held.items() if key not in repeated]
    taken = {*once, *(c for columns in groups.values() for c in columns)}
    aside = [h.text for c, h in enumerate(grid.headings) if c not in taken and h.text.strip()]
    said = [f"columns of no specimen, left aside: {', '.join(map(repr, aside))}"] if aside else []
    parts = []
    for name, columns in groups.items():
        rows = [i for i in range(len(grid.rows)) if np.isfinite(grid.values[i, columns]).any()]
        title = name if named else f"specimen {name}"
        if len(rows) >= LEAST_ROWS:
            parts.append((title, grid.cut(rows, sorted([*once, *columns])), True))
        else:
            labels = ", ".join(repr(grid.headings[c].text) for c in columns)
            said.append(
                f"check: {title} ({labels}) has {len(rows)} rows, fewer than a test needs, and was left out"
            )
    for _, part, _ in parts:
        part.notices += said
    return parts


def _same_in_another_unit(grid: Grid, column: int, other: int) -> bool:
    """True if two columns are one measurement in two units, rather than those of two specimens."""
    if grid.headings[column].unit == grid.headings[other].unit:
        return False
    first, second = grid.values[:, other], grid.values[:, column]
    there = np.isfinite(first) & np.isfinite(second)
    if not there.any() or not np.abs(first[there]).max() > 0.0:
        return False
    scale = float(first[there] @ second[there]) / float(first[there] @ first[there])
    rest = float(np.abs(second[there] - scale * first[there]).max())
    return rest <= ROUNDING * float(np.abs(second[there]).max())


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
    if len(parts) < 2 or min(map(len, parts)) < LEAST_ROWS:
        return []
    return [
        (f"test {k}", grid.cut(rows, range(grid.values.shape[1])), False)
        for k, rows in enumerate(parts, start=1)
    ]
