"""Splitting of a table that holds several tests: by a column of names, by lines between the rows, by groups
of columns, or at restarts."""

import itertools
import re

import numpy as np

from .columns_aside import ROUNDING
from .grid import Grid
from .ran_on import without_rows_of_zeros
from .separators import LEAST_ROWS
from .split_by_name import Part, by_column, by_lines, too_short
from .words import meaning

_RESTART = 0.05  # Maximum distance from its start at which a test restarts, as part of the driver's range
_OUTPUTS = ("stress", "true_stress", "force")
_SHAPES = ("length", "curvature", "bend_angle", "elongation")
_DRIVERS = ("strain", "true_strain", "stretch", "elongation", "pressure")


def split(grid: Grid) -> list[Part]:
    """Tests of a table without rows of zeros at their ends; one without a title where it holds only one."""
    grid = _without_rows_of_zeros(grid)
    for tests_in in (by_column, by_lines, _by_groups, _by_restart):
        parts = tests_in(grid)
        if parts:
            return [part._replace(grid=_without_rows_of_zeros(part.grid)) for part in parts]
    _warn_of_restart(grid)
    return [Part("", grid, True)]


def _without_rows_of_zeros(grid: Grid) -> Grid:
    return without_rows_of_zeros(grid, _driver_column(_columns(grid)))


def _warn_of_restart(grid: Grid) -> None:
    """Warn if the test seems to restart below a line without numbers, or where a column of words changes."""
    driver = _driver(grid)
    if driver is None:
        return
    span = _span(driver)
    near_start = np.abs(driver - driver[0]) <= _RESTART * span
    jumped = np.abs(np.diff(driver, prepend=driver[0])) > 0.5 * span
    restarts = np.flatnonzero(near_start & jumped)
    if not restarts.size:
        return
    for i in restarts:
        if grid.rows[i] - grid.rows[i - 1] > 1:
            lines = [" ".join(filter(None, line)) for line in grid.breaks.get(int(i), [])]
            line = f"the line {lines[-1][:60]!r}" if lines else "an empty line"
            grid.notices.append(
                f"check: below {line} the test begins anew (row {grid.rows[i]}), read as one test. If"
                " that is another specimen, write its name into that line (Specimen 2)"
            )
            return
    for column, heading in enumerate(grid.headings):
        texts = grid.texts(column)
        changes = [i for i in range(1, len(texts)) if texts[i] != texts[i - 1]]
        words = sum(bool(re.search(r"[^\W\d]", text)) for text in texts)
        if changes and set(changes) <= set(restarts) and 2 * words > len(texts) and meaning(heading) is None:
            names = ", ".join(map(repr, dict.fromkeys(texts)))
            grid.notices.append(
                f"check: the test begins anew (row {grid.rows[changes[0]]}) where {heading.text!r} changes"
                f" ({names[:80]}), read as one test. If these are specimens, call that column Specimen"
            )
            return


def _columns(grid: Grid) -> dict[str, int]:
    """First column of each quantity."""
    meanings = [meaning(heading) for heading in grid.headings]
    return {m.quantity: c for c, m in reversed(list(enumerate(meanings))) if m is not None}


def _driver_column(columns: dict[str, int]) -> int | None:
    """Column of the quantity that the machine drives; None where there is none."""
    return next((columns[name] for name in _DRIVERS if name in columns), None)


def _driver(grid: Grid) -> np.ndarray | None:
    """Values of the quantity that the machine drives, without gaps; None if it is absent or constant."""
    column = _driver_column(_columns(grid))
    if column is None:
        return None
    values = grid.values[:, column]
    finite = np.isfinite(values)
    if finite.sum() < 2 * LEAST_ROWS or not np.ptp(values[finite]) > 0.0:
        return None
    return np.interp(np.arange(values.size), np.flatnonzero(finite), values[finite])


