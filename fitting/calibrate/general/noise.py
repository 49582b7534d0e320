"""Noise that nobody states, as the residuals of a fitted model tell it.

Readings of an output tell how much they jitter. They tell neither what noise of inputs adds, nor how long its
own errors last. The fast scatter of the residuals tells both. Slow misfit is hardly in it, so a law that
misses the recordings still does. A diagnosis judges by such noise, too (`with_noise_of` there): two commands
that judge one model by two noises would contradict each other.
"""

from collections.abc import Mapping, Sequence

import equinox as eqx
import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import unstated_noise
from fitting.inference.noise import FEW, robust_noise
from fitting.specimens import Rows
from fitting.specimens.reduction import chosen_readings, reduced
from fitting.specimens.rows import MOST_ROWS


def with_noise_of_residuals(
    recordings: Sequence[Recording], rows: Sequence[Rows], predicted: Sequence[Mapping[str, np.ndarray]]
) -> list[Rows]:
    """Recordings whose unstated noise is at least what the residuals of a model tell.

    Args:
        recordings: recordings as they were read, or reduced.
        rows: the same as arrays.
        predicted: outputs of the model in every recording, SI, (rows,) each, NaN without an answer.
    """
    return [_told(*parts) for parts in zip(recordings, rows, predicted, strict=True)]


def _told(recording: Recording, rows: Rows, predicted: Mapping[str, np.ndarray]) -> Rows:
    """One recording with the noise that its residuals tell.

    Rows that were chosen among more lie apart, so that slow misfit would pass for scatter. They tell nothing.
    """
    weights = {name: np.asarray(weight) for name, weight in rows.weight.items()}
    apart = chosen_readings(reduced(recording, MOST_ROWS)) is not None
    silent = [n for n in weights if n in predicted and recording.has(n) and not recording.noise_si(n)]
    for name in silent:
        there = (weights[name] > 0.0) & np.isfinite(predicted[name])
        residuals = np.asarray(rows.measured[name])[there] - np.asarray(predicted[name])[there]
        noise = 0.0 if apart else _noise_of(np.asarray(rows.time)[there], residuals)
        weights[name] = np.minimum(weights[name], 1.0 / noise) if noise > 0.0 else weights[name]
    return eqx.tree_at(lambda r: r.weight, rows, weights) if silent else rows


def _noise_of(time: np.ndarray, residuals: np.ndarray) -> float:
    """Standard deviation of a row, SI; 0 where too few rows tell it."""
    if len(residuals) < FEW:
        return 0.0
    return unstated_noise(residuals, robust_noise(time, residuals))[0]
