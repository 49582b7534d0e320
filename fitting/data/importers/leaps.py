"""Questions about single rows far from their neighbours, and positions that begin anew within a test."""

from collections.abc import Mapping

import numpy as np

from ..recordings import schema
from .making import Making

APART = 8.0
"""Minimum distance of one reading from the middle of its neighbours, over that of any other reading [1]."""
OF_RANGE = 0.2
"""The same, over the range of all other readings of the column [1]."""
BESIDE = 0.2
"""Maximum distance of the two neighbours from each other, over that of the reading between them [1]."""
LEAST_ROWS = 8
"""Minimum number of rows of a column that is looked at."""
FIRST = 4.0
"""Minimum first rate of a temperature over its largest other one [1]. Heat takes time."""
FIRST_K = 2.0
"""Minimum first step of a temperature [K]. Sensors scatter by less."""
ANEW = 4.0
"""Minimum step of a position that begins anew, over the largest other one [1]."""
ANEW_OF_RANGE = 0.1
"""The same, over the range of the position [1]."""
FOLLOWS = 0.2
"""Maximum step of the force where a position begins anew, over what such a move makes elsewhere [1]."""
STOPPED_ROWS = 5
"""Minimum number of rows in succession at one largest strain, for an extensometer that stopped."""
STOPPED_GROWN = 0.1
"""Minimum growth of the stress meanwhile, over its range [1]."""
STILL = 1e-3
"""Maximum range of a pressure that stays the same, over the largest reading [1]."""
LONGER = 0.02
"""Minimum range of a length that changes meanwhile, over the largest reading [1]. Creep is smaller."""
_MAY_LEAP = ("time", "cycle", "current", "setpoint", "bend_direction")
"""Beginnings of columns that may leap in one row: a drive that is switched, and counts."""


def question_leaps(columns: Mapping[str, np.ndarray], rows: np.ndarray, making: Making) -> None:
    """Ask about readings of one row that are far from all others, and a position that was set to zero.

    Args:
        columns: canonical columns, each of shape (rows,).
        rows: number of each row in the file.
        making: state of the import; questions are added to its notices.
    """
    for name, values in columns.items():
        known = np.flatnonzero(np.isfinite(values))
        if known.size < LEAST_ROWS or name.startswith(_MAY_LEAP):
            continue
        for k in _alone(values[known]):
            before, at, after = values[known[k - 1 : k + 2]]
            making.warn(
                f"{name} is {at:.6g} in row {rows[known[k]]} alone, between {before:.4g} and {after:.4g}: was"
                " that no reading of the specimen? Then leave this field empty in the file"
            )
        if name.startswith("temperature"):
            time = columns.get("time_s", rows)[known]
            _question_first(name, values[known], time, rows[known], making)
    if making.kind == "tube" and {"pressure_kPa", "length_mm"} <= columns.keys():
        _question_still(columns["pressure_kPa"], columns["length_mm"], making)
    if making.kind == "elastomer" and {"strain", "stress_kPa"} <= columns.keys():
        _question_stopped(columns["strain"], columns["stress_kPa"], rows, making)
    pair = schema.KINDS[making.kind].pull
    if pair and pair[0] in columns:
        _question_last(pair[0], columns[pair[0]], rows, making)
    if pair and all(name in columns for name in pair):
        _question_anew(pair, columns, rows, making)


def _alone(values: np.ndarray) -> list[int]:
    """Places of readings that stand alone: the farthest one, and those left without it; three at most."""
    found: list[int] = []
    left = np.arange(len(values))
    while len(found) < 3 and len(left) >= LEAST_ROWS:
        now = values[left]
        middle = 0.5 * (now[:-2] + now[2:])
        away = np.abs(now[1:-1] - middle)
        k = int(np.argmax(away))
        beside = abs(float(now[k + 2] - now[k]))
        others = np.delete(away, slice(max(0, k - 1), k + 2))
        span = float(np.ptp(np.delete(now, k + 1)))
        is_alone = away[k] > APART * float(others.max(initial=0.0)) and away[k] > OF_RANGE * span
        if not is_alone or beside > BESIDE * away[k]:
            break
        found.append(int(left[k + 1]))
        left = np.delete(left, k + 1)
    return sorted(k for k in found if 0 < k < len(values) - 1)


