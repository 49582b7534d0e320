"""Outliers: single readings far from their neighbours, such as a lost marker or a spike of a load cell.

An outlier is a residual far from those on both sides, while these agree with each other. A row where the
model itself bends as much is no outlier, because a delay leaves the same there.
"""

from dataclasses import dataclass, replace

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import Channel
from fitting.inference.noise import GAUSSIAN_MAD

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..settings import DEFAULT

CHANCE = DEFAULT.chance
LISTS = DEFAULT.lists
NOISE = DEFAULT.noise
SHARE = DEFAULT.share
VALUES = DEFAULT.values


@dataclass(frozen=True)
class Outliers:
    """Readings that are not counted.

    Attributes:
        recording: its name.
        quantity: output.
        times: times of the rows [s] (numbers of rows without a clock), ascending.
        distance: distance of the farthest one, in 1-sigmas of the noise.
    """

    recording: str
    quantity: str
    times: tuple[float, ...]
    distance: float

    @property
    def text(self) -> str:
        """Sentence for a report."""
        at = [f"{t:.4g}" for t in self.times[: LISTS.told]] + ["..."] * (
            len(self.times) > LISTS.told
        )
        return (
            f"{self.recording}: not counted, for far from the readings on both sides (by up to "
            f"{self.distance:.0f} standard deviations): {self.quantity} at {', '.join(at)} s"
        )


def without_outliers(program: Program, here: Evaluation) -> Program:
    """The program without outliers about a fitted base model.

    A resistance that latent trajectories follow is left as it is. Those that the program is without already
    stay so, and count towards what may be left out of a recording.

    Args:
        program: program of the campaign; it is not changed.
        here: the fitted model.
    """
    found = {(one.recording, one.quantity): one for one in program.outliers}
    bare, channels = ([list(row) for row in rows] for rows in (program.bare, program.channels))
    for k, recording in enumerate(program.recordings):
        for j, channel in enumerate(program.channels[k]):
            if program.follows(channel.quantity):
                continue
            clock = np.asarray(program.stacked.time)[k]
            key = recording.name, channel.quantity
            times, farthest = (found[key].times, found[key].distance) if key in found else ((), 0.0)
            rows, far = outliers_of(channel, here.predicted[k][j], clock, len(times))
            if len(recording) == np.asarray(program.stacked.mask)[k].sum():
                rows = among_readings(recording, channel, rows)
            if not rows.size:
                continue
            times = tuple(sorted({*times, *map(float, clock[rows])}))
            found[key] = Outliers(*key, times, max(far, farthest))
            for kept in (bare, channels):
                sigma = kept[k][j].sigma.copy()
                sigma[rows] = np.inf
                kept[k][j] = replace(kept[k][j], sigma=sigma)
    apart = tuple(found.values())
    if apart == tuple(program.outliers):
        return program
    return replace(program, bare=bare, channels=channels, outliers=apart)


def among_readings(recording: Recording, channel: Channel, rows: np.ndarray) -> np.ndarray:
    """Outliers among kept rows that are outliers among all readings, too.

    Kept rows lie further apart in time, so they differ by more than neighbouring readings.

    Args:
        recording: the one that was fitted.
        channel: channel of the recording.
        rows: rows of the outliers.
    """
    if not recording.reduction or recording.reduction.rows is None:
        return rows
    values = recording.whole.si(channel.quantity)
    there = np.flatnonzero(np.isfinite(values))
    far, apart = (np.zeros(len(values)) for _ in range(2))
    far[there], apart[there] = _beside(values[there])
    kept = recording.reduction.rows[rows]
    return rows[
        (far[kept] > CHANCE.outlier * channel.sigma[rows])
        & (far[kept] > CHANCE.deviations * apart[kept])
    ]


def outliers_of(
    channel: Channel, predicted: np.ndarray, clock: np.ndarray, before: int = 0
) -> tuple[np.ndarray, float]:
    """Rows of a channel that are outliers, and the distance of the farthest one, in 1-sigmas.

    Args:
        channel: channel of one recording.
        predicted: predictions of a fitted model, SI, (rows,), NaN where it has no answer.
        clock: times of the rows [s] (numbers of rows without a clock), (rows,). A missing row is no bend.
        before: number of the channel's outliers that are left out already.
    """
    there = np.flatnonzero(np.isfinite(channel.sigma) & np.isfinite(predicted))
    if len(there) < VALUES.minimum:
        return there[:0], 0.0
    sigma, curve = channel.sigma[there], predicted[there]
    far, apart = _beside((channel.measured[there] - curve) / sigma)
    bends = np.pad(_bends(curve, clock[there]), 2) / np.pad(sigma, 1, "edge")
    bends = np.lib.stride_tricks.sliding_window_view(bends, 3).max(axis=1)
    usual = max(1.0, np.median(far) / GAUSSIAN_MAD)
    odd = far > CHANCE.outlier * usual
    odd &= far > CHANCE.deviations * np.maximum(apart, bends)
    if not odd.any() or before + odd.sum() > max(SHARE.outliers * (before + len(there)), 1.0):
        return there[:0], 0.0
    return there[odd], float(far[odd].max())


def _bends(curve: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """How far a curve bends at every row but the first and the last: its second difference at equal steps.

    Elsewhere it is twice the distance from the line through the rows on both sides.
    """
    before, after = np.diff(clock)[:-1], np.diff(clock)[1:]
    both = before + after
    share = np.where(both > 0.0, before / np.where(both > 0.0, both, 1.0), 0.5)
    return np.abs(2.0 * ((1.0 - share) * curve[:-2] + share * curve[2:] - curve[1:-1]))


def _beside(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of every value from those on both sides, and the spread of these; both (values,).

    One neighbour on either end does not count for the spread, for it may be an outlier itself. Both are zero
    for the first and last few values.
    """
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * NOISE.neighbours + 1)
    beside = np.sort(np.delete(windows, NOISE.neighbours, axis=1), axis=1)
    far = np.abs(windows[:, NOISE.neighbours] - np.median(beside, axis=1))
    return np.pad(far, NOISE.neighbours), np.pad(beside[:, -2] - beside[:, 1], NOISE.neighbours)
