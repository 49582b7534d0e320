"""Noise that nobody states, as the residuals of a fitted model tell it.

Readings of an output tell how much they jitter. They tell neither what noise of inputs adds, nor how long its
own errors last. The fast scatter of the residuals tells both. Slow misfit is hardly in it, so a law that
misses the recordings still does. A diagnosis judges by such noise, too (`with_noise_of` there): two commands
that judge one model by two noises would contradict each other.
"""

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet

import equinox as eqx
import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import unstated_noise_of_several
from fitting.inference.noise import robust_noise
from fitting.specimens import Rows
from fitting.specimens.reduction import chosen_readings, reduced
from fitting.specimens.rows import MOST_ROWS

FEWEST = 12
"""Minimum number of rows of a recording that tell a noise."""


def with_noise_of_residuals(
    recordings: Sequence[Recording],
    rows: Sequence[Rows],
    predict: Callable[[], Sequence[Mapping[str, np.ndarray]]],
) -> Sequence[Rows]:
    """Recordings whose unstated noise is at least what the residuals of a model tell.

    Recordings of an output tell one noise, or one each where they clearly differ
    (`fitting.inference.partial_pooling`). Fitted ones are judged among themselves. Those for validation are
    judged among all, since they change no fit. Rows that were chosen among more lie apart, and slow misfit
    would pass for scatter. So such recordings are not asked. They have the noise of the others, where that
    is one.

    Args:
        recordings: recordings as they were read, or reduced.
        rows: the same as arrays.
        predict: gives outputs of the model in every recording, SI, (rows,) each, NaN without an answer. It is
            called only where a noise is not stated.
    """
    if not any(_unstated(recording, one) for recording, one in zip(recordings, rows, strict=True)):
        return rows
    predicted = predict()
    told: dict[str, dict[int, tuple[np.ndarray, float]]] = {}
    for k, (recording, one, found) in enumerate(zip(recordings, rows, predicted, strict=True)):
        if chosen_readings(reduced(recording, MOST_ROWS)) is None:
            for name in _silent(recording, one, found):
                if residuals := _residuals(one, name, found[name]):
                    told.setdefault(name, {})[k] = residuals
    fitted = {k for k, recording in enumerate(recordings) if recording.role == "fit"}
    sizes = {name: _sizes(each, fitted, len(rows)) for name, each in told.items()}
    return [
        _with_at_least(one, {n: sizes[n][k] for n in _silent(recording, one, found) if n in sizes})
        for k, (recording, one, found) in enumerate(zip(recordings, rows, predicted, strict=True))
    ]


def _sizes(told: Mapping[int, tuple[np.ndarray, float]], fitted: AbstractSet[int], count: int) -> np.ndarray:
    """Standard deviation of one output in every recording, shape (count,); 0 where nothing tells it.

    Args:
        told: residuals and the size of their white noise, of the recordings that tell them, by number.
        fitted: numbers of the recordings that are fitted.
        count: number of recordings.
    """
    found, tests = np.zeros(count), sorted(set(told) & fitted)
    if not tests:
        return found
    sizes = _of(told, tests)
    found[:] = sizes[0] if np.ptp(sizes) == 0.0 else 0.0
    found[tests] = sizes
    every = sorted(told)
    among_all = _of(told, every)
    for k, size in zip(every, among_all, strict=True) if np.ptp(among_all) > 0.0 else ():
        if k not in fitted:
            found[k] = size
    return found


def _of(told: Mapping[int, tuple[np.ndarray, float]], chosen: Sequence[int]) -> np.ndarray:
    """Standard deviations of an output in some recordings, judged among themselves."""
    return unstated_noise_of_several(*zip(*(told[k] for k in chosen), strict=True))


def _unstated(recording: Recording, rows: Rows) -> list[str]:
    """Outputs of a recording whose noise nobody states."""
    return [n for n in rows.weight if recording.has(n) and not recording.noise_si(n)]


def _silent(recording: Recording, rows: Rows, predicted: Mapping[str, np.ndarray]) -> list[str]:
    """Outputs of a recording that the model predicts and whose noise nobody states."""
    return [n for n in _unstated(recording, rows) if n in predicted]


def _residuals(rows: Rows, name: str, predicted: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Residuals of an output that count, and the size of their white noise, SI; None where there are few."""
    there = (np.asarray(rows.weight[name]) > 0.0) & np.isfinite(predicted)
    if there.sum() < FEWEST:
        return None
    residuals = np.asarray(rows.measured[name])[there] - np.asarray(predicted)[there]
    return residuals, robust_noise(np.asarray(rows.time)[there], residuals)


def _with_at_least(rows: Rows, sizes: Mapping[str, float]) -> Rows:
    """One recording with at least these standard deviations of its outputs, SI; itself where none counts."""
    sizes = {name: size for name, size in sizes.items() if size > 0.0}
    if not sizes:
        return rows
    least = {name: np.minimum(np.asarray(rows.weight[name]), 1.0 / size) for name, size in sizes.items()}
    return eqx.tree_at(lambda r: r.weight, rows, {**rows.weight, **least})
