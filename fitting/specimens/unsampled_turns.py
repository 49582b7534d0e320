"""Turning points of a drive that fall between two rows.

A specimen that is pulled and let go reaches its largest strain between two rows of a slow logger. The
material remembers that strain, but no row has it. Where the drive moves at a constant rate on both sides,
the two lines meet at the turning point. It becomes a row without readings, which the model passes through.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import Recording, Reduction, schema
from fitting.inference.driven import measured

REMEMBERED = ("elongation", "strain", "pressure")
"""Drives whose largest value a material remembers."""
EVEN = 0.02
"""Maximum relative difference of two neighbouring rates for a constant rate. Commands differ by rounding."""
INSIDE = 0.02
"""Minimum distance of a turning point from both rows, in the time between them."""
FARTHER = 2e-3
"""Minimum distance of a turning point beyond both rows, over the range of the drive."""


def with_unsampled_turns(recording: Recording) -> Recording:
    """A recording with a row at each turning point of its drive that no row has.

    Args:
        recording: recording of any kind, original or with selected rows. An actuator is left as it is: it has
            no drive that is remembered.

    Returns:
        The same recording where there is nothing to add. Added rows hold the drives at the turning point, and
        NaN in measured columns. Their index in `Reduction.rows` is that of the row before.
    """
    numeric = [n for n in recording.known_columns if np.asarray(recording.columns[n]).dtype.kind == "f"]
    drives = [name for name in numeric if name not in ("time_s", "cycle", *measured(recording))]
    remembered = [name for name in drives if schema.quantity_and_unit(name)[0] in REMEMBERED]
    means = recording.reduction is not None and recording.reduction.rows is None
    if recording.kind == "actuator" or not recording.has("time") or not remembered or means:
        return recording
    time = recording.si("time")
    turns = unsampled_turns(time, np.asarray(recording.columns[remembered[0]], float))
    if not len(turns.row):
        return recording
    added = {name: np.interp(turns.time, time, recording.columns[name]) for name in drives}
    added |= {"time_s": turns.time, remembered[0]: turns.drive}
    if "cycle" in numeric:
        added["cycle"] = np.asarray(recording.columns["cycle"])[turns.row]
    columns = {n: np.insert(recording.columns[n], turns.row + 1, added.get(n, np.nan)) for n in numeric}
    before = recording.reduction
    origin = np.arange(len(recording)) if before is None else before.rows
    ends = zip(origin[turns.row], origin[turns.row + 1], strict=True)
    pairs = ", ".join(f"{first + 1} and {second + 1}" for first, second in ends)
    text = (
        f"{recording.name}: {remembered[0]} turns between rows {pairs}, beyond both; a row without readings "
        "stands where the lines through the rows on either side meet"
    )
    text = f"{before.text}; {text}" if before and before.text else text
    how = Reduction(recording.whole, np.insert(origin, turns.row + 1, origin[turns.row]), 1, text)
    return dataclasses.replace(recording, columns=columns, reduction=how)


@dataclass(frozen=True)
class Turns:
    """Turning points between rows.

    Attributes:
        row: index of the row before each, ascending, shape (m,).
        time: time of each, s, shape (m,).
        drive: value of the drive at each, in its unit, shape (m,).
    """

    row: np.ndarray
    time: np.ndarray
    drive: np.ndarray


def unsampled_turns(time: np.ndarray, drive: np.ndarray) -> Turns:
    """Turning points of a drive that no row has.

    Args:
        time: times of the rows, s, shape (n,).
        drive: values of the drive at these rows, shape (n,), finite for any to be found.
    """
    none = np.zeros(0)
    steps = np.diff(time)
    if len(time) < 6 or not np.all(np.isfinite(drive)) or not np.all(steps > 0.0):
        return Turns(none.astype(int), none, none)
    rate = np.diff(drive) / steps
    row = np.arange(2, len(time) - 3)
    before, after = rate[row - 1], rate[row + 1]
    even = np.abs(rate[row - 2] - before) <= EVEN * np.abs(before)
    even &= np.abs(rate[row + 2] - after) <= EVEN * np.abs(after)
    turns = even & (before * after < 0.0)
    row, before, after = row[turns], before[turns], after[turns]
    later = (drive[row + 1] - drive[row] - after * steps[row]) / (before - after)
    reached = drive[row] + before * later
    beyond = np.minimum(np.abs(reached - drive[row]), np.abs(reached - drive[row + 1]))
    inside = (later > INSIDE * steps[row]) & (later < (1.0 - INSIDE) * steps[row])
    found = inside & (beyond > FARTHER * np.ptp(drive))
    return Turns(row[found], time[row[found]] + later[found], reached[found])
