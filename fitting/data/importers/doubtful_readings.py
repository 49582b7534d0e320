"""Readings that an instrument gives where it cannot measure: a limit of its range, a turned sign, a leap of
the clock by an hour."""

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..recordings import schema
from ..recordings.angle_units import TURN_DEG
from .making import Channel, Making
from .running_clock import leap_by_an_hour

LONGEST = 5
"""Minimum number of rows in succession at one largest value, for a limit of the instrument."""
LONGER = 4
"""The same, as a multiple of the longest stay at any other value. A coarse resolution stays everywhere."""
MOVED = 0.03
"""Minimum change of the drive over those rows, as part of its range."""
TWICE = 0.1
"""Minimum share of rows that repeat the one before in every column, the clock included, to ask about them."""
OF_ONE_TIME = 0.9
"""Minimum share of the rows of one time that are the same. Under a clock of whole seconds, rows of a hold
are."""
TURNED = 0.2
"""Minimum value on both sides of a turned sign, as part of the largest one."""
MIRRORED = 0.2
"""Maximum sum of the values on both sides of a turned sign, as part of the larger one."""
STEPS = 5.0
"""Minimum change at a turned sign, in median changes from row to row."""
WRAPPED_DEG = 60.0
"""Maximum distance from one turn of the leap of an angle that is counted from 0 to 360 degrees, or from -180
to 180 [deg]."""
GOES_ON = 3.0
"""Maximum step that is left of such a leap without the turn, over the largest other one in its direction [1].
The same of a drive that leaps, over the steps near it."""
NEARBY = 3
"""Number of steps before and after a leap that are near it."""
FALLS = 0.2
"""Maximum change of a drive that does not leap, over its range [1]. A vented actuator falls back to rest."""
HELD_SHARE, LOST_SHARE = 0.5, 0.1
"""Stress before and after a specimen breaks, as part of the largest one. In 8 measured pulls to rupture it
fell from more than the first to less than the second, and stayed there. A load cell that reads something at
rest reads it afterwards, too, so that the stress is also counted from that of the first row."""
BREAKS_WITHIN = 0.1
"""Maximum change of the strain meanwhile, as part of its range. Of 15 such pulls, 14 broke within 0.05. One
of a metal, in a frame that sprang back, broke within 0.07."""
SUDDEN = 0.1
"""Maximum change of the strain in as many rows of the pull before, as part of its range. A rubber that is
held relaxes over more rows."""
BACK = 0.02
"""Maximum return of the strain from there to the end, as part of its range. Unloading returns farther."""
SWEPT_K = 5.0
"""Minimum change of a wire's temperature under which its stress may vanish without a break [K]."""
FIRST_STEPS = 5
"""Number of steps after the first one that tell where a drive goes."""
FIRST_APART = 2.0
"""Minimum first step that goes the other way, over the largest of these [1]. Of 88 recorded and simulated
tests none begins with a step against steady ones."""
FIRST_OF_RANGE = 1e-3
"""The same, over the range of the drive [1]."""
FIRST_QUANTA = 3.0
"""The same, over the smallest step of the drive [1]. A coarse sensor at rest steps by one."""

_MINUS = re.compile(r"\s*[-\u2212\u2013]\s?[^\W\d_]")

_GRAD = re.compile(r"[(\[/,]\s*grad\s*[)\]]?\s*$", re.IGNORECASE)
_GERMAN = re.compile(r"winkel|biegung", re.IGNORECASE)

_DRIVES = ("pressure", "current", "resistance")
"""Beginnings of the columns of an actuator that follow what is done to it."""


class _Course(NamedTuple):
    """A responding quantity beside the one that drives it, where both are known.

    Attributes:
        drive: name of the driving quantity.
        answer, unit: name of the responding quantity, and its unit.
        x, y: values of both, shape (rows,).
        rows: number of each row in the file.
    """

    drive: str
    answer: str
    unit: str
    x: np.ndarray
    y: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, columns: Mapping[str, np.ndarray], pair: tuple[str, str], rows: np.ndarray) -> "_Course":
        """Two canonical columns, without the rows in which one is missing."""
        x, y = (columns[name] for name in pair)
        finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
        answer, _, unit = pair[1].rpartition("_")
        return cls(pair[0].split("_")[0], answer, unit, x[finite], y[finite], rows[finite])