def _question_first(
    name: str, values: np.ndarray, time: np.ndarray, rows: np.ndarray, making: Making
) -> None:
    """Ask about a first temperature far from the second one, as a sensor gives it where it is switched on."""
    steps, passed = np.abs(np.diff(values)), np.diff(time)
    if not np.all(passed > 0.0):
        passed = np.ones(len(steps))
    rates = steps / passed
    is_far = steps[0] > max(FIRST_K, OF_RANGE * float(np.ptp(values[1:])))
    if is_far and rates[0] > FIRST * float(rates[1:].max()):
        making.warn(
            f"{name} is {values[0]:.4g} in row {rows[0]} and {values[1]:.4g} in row {rows[1]}, and never"
            " changes as fast again: was the first one a reading? If not, leave this field empty in the file"
        )


def _question_last(name: str, values: np.ndarray, rows: np.ndarray, making: Making) -> None:
    """Ask about a last position far beyond all others, as a sum below a table is."""
    known = np.flatnonzero(np.isfinite(values))
    x = values[known]
    if x.size < LEAST_ROWS:
        return
    least, most = float(x[:-1].min()), float(x[:-1].max())
    beyond = max(float(x[-1]) - most, least - float(x[-1]))
    if beyond > OF_RANGE * (most - least) and beyond > APART * float(np.abs(np.diff(x[:-1])).max()):
        making.warn(
            f"{name} is {x[-1]:.6g} in row {rows[known[-1]]}, the last one, and {least:.4g} to {most:.4g} in"
            f" all others: is it a reading, or a sum? {making.keep_rows(1, int(rows[known[-2]]))} leaves"
            " it out"
        )


def _question_still(pressure: np.ndarray, length: np.ndarray, making: Making) -> None:
    """Ask about a pressure that stays the same while the tube gets longer, as that of a supply does."""
    pressures, lengths = (values[np.isfinite(values)] for values in (pressure, length))
    if pressures.size and lengths.size and np.ptp(pressures) <= STILL * float(np.abs(pressures).max()):
        if np.ptp(lengths) > LONGER * float(lengths.max()):
            making.warn(
                f"pressure_kPa is {pressures[0]:.4g} in every row, and the length changes by"
                f" {np.ptp(lengths):.3g} mm: is it the pressure in the tube, and not that of a supply or a"
                " set point? --map pressure=... names another column"
            )


def _question_stopped(strain: np.ndarray, stress: np.ndarray, rows: np.ndarray, making: Making) -> None:
    """Ask about a strain that stays at its largest value while the stress grows.

    So reads an extensometer that was taken off. The stress of a specimen that is held falls.
    """
    both = np.flatnonzero(np.isfinite(strain) & np.isfinite(stress))
    x, y = np.abs(strain[both]), np.abs(stress[both])
    if not x.size or not x.max() > 0.0:
        return
    held = np.flatnonzero(x == x.max())
    runs = np.split(held, np.flatnonzero(np.diff(held) > 1) + 1)
    longest = max(runs, key=len)
    grown = float(y[longest[-1]] - y[longest[0]])
    if len(longest) >= STOPPED_ROWS and grown > STOPPED_GROWN * float(np.ptp(y)):
        making.warn(
            f"strain stays at its largest value, {strain[both[longest[0]]]:.4g}, from row"
            f" {rows[both[longest[0]]]} to {rows[both[longest[-1]]]} while the stress grows: was the"
            " extensometer at its end, or taken off? Then leave these rows out with --rows, or name another"
            " column with --map"
        )


def _question_anew(
    pair: tuple[str, str], columns: Mapping[str, np.ndarray], rows: np.ndarray, making: Making
) -> None:
    """Ask about a position that leaps from one row to the next while the force goes on as before.

    A stretch that is followed by a rest makes the force leap, too.
    """
    both = np.flatnonzero(np.isfinite(columns[pair[0]]) & np.isfinite(columns[pair[1]]))
    if both.size < LEAST_ROWS:
        return
    position, force = (columns[name][both] for name in pair)
    moved, changed = np.diff(position), np.abs(np.diff(force))
    k = int(np.argmax(np.abs(moved)))
    leap, others = abs(float(moved[k])), np.delete(np.abs(moved), k)
    reach = float(np.ptp(position))
    if not (others.max() > 0.0 and leap > ANEW * float(others.max()) and leap > ANEW_OF_RANGE * reach):
        return
    usual = float(np.sum(np.delete(changed, k)) / np.sum(others)) * leap
    if not changed[k] < FOLLOWS * usual or changed[k] > float(np.delete(changed, k).max()):
        return
    name, _, unit = pair[0].partition("_")
    at = tuple(f"{x:.4g}{f' {unit}' if unit else ''}" for x in position[k : k + 2])
    making.warn(
        f"{name} leaps from {at[0]} to {at[1]} at row {rows[both[k + 1]]}, and {pair[1].partition('_')[0]}"
        " goes on as before: was the position set to zero there, or does its unit change? Then put the rows"
        " from there right in the file, or leave them out with --rows"
    )
