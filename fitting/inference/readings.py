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

from .between_readings import OriginalReadings, readings_at, readings_between
from .driven import measured, predicted
from .full_scale import LONG, saturated
from .noise import clearly_smaller, robust_noise, rounding_noise, variance_before_rounding
from .repeated_readings import copied, everywhere, regular, slower
from .serial_correlation import CHANCE

UNEVEN = 0.5
"""Maximum deviation, in usual steps, of a clock from an even one that was written with few digits."""
FAR_BELOW = 0.5
"""Maximum ratio of a stated noise to the rounding error for it to be reported as too small."""


@dataclass(frozen=True)
class Readings:
    """Classification of the rows of a column.

    Attributes:
        counted: mask of the rows that are measurements, shape (rows,).
        repeated, interpolated, saturated: numbers of rows that are no measurements, by reason.
        level: saturation value of the channel, SI; NaN where there is none.
        originals: readings between which its rows were interpolated; None where they are readings.
    """

    counted: np.ndarray
    repeated: int = 0
    interpolated: int = 0
    saturated: int = 0
    level: float = np.nan
    originals: OriginalReadings | None = None


def readings_of(recording: Recording, quantity: str) -> Readings:
    """Classification of the rows of one column.

    Args:
        recording: original recording.
        quantity: name of the column's quantity; for a prescribed one, all rows that are no copies count.
    """
    return _memoised(recording, quantity, _readings_of)


def _memoised(recording: Recording, quantity: str, compute: Callable[[Recording, str], Any]) -> Any:
    """Result of `compute` for a column, computed once for its present array."""
    key, values = (compute.__name__, quantity), recording.columns[recording.column(quantity)]
    known = recording.memo.get(key)
    if known is None or known[0] is not values:
        known = recording.memo[key] = values, compute(recording, quantity)
    return known[1]


def _readings_of(recording: Recording, quantity: str) -> Readings:
    values = recording.si(quantity)
    rows = np.flatnonzero(np.isfinite(values))
    if recording.column(quantity) not in measured(recording):
        unique = rows[_not_copied(recording, rows)]
        drawn = [originals for originals in _readings_of_columns(recording) if originals]
        # a file is interpolated in every column
        read = _nearest(recording, unique, drawn) if drawn else unique
        mask = np.isin(np.arange(len(values)), read)
        first = drawn[0] if drawn else None
        return Readings(mask, len(rows) - len(unique), len(unique) - len(read), originals=first)
    below, level = _memoised(recording, quantity, _below_full_scale)
    unique = below[_not_copied(recording, below)]
    originals = _originals(recording, quantity, unique)
    new_rows = unique if originals else below[_fresh(recording, below, values[below])]
    measured_rows = _nearest(recording, unique, [originals]) if originals else new_rows
    counted = np.zeros(len(values), bool)
    counted[measured_rows] = True
    repeated, between = len(below) - len(new_rows), len(new_rows) - len(measured_rows)
    return Readings(counted, repeated, between, len(rows) - len(below), level, originals)


def _below_full_scale(recording: Recording, quantity: str) -> tuple[np.ndarray, float]:
    """Rows in which a measured column has a value and is not saturated, and its saturation value."""
    values = recording.si(quantity)
    rows = np.flatnonzero(np.isfinite(values))
    names = [name for name in _channels(recording) if recording.column(quantity) != name]
    others = [recording.si(name)[rows] for name in names]
    stopped, level = saturated(values[rows], others, recording.full_scale.get(quantity))
    return rows[~stopped], level


def _originals(recording: Recording, quantity: str, rows: np.ndarray) -> OriginalReadings | None:
    """Readings between which some rows of a measured column were interpolated.

    A file is interpolated in every column. A column whose own corners are too blunt for a grid lies on lines
    between the positions of another column's readings.
    """
    found = _memoised(recording, quantity, _own_originals)
    others = (schema.quantity_and_unit(name)[0] for name in measured(recording))
    for other in others if found is None else ():
        grid = None if other == quantity else _memoised(recording, other, _own_originals)
        if grid is not None:
            found = readings_at(grid, _positions(recording)[rows], recording.si(quantity)[rows])
        if found is not None:
            break
    return found