def question_readings(
    columns: dict[str, np.ndarray], rows: np.ndarray, is_clock: bool, making: Making
) -> None:
    """Ask about readings that stay at a limit, a sign that turns, and a clock that leaps by an hour.

    Args:
        columns: canonical columns, each of shape (rows,).
        rows: number of each row in the file.
        is_clock: true if the time was read from times of day.
        making: state of the import; questions are added to its notices.
    """
    for pair in schema.KINDS[making.kind].responses:
        if all(name in columns for name in pair):
            course = _Course.of(columns, pair, rows)
            if len(course.rows) > 2 * LONGEST:
                _question_limit(course, making)
                _question_sign(course, making)
                if pair[0] == "strain" and not _heated(columns):
                    _question_rupture(course, making)
                if course.drive in ("strain", "elongation") and course.answer != "resistance":
                    _question_first(course, making)
    if is_clock and "time_s" in columns:
        _question_hour(columns["time_s"], rows, making)
    if "bend_angle_deg" in columns:
        _question_turn(columns, rows, making)


def question_twice(columns: dict[str, np.ndarray], making: Making) -> None:
    """Ask about rows that were all written twice, or more often: they would count as so many readings.

    Args:
        columns: canonical columns as they stand in the file, each of shape (rows,), with a clock.
        making: state of the import; questions are added to its notices.
    """
    values = np.stack(list(columns.values()))
    if values.shape[1] < 2 or "time_s" not in columns:
        return
    same = np.all((values[:, 1:] == values[:, :-1]) | np.isnan(values[:, 1:] + values[:, :-1]), axis=0)
    still = np.diff(columns["time_s"]) == 0.0
    repeated = int(np.sum(same & still))
    if repeated >= max(LONGEST, TWICE * values.shape[1], OF_ONE_TIME * int(np.sum(still))):
        making.warn(
            f"{repeated} rows repeat the row before them in every column, the time included: was each reading"
            " written several times? Then take these rows out of the file, or a fit counts them as readings"
        )


def question_labels(channels: Mapping[str, Channel], making: Making) -> None:
    """Ask about headings that begin with a minus, such as `-Load (N)`, and about an `Angle (grad)`.

    Args:
        channels: channels by quantity, with their columns and headings.
        making: state of the import; questions are added to its notices.
    """
    for quantity, channel in channels.items():
        if channel.column >= 0 and _MINUS.match(channel.label) and quantity not in making.options.scales:
            making.warn(
                f"the heading {channel.label!r} begins with a minus, and its numbers were taken as they"
                f" stand; if that turns their sign: --scale {quantity}=-1"
            )
        if quantity == "bend_angle" and _GRAD.search(channel.label) and not _GERMAN.search(channel.label):
            if quantity not in {*making.options.scales, *making.options.units}:
                making.warn(
                    f"{channel.label!r} was taken in degrees, as grad is in German; if these are gon, where"
                    " 400 make a turn: --scale bend_angle=0.9"
                )


def _stays(values: np.ndarray) -> list[tuple[int, int]]:
    """Begin and end of each succession of equal values, the end excluded."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    return list(zip([0, *edges.tolist()], [*edges.tolist(), len(values)], strict=True))


def _question_limit(course: _Course, making: Making) -> None:
    """Ask about a largest value that stays while the specimen moves: the end of a load cell's range?"""
    x, y = course.x, course.y
    stays = _stays(y)
    for limit in {float(y.max()), float(y.min())} - {0.0}:
        if abs(limit) < float(np.abs(y).max()):
            continue
        at_limit = [(a, b) for a, b in stays if y[a] == limit]
        begin, end = max(at_limit, key=lambda stay: stay[1] - stay[0])
        elsewhere = max((b - a for a, b in stays if y[a] != limit), default=len(y))
        if end - begin < max(LONGEST, LONGER * elsewhere):
            continue
        if np.ptp(x[begin:end]) > MOVED * np.ptp(x):
            making.warn(
                f"{course.answer} stays at its largest value, {limit:.6g} {course.unit}, from row"
                f" {course.rows[begin]} to {course.rows[end - 1]} while {course.drive} changes: was that the"
                " end of the instrument's range? Then leave these fields empty"
            )