def _by_groups(grid: Grid) -> list[Part]:
    """Tests by their group of columns, where stress or load occurs several times.

    So do tests of tubes and actuators, if pressure and shape occur equally often under the same headings. An
    actuator may have several pressures, and lengths of two sides, but not under one name each.
    """
    meanings = [meaning(heading) for heading in grid.headings]
    columns_of: dict[tuple[str, int], list[int]] = {}
    for column, known in enumerate(meanings):
        if known is not None and not np.isnan(grid.values[:, column]).all():
            same = columns_of.setdefault((known.quantity, known.rank), [])
            if not any(_same_in_another_unit(grid, column, other) for other in same):
                same.append(column)
    repeated = {key: columns for key, columns in columns_of.items() if len(columns) > 1}
    outputs = [key for key in repeated if key[0] in _OUTPUTS] or [
        key
        for key in repeated
        if key[0] == "strain" and not any(other[0] in _OUTPUTS for other in columns_of)
    ]
    shapes = [] if outputs else _shapes_under_pressure(grid, columns_of)
    outputs = outputs or shapes
    if not outputs or not any(key[0] in (*_DRIVERS, "temperature") for key in columns_of):
        return []
    groups, named = _groups(grid, meanings, repeated, columns_of[outputs[0]])
    twins, all_groups = {}, groups
    if shapes and not named and not _one_after_another(list(groups.values())):
        return []
    if not named:
        twins = _twins(grid, groups)
        groups = {name: columns for name, columns in groups.items() if name not in twins}
    if len(groups) < 2:
        return []
    once = [columns[0] for key, columns in columns_of.items() if key not in repeated]
    taken = {*once, *(c for columns in groups.values() for c in columns)}
    repeats = {c for name in twins for c in all_groups[name]}
    aside = [
        h.text for c, h in enumerate(grid.headings) if c not in taken | repeats and h.text.strip()
    ]
    notices = [f"columns of no specimen, left aside: {', '.join(map(repr, aside))}"] if aside else []
    notices += [
        _repeating(all_groups[name], groups[first])
        for name, first in twins.items()
    ]
    if shapes and not named:
        notices.append(_as_specimens(grid, groups, columns_of, once))
    if not named and not any(key[0] in _DRIVERS for key in repeated):
        labels = ", ".join(repr(grid.headings[c].text) for c in columns_of[outputs[0]] if c in taken)
        notices.append(
            f"check: {labels} were taken as those of {len(groups)} specimens, each with the other columns; if"
            " all are of one, --specimen picks the column that counts"
        )
    parts = []
    for name, columns in groups.items():
        rows = [i for i in range(len(grid.rows)) if np.isfinite(grid.values[i, columns]).any()]
        title = name if named else f"specimen {name}"
        if len(rows) >= LEAST_ROWS:
            parts.append(Part(title, grid.cut(rows, sorted([*once, *columns])), True))
        else:
            labels = ", ".join(repr(grid.headings[c].text) for c in columns)
            notices.append(too_short(f"{title} ({labels})", len(rows)))
    for part in parts:
        part.grid.notices += notices
    return parts


def _shapes_under_pressure(
    grid: Grid, columns_of: dict[tuple[str, int], list[int]]
) -> list[tuple[str, int]]:
    """Repeated shapes of a tube or an actuator whose pressures are repeated with them, by their headings."""
    if any(key[0] in (*_OUTPUTS, "strain") for key in columns_of):
        return []
    counts = {
        key: len(columns)
        for key, columns in columns_of.items()
        if len(columns) > 1 and len({grid.headings[c].text.casefold() for c in columns}) == 1
    }
    pressures = {count for key, count in counts.items() if key[0] == "pressure"}
    return [key for key, count in counts.items() if key[0] in _SHAPES and count in pressures]


def _one_after_another(groups: list[list[int]]) -> bool:
    """True if each group of columns ends before the next one begins."""
    return all(max(one) < min(two) for one, two in zip(groups[:-1], groups[1:], strict=True))


def _twins(grid: Grid, groups: dict[str, list[int]]) -> dict[str, str]:
    """Groups that repeat the numbers of an earlier one, each with the name of that one."""
    twins: dict[str, str] = {}
    for name, columns in groups.items():
        for first, others in groups.items():
            if first == name:
                break
            same = np.array_equal(grid.values[:, columns], grid.values[:, others], equal_nan=True)
            if same and first not in twins:
                twins[name] = first
                break
    return twins


def _repeating(columns: list[int], others: list[int]) -> str:
    """Notice about columns that repeat the numbers of as many others."""
    one = len(columns) == 1
    verb, noun = ("repeats", "column") if one else ("repeat", "columns")
    return f"{noun} {_numbers(columns)} {verb} {noun} {_numbers(others)}: left aside"


def _numbers(columns: list[int]) -> str:
    """Numbers of columns in words, from 1: `1, 2`."""
    return ", ".join(str(c + 1) for c in columns)


