"""Downsampling of long recordings: means where no channel bends within one, else selected rows.

A mean over rows lies on the curve of a law only where the law is straight over these rows. So rows are
averaged only if that holds in every block (`block_means`).

Otherwise single rows are kept, denser where readings change. Turning points of the drivers are among them, so
that loops stay loops. Of very many cycles, some are kept whole.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from fitting.data.recordings import Campaign, Recording, Reduction, schema
from fitting.inference.driven import predicted
from fitting.inference.readings import read_rows, readings_of, share_full_scale
from pneusma_jax.errors import counted

from .block_means import PART, averaged, means_of, moving_channels, range_of_noise
from .rows import MOST_ROWS

ROW = "row"
"""Name of the number of a row among the columns that are averaged with it."""
TURNS = 0.1
"""Minimum part of a channel's range by which it returns after a turning point."""
EACH_WAY = 8
"""Minimum number of rows between turning points that show a transformation. With fewer, whole cycles are left
out."""
FINE = 2
"""Number of rows of the moving average before turning points are sought. Noise of a thirtieth of the range
then makes no turning point. A transformation of three rows is not smeared."""
ENOUGH = 0.25
"""Minimum share of rows that measure every output; from it on, only such rows are kept."""
EVEN_SHARE = 0.5
"""Share of the kept rows that are spread evenly. The others go where readings change."""


def thinned(campaign: Campaign, most: int) -> Campaign:
    """A campaign whose recordings have at most `most` rows, see `reduced`. They share their full scale."""
    share_full_scale(campaign.recordings)
    return dataclasses.replace(campaign, recordings=[reduced(r, most) for r in campaign.recordings])