def _question_sign(course: _Course, making: Making) -> None:
    """Ask about a reading that goes on with the other sign from one row to the next."""
    x, y = course.x, course.y
    first, second = y[:-1], y[1:]
    larger = np.maximum(np.abs(first), np.abs(second))
    turned = (first * second < 0.0) & (x[:-1] * x[1:] > 0.0)
    turned &= np.minimum(np.abs(first), np.abs(second)) > TURNED * float(np.abs(y).max())
    turned &= np.abs(first + second) < MIRRORED * larger
    turned &= np.abs(np.diff(y)) > STEPS * float(np.median(np.abs(np.diff(y))))
    if turned.any():
        at = int(np.flatnonzero(turned)[0])
        if at + 2 < len(y) and turned[at + 1]:
            what = (
                f"is {second[at]:.4g} {course.unit} in row {course.rows[at + 1]} alone, between"
                f" {first[at]:.4g} and {y[at + 2]:.4g}, while {course.drive} goes on: is its sign right? If"
                " it is not, mend this field in the file, or leave it empty"
            )
        else:
            what = (
                f"turns its sign from {first[at]:.4g} to {second[at]:.4g} {course.unit} at row"
                f" {course.rows[at + 1]} while {course.drive} goes on: was the instrument connected the other"
                " way from there? Then mend these fields in the file"
            )
        making.warn(f"{course.answer} {what}")


def _heated(columns: Mapping[str, np.ndarray]) -> bool:
    """True if the temperature of a specimen changes, so that its stress may vanish at one strain."""
    temperature = columns.get("temperature_degC", np.zeros(1))
    return np.isfinite(temperature).any() and bool(np.nanmax(temperature) - np.nanmin(temperature) > SWEPT_K)


def _question_rupture(course: _Course, making: Making) -> None:
    """Ask about a stress that falls to nothing while the strain goes on, as where a specimen breaks."""
    x, y = course.x, course.y
    peak = int(np.argmax(np.abs(y)))
    side, reach = np.sign(x[peak]) or 1.0, float(np.ptp(x))
    part = np.minimum(y / (y[peak] or 1.0), (y - y[0]) / ((y[peak] - y[0]) or 1.0))
    held = np.flatnonzero(part > HELD_SHARE)
    kept = np.flatnonzero(part > LOST_SHARE)
    if held.size < LONGEST or kept[-1] + 1 >= len(y) or not reach > 0.0:
        return
    before, after = int(held[-1]), int(kept[-1]) + 1
    pace = float(np.median(side * np.diff(x[: before + 1])))
    pace = pace or side * float(x[before] - x[0]) / max(before, 1)  # a coarse sensor often stands still
    sudden = 0.0 < (after - before) * pace <= SUDDEN * reach
    within = abs(x[after] - x[before]) <= BREAKS_WITHIN * reach
    back = float(np.max(side * (x[before] - x[before:])))
    if sudden and within and back <= BACK * reach:
        making.warn(
            f"{course.answer} falls from {y[before]:.4g} {course.unit} in row {course.rows[before]} to"
            f" {y[after]:.4g} in row {course.rows[after]} and stays there, while strain does not go back: did"
            " the specimen break, or slip out of its grips? These rows are kept, and a fit takes them for the"
            f" material's. If it did: {making.keep_rows(*_up_to(course.rows, before))}"
        )