def _as_specimens(
    grid: Grid, groups: dict[str, list[int]], columns_of: dict[tuple[str, int], list[int]], once: list[int]
) -> str:
    """Notice about groups of columns without titles that were taken as a specimen each."""
    of_all = [columns[0] for key, columns in columns_of.items() if key[0] != "time" and columns[0] in once]
    shared = ", ".join(repr(grid.headings[column].text) for column in of_all)
    beside = f" Each was also given {shared}: right if of all of them." if shared else ""
    each = " and ".join(f"({_numbers(columns)})" for columns in groups.values())
    first = next(iter(groups))
    return (
        f"check: columns {each} have the same headings and were taken as {len(groups)} specimens.{beside} If"
        f" all are of one, --specimen specimen_{first} reads the first ones alone; titles above the columns"
        " name specimens"
    )


def _same_in_another_unit(grid: Grid, column: int, other: int) -> bool:
    """True if two columns are one measurement in two units, rather than those of two specimens."""
    if grid.headings[column].unit == grid.headings[other].unit:
        return False
    first, second = grid.values[:, other], grid.values[:, column]
    both = np.isfinite(first) & np.isfinite(second)
    if not both.any() or not np.abs(first[both]).max() > 0.0:
        return False
    scale = float(first[both] @ second[both]) / float(first[both] @ first[both])
    deviation = float(np.abs(second[both] - scale * first[both]).max())
    return deviation <= ROUNDING * float(np.abs(second[both]).max())


def _groups(
    grid: Grid, meanings: list, repeated: dict[tuple[str, int], list[int]], outputs: list[int]
) -> tuple[dict[str, list[int]], bool]:
    """Columns of each group by its name, and true if the file names the groups.

    Names are titles above the columns, else tags in the headings, else numbers in order.
    """
    columns = sorted(c for members in repeated.values() for c in members)
    spans = _titles(grid)
    titles = {c: spans[c] for c in columns if c in spans}
    if len(titles) == len(columns) and len({titles[c] for c in outputs}) == len(outputs):
        return {
            t: [c for c in columns if titles[c] == t] for t in dict.fromkeys(titles[c] for c in columns)
        }, True
    tags = {c: meanings[c].tag for c in columns}
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
    """Titles above groups of columns, by column: the row above the headings, with its gaps filled.

    Where empty columns divide the groups, and each has one title, that is the group's wherever it stands.
    """
    row = grid.preamble[-1] if grid.preamble else []
    if len({cell for cell in row if cell}) < 2:
        return {}
    named = [column for column, heading in enumerate(grid.headings) if heading.text.strip()]
    by_run = itertools.groupby(enumerate(named), key=lambda one: one[1] - one[0])
    blocks = [[column for _, column in run] for _, run in by_run]
    above = [[row[column] for column in block if column < len(row) and row[column]] for block in blocks]
    if len(blocks) > 1 and all(len(titles) == 1 for titles in above):
        return {column: titles[0] for block, titles in zip(blocks, above, strict=True) for column in block}
    spans, last = {}, ""
    for column in range(len(grid.headings)):
        last = row[column] if column < len(row) and row[column] else last
        if last:
            spans[column] = last
    return spans


def _by_restart(grid: Grid) -> list[Part]:
    """Tests that begin where clock and driver both restart. A column that counts cycles rules this out."""
    columns = _columns(grid)
    column = _driver_column(columns)
    if "time" not in columns or column is None or "cycle" in columns:
        return []
    time, driver = grid.values[:, columns["time"]], grid.values[:, column]
    span, duration = _span(driver), _span(time)
    if not span > 0.0 or not duration > 0.0:
        return []
    near_start = (time[1:] - time[0] <= _RESTART * duration) & (
        np.abs(driver[1:] - driver[0]) <= _RESTART * span
    )
    cuts = [0, *(int(i) + 1 for i in np.flatnonzero((np.diff(time) < 0.0) & near_start)), len(time)]
    parts = [range(a, b) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]
    if len(parts) < 2 or min(map(len, parts)) < LEAST_ROWS:
        return []
    return [
        Part(f"test {k}", grid.cut(rows, range(grid.values.shape[1])), False)
        for k, rows in enumerate(parts, start=1)
    ]


def _span(values: np.ndarray) -> float:
    """Range of the values; 0 where none is finite."""
    return float(np.nanmax(values) - np.nanmin(values)) if np.isfinite(values).any() else 0.0
