"""Random walks and ramps behind readings: their kinds, the fractions behind them, and the evidence.

A fraction is held still, walks, or goes on as it went before (a ramp). Readings stand in units of their
noise, so that each has a variance of one. Predictions are linear in the fractions.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.late import Late
from pneusma_jax.numerics.lengths import fixed_length, going_on, lengthened
from pneusma_jax.program_cache import stored_jit

linalg = Late("scipy.linalg")

PROCESS_NOISES = 10.0 ** np.arange(-9.0, 0.0, 1.0)
"""Candidate variances of a fraction's change [1/s], from a cold spring, which stays, to one heated in
seconds."""
RAMP_NOISES = 10.0 ** np.arange(-9.0, -2.0, 1.0)
"""Candidate variances of the difference between a fraction's change and the one before [1/s]."""
CORNERS_KEPT = 4
"""Number of rows for which a filter keeps a corner although a later one seems likelier, to show its ramp."""
NOISES = np.concatenate([PROCESS_NOISES, RAMP_NOISES, np.repeat(RAMP_NOISES, CORNERS_KEPT)])
"""Variances of all kinds of steps [1/s]: of walks, of ramps that go on, of ramps that begin with a corner."""
RAMPS = np.arange(len(NOISES)) >= len(PROCESS_NOISES)
"""True for kinds of steps that go on as before."""
CORNERS = np.arange(len(NOISES)) >= len(PROCESS_NOISES) + len(RAMP_NOISES)
"""True for kinds whose first step may have any size."""
BEGINS_IN = np.where(CORNERS, np.arange(len(NOISES)) % CORNERS_KEPT, -1)
"""Row, modulo `CORNERS_KEPT`, in which a kind may begin; -1 for any."""
CORNER = 1e-3
"""Variance of a step that may have any size [1/s]: 0.03 in a second, as a strong current heats."""
OTHERS = int(np.argmin(np.abs(np.log(PROCESS_NOISES / 1e-4))))
"""Kind of the steps of other springs' fractions while one is looked at: the walk of 1e-4 1/s."""
FIRST = 1.0
"""Variance of a fraction before the first reading [1], when it is unknown."""
SHORTEST = 1e-9
"""Least time between rows [s], so that none has a variance of zero."""