def _question_first(course: _Course, making: Making) -> None:
    """Ask about a first row far from the second, from which the drive goes the other way.

    A logger that starts before the machine is in place writes such a row.
    """
    x, steps = course.x, np.diff(course.x)
    ahead = np.sign(x[1:][np.argmax(np.abs(x[1:] - x[1]))] - x[1])
    first, after = -ahead * steps[0], ahead * steps[1 : 1 + FIRST_STEPS]
    moved = np.abs(steps[steps != 0.0])
    if not moved.size or np.any(after < 0.0):
        return
    least = max(
        FIRST_APART * float(after.max()), FIRST_OF_RANGE * float(np.ptp(x)), FIRST_QUANTA * float(moved.min())
    )
    if first > least:
        goes = "rises" if ahead > 0.0 else "falls"
        making.warn(
            f"{course.drive} is {x[0]:.4g} in row {course.rows[0]} and {x[1]:.4g} in row {course.rows[1]},"
            f" from where it {goes}: was the first row logged before the test began? If it was:"
            f" {making.keep_rows(*_from_second(course.rows))}"
        )


def _from_second(rows: np.ndarray) -> tuple[int, int | None]:
    """Numbers of the first and the last row, from the second row of a test to its end."""
    return (1, int(rows[1])) if rows[0] > rows[-1] else (int(rows[1]), None)


def _up_to(rows: np.ndarray, at: int) -> tuple[int, int | None]:
    """Numbers of the first and the last row, from the start of a test up to one of its rows.

    A log that begins with its newest row keeps the rows from there on.
    """
    return (int(rows[at]), None) if rows[0] > rows[-1] else (1, int(rows[at]))


def _question_turn(columns: dict[str, np.ndarray], rows: np.ndarray, making: Making) -> None:
    """Ask about an angle that leaps by a turn, because it is counted within one turn only.

    Without the turn it goes on as elsewhere, and it does not fall to rest together with a drive.
    """
    angle = columns["bend_angle_deg"]
    known = np.flatnonzero(np.isfinite(angle))
    steps = np.diff(angle[known])
    turns = np.abs(np.abs(steps) - TURN_DEG) <= WRAPPED_DEG
    drives = {name: values[known] for name, values in columns.items() if name.startswith(_DRIVES)}
    for leap in np.flatnonzero(turns):
        left = float(steps[leap] - np.copysign(TURN_DEG, steps[leap]))
        before, after = angle[known[leap : leap + 2]]
        falls = abs(before) > TURN_DEG / 2.0 > abs(after)
        if abs(left) > GOES_ON * float(np.max(np.sign(left) * steps[~turns], initial=0.0)):
            continue
        if falls and any(_falls_to_rest(name, values, leap) for name, values in drives.items()):
            continue
        making.warn(
            f"bend_angle_deg leaps from {before:.4g} to {after:.4g} at row {rows[known[leap + 1]]}: is it"
            " counted within one turn? Then add or take off 360 degrees in the file, so that it goes on"
        )
        return


def _falls_to_rest(name: str, values: np.ndarray, leap: int) -> bool:
    """True for a drive that comes far closer to its rest from one row to the next, and is not only noise.

    Pressures and currents rest at zero, and a resistance where it starts.
    """
    found = values[np.isfinite(values)]
    if not found.size:
        return False
    away = np.abs(values - (found[0] if name.startswith("resistance") else 0.0))
    steps = np.diff(values)
    near = [*steps[max(0, leap - NEARBY) : leap], *steps[leap + 1 : leap + 1 + NEARBY]]
    usual = float(np.max(np.nan_to_num(np.abs(near)), initial=0.0))
    least = max(FALLS * float(np.ptp(found)), GOES_ON * usual)
    return bool(away[leap + 1] < away[leap] and abs(steps[leap]) > least)


def _question_hour(time: np.ndarray, rows: np.ndarray, making: Making) -> None:
    """Ask about a time of day that leaps by an hour, as where daylight saving begins."""
    leap = leap_by_an_hour(time)
    if leap is not None and time[leap + 1] > time[leap]:
        making.warn(
            f"the clock leaps by an hour at row {rows[leap + 1]}: was it a pause, or did daylight saving"
            " begin? Then take an hour off the times from there"
        )
