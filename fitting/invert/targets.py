"""Targets from a CSV: columns of goals with their units, and perhaps time."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import UNITS, to_si

from .csv_file import check_sizes, columns_of, unit_of
from .goals import GOALS


@dataclass(frozen=True)
class Targets:
    """Target values of goals, row by row.

    Attributes:
        goals: names of the goals; wanted: their target values in SI, shape (rows, columns).
        time: time of the rows [s], shape (rows,), if they follow each other; else None.
    """

    goals: tuple[str, ...]
    wanted: np.ndarray
    time: np.ndarray | None = None


def read_targets(path: str | Path) -> Targets:
    """Read targets from a CSV whose columns are those of goals, in any unit of the right kind, and `time_s`.

    Raises:
        InputError: one line with file, row and column.
    """
    path = Path(path)
    columns = columns_of(path)
    if not columns or not next(iter(columns.values())).size:
        raise InputError(f"{path}: there is no target: a header and at least one row are needed")
    return targets_of(columns, str(path))


def targets_of(columns: Mapping[str, np.ndarray], where: str) -> Targets:
    """Targets of columns by name; each value is in the unit that the column's name states.

    Raises:
        InputError: for a column that is no goal's, or a goal whose columns are not all there. Also for a
            value beyond what can be computed, or time that does not rise.
    """
    columns = dict(columns)
    time = columns.pop("time_s", None)
    known = {c: name for name, goal in GOALS.items() for c in goal.columns}
    stems = {_stem(c): c for c in known}
    found: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        usual = stems.get(_stem(name))
        if usual is None:
            raise InputError(f"{where}: unknown column {name!r}, {nearest(name, [*known, 'time_s'])}")
        if usual in found:
            raise InputError(f"{where}: column {name!r} says again what another one says of {_stem(usual)}")
        if usual.startswith("direction"):
            found[usual] = np.asarray(values, dtype=float)
            continue
        unit, wanted = unit_of(name, where), UNITS[unit_of(usual, where)].dimension
        if UNITS[unit].dimension != wanted:
            raise InputError(f"{where}: column {name!r} is no {wanted}; {usual} is one")
        found[usual] = to_si(np.asarray(values, dtype=float), unit)
        check_sizes(found[usual], GOALS[known[usual]].size, usual, where)
    goals = tuple(n for n, g in GOALS.items() if any(c in found for c in g.columns))
    if not goals:
        raise InputError(f"{where}: nothing is wanted: name at least one of {', '.join(known)}")
    for name in goals:
        for column in GOALS[name].columns:
            if column not in found:
                raise InputError(f"{where}: {name} needs column {column!r} too")
    wanted = np.column_stack([found[c] for n in goals for c in GOALS[n].columns])
    if "direction" in goals:
        at = sum(len(GOALS[n].columns) for n in goals[: goals.index("direction")])
        largest = np.max(np.abs(wanted[:, at : at + 3]), axis=1, keepdims=True)
        if np.any(largest <= 0.0):
            raise InputError(f"{where}: a direction must not be zero")
        wanted[:, at : at + 3] /= largest
        wanted[:, at : at + 3] /= np.linalg.norm(wanted[:, at : at + 3], axis=1, keepdims=True)
    if time is not None and np.any(late := np.diff(time) <= 0.0):
        k = int(np.argmax(late))
        how = "goes backwards" if time[k + 1] < time[k] else "stands still"
        raise InputError(f"{where}: column time_s {how}: after {time[k]:g} s comes {time[k + 1]:g} s")
    return Targets(goals, wanted, time)


def _stem(column: str) -> str:
    return column if column.startswith("direction") else column.rpartition("_")[0]
