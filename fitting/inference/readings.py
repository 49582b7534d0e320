"""Which readings of a column are measurements, and how noisy they are.

A logger that is faster than its instrument writes a reading again, or draws a straight line to the next one;
an instrument at full scale says only that there is more. Such rows have a value but tell nothing by it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.data.recordings import Recording, schema
from pneusma_jax.units import from_si

from .driven import measured, predicted
from .full_scale import LONG, runs, saturated
from .noise import common_step, robust_noise, rounding_noise, standing

STEPS = 2.5
"""Median move between readings, in least moves, from which rows that stand still were not read: rounded
readings of a slow course move by one step, seldom by two."""
AS_OFTEN = 0.7
"""Share of stretches of one length from which a logger made them."""
STRAIGHT = 0.05
"""Share of rows exactly on the line between their neighbours from which rows are interpolated."""
EXACT = 1e-6
"""Of the largest reading, a distance from that line that is none: files have seven digits."""
COUNTED = 0.1
"""Rows from one reading to the next that are miscounted, as a few readings lie on the line of their
neighbours."""
CROOKED = 100.0
"""Such distances that a course moves by where being on the line means anything."""
FULL_SCALE = "full scale"
"""What a recording's memo holds of other recordings' channels."""
FAR_BELOW = 0.5
"""Part of the error of rounding alone below which a stated noise is said to be too small for the readings."""


@dataclass(frozen=True)
class Readings:
    """What the rows of a column are.

    Attributes:
        counted: rows that are measurements, shape (rows,).
        repeated, interpolated, saturated: how many rows are not, and why.
        level: value at which the channel stops, SI; NaN where it does not.
        every: rows from one reading to the next where it is interpolated; 1 elsewhere.
    """

    counted: np.ndarray
    repeated: int = 0
    interpolated: int = 0
    saturated: int = 0
    level: float = np.nan
    every: int = 1


def readings_of(recording: Recording, quantity: str) -> Readings:
    """What the rows of one column are.

    Args:
        recording: as it was read.
        quantity: of the column; of one that is set, all that are no copies count.
    """
    return _remembered(recording, quantity, _readings_of)


def _remembered(recording: Recording, quantity: str, told: Callable[[Recording, str], Any]) -> Any:
    """What `told` says about a column, once for each."""
    key = told.__name__, quantity, id(recording.columns[recording.column(quantity)])
    if key not in recording.memo:
        recording.memo[key] = told(recording, quantity)
    return recording.memo[key]


def _readings_of(recording: Recording, quantity: str) -> Readings:
    values = recording.si(quantity)
    rows = np.flatnonzero(np.isfinite(values))
    if recording.column(quantity) not in measured(recording):
        once = rows[_not_copied(recording, rows)]
        others = [schema.quantity_and_unit(name)[0] for name in predicted(recording)]
        every = max((readings_of(recording, name).every for name in others), default=1)
        kept = once[::every]  # a file that is interpolated is so in every column
        told = np.isin(np.arange(len(values)), kept)
        return Readings(told, len(rows) - len(once), len(once) - len(kept), every=every)
    names = [name for name in _channels(recording) if recording.column(quantity) != name]
    others = [recording.si(name)[rows] for name in names]
    stopped, level = saturated(values[rows], others, recording.memo.get((FULL_SCALE, quantity)))
    below = rows[~stopped]
    fresh = below[_fresh(recording, below, values[below])]
    every = _spacing(values[fresh])
    apart = fresh[::every]
    counted = np.zeros(len(values), bool)
    counted[apart] = True
    repeated, between = len(below) - len(fresh), len(fresh) - len(apart)
    return Readings(counted, repeated, between, int(stopped.sum()), level, every)


def read_rows(recording: Recording) -> np.ndarray:
    """Rows of a recording that were read, where a logger wrote whole rows again or interpolated the file.

    Args:
        recording: as it was read.
    """
    rows = np.arange(len(recording))
    once = rows[_not_copied(recording, rows)]
    names = [schema.quantity_and_unit(name)[0] for name in predicted(recording)]
    return once[:: min((readings_of(recording, name).every for name in names), default=1)]


def share_full_scale(recordings: Sequence[Recording]) -> None:
    """Let every recording know the values at which its channels stop in others: while a test is held there,
    its drivers do not go on.

    Args:
        recordings: of one campaign, as they were read.
    """
    names = dict.fromkeys(name for recording in recordings for name in recording.outputs)
    for quantity in (schema.quantity_and_unit(name)[0] for name in names):
        held = [r for r in recordings if r.has(quantity)]
        levels = {readings_of(r, quantity).level for r in held}
        levels = {level for level in levels if np.isfinite(level)}
        for recording in held if len(levels) == 1 else ():
            if not np.isfinite(readings_of(recording, quantity).level):
                for key in [key for key in recording.memo if key[1] == quantity]:
                    del recording.memo[key]
                recording.memo[FULL_SCALE, quantity] = next(iter(levels))


def noise_found(recording: Recording, quantity: str) -> float:
    """1-sigma of one reading as its fast changes show it, SI; without a clock, rows count for time.

    Args:
        recording: its readings are those before any reduction.
        quantity: of the column.
    """
    return _remembered(recording.whole, quantity, _noise_found)


def _noise_found(whole: Recording, quantity: str) -> float:
    values = whole.si(quantity)
    time = whole.si("time") if whole.has("time") else np.arange(float(len(values)))
    there = readings_of(whole, quantity).counted & np.isfinite(time)
    time = time[there]
    if not np.all(np.diff(time) > 0.0):  # a clock that stands still between some rows
        time = np.arange(float(len(time)))
    return robust_noise(time, values[there])


def read_values(recording: Recording, quantity: str) -> np.ndarray:
    """Readings of a column that are measurements, before any reduction, SI, in their order."""
    whole = recording.whole
    return whole.si(quantity)[readings_of(whole, quantity).counted]


def measurements(recording: Recording, quantity: str) -> np.ndarray:
    """A column in SI, shape (rows,), NaN where a row is no measurement."""
    values = recording.si(quantity)
    if recording.reduction and recording.reduction.rows is None:
        return values  # means of measurements
    counted = readings_of(recording.whole, quantity).counted
    if recording.reduction:
        counted = counted[recording.reduction.rows]
    return np.where(counted, values, np.nan)


def cautions(recordings: Sequence[Recording]) -> list[str]:
    """What readings are not, and what noise cannot be, a sentence each."""
    return [text for recording in recordings for text in _cautions(recording.whole)]


def _cautions(recording: Recording) -> list[str]:
    found, rows = [], len(recording)
    for column in predicted(recording):
        quantity, unit = schema.quantity_and_unit(column)
        told = readings_of(recording, quantity)
        place = f"{recording.name}: {column}"
        if told.saturated:
            level = float(from_si(told.level, unit))
            found.append(
                f"{place} stops at {level:.4g}, its extreme value, while other channels go on: "
                f"{told.saturated} of {rows} rows there, or too near to it, are not compared with the model"
            )
        if told.repeated:
            found.append(
                f"{place} repeats earlier readings in {told.repeated} of {rows} rows; only new ones count"
            )
        if told.interpolated:
            found.append(
                f"{place} is interpolated between readings: {told.interpolated} of {rows} rows add nothing "
                "to those beside them and do not count"
            )
        stated, rounding = recording.noise_si(quantity), rounding_noise(recording.si(quantity)[told.counted])
        if stated and stated < FAR_BELOW * rounding:
            step, least, said = (
                float(from_si(x, unit, difference=True)) for x in (np.sqrt(12.0) * rounding, rounding, stated)
            )
            found.append(
                f"{place}: the stated noise of {said:.3g} {unit} is far below the {least:.3g} {unit} that "
                f"rounding in steps of {step:.3g} {unit} leaves; it stays as stated, so rounding may "
                "look like misfit"
            )
    return found


def _channels(recording: Recording) -> list[str]:
    """Columns of numbers, the clock and counts left out."""
    known = [name for name in recording.known_columns if name not in ("time_s", "cycle")]
    return [name for name in known if np.asarray(recording.columns[name]).dtype.kind == "f"]


def _fresh(recording: Recording, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows that are no copies: of whole rows, or of a slower channel's reading."""
    fresh = _not_copied(recording, rows)
    own = values[fresh]
    moves = np.abs(np.diff(own))
    if _copied(moves) and not _in_steps(own, moves):
        fresh[np.flatnonzero(fresh)[1:]] = moves > 0.0
    return fresh