def _own_originals(recording: Recording, quantity: str) -> OriginalReadings | None:
    """Readings of a measured column that its own rows tell."""
    below, _ = _memoised(recording, quantity, _below_full_scale)
    rows = below[_not_copied(recording, below)]
    return readings_between(_positions(recording)[rows], recording.si(quantity)[rows])


def _positions(recording: Recording) -> np.ndarray:
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


def _readings_of_columns(recording: Recording) -> list[OriginalReadings | None]:
    """Readings between which the rows of each predicted column were interpolated."""
    names = [schema.quantity_and_unit(name)[0] for name in predicted(recording)]
    return [readings_of(recording, name).originals for name in names]


def _nearest(recording: Recording, rows: np.ndarray, drawn: Sequence[OriginalReadings]) -> np.ndarray:
    """Rows, among some, that are nearest to a reading of any column."""
    places = _positions(recording)[rows]
    return rows[np.unique(np.concatenate([originals.nearest(places) for originals in drawn]))]


def read_rows(recording: Recording) -> np.ndarray:
    """Rows of a recording that were read, where a logger repeated whole rows or interpolated the file.

    Args:
        recording: original recording.
    """
    rows = np.arange(len(recording))
    unique = rows[_not_copied(recording, rows)]
    drawn = _readings_of_columns(recording)
    return _nearest(recording, unique, drawn) if drawn and all(drawn) else unique


def share_full_scale(recordings: Sequence[Recording]) -> None:
    """Share the saturation values of each channel among recordings. While a test is saturated throughout, its
    drivers may not continue, so it cannot show this alone.

    Args:
        recordings: original recordings of one campaign.
    """
    names = dict.fromkeys(name for recording in recordings for name in recording.outputs)
    for quantity in (schema.quantity_and_unit(name)[0] for name in names):
        having = [r for r in recordings if r.has(quantity)]
        levels = {readings_of(r, quantity).level for r in having}
        levels = {level for level in levels if np.isfinite(level)}
        for recording in having if len(levels) == 1 else ():
            if not np.isfinite(readings_of(recording, quantity).level):
                for key in [key for key in recording.memo if key[1] == quantity]:
                    del recording.memo[key]
                recording.full_scale[quantity] = next(iter(levels))


def stated_noise(recording: Recording, quantity: str) -> float | None:
    """Stated standard deviation of an output's readings, rounding included, SI; None where nobody states it.

    A stated noise may be that of the instrument, before a logger rounds, or that of the readings. It is that
    of the readings if their variance without rounding (`variance_before_rounding`) is at most the stated one
    less that of `rounding_noise`, and chance. Otherwise rounding is added: too little noise makes misfit.
    Nothing is added where the recording says that its noise includes rounding.

    Args:
        recording: recording whose readings before any reduction are used.
        quantity: name of the output's quantity.
    """
    stated = recording.noise_si(quantity)
    if not stated or recording.noise_includes_rounding:
        return stated
    rounding, before = _memoised(recording.whole, quantity, _rounding)
    held = before <= CHANCE * (stated**2 - rounding**2)
    return stated if held else float(np.hypot(stated, rounding))


def _rounding(whole: Recording, quantity: str) -> tuple[float, float]:
    """Standard deviation of the rounding of a column's readings, and their variance before it, SI."""
    values = read_values(whole, quantity)
    rounding = rounding_noise(values)
    return rounding, variance_before_rounding(values) if rounding > 0.0 else np.inf


def noise_found(recording: Recording, quantity: str) -> float:
    """Standard deviation of one reading's noise, from its high-frequency content, SI. Without a clock, rows
    count for time, or the way of the drivers where that makes the column clearly smoother: points of a table
    may lie unevenly.

    Args:
        recording: recording whose readings before any reduction are used.
        quantity: name of the column's quantity.
    """
    return _memoised(recording.whole, quantity, _noise_found)


def noise_of(recording: Recording, quantity: str) -> float:
    """Standard deviation of one reading's noise, stated or as `noise_found` tells it, SI.

    Every command takes the noise of a measured input from here, in fits and in diagnoses.

    Args:
        recording: recording whose readings before any reduction are used.
        quantity: name of the column's quantity.
    """
    stated = recording.noise_si(quantity)
    return noise_found(recording, quantity) if stated is None else stated


