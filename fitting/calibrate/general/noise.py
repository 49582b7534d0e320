"""Noise that nobody states, as the residuals of a fitted model tell it.

Readings of an output tell how much they jitter. They tell neither what noise of inputs adds, nor how long its
own errors last. The fast scatter of the residuals tells both. Slow misfit is hardly in it, so a law that
misses the recordings still does. A diagnosis judges by such noise, too (`with_noise_of` there): two commands
that judge one model by two noises would contradict each other.
"""

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import equinox as eqx
import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import unstated_noise_of_several
from fitting.inference.noise import robust_noise
from fitting.specimens import Rows
from fitting.specimens.reduction import chosen_readings, reduced
from fitting.specimens.rows import CLEAN, MOST_ROWS, with_extra

FEWEST = 12
"""Minimum number of rows of a recording that tell a noise."""


@dataclass(frozen=True)
class _Residuals:
    """Residuals of an output of one recording, in which its instrument's noise and that of inputs are even.

    Attributes:
        residuals: over the shape of their noise, whose mean square keeps the instrument's part, SI, (rows,).
        white: standard deviation of their fast scatter, as if it were white, SI.
        inputs: mean variance by the noise of inputs, SI.
    """

    residuals: np.ndarray
    white: float
    inputs: float


def with_noise_of_residuals(
    recordings: Sequence[Recording],
    rows: Sequence[Rows],
    predict: Callable[[], Sequence[Mapping[str, np.ndarray]]],
) -> Sequence[Rows]:
    """Recordings whose unstated noise is at least what the residuals of a model tell.

    An output has its own noise, alike in all rows, and that of inputs, which follows the slope of the model.
    What residuals tell beyond the second is the first. Zeros of instruments are sized by the two apart.

    Recordings of an output tell one noise, or one each where they clearly differ
    (`fitting.inference.partial_pooling`). Fitted ones are judged among themselves. Those for validation are
    judged among all, since they change no fit. Rows that were chosen among more lie apart, and slow misfit
    would pass for scatter. So such recordings are not asked. They have the noise of the others, or the
    geometric mean of theirs.

    Args:
        recordings: recordings as they were read, or reduced.
        rows: the same as arrays.
        predict: gives outputs of the model in every recording, SI, (rows,) each, NaN without an answer. It is
            called only where a noise is not stated.
    """
    if not any(_unstated(recording, one) for recording, one in zip(recordings, rows, strict=True)):
        return rows
    predicted = predict()
    told: dict[str, dict[int, _Residuals]] = {}
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


def _sizes(told: Mapping[int, _Residuals], fitted: AbstractSet[int], count: int) -> np.ndarray:
    """Standard deviation of one output in every recording, shape (count,); 0 where nothing tells it.

    Args:
        told: residuals of the recordings that tell a noise, by number.
        fitted: numbers of the recordings that are fitted.
        count: number of recordings.
    """
    found, tests = np.zeros(count), sorted(set(told) & fitted)
    if not tests:
        return found
    sizes = _of(told, tests)
    found[:] = sizes[0] if np.ptp(sizes) == 0.0 else np.exp(np.mean(np.log(sizes)))
    found[tests] = sizes
    every = sorted(told)
    among_all = _of(told, every)
    for k, size in zip(every, among_all, strict=True) if np.ptp(among_all) > 0.0 else ():
        if k not in fitted:
            found[k] = size
    return found


def _of(told: Mapping[int, _Residuals], chosen: Sequence[int]) -> np.ndarray:
    """Standard deviations of an output in some recordings, judged among themselves."""
    each = [told[k] for k in chosen]
    return unstated_noise_of_several(
        [one.residuals for one in each], [one.white for one in each], [one.inputs for one in each]
    )


def _unstated(recording: Recording, rows: Rows) -> list[str]:
    """Outputs of a recording whose noise nobody states."""
    return [n for n in rows.weight if recording.has(n) and not recording.noise_si(n)]


def _silent(recording: Recording, rows: Rows, predicted: Mapping[str, np.ndarray]) -> list[str]:
    """Outputs of a recording that the model predicts and whose noise nobody states."""
    return [n for n in _unstated(recording, rows) if n in predicted]


def _residuals(rows: Rows, name: str, predicted: np.ndarray) -> _Residuals | None:
    """Residuals of an output that count; None where there are few."""
    weight = np.asarray(rows.weight[name])
    there = (weight > 0.0) & np.isfinite(predicted)
    if there.sum() < FEWEST:
        return None
    shape = 1.0 / weight[there]
    shape *= np.sqrt(np.mean(shape**-2.0))
    residuals = (np.asarray(rows.measured[name])[there] - np.asarray(predicted)[there]) / shape
    inputs = float(np.mean(_by_inputs(rows, name)[there] / shape**2))
    return _Residuals(residuals, robust_noise(np.asarray(rows.time)[there], residuals), inputs)


def _by_inputs(rows: Rows, name: str) -> np.ndarray:
    """Variance of an output by the noise of inputs, SI, shape (rows,); 0 in rows that do not count."""
    weight, clean = np.asarray(rows.weight[name]), np.asarray(rows.extra.get(CLEAN, rows.weight)[name])
    counts = (weight > 0.0) & (clean > 0.0)
    whole, own = (1.0 / np.where(counts, x, 1.0) ** 2 for x in (weight, clean))
    return np.maximum(whole - own, 0.0)


def _with_at_least(rows: Rows, sizes: Mapping[str, float]) -> Rows:
    """One recording with at least these standard deviations of its outputs; itself where none counts.

    Args:
        rows: the recording.
        sizes: standard deviations without the noise of inputs, SI, by output.
    """
    sizes = {name: size for name, size in sizes.items() if size > 0.0}
    if not sizes:
        return rows
    known = rows.extra.get(CLEAN, {})
    least = {n: np.minimum(np.asarray(known.get(n, rows.weight[n])), 1.0 / size) for n, size in sizes.items()}
    weights = {n: own / np.sqrt(1.0 + own**2 * _by_inputs(rows, n)) for n, own in least.items()}
    found = eqx.tree_at(lambda r: r.weight, rows, {**rows.weight, **weights})
    return with_extra(found, **{CLEAN: {**known, **least}}) if known else found