def reduced(recording: Recording, most: int) -> Recording:
    """A recording with at most `most` rows, which refers to its original. A short recording is returned as it
    is.

    Args:
        recording: original recording, or an earlier reduction.
        most: maximum number of rows, those apart that were added without readings.
    """
    if recording.reduction:
        few = len(recording) - recording.reduction.added <= most
        return recording if few else reduced(recording.whole, most)
    read = read_rows(recording)
    if len(read) <= most:
        return recording if len(read) == len(recording) else _only_readings(recording, read)
    table = _table(recording)
    block = -(-len(recording) // most)
    turns = _turning_rows(recording, table, min(block, FINE))
    means = means_of(recording, _measured(recording, table), turns, block)
    if means is not None:
        count = len(next(iter(means.values())))
        left = len(recording) - block * count
        text = (
            f"{recording.name}: reduced from {len(recording)} rows to {count}, each the mean of {block}. "
            f"Within none of them a channel moves by more than {100 * PART:.0f} % of its range, noise aside"
        )
        if left:
            rest = counted(left, "row") + " left over before a turn or the end"
            text += f"; {rest} {'is' if left == 1 else 'are'} left out"
        how = Reduction(recording, None, block, text)
        return dataclasses.replace(recording, columns=means, reduction=how)
    rows, cycles = _selected_rows(recording, table, turns, block, most)
    of = f", of {cycles[0]} of its {cycles[1]} cycles" if cycles else ""
    text = (
        f"{recording.name}: {len(rows)} of {len(recording)} rows are used{of}, as they were read. They lie "
        "closer together where readings change, and include the turning points"
    ) + ("; effects with a memory do not see the cycles left out" if cycles else "")
    columns = {name: column[rows] for name, column in table.items()}
    return dataclasses.replace(recording, columns=columns, reduction=Reduction(recording, rows, 1, text))


def _only_readings(recording: Recording, rows: np.ndarray) -> Recording:
    """A recording without rows that are no readings; `inference.readings.cautions` reports them."""
    columns = {name: column[rows] for name, column in _table(recording).items()}
    return dataclasses.replace(recording, columns=columns, reduction=Reduction(recording, rows, 1, ""))


def chosen_readings(recording: Recording) -> np.ndarray | None:
    """Number of each row among the original's readings, ascending; None where no reading was left out."""
    how = recording.reduction
    if how is None or how.rows is None or not how.text:
        return None
    return np.searchsorted(read_rows(how.source), how.rows)


def reduction_notes(recordings: Sequence[Recording], most: int = MOST_ROWS) -> list[str]:
    """Sentences that say how each recording was reduced.

    Args:
        recordings: original or reduced recordings.
        most: maximum number of rows.
    """
    found = [reduced(recording, most).reduction for recording in recordings]
    return [how.text for how in found if how and how.text]


def _table(recording: Recording) -> dict[str, np.ndarray]:
    """Numeric columns of known quantities, canonical units."""
    columns = {name: np.asarray(recording.columns[name]) for name in recording.known_columns}
    return {name: values for name, values in columns.items() if values.dtype.kind == "f"}


def _measured(recording: Recording, table: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns with NaN where there is no measurement."""
    found: dict[str, np.ndarray] = {}
    for name, column in table.items():
        if name in ("time_s", "cycle"):
            found[name] = column
            continue
        counted = readings_of(recording, schema.quantity_and_unit(name)[0]).counted
        found[name] = np.where(counted, column, np.nan)
    return found


def _selected_rows(
    recording: Recording, table: Mapping[str, np.ndarray], turns: np.ndarray, block: int, most: int
) -> tuple[np.ndarray, tuple[int, int] | None]:
    """Selected rows, ascending; and the counts of kept and of all cycles, where some are left out."""
    count = len(recording)
    channels = [
        name
        for name in moving_channels(table)
        if np.ptp(_finite(table[name])) > range_of_noise(recording, name)
    ]
    means = averaged({ROW: np.arange(float(count)), **{n: table[n] for n in channels}}, min(block, FINE))
    usable, cycles = np.ones(count, bool), None
    if len(turns) * EACH_WAY > most:
        usable, cycles = _whole_cycles(turns, count, most)
        turns = turns[usable[turns]]
    path = EVEN_SHARE * np.linspace(0.0, 1.0, count)
    for name in channels:
        finite = np.isfinite(means[name])
        course = np.interp(np.arange(count), means[ROW][finite], means[name][finite])
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(course)))])
        path += (1.0 - EVEN_SHARE) / len(channels) * way / max(way[-1], 1e-300)
    candidates = usable & _informative_rows(recording)
    candidates[[0, -1]] = True
    rows = np.flatnonzero(candidates)
    gone = np.interp(rows, np.flatnonzero(usable), np.cumsum(np.diff(path, prepend=0.0)[usable]))
    return _along(rows, gone, turns, most), cycles


def _along(rows: np.ndarray, gone: np.ndarray, turns: np.ndarray, most: int) -> np.ndarray:
    """At most `most` rows at even distances along a path, turning points among them, ascending.

    Where rows lie farther apart than the distance, several wanted places have one row. So the distance is
    found by bisection.

    Args:
        rows: rows that may be chosen, ascending.
        gone: way along the path to each.
        turns: rows that are chosen in any case.
        most: maximum number of rows.
    """

    def chosen(count: int) -> np.ndarray:
        wanted = np.linspace(gone[0], gone[-1], count)
        near = rows[np.clip(np.searchsorted(gone, wanted), 0, len(rows) - 1)]
        return np.unique(np.concatenate([near, turns]))

    few, many = 2, 64 * most
    while many - few > 1:
        middle = (few + many) // 2
        few, many = (middle, many) if len(chosen(middle)) <= most else (few, middle)
    return chosen(few)[:most]


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _informative_rows(recording: Recording) -> np.ndarray:
    """Rows that hold every required column and, if enough rows remain, measurements of every output."""
    outputs = [schema.quantity_and_unit(name)[0] for name in predicted(recording)]
    counted = [readings_of(recording, quantity).counted for quantity in outputs]
    found = np.all(counted, axis=0)
    if found.mean() < ENOUGH:
        found = np.any(counted, axis=0)
    for name in schema.KINDS[recording.kind].columns.required:
        if name in recording.columns and name not in predicted(recording):
            found &= np.isfinite(recording.columns[name])
    return found if found.any() else ~found


def _turning_rows(recording: Recording, table: Mapping[str, np.ndarray], block: int) -> np.ndarray:
    """Rows at which a driver turns back, ascending; sought in means over `block` rows."""
    drivers = [name for name in moving_channels(table) if name not in predicted(recording)]
    means = averaged({ROW: np.arange(float(len(recording))), **{n: table[n] for n in drivers}}, block)
    found: list[int] = []
    for name in drivers:
        finite = np.isfinite(means[name])
        course, at = means[name][finite], means[ROW][finite]
        sign, best, back = 0, 0, max(TURNS * np.ptp(course), range_of_noise(recording, name))
        for k in range(len(course)):
            if sign == 0:
                sign = int(np.sign(course[k] - course[0])) if abs(course[k] - course[0]) > back else 0
                best = k
            elif sign * (course[k] - course[best]) > 0.0:
                best = k
            elif sign * (course[best] - course[k]) > back:
                found.append(_peak_row(sign * table[name], int(at[best]), block))
                sign, best = -sign, k
    return np.unique(np.array(found, int))


def _peak_row(values: np.ndarray, row: int, block: int) -> int:
    """Row of the largest value near a given row; isolated spikes are ignored."""
    first, last = max(row - block, 1), min(row + block + 1, len(values) - 1)
    middle = np.median(
        [values[first - 1 : last - 1], values[first:last], values[first + 1 : last + 1]], axis=0
    )
    return first + int(np.nanargmax(middle)) if np.isfinite(middle).any() else row


def _whole_cycles(turns: np.ndarray, count: int, most: int) -> tuple[np.ndarray, tuple[int, int]]:
    """Rows of cycles spread evenly over the recording, the first and the last included; and both counts of
    cycles."""
    starts = np.concatenate([[0], turns[1::2], [count]])
    starts = np.unique(starts)
    whole = len(starts) - 1
    rows = min(2 * EACH_WAY, int(np.ceil(np.mean(np.diff(starts)))))  # kept of one cycle
    chosen = np.unique(np.linspace(0, whole - 1, min(max(most // rows, 2), whole)).round().astype(int))
    usable = np.zeros(count, bool)
    for k in chosen:
        usable[starts[k] : starts[k + 1]] = True
    return usable, (len(chosen), whole)
