"""Readings that stand apart from their neighbours: a lost marker, a spike of a load cell, no physics.

They are told by what the refitted base model leaves, whatever else it leaves: one row that is far from the
rows on both sides, which agree. Where the model itself bends as much, a delay would leave such a row, too,
and at the turn of a load so would anything that goes with it.
"""

from dataclasses import dataclass, replace

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import Channel
from fitting.inference.noise import GAUSSIAN_MAD

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..settings import DEFAULT

OUTLIERS = DEFAULT.outliers


@dataclass(frozen=True)
class Outliers:
    """Readings that are not counted.

    Attributes:
        recording: its name.
        quantity: output.
        times: of the rows, s (numbers of rows without a clock), ascending.
        distance: of the farthest one, in 1-sigmas of the noise.
    """

    recording: str
    quantity: str
    times: tuple[float, ...]
    distance: float

    @property
    def text(self) -> str:
        """For a report."""
        at = [f"{t:.4g}" for t in self.times[: OUTLIERS.maximum_told]] + ["..."] * (
            len(self.times) > OUTLIERS.maximum_told
        )
        return (
            f"{self.recording}: not counted, for far from the readings on both sides (by up to "
            f"{self.distance:.0f} standard deviations): {self.quantity} at {', '.join(at)} s"
        )


def without_outliers(program: Program, here: Evaluation) -> Program:
    """The program without readings that stand apart from what a fitted base model leaves beside them.

    A resistance that latent trajectories follow is left as it is: where they cannot follow, a row says
    nothing.

    Args:
        program: of the campaign; left alone.
        here: the fitted model.
    """
    found = []
    bare, channels = ([list(row) for row in rows] for rows in (program.bare, program.channels))
    for k, recording in enumerate(program.recordings):
        for j, channel in enumerate(program.channels[k]):
            if program.follows(channel.quantity):
                continue
            rows, far = outliers_of(channel, here.predicted[k][j])
            if len(recording) == np.asarray(program.stacked.mask)[k].sum():
                rows = among_readings(recording, channel, rows)
            if not rows.size:
                continue
            times = np.asarray(program.stacked.time)[k][rows]
            found.append(Outliers(recording.name, channel.quantity, tuple(float(t) for t in times), far))
            for kept in (bare, channels):
                sigma = kept[k][j].sigma.copy()
                sigma[rows] = np.inf
                kept[k][j] = replace(kept[k][j], sigma=sigma)
    apart = *program.apart, *found
    return replace(program, bare=bare, channels=channels, apart=apart) if found else program


def among_readings(recording: Recording, channel: Channel, rows: np.ndarray) -> np.ndarray:
    """Of rows that stand apart those that do so among the readings of a recording of which rows were kept:
    rows that lie further apart than readings differ by more.

    Args:
        recording: the one that was fitted.
        channel: of it.
        rows: that stand apart.
    """
    if not recording.reduction or recording.reduction.rows is None:
        return rows
    values = recording.whole.si(channel.quantity)
    there = np.flatnonzero(np.isfinite(values))
    far, apart = (np.zeros(len(values)) for _ in range(2))
    far[there], apart[there] = _beside(values[there])
    kept = recording.reduction.rows[rows]
    return rows[
        (far[kept] > OUTLIERS.minimum_distance * channel.sigma[rows])
        & (apart[kept] < far[kept] / OUTLIERS.neighbour_factor)
    ]


def outliers_of(channel: Channel, predicted: np.ndarray) -> tuple[np.ndarray, float]:
    """Rows of a channel that stand apart, and how far the farthest one does, in 1-sigmas.

    Args:
        channel: of one recording.
        predicted: by a fitted model, SI, (rows,), NaN where it has no answer.
    """
    there = np.flatnonzero(np.isfinite(channel.sigma) & np.isfinite(predicted))
    if len(there) < OUTLIERS.minimum_readings:
        return there[:0], 0.0
    sigma, course = channel.sigma[there], predicted[there]
    far, apart = _beside((channel.measured[there] - course) / sigma)
    bends = np.pad(np.abs(np.diff(course, 2)), 2) / np.pad(sigma, 1, "edge")
    bends = np.lib.stride_tricks.sliding_window_view(bends, 3).max(axis=1)
    usual = np.median(far) / GAUSSIAN_MAD
    odd = (
        (far > max(OUTLIERS.minimum_distance, OUTLIERS.minimum_relative_distance * usual))
        & (apart < far / OUTLIERS.neighbour_factor)
        & (far > OUTLIERS.bend_factor * bends)
    )
    if not odd.any() or odd.sum() > max(OUTLIERS.maximum_share * len(there), 1.0):
        return there[:0], 0.0
    return there[odd], float(far[odd].max())


def _beside(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far every value is from those on both sides, and how far these are from each other, but for one on
    either end, which may stand apart itself; both (values,). The first and last few are near."""
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * OUTLIERS.neighbours + 1)
    beside = np.sort(np.delete(windows, OUTLIERS.neighbours, axis=1), axis=1)
    far = np.abs(windows[:, OUTLIERS.neighbours] - np.median(beside, axis=1))
    return np.pad(far, OUTLIERS.neighbours), np.pad(beside[:, -2] - beside[:, 1], OUTLIERS.neighbours)
