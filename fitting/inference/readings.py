"""Selection of the readings of a column that are measurements, and their noise.

A logger that is faster than its instrument repeats a reading, or draws a straight line to the next one. An
instrument at full scale gives only a bound. Such rows have a value but carry no information.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.data.recordings import Recording, schema
from pneusma_jax.units import from_si

from .between_readings import Taken, readings_between
from .driven import measured, predicted
from .full_scale import LONG, saturated
from .noise import robust_noise, rounding_noise
from .repeated_readings import copied, everywhere, regular, slower

UNEVEN = 0.5
"""Maximum deviation, in usual steps, of a clock from an even one that was written with few digits."""
FULL_SCALE = "full scale"
"""Key of a recording's memo with the saturation values of other recordings' channels."""
FAR_BELOW = 0.5
"""Maximum ratio of a stated noise to the rounding error for it to be reported as too small."""


@dataclass(frozen=True)
class Readings:
    """Classification of the rows of a column.

    Attributes:
        counted: mask of the rows that are measurements, shape (rows,).
        repeated, interpolated, saturated: numbers of rows that are no measurements, by reason.
        level: saturation value of the channel, SI; NaN where there is none.
        taken: readings between which its rows were interpolated; None where they are readings.
    """

    counted: np.ndarray
    repeated: int = 0
    interpolated: int = 0
    saturated: int = 0
    level: float = np.nan
    taken: Taken | None = None


def readings_of(recording: Recording, quantity: str) -> Readings:
    """Classification of the rows of one column.

    Args:
        recording: original recording.
        quantity: name of the column's quantity; for a prescribed one, all rows that are no copies count.
    """
    return _remembered(recording, quantity, _readings_of)


def _remembered(recording: Recording, quantity: str, told: Callable[[Recording, str], Any]) -> Any:
    """Result of `told` for a column, computed once."""
    key = told.__name__, quantity, id(recording.columns[recording.column(quantity)])
    if key not in recording.memo:
        recording.memo[key] = told(recording, quantity)
    return recording.memo[key]


def _readings_of(recording: Recording, quantity: str) -> Readings:
    values = recording.si(quantity)
    rows = np.flatnonzero(np.isfinite(values))
    if recording.column(quantity) not in measured(recording):
        once = rows[_not_copied(recording, rows)]
        drawn = [taken for taken in _drawn(recording) if taken]
        kept = _nearest(recording, once, drawn) if drawn else once  # a file is interpolated in every column
        told = np.isin(np.arange(len(values)), kept)
        return Readings(told, len(rows) - len(once), len(once) - len(kept), taken=drawn[0] if drawn else None)
    names = [name for name in _channels(recording) if recording.column(quantity) != name]
    others = [recording.si(name)[rows] for name in names]
    stopped, level = saturated(values[rows], others, recording.memo.get((FULL_SCALE, quantity)))
    below = rows[~stopped]
    once = below[_not_copied(recording, below)]
    taken = readings_between(_places(recording)[once], values[once])
    fresh = once if taken else below[_fresh(recording, below, values[below])]
    apart = _nearest(recording, once, [taken]) if taken else fresh
    counted = np.zeros(len(values), bool)
    counted[apart] = True
    repeated, between = len(below) - len(fresh), len(fresh) - len(apart)
    return Readings(counted, repeated, between, int(stopped.sum()), level, taken)


def _places(recording: Recording) -> np.ndarray:
    """Positions of rows between readings: by the clock, in its usual steps, where these are uneven by more
    than its digits; else the row number."""
    number = np.arange(float(len(recording)))
    time = recording.si("time") if recording.has("time") else number
    steps = np.diff(time)
    if not len(steps) or not np.all(steps > 0.0):
        return number
    clock = (time - time[0]) / float(np.median(steps))
    even = number * clock[-1] / number[-1]
    return number if np.max(np.abs(clock - even)) < UNEVEN else clock


def _drawn(recording: Recording) -> list[Taken | None]:
    """Readings between which the rows of each predicted column were interpolated."""
    names = [schema.quantity_and_unit(name)[0] for name in predicted(recording)]
    return [readings_of(recording, name).taken for name in names]


def _nearest(recording: Recording, rows: np.ndarray, drawn: Sequence[Taken]) -> np.ndarray:
    """Those of some rows that are nearest to a reading of any column."""
    places = _places(recording)[rows]
    return rows[np.unique(np.concatenate([taken.nearest(places) for taken in drawn]))]


def read_rows(recording: Recording) -> np.ndarray:
    """Rows of a recording that were read, where a logger repeated whole rows or interpolated the file.

    Args:
        recording: original recording.
    """
    rows = np.arange(len(recording))
    once = rows[_not_copied(recording, rows)]
    drawn = _drawn(recording)
    return _nearest(recording, once, drawn) if drawn and all(drawn) else once


def share_full_scale(recordings: Sequence[Recording]) -> None:
    """Share the saturation values of each channel among recordings. While a test is saturated throughout, its
    drivers may not continue, so it cannot show this alone.

    Args:
        recordings: original recordings of one campaign.
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
    """Standard deviation of one reading's noise, from its high-frequency content, SI. Without a clock, rows
    count for time.

    Args:
        recording: recording whose readings before any reduction are used.
        quantity: name of the column's quantity.
    """
    return _remembered(recording.whole, quantity, _noise_found)


def _noise_found(whole: Recording, quantity: str) -> float:
    values, taken = whole.si(quantity), readings_of(whole, quantity).taken
    if taken and whole.column(quantity) in measured(whole):
        known = np.isfinite(taken.values)
        return robust_noise(taken.at[known], taken.values[known])
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
    """Warnings about rows that are no measurements and about impossible noise, a sentence each."""
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
    """Numeric columns, without the clock and counts."""
    known = [name for name in recording.known_columns if name not in ("time_s", "cycle")]
    return [name for name in known if np.asarray(recording.columns[name]).dtype.kind == "f"]


def _fresh(recording: Recording, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows that are no copies: of whole rows, or of a slower channel's reading."""
    fresh = _not_copied(recording, rows)
    own = values[fresh]
    moves = np.abs(np.diff(own))
    if slower(own, moves):
        fresh[np.flatnonzero(fresh)[1:]] = moves > 0.0
    return fresh



def _not_copied(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Rows in which any channel moved, where a logger writes each as often as the last."""
    fresh = np.ones(len(rows), bool)
    if len(rows) < LONG:
        return fresh
    table = np.stack([recording.columns[name][rows] for name in _channels(recording)])
    moves = np.abs(np.nan_to_num(np.diff(table, axis=1))).max(axis=0)
    if copied(moves) and len(table) > 1 and regular(moves) and everywhere(moves):
        fresh[1:] = moves > 0.0
    return fresh