def _noise_found(whole: Recording, quantity: str) -> float:
    values, originals = whole.si(quantity), readings_of(whole, quantity).originals
    if originals and whole.column(quantity) in measured(whole):
        finite = np.isfinite(originals.values)
        return robust_noise(originals.at[finite], originals.values[finite])
    time = whole.si("time") if whole.has("time") else np.arange(float(len(values)))
    counted = readings_of(whole, quantity).counted & np.isfinite(time)
    time = time[counted]
    if not np.all(np.diff(time) > 0.0):  # a clock that stands still between some rows
        time = np.arange(float(len(time)))
    noise = robust_noise(time, values[counted])
    way = np.zeros(len(time)) if whole.has("time") else _way(whole, counted)
    smoother = robust_noise(way, values[counted]) if np.all(np.diff(way) > 0.0) else noise
    return smoother if clearly_smaller(smoother, noise, len(way)) else noise


def _way(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Way that the drivers have come at some rows: the sum of their moves, each over its range, [1]."""
    way = np.zeros(int(rows.sum()))
    read = measured(recording)
    for name in recording.known_columns:
        values = recording.si(schema.quantity_and_unit(name)[0])[rows]
        if name not in read and np.isfinite(values).all() and np.ptp(values) > 0.0:
            way[1:] += np.cumsum(np.abs(np.diff(values))) / np.ptp(values)
    return way


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
        readings = readings_of(recording, quantity)
        place = f"{recording.name}: {column}"
        if readings.saturated:
            level = float(from_si(readings.level, unit))
            found.append(
                f"{place} stops at {level:.4g}, its extreme value, while other channels go on. "
                f"{readings.saturated} of {rows} rows there, or too near to it, are not compared with the"
                " model"
            )
        if readings.repeated:
            found.append(
                f"{place} repeats earlier readings in {readings.repeated} of {rows} rows; only new ones count"
            )
        if readings.interpolated:
            found.append(
                f"{place} is interpolated between readings: {readings.interpolated} of {rows} rows add"
                " nothing to those beside them and do not count"
            )
        stated = recording.noise_si(quantity)
        rounding, _ = _memoised(recording, quantity, _rounding)
        if stated and stated < FAR_BELOW * rounding:
            sizes = np.sqrt(12.0) * rounding, rounding, stated, np.hypot(stated, rounding)
            step, least, small, both = (float(from_si(x, unit, difference=True)) for x in sizes)
            below = f"{place}: the stated noise of {small:.3g} {unit} is far below the {least:.3g} {unit} "
            below += f"that rounding in steps of {step:.3g} {unit} leaves"
            if recording.noise_includes_rounding:
                found.append(f"{below}. Its file says that rounding is included, so nothing is added")
            else:
                found.append(
                    f"{below}. If it includes rounding, state noise_includes_rounding = true above [noise]. "
                    f"Rounding is added to it, so that the readings count with {both:.3g} {unit}"
                )
    return found


def _channels(recording: Recording) -> list[str]:
    """Numeric columns, without the clock and counts."""
    names = [name for name in recording.known_columns if name not in ("time_s", "cycle")]
    return [name for name in names if np.asarray(recording.columns[name]).dtype.kind == "f"]


def _fresh(recording: Recording, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Rows that are no copies: of whole rows, or of a slower channel's reading."""
    new = _not_copied(recording, rows)
    own = values[new]
    moves = np.abs(np.diff(own))
    if slower(own, moves):
        new[np.flatnonzero(new)[1:]] = moves > 0.0
    return new


def _not_copied(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Rows in which any channel moved, where a logger writes each as often as the last."""
    new = np.ones(len(rows), bool)
    if len(rows) < LONG:
        return new
    table = np.stack([recording.columns[name][rows] for name in _channels(recording)])
    moves = np.abs(np.nan_to_num(np.diff(table, axis=1))).max(axis=0)
    if copied(moves) and len(table) > 1 and regular(moves) and everywhere(moves):
        new[1:] = moves > 0.0
    return new
