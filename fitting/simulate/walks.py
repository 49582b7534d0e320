"""Random walks behind readings: their filter, their smoother, and the most likely variances of their steps.

Readings stand in units of their noise, so that each has a variance of one. Predictions are linear in what
walks.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.numerics.lengths import fixed_length, going_on, lengthened
from pneusma_jax.numerics.linear import solve_small
from pneusma_jax.program_cache import stored_jit

PROCESS_NOISES = 10.0 ** np.arange(-9.0, 0.0, 1.0)
"""Candidate variances of a fraction's change [1/s], from a cold spring, which stays, to one heated in
seconds."""
OTHERS = 1e-4
"""Variance of the change of other springs' fractions while one is looked at [1/s]."""
FIRST = 1.0
"""Variance of a fraction before the first reading [1], when it is unknown."""
UNTIED = 1e12
"""Variance of a step that ties nothing [1]."""
LEAST = 1e-30
"""Least variance of a step [1], so that three of them have a determinant that is not rounded to zero."""


def along(slope: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Change of the readings with fractions, shape (rows, wired)."""
    return np.einsum("tij,tj->ti", slope, x)


def costs_of(
    time: np.ndarray, x: np.ndarray, missed: np.ndarray, process_noise: np.ndarray, cold: np.ndarray
) -> np.ndarray:
    """Half the weighted sum of squares of each row, shape (n,).

    It counts the readings' misfits, and half of each of the walk's two steps at the row. All are in standard
    deviations. The sum over all rows is that of the recording.

    Args:
        time: time [s], shape (n,).
        x: fractions [1], shape (n, m).
        missed: readings less predictions, in units of their noise, shape (n, m).
        process_noise: variance of each fraction's change before each row [1/s], shape (n, m).
        cold: true where a spring is cold; steps that end there are not of the walk. Shape (n, m).
    """
    steps, changes = np.diff(time)[:, None], np.where(cold[1:], 0.0, np.diff(x, axis=0))
    walked = 0.5 * np.sum(changes**2 / (process_noise[1:] * np.maximum(steps, 1e-9)), axis=1)
    costs = np.sum(missed**2, axis=1) + np.append(walked, 0.0) + np.insert(walked, 0, 0.0)
    costs[0] += np.sum(np.where(cold[0], 0.0, x[0] - 0.5) ** 2) / FIRST
    return 0.5 * costs


def process_noise_of(time: np.ndarray, target: np.ndarray, slope: np.ndarray, cold: np.ndarray) -> np.ndarray:
    """Most likely variance of each change of a fraction [1/s], one spring after the other, twice.

    Between rows it may change, at the cost of the logarithm of their number: a heated spring is held still
    afterwards. Shape (n, m).
    """
    longer = _with_silent_rows(time, (target, slope, cold))
    return np.asarray(_process_noise(*longer, np.log(len(time))))[: len(time)]


def cold_rows(time: np.ndarray, free: tuple, held: tuple, cold: np.ndarray, k: int) -> np.ndarray:
    """Rows in which a spring is most likely exactly cold, shape (n,).

    In each row it is either cold or walks with any of the process noises. Another state than before costs the
    logarithm of the number of rows.

    Args:
        time: time [s], ascending, shape (n,).
        free, held: targets and slopes about fractions that walk, and about those with this spring cold; see
            `smoothed`.
        cold: true where a spring is held cold, shape (n, m); that of spring `k` is not used.
        k: index of the spring.
    """
    length = fixed_length(len(time))
    (clock, *free), (_, *held) = (_with_silent_rows(time, given) for given in (free, held))
    (cold,) = lengthened((cold,), length)
    return np.asarray(_cold_rows(clock, tuple(free), tuple(held), cold, np.log(len(time)), k))[: len(time)]


def smoothed(
    time: np.ndarray,
    target: np.ndarray,
    slope: np.ndarray,
    process_noise: np.ndarray,
    cold: np.ndarray,
    held: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Rauch-Tung-Striebel smoother of random walks.

    Args:
        time: time [s], ascending, shape (n,).
        target: readings in units of their noise, shape (n, m).
        slope: slope of the readings over the fractions, shape (n, m, m).
        process_noise: variance of each fraction's change before each row [1/s], shape (n, m).
        cold: true where a spring is exactly cold, shape (n, m).
        held: fractions near which rows are held, shape (n, m), and with which precision [1], shape (n,).

    Returns:
        Fractions, shape (n, m), and the log-likelihoods of each row's readings, shape (n,); in held rows the
        holds count as readings.
    """
    near, precision = held or (np.zeros_like(target), np.zeros(len(time)))
    root = np.sqrt(precision)[:, None]
    target = np.concatenate([target, root * near], axis=1)
    slope = np.concatenate([slope, root[:, :, None] * np.eye(near.shape[1])], axis=1)
    longer = _with_silent_rows(time, (target, slope, process_noise, cold))
    means, evidence = (np.asarray(found) for found in _smoothed(*longer))
    return means[: len(time)], evidence[: len(time)]


def _with_silent_rows(time: np.ndarray, courses: tuple) -> tuple:
    """A clock and courses of a fixed length. The rows that are added say nothing: their slopes are zero."""
    length, rows = fixed_length(len(time)), len(time)
    target, slope, *others = lengthened(courses, length)
    target, slope = target.copy(), slope.copy()
    target[rows:], slope[rows:] = 0.0, 0.0
    return going_on(time, length), target, slope, *others


class _Filtered(NamedTuple):
    """What `_filtered` finds for several candidates side by side.

    Attributes:
        means, variances: of the fractions, shapes (n, candidates, m) and (n, candidates, m, m).
        evidence: log-likelihoods of each row's readings after all rows before, shape (n, candidates).
        score: their sum less the cost of changes between candidates, shape (candidates,).
        parents: candidate that each one went on from, shape (n, candidates).
    """

    means: Array
    variances: Array
    evidence: Array
    score: Array
    parents: Array


@stored_jit()
def _process_noise(time: Array, target: Array, slope: Array, cold: Array, change: Array) -> Array:
    """See `process_noise_of`; `change` is the cost of another variance [nat]."""
    rows, count = jnp.shape(cold)

    def one_spring(process_noise: Array, k: Array) -> tuple[Array, None]:
        trials = jnp.repeat(process_noise[:, None], len(PROCESS_NOISES), axis=1)
        trials = trials.at[:, :, k].set(PROCESS_NOISES)
        found = _filtered(time, target[:, None], slope[:, None], trials, cold[:, None], change)
        return process_noise.at[:, k].set(jnp.asarray(PROCESS_NOISES)[_likeliest(found)]), None

    order = jnp.tile(jnp.arange(count), 2)
    return jax.lax.scan(one_spring, jnp.full((rows, count), OTHERS), order)[0]


@stored_jit()
def _cold_rows(time: Array, free: tuple, held: tuple, cold: Array, change: Array, k: Array) -> Array:
    """See `cold_rows`."""
    noises = jnp.asarray([*PROCESS_NOISES, PROCESS_NOISES[0]])
    is_held = jnp.arange(len(noises)) == len(PROCESS_NOISES)
    target, slope = (
        jnp.where(jnp.expand_dims(is_held, range(1, jnp.ndim(a))), b[:, None], a[:, None])
        for a, b in zip(free, held, strict=True)
    )
    of_k = jnp.arange(cold.shape[1]) == k
    cold = jnp.where(of_k, is_held[:, None], cold[:, None])
    process_noise = jnp.where(of_k, noises[:, None], jnp.full((len(time), 1, 1), OTHERS))
    return is_held[_likeliest(_filtered(time, target, slope, process_noise, cold, change))]


def _likeliest(found: _Filtered) -> Array:
    """The likeliest way through candidates (Viterbi): one for each row, shape (n,)."""
    back = lambda way, parents: (parents[way], way)  # noqa: E731
    return jax.lax.scan(back, jnp.argmax(found.score), found.parents, reverse=True)[1]


@stored_jit()
def _smoothed(
    time: Array, target: Array, slope: Array, process_noise: Array, cold: Array
) -> tuple[Array, Array]:
    """See `smoothed`."""
    alone = (x[:, None] for x in (target, slope, process_noise, cold))
    found = _filtered(time, *alone, jnp.inf)
    means, variances = found.means[:, 0], found.variances[:, 0]
    grown = process_noise[1:] * jnp.diff(time)[:, None] + jnp.where(cold[1:], UNTIED, 0.0) + LEAST

    def back(later: Array, row: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        mean, variance, step = row
        smooth = mean + variance @ solve_small(variance + jnp.diag(step), later - mean)
        return smooth, smooth

    _, smooth = jax.lax.scan(back, means[-1], (means[:-1], variances[:-1], grown), reverse=True)
    return jnp.concatenate([smooth, means[-1:]]), found.evidence[:, 0]


def _filtered(
    time: Array, target: Array, slope: Array, process_noise: Array, cold: Array, change: Array | float
) -> _Filtered:
    """Kalman filter of random walks, for several candidates of their variances side by side.

    Args:
        time: see `smoothed`.
        target, slope, cold: see `smoothed`, with an axis of one or all candidates after the first one.
        process_noise: variance of each fraction's change before each row [1/s], shape (n, candidates, m).
        change: cost of going on with another candidate [nat]; infinite if none does.
    """
    _, several, count = jnp.shape(process_noise)
    own, unit = jnp.arange(several), jnp.eye(count)

    def row(carry: tuple, at: tuple) -> tuple[tuple, tuple]:
        (mean, variance, score), (step, ohms, tangents, process_noise, cold) = carry, at
        best = jnp.argmax(score)
        from_ = jnp.where(score[best] - change > score, best, own)
        mean, score = mean[from_], jnp.maximum(score, score[best] - change)
        variance = variance[from_] + (process_noise * step)[:, :, None] * unit
        mean = jnp.where(cold, 1.0, mean)
        variance = variance * (~cold[:, :, None] & ~cold[:, None, :])
        evidence = jnp.zeros(several)
        for k in range(tangents.shape[1]):  # the readings of one row, at most six
            reach = jnp.sum(variance * tangents[:, k, None, :], axis=2)
            spread = jnp.sum(reach * tangents[:, k], axis=1) + 1.0
            surprise = ohms[:, k] - jnp.sum(mean * tangents[:, k], axis=1)
            mean = mean + (surprise / spread)[:, None] * reach
            variance = variance - reach[:, :, None] * (reach / spread[:, None])[:, None, :]
            evidence = evidence - 0.5 * (surprise**2 / spread + jnp.log(spread))
        score = score + evidence
        return (mean, variance, score), (mean, variance, evidence, from_)

    begin = jnp.full((several, count), 0.5), jnp.tile(FIRST * unit, (several, 1, 1)), jnp.zeros(several)
    rows = jnp.diff(time, prepend=time[:1]), target, slope, process_noise, cold
    (_, _, score), (means, variances, evidence, parents) = jax.lax.scan(row, begin, rows)
    return _Filtered(means, variances, evidence, score, parents)
