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
            f" {making.keep_rows(1, int(rows[back[0]]))}",
            int(rows[back[0] + 1]), "time",
        )  # fmt: skip
    if back.size:
        where = ", ".join(str(rows[i + 1]) for i in back[:5])
        making.warn(
            f"the clock goes back {counted(back.size, 'time')} (row {where}). It is kept as"
            f" {LOGGED_CLOCK}, which nothing uses. The order of rows is taken as the order of time"
        )
        others = {name: values for name, values in columns.items() if name != "time_s"}
        making.notices[:] = [
            text.replace("time_s from", f"{LOGGED_CLOCK} from", 1) if text.startswith("time_s from") else text
            for text in making.notices
        ]
        return {**others, LOGGED_CLOCK: time}
    return {**columns, "time_s": _spread_ticks(time, notices)}


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