def _not_copied(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Rows in which any channel moved, where a logger writes each as often as the last."""
    fresh = np.ones(len(rows), bool)
    if len(rows) < LONG:
        return fresh
    table = np.stack([recording.columns[name][rows] for name in _channels(recording)])
    moves = np.abs(np.nan_to_num(np.diff(table, axis=1))).max(axis=0)
    if _copied(moves) and len(table) > 1 and _regular(moves):
        fresh[1:] = moves > 0.0
    return fresh


def _in_steps(values: np.ndarray, moves: np.ndarray) -> bool:
    """Whether readings stand still because they move by whole steps, or not within a dead band: as long as
    their course takes for that, while a logger writes each as often as the last."""
    step, usual = common_step(values), float(np.median(moves[moves > 0.0]))
    if step > 0.0:
        return usual <= STEPS * step
    return bool(usual <= STEPS * moves[moves > 0.0].min()) and not _regular(moves)


def _regular(moves: np.ndarray) -> bool:
    """Whether most stretches of equal readings are equally long."""
    stands = standing(moves)
    return bool(np.mean(stands == np.median(stands)) >= AS_OFTEN)


def _copied(moves: np.ndarray) -> bool:
    """Whether most readings come more than once in a row, by what each moved from the one before."""
    stands = standing(moves)
    return len(stands) > LONG and bool(np.median(stands) > 1.0)


def _spacing(values: np.ndarray) -> int:
    """Rows from one reading to the next, rounded up, where rows are interpolated; 1 where none are."""
    if len(values) < 2 * LONG:
        return 1
    none = EXACT * float(np.max(np.abs(values)))
    if common_step(values) > none:
        return 1  # rounded readings lie on lines, too
    off = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    moving = np.abs(values[2:] - values[:-2]) > CROOKED * none
    straight, crooked = moving & (off <= none), moving & (off > none)
    if straight.sum() < STRAIGHT * moving.sum() or not off.max() > CROOKED * none:
        return 1
    readings = sum((b - a + 1) // 2 for a, b in runs(crooked))  # a row on either side of each, or one on it
    return max(int(np.ceil(moving.sum() / max(readings, 1) - COUNTED)), 1)