def linear_readings(slope: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Readings that slopes give for fractions, or their change for a change of fractions, shape (n, m).

    Args:
        slope: slope of the readings over the fractions, shape (n, m, m): rows, readings, fractions.
        x: fractions, or a change of them [1], shape (n, m).
    """
    return np.einsum("tij,tj->ti", slope, x)


def _steps_and_ratios(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times between rows [s], shape (n - 1,), and their ratios to the one before [1], 0 for the first."""
    step = np.maximum(np.diff(time), SHORTEST)
    return step, np.insert(step[1:] / step[:-1], 0, 0.0)


def _variances(kind: np.ndarray, cold: np.ndarray) -> np.ndarray:
    """Variance of the step to each row but the first [1/s], shape (n - 1, m)."""
    begins = (kind[1:] != kind[:-1]) | cold[:-1]
    return np.where(begins & CORNERS[kind[1:]], CORNER, NOISES[kind[1:]])


def costs_of(
    time: np.ndarray, x: np.ndarray, missed: np.ndarray, kind: np.ndarray, cold: np.ndarray
) -> np.ndarray:
    """Half the weighted sum of squares of each row, shape (n,).

    It counts the readings' misfits, and half of each of the two steps at the row. All are in standard
    deviations. The sum over all rows is that of the recording.

    Args:
        time: time [s], shape (n,).
        x: fractions [1], shape (n, m).
        missed: readings less predictions, in units of their noise, shape (n, m).
        kind: kind of the step to each row, an index into `NOISES`, shape (n, m).
        cold: true where a spring is cold; steps that end there are not counted. Shape (n, m).
    """
    step, ratio = _steps_and_ratios(time)
    changes = np.diff(x, axis=0)
    before = np.concatenate([np.zeros_like(x[:1]), changes[:-1]])
    unlike = np.where(cold[1:], 0.0, changes - RAMPS[kind[1:]] * ratio[:, None] * before)
    walked = 0.5 * np.sum(unlike**2 / (_variances(kind, cold) * step[:, None]), axis=1)
    costs = np.sum(missed**2, axis=1) + np.append(walked, 0.0) + np.insert(walked, 0, 0.0)
    costs[0] += np.sum(np.where(cold[0], 0.0, x[0] - 0.5) ** 2) / FIRST
    return 0.5 * costs


def kinds_of(time: np.ndarray, target: np.ndarray, slope: np.ndarray, cold: np.ndarray) -> np.ndarray:
    """Most likely kind of each step, one spring after the other, twice; shape (n, m).

    Between rows it may change, at the cost of the logarithm of their number: a heated spring is held still
    afterwards.
    """
    longer = _with_silent_rows(time, (target, slope, cold))
    return np.asarray(_kinds(*longer, np.log(len(time))))[: len(time)]


def cold_rows(time: np.ndarray, free: tuple, at_cold: tuple, cold: np.ndarray, k: int) -> np.ndarray:
    """Rows in which a spring is most likely exactly cold, shape (n,).

    In each row it is either cold or takes a step of any kind. Another state than before costs the logarithm
    of the number of rows.

    Args:
        time: time [s], ascending, shape (n,).
        free, at_cold: targets and slopes of the readings, linearised about fractions that walk and about the
            same with this spring cold; see `smoothed`.
        cold: true where a spring is held cold, shape (n, m); that of spring `k` is not used.
        k: index of the spring.
    """
    length = fixed_length(len(time))
    (clock, *free), (_, *at_cold) = (_with_silent_rows(time, given) for given in (free, at_cold))
    (cold,) = lengthened((cold,), length)
    return np.asarray(_cold_rows(clock, tuple(free), tuple(at_cold), cold, np.log(len(time)), k))[: len(time)]


def smoothed(
    time: np.ndarray,
    target: np.ndarray,
    slope: np.ndarray,
    kind: np.ndarray,
    cold: np.ndarray,
    held: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, float]:
    """Likeliest fractions behind linear readings, all rows together, and the logarithm of their evidence.

    Args:
        time: time [s], ascending, shape (n,).
        target: readings in units of their noise, shape (n, m).
        slope: slope of the readings over the fractions, shape (n, m, m).
        kind: kind of the step to each row, shape (n, m).
        cold: true where a spring is exactly cold, shape (n, m).
        held: fractions near which rows are held, shape (n, m), and with which precision [1], shape (n,).

    Returns:
        Fractions, shape (n, m), and the log-likelihood of all readings less its constant. Where rows are held
        the latter means nothing, since holds sharpen the fractions and are no readings.
    """
    free = ~cold
    step, ratio = _steps_and_ratios(time)
    weight = np.where(free[1:], 1.0 / (_variances(kind, cold) * step[:, None]), 0.0)
    gain = RAMPS[kind[1:]] * ratio[:, None]
    own, next_, second, right = _normal_equations(target, slope, weight, gain, cold, held)
    factor = linalg.cholesky_banded(_banded(own, next_, second))
    x = linalg.cho_solve_banded((factor, False), right.ravel()).reshape(cold.shape)
    missed = target - linear_readings(slope, x)
    spread = np.sum(np.log(weight[weight > 0.0])) - np.sum(free[0]) * np.log(FIRST)
    evidence = 0.5 * spread - np.sum(np.log(factor[-1])) - np.sum(costs_of(time, x, missed, kind, cold))
    return x, float(evidence)


def _normal_equations(
    target: np.ndarray,
    slope: np.ndarray,
    weight: np.ndarray,
    gain: np.ndarray,
    cold: np.ndarray,
    held: tuple[np.ndarray, np.ndarray] | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Normal equations of `smoothed`, in which a cold fraction has the solution 1.

    Args:
        target, slope, cold, held: as of `smoothed`.
        weight: precision of the step to each row but the first, 0 to a cold one, shape (n - 1, m).
        gain: part of the step before with which a step goes on, 0 for a walk, shape (n - 1, m).

    Returns:
        Blocks of the precision: of a row, shape (n, m, m), of a row and the next, and of a row and the one
        after it, each diagonal, shape (n, m). And the right side, shape (n, m).
    """
    rows, count = cold.shape
    free = ~cold
    own = np.einsum("tij,tik->tjk", slope, slope)
    right = np.einsum("tij,ti->tj", slope, target)
    diagonal, next_, second = np.zeros((rows, count)), np.zeros((rows, count)), np.zeros((rows, count))
    diagonal[0] += free[0] / FIRST
    right[0] += 0.5 * free[0] / FIRST
    diagonal[1:] += weight
    diagonal[:-1] += weight * (1.0 + gain) ** 2
    diagonal[:-2] += weight[1:] * gain[1:] ** 2
    next_[:-1] -= weight * (1.0 + gain)
    next_[:-2] -= weight[1:] * gain[1:] * (1.0 + gain[1:])
    second[:-2] += weight[1:] * gain[1:]
    if held is not None:
        near, precision = held
        diagonal += precision[:, None]
        right += precision[:, None] * near
    own += diagonal[:, :, None] * np.eye(count)
    # cold fractions are known: what they pull goes to the right side
    known = cold.astype(float)
    pull = np.einsum("tjk,tk->tj", own, known)
    pull[:-1] += next_[:-1] * known[1:]
    pull[1:] += next_[:-1] * known[:-1]
    pull[:-2] += second[:-2] * known[2:]
    pull[2:] += second[:-2] * known[:-2]
    right = np.where(cold, 1.0, right - pull)
    own = np.where(free[:, :, None] & free[:, None, :], own, np.eye(count) * cold[:, :, None])
    next_[:-1] *= free[:-1] & free[1:]
    second[:-2] *= free[:-2] & free[2:]
    return own, next_, second, right


def _banded(own: np.ndarray, next_: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Blocks of `_normal_equations` in the upper form of `cholesky_banded`, shape (2 m + 1, n m)."""
    rows, count = next_.shape
    banded = np.zeros((2 * count + 1, rows * count))  # upper diagonals, the outermost first
    for offset in range(count):
        for j in range(offset, count):
            banded[2 * count - offset, j::count] += own[:, j - offset, j]
    banded[count, count:] += next_[:-1].ravel()
    banded[0, 2 * count :] += second[:-2].ravel()
    return banded


def _with_silent_rows(time: np.ndarray, courses: tuple) -> tuple:
    """A clock and courses of a fixed length. The rows that are added say nothing: their slopes are zero."""
    length, rows = fixed_length(len(time)), len(time)
    target, slope, *others = lengthened(courses, length)
    target, slope = target.copy(), slope.copy()
    target[rows:], slope[rows:] = 0.0, 0.0
    return going_on(time, length), target, slope, *others


class _Candidates(NamedTuple):
    """Candidates for the steps of one spring.

    Attributes:
        kind: kind of the step to each row, shape (n, candidates, m).
        cold: true where a spring is exactly cold, shape (n, 1 or candidates, m).
        begins_in: row modulo `CORNERS_KEPT` in which a candidate may follow another one, -1 for any, shape
            (candidates,).
        spring: index of the spring whose kinds the candidates differ in.
    """

    kind: Array
    cold: Array
    begins_in: Array
    spring: Array


class _Filtered(NamedTuple):
    """Result of `_filtered` for several candidates side by side.

    Attributes:
        score: log-likelihood of all readings less the cost of changes of candidate, shape (candidates,).
        parents: candidate that each one went on from, shape (n, candidates).
    """

    score: Array
    parents: Array


@stored_jit()
def _kinds(time: Array, target: Array, slope: Array, cold: Array, change: Array) -> Array:
    """See `kinds_of`; `change` is the cost of another kind [nat]."""
    rows, count = jnp.shape(cold)

    def one_spring(kind: Array, k: Array) -> tuple[Array, None]:
        trials = jnp.repeat(kind[:, None], len(NOISES), axis=1)
        trials = trials.at[:, :, k].set(jnp.arange(len(NOISES)))
        candidates = _Candidates(trials, cold[:, None], jnp.asarray(BEGINS_IN), k)
        found = _filtered(time, target[:, None], slope[:, None], candidates, change)
        return kind.at[:, k].set(_likeliest(found)), None

    order = jnp.tile(jnp.arange(count), 2)
    return jax.lax.scan(one_spring, jnp.full((rows, count), OTHERS), order)[0]


@stored_jit()
def _cold_rows(time: Array, free: tuple, at_cold: tuple, cold: Array, change: Array, k: Array) -> Array:
    """See `cold_rows`; `change` is the cost of another state [nat]. The last candidate is a cold spring."""
    kinds = jnp.arange(len(NOISES) + 1)
    is_cold = kinds == len(NOISES)
    target, slope = (
        jnp.where(jnp.expand_dims(is_cold, range(1, jnp.ndim(a))), b[:, None], a[:, None])
        for a, b in zip(free, at_cold, strict=True)
    )
    of_k = jnp.arange(cold.shape[1]) == k
    cold = jnp.where(of_k, is_cold[:, None], cold[:, None])
    trials = jnp.broadcast_to(jnp.where(of_k, jnp.where(is_cold, 0, kinds)[:, None], OTHERS), cold.shape)
    candidates = _Candidates(trials, cold, jnp.asarray([*BEGINS_IN, -1]), k)
    return is_cold[_likeliest(_filtered(time, target, slope, candidates, change))]


def _likeliest(found: _Filtered) -> Array:
    """The likeliest way through candidates (Viterbi): one for each row, shape (n,)."""
    back = lambda way, parents: (parents[way], way)  # noqa: E731
    return jax.lax.scan(back, jnp.argmax(found.score), found.parents, reverse=True)[1]


def _filtered(
    time: Array, target: Array, slope: Array, candidates: _Candidates, change: Array
) -> _Filtered:
    """Kalman filter of a row's fractions and those of the row before, for several candidates side by side.

    Args:
        time: see `smoothed`.
        target, slope: see `smoothed`, with an axis of one or all candidates after the first one.
        candidates: kinds of steps of one spring.
        change: cost of going on with another candidate [nat].
    """
    kind, cold, begins_in, spring = candidates
    _, several, count = jnp.shape(kind)
    own = jnp.arange(several)
    step = jnp.maximum(jnp.diff(time), SHORTEST)
    ratio = jnp.concatenate([jnp.zeros(2), step[1:] / step[:-1]])
    begins = (kind[1:] != kind[:-1]) | cold[:-1]  # of other springs; of this one the filter knows
    begins = jnp.concatenate([jnp.zeros_like(begins[:1]), begins])
    of_k = jnp.arange(count) == spring

    def row(carry: tuple, at: tuple) -> tuple[tuple, Array]:
        (mean, variance, score), (number, step, ratio, target, slope, kind, cold, begins) = carry, at
        # each candidate goes on from itself, or from the best one where that scores more in spite of the cost
        best = jnp.argmax(score)
        may = (begins_in < 0) | (begins_in == number % CORNERS_KEPT)
        from_ = jnp.where(may & (score[best] - change > score), best, own)
        score = jnp.where(from_ != own, score[best] - change, score)
        begins = jnp.where(of_k, (from_ != own)[:, None], begins)
        mean, variance = _predicted(mean[from_], variance[from_], step, ratio, kind, cold, begins)
        mean, variance, evidence = _updated(mean, variance, target, slope)
        return (mean, variance, score + evidence), from_

    known = jnp.concatenate([jnp.ones((several, count)), jnp.zeros((several, count))], axis=1)
    begin = jnp.full((several, 2 * count), 0.5), _diagonal(FIRST * known), jnp.zeros(several)
    rows = jnp.arange(len(time)), jnp.insert(step, 0, 0.0), ratio, target, slope, kind, cold, begins
    (_, _, score), parents = jax.lax.scan(row, begin, rows)
    return _Filtered(score, parents)


def _predicted(
    mean: Array, variance: Array, step: Array, ratio: Array, kind: Array, cold: Array, begins: Array
) -> tuple[Array, Array]:
    """Mean and variance of each fraction and of the one before, a step later.

    Args:
        mean, variance: those of the row before, shapes (candidates, 2 m) and (candidates, 2 m, 2 m).
        step: length of the step [s]; ratio: over the length of the step before.
        kind: kind of the step, shape (candidates, m).
        cold: springs that are cold, shape (m,) or (candidates, m).
        begins: springs whose kind begins here, shape (candidates, m).
    """
    every, nothing = jnp.ones(jnp.shape(kind)), jnp.zeros(jnp.shape(kind))
    noises, ramps, corners = map(jnp.asarray, (NOISES, RAMPS, CORNERS))
    noise = jnp.where(begins & corners[kind], CORNER, noises[kind])
    gain = ramps[kind] * ratio
    goes_on = jnp.concatenate(
        [
            jnp.concatenate([_diagonal(1.0 + gain), _diagonal(-gain)], axis=2),
            jnp.concatenate([_diagonal(every), _diagonal(nothing)], axis=2),
        ],
        axis=1,
    )
    mean = jnp.einsum("sij,sj->si", goes_on, mean)
    variance = jnp.einsum("sij,sjk,slk->sil", goes_on, variance, goes_on)
    variance = variance + _diagonal(jnp.concatenate([noise * step, nothing], axis=1))
    is_cold = jnp.concatenate([jnp.broadcast_to(cold, nothing.shape), nothing > 1.0], axis=1)
    return jnp.where(is_cold, 1.0, mean), variance * (~is_cold[:, :, None] & ~is_cold[:, None, :])


def _updated(mean: Array, variance: Array, target: Array, slope: Array) -> tuple[Array, Array, Array]:
    """Mean and variance after the readings of one row, at most three, and their log-likelihood.

    Args:
        mean, variance: see `_predicted`.
        target, slope: readings and their derivatives, shapes (candidates, m) and (candidates, m, m); of one
            candidate where they are the same for all.
    """
    count, evidence = mean.shape[1] // 2, jnp.zeros(mean.shape[0])
    for reading in range(count):
        tangent = slope[:, reading]
        reach = jnp.sum(variance[:, :, :count] * tangent[:, None, :], axis=2)
        spread = jnp.sum(reach[:, :count] * tangent, axis=1) + 1.0
        surprise = target[:, reading] - jnp.sum(mean[:, :count] * tangent, axis=1)
        mean = mean + (surprise / spread)[:, None] * reach
        variance = variance - reach[:, :, None] * (reach / spread[:, None])[:, None, :]
        evidence = evidence - 0.5 * (surprise**2 / spread + jnp.log(spread))
    return mean, variance, evidence


def _diagonal(values: Array) -> Array:
    """Diagonal matrices, (..., n, n) of (..., n)."""
    return values[:, :, None] * jnp.eye(values.shape[1])
