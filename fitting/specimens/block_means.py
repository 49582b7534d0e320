"""Means over blocks of rows, where each lies on the curve of its rows.

A mean lies there where a law is straight over its rows. Three conditions ensure it, in every block:

- no driver turns within it: blocks begin anew at every turning point;
- no channel moves by more than a small part of its range within it, noise aside;
- no output bends within it by more than the noise of the mean.
"""

from collections.abc import Mapping

import numpy as np

from fitting.data.recordings import Recording, schema
from fitting.inference.driven import predicted
from fitting.inference.readings import noise_found

PART = 0.05
"""Maximum part of a channel's range by which it moves within a block. A mean over 12 % of the range of a
wire's temperature lay off its curve by 20 times the noise of a strain."""
BENT = 0.5
"""Maximum distance of a mean from a bent curve, in units of the noise of a mean. The largest of a thousand
means looks like 0.34 to 0.46 by noise alone (100 simulated recordings)."""
SCATTER = 6.0
"""Maximum range of noise within a block, in standard deviations, after a running median of three rows. It was
5.7 at most in blocks of 2 to 100 of 26,000 rows (100 simulated recordings)."""
NOISIEST = 1.0 / 30.0
"""Maximum standard deviation of a driver's noise, as part of its range. Motion that is faster than rows
resolve, of fewer than five rows a cycle, looks like more noise than that."""
LEAST_RANGE = 0.3
"""Maximum standard deviation of noise that is not stated, as part of a column's range. The range of 129
normal numbers was never less than 3.35 standard deviations (100,000 draws; 99.9 % lie above 3.7)."""

RESTS = 3
"""Minimum number of rows for which a switched column stays at one value, in three of four stretches. Random
flicker between two values of a readout stays for one row in half of them."""


def means_of(
    recording: Recording, columns: Mapping[str, np.ndarray], turns: np.ndarray, block: int
) -> dict[str, np.ndarray] | None:
    """Means over blocks of rows, or None where one of them would lie off the curve of its rows.

    Args:
        recording: original recording, which states noise and outputs.
        columns: its columns of shape (n,), NaN where there is no measurement.
        turns: rows at which a driver turns back, ascending.
        block: number of rows in a mean. Rows left over before a turn or the end make no mean.
    """
    count = len(recording)
    borders = np.unique(np.concatenate([[0], turns, [count]]))
    starts = np.concatenate([np.arange(a, b, block) for a, b in zip(borders[:-1], borders[1:], strict=True)])
    whole = np.diff(starts, append=count) == block
    whole[-1] = count - starts[-1] == block
    if whole.sum() < 3 or not all(
        _is_at_rest(recording, name, columns[name], starts) for name in moving_channels(columns)
    ):
        return None
    means = {name: _over(values, starts) for name, values in columns.items()}
    piece = np.searchsorted(borders, starts, side="right")[whole]
    found = {name: values[whole] for name, values in means.items()}
    outputs = [name for name in moving_channels(found) if name in predicted(recording)]
    return (
        found if all(_is_straight(recording, name, found[name], piece, block) for name in outputs) else None
    )


def averaged(columns: Mapping[str, np.ndarray], block: int) -> dict[str, np.ndarray]:
    """Means over blocks of rows. Missing samples of a block are left out.

    Args:
        columns: columns of shape (n,), NaN where missing.
        block: number of rows in a mean; the last block may have fewer.
    """
    starts = np.arange(0, len(next(iter(columns.values()))), block)
    return {name: _over(values, starts) for name, values in columns.items()}


def moving_channels(table: Mapping[str, np.ndarray]) -> list[str]:
    """Columns other than the clock and counts that take more than one value."""
    moving = [name for name, x in table.items() if np.isfinite(x).any() and np.nanmax(x) > np.nanmin(x)]
    return [name for name in moving if name not in ("time_s", "cycle")]


def range_of_noise(recording: Recording, name: str) -> float:
    """Range over which noise alone takes a column of a recording, in the column's unit.

    It is the range of that many independent normal numbers. An estimate of noise that is too large for that
    is not believed: motion that is faster than rows resolve looks like it. Where nobody states noise, a
    column that rests at one of a few values between switches has none. One that flickers between two or three
    values of its readout is nothing but noise.
    """
    noise, values = _noise(recording, name), recording.columns[name]
    reach = float(np.nanmax(values) - np.nanmin(values))
    if not recording.noise.get(name):
        levels, runs = _levels_and_runs(values)
        if len(levels) <= len(runs) / 2.0 + 1.0 and np.quantile(runs, 0.25) >= RESTS:
            return 0.0
        if len(levels) <= 3:
            return reach
        if noise > LEAST_RANGE * reach:
            return 0.0
    return 2.0 * np.sqrt(2.0 * np.log(len(values))) * noise


def _levels_and_runs(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct values of a column, and lengths of the stretches in which it stays at one."""
    finite = values[np.isfinite(values)]
    changes = np.flatnonzero(np.diff(finite)) + 1
    return np.unique(finite), np.diff(np.concatenate([[0], changes, [len(finite)]]))


def _over(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Means from each start to the next; NaN where all are missing."""
    finite = np.isfinite(values)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    counts = np.add.reduceat(finite.astype(float), starts)
    return np.where(counts > 0, total / np.maximum(counts, 1.0), np.nan)


def _is_at_rest(recording: Recording, name: str, values: np.ndarray, starts: np.ndarray) -> bool:
    """True if a channel stays within a small part of its range, and its noise, in every block.

    Single spikes are ignored: a mean of many rows hardly feels one.
    """
    rows = np.flatnonzero(np.isfinite(values))
    course = values[rows]
    if len(course) > 2:
        course = np.concatenate(
            [course[:1], np.median([course[:-2], course[1:-1], course[2:]], axis=0), course[-1:]]
        )
    first = np.searchsorted(rows, starts)
    first = np.unique(first[first < len(rows)])
    within = np.maximum.reduceat(course, first) - np.minimum.reduceat(course, first)
    reach, noise = float(np.ptp(course)), _noise(recording, name)
    if name not in predicted(recording) and noise > NOISIEST * reach:
        return False
    return bool(within.max() <= PART * reach + SCATTER * noise)


def _is_straight(recording: Recording, name: str, means: np.ndarray, piece: np.ndarray, block: int) -> bool:
    """True if means of an output lie on the curve of their rows, between the turns of a test.

    Args:
        recording: original recording.
        name: name of the output.
        means: means of whole blocks, shape (m,).
        piece: number of the stretch between turns that each lies in, shape (m,).
        block: number of rows in a mean.
    """
    together = (piece[2:] == piece[:-2]) & np.isfinite(np.diff(means, 2))
    if not together.any():
        return False
    off = float(np.max(np.abs(np.diff(means, 2))[together])) / 24.0  # f'' h^2 / 24 over a width h
    return off <= BENT * _noise(recording, name) / np.sqrt(block)


def _noise(recording: Recording, name: str) -> float:
    """Noise of a column in its own unit, as stated or as its readings show it."""
    stated = recording.noise.get(name)
    if stated:
        return float(stated)
    quantity = schema.quantity_and_unit(name)[0]
    values, si = recording.columns[name], recording.si(quantity)
    scale = float(np.nanmax(si) - np.nanmin(si))
    return noise_found(recording, quantity) * float(np.nanmax(values) - np.nanmin(values)) / scale
