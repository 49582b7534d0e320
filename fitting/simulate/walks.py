"""Random walks behind readings: their filter, their smoother, and the most likely variances of their steps.

Readings stand in units of their noise, so that each has a variance of one. Predictions are linear in what
walks.
"""

from typing import NamedTuple

import numpy as np

WANDER = 10.0 ** np.arange(-9.0, 0.0, 1.0)
"""Candidate variances of a fraction's change [1/s], from a cold spring, which stays, to one heated in
seconds."""
FIRST = 1.0
"""Variance of a fraction before the first reading [1], when it is unknown."""
UNTIED = 1e12
"""Variance of a step that ties nothing [1]."""


def along(slope: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Change of the readings with fractions, shape (rows, wired)."""
    return np.einsum("tij,tj->ti", slope, x)


def costs_of(
    time: np.ndarray, x: np.ndarray, missed: np.ndarray, wander: np.ndarray, cold: np.ndarray
) -> np.ndarray:
    """Half the sum of squares of each row: what readings miss, and half of the walk's two steps at the row,
    in units of their deviation; shape (n,). The sum over all rows is that of the recording.

    Args:
        time: time [s], shape (n,).
        x: fractions [1], shape (n, m).
        missed: readings less predictions, in units of their noise, shape (n, m).
        wander: variance of each fraction's change before each row [1/s], shape (n, m).
        cold: true where a spring is cold; steps that end there are not of the walk. Shape (n, m).
    """
    steps, changes = np.diff(time)[:, None], np.where(cold[1:], 0.0, np.diff(x, axis=0))
    walked = 0.5 * np.sum(changes**2 / (wander[1:] * np.maximum(steps, 1e-9)), axis=1)
    costs = np.sum(missed**2, axis=1) + np.append(walked, 0.0) + np.insert(walked, 0, 0.0)
    costs[0] += np.sum(np.where(cold[0], 0.0, x[0] - 0.5) ** 2) / FIRST
    return 0.5 * costs


def process_noise_of(time: np.ndarray, target: np.ndarray, slope: np.ndarray, cold: np.ndarray) -> np.ndarray:
    """Most likely variance of each change of a fraction [1/s], one spring after the other, twice.

    Between rows it may change, at the cost of the logarithm of their number: a heated spring is held still
    afterwards. Shape (n, m).
    """
    rows, count = target.shape
    wander = np.full((rows, count), 1e-4)
    for _ in range(2):
        for k in range(count):
            trials = np.repeat(wander[:, None], len(WANDER), axis=1)
            trials[:, :, k] = WANDER
            found = _filtered(time, target, slope, trials, cold, np.log(rows))
            way = int(np.argmax(found.score))
            for t in range(rows - 1, -1, -1):
                wander[t, k] = WANDER[way]
                way = found.parents[t, way]
    return wander


class _Filtered(NamedTuple):
    """What `_filtered` finds for several candidates side by side.

    Attributes:
        means, variances: of the fractions, shapes (n, candidates, m) and (n, candidates, m, m).
        evidence: log-likelihoods of each row's readings after all rows before, shape (n, candidates).
        score: their sum less the cost of changes between candidates, shape (candidates,).
        parents: candidate that each one went on from, shape (n, candidates).
    """

    means: np.ndarray
    variances: np.ndarray
    evidence: np.ndarray
    score: np.ndarray
    parents: np.ndarray


def _filtered(
    time: np.ndarray,
    target: np.ndarray,
    slope: np.ndarray,
    wander: np.ndarray,
    cold: np.ndarray,
    change: float = np.inf,
) -> _Filtered:
    """Kalman filter of random walks, for several candidates of their variances side by side.

    Args:
        time: time [s], ascending, shape (n,).
        target: readings in units of their noise, shape (n, m).
        slope: slope of the readings over the fractions, shape (n, m, m).
        wander: variance of each fraction's change before each row [1/s], shape (n, candidates, m).
        cold: true where a spring is exactly cold, shape (n, m).
        change: cost of going on with another candidate [nat].
    """
    rows, several, count = wander.shape
    steps, unit, own = np.diff(time, prepend=time[0]), np.eye(count), np.arange(several)
    means, variances = np.empty((rows, several, count)), np.empty((rows, several, count, count))
    mean, variance = np.full((several, count), 0.5), np.tile(FIRST * unit, (several, 1, 1))
    evidence, score, parents = np.zeros((rows, several)), np.zeros(several), np.zeros((rows, several), int)
    for t in range(rows):
        best = np.argmax(score)
        parents[t] = from_ = np.where(score[best] - change > score, best, own)
        mean, score = mean[from_], np.maximum(score, score[best] - change)
        variance = variance[from_] + (wander[t] * steps[t])[:, :, None] * unit
        if cold[t].any():
            warm = ~cold[t]
            mean = np.where(warm, mean, 1.0)
            variance = variance * (warm[:, None] & warm)
        for ohms, tangent in zip(target[t], slope[t], strict=True):
            reach = variance @ tangent
            spread = reach @ tangent + 1.0
            surprise = ohms - mean @ tangent
            mean = mean + (surprise / spread)[:, None] * reach
            variance = variance - reach[:, :, None] * (reach / spread[:, None])[:, None, :]
            evidence[t] -= 0.5 * (surprise**2 / spread + np.log(spread))
        score = score + evidence[t]
        means[t], variances[t] = mean, variance
    return _Filtered(means, variances, evidence, score, parents)


def smoothed(
    time: np.ndarray, target: np.ndarray, slope: np.ndarray, wander: np.ndarray, cold: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rauch-Tung-Striebel smoother behind `_filtered`, of one candidate.

    Returns:
        Fractions, shape (n, m), and the log-likelihoods of each row's readings, shape (n,).
    """
    found = _filtered(time, target, slope, wander[:, None], cold)
    means, variances = found.means[:, 0], found.variances[:, 0]
    steps, smooth = np.diff(time), means.copy()
    for t in range(len(time) - 2, -1, -1):
        ahead = variances[t] + np.diag(wander[t + 1] * steps[t] + UNTIED * cold[t + 1] + 1e-300)
        smooth[t] = means[t] + variances[t] @ np.linalg.solve(ahead, smooth[t + 1] - means[t])
    return smooth, found.evidence[:, 0]
