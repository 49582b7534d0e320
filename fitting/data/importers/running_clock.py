"""The column `time_s` of a recording.

It is made where the file has no clock, set aside where the clock was reset, and interpolated where it is
coarse.
"""

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import schema
from ..recordings.table import unusable
from .making import Making

LOGGED_CLOCK = "clock_as_logged"
"""Column to which a clock that goes back is renamed, so that nothing uses it."""
DEFAULT_INTERVAL_S = 1.0
"""Seconds between rows that a recording without a clock is given, where one is needed and none is stated."""
HOUR_S = 3600.0
"""Leap of a clock at the begin or the end of daylight saving [s]."""
HOUR_STEPS = 2.0
"""Maximum distance of a leap from an hour, in median steps of the clock."""


def with_clock(
    columns: dict[str, np.ndarray],
    rows: np.ndarray,
    making: Making,
) -> dict[str, np.ndarray]:
    """The columns with a clock that never goes back, or without a clock if the kind of test needs none.

    Args:
        columns: columns of the recording, shape (rows,) each.
        rows: line in the raw file of each row, for messages.
        making: state of the import. Notices are added to it, and `clock_counts_rows` is set.

    Raises:
        InputError: if the clock goes back although the kind of test needs one.
    """
    needed, notices = "time_s" in schema.KINDS[making.kind].columns.required, making.notices
    if len(rows) > 1 and "time_s" in columns and not np.ptp(columns["time_s"]) > 0.0:
        making.warn(f"the clock stands still at {columns['time_s'][0]:g} s in every row and was left out")
        columns = {name: values for name, values in columns.items() if name != "time_s"}
    if "time_s" not in columns:
        if not needed and making.options.interval_s is None:
            return columns
        step = making.options.interval_s or DEFAULT_INTERVAL_S
        making.use("--interval")
        making.clock_counts_rows = making.options.interval_s is None
        notices.append(
            f"the file has no clock: time_s counts the rows, {step:g} s apart (--interval states the true"
            " step). Nothing that depends on rate can be judged from it"
        )
        return {"time_s": step * np.arange(len(rows), dtype=float), **columns}
    time = columns["time_s"]
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size and needed:
        raise unusable(
            making.place, f"the clock goes back from {time[back[0]]:g} to {time[back[0] + 1]:g} s; cut the"
            " file there, and import the pieces, or keep the first one:"
            f" {making.keep_rows(1, int(rows[back[0]]))}{_saving_ended(time, rows)}",
            int(rows[back[0] + 1]), "time",
        )  # fmt: skip
    if back.size:
        where = ", ".join(str(rows[i + 1]) for i in back[:5])
        making.warn(
            f"the clock goes back {counted(back.size, 'time')} (row {where}). It is kept as"
            f" {LOGGED_CLOCK}, which nothing uses. The order of rows is taken as the order of time"
            f"{_saving_ended(time, rows)}"
        )
        others = {name: values for name, values in columns.items() if name != "time_s"}
        making.notices[:] = [
            text.replace("time_s from", f"{LOGGED_CLOCK} from", 1) if text.startswith("time_s from") else text
            for text in making.notices
        ]
        return {**others, LOGGED_CLOCK: time}
    return {**columns, "time_s": _spread_ticks(time, notices)}


def leap_by_an_hour(time: np.ndarray) -> int | None:
    """The row before the one leap of a clock by an hour, forth or back; None where it has none, or several.

    Args:
        time: clock of rows much less than an hour apart [s], shape (rows,).
    """
    steps = np.diff(time)
    usual = float(np.median(steps)) if steps.size else 0.0
    leaps = np.flatnonzero(np.abs(np.abs(steps - usual) - HOUR_S) <= HOUR_STEPS * usual)
    return int(leaps[0]) if 0.0 < usual < HOUR_S / 60.0 and leaps.size == 1 else None


def _saving_ended(time: np.ndarray, rows: np.ndarray) -> str:
    """Question whether daylight saving ended where a clock goes back by an hour; empty elsewhere."""
    leap = leap_by_an_hour(time)
    if leap is None or time[leap + 1] > time[leap]:
        return ""
    row = rows[leap + 1]
    return f". It is an hour: did daylight saving end? Then add an hour to the times from row {row}"


def _spread_ticks(time: np.ndarray, notices: list[str]) -> np.ndarray:
    """Times of rows, where those with the same time are spread evenly over one step of the clock.

    A coarse clock gives several rows the same time. Its step is the smallest difference of two times, or less
    where the next time comes sooner.

    Args:
        time: clock that never goes back [s], shape (rows,).
        notices: receives a sentence if any time was repeated.
    """
    steps = np.diff(time)
    repeats = int(np.sum(steps == 0.0))
    if repeats == 0 or not (steps > 0.0).any():
        return time
    resolution = float(steps[steps > 0.0].min())
    ticks, first, counts = np.unique(time, return_index=True, return_counts=True)
    width = np.append(np.minimum(np.diff(ticks), resolution), resolution)
    offset = np.arange(len(time)) - np.repeat(first, counts)
    notices.append(
        f"{counted(repeats, 'row repeats', 'rows repeat')} the time before them (the"
        f" clock steps by {resolution:g} s): spread evenly"
        " over a step"
    )
    return time + np.repeat(width / counts, counts) * offset
