"""Choice of tests: greedily by information per minute, followed by exchanges that improve it.

The knowledge after some tests is Gaussian: precisions of prior and tests add up. The worth of a test is the
expected decrease of the log-volume of the wanted constants' uncertainty, the others integrated out
(D_s-optimality). It is averaged over alloys that the priors allow, so that the protocol suits an
uncharacterised alloy.

`information[:, test, r]` is the information of `r + 1` repeats together. Repeats average the instruments'
errors, but not the error of the model, which is the same in every repeat.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WANTED = ("beta_1", "beta_2", "beta_3", "ka_1", "ka_2", "ka_3", "km_1", "km_2", "km_3", "a", "b")
LEAST_GAIN = 0.3
"""Minimum information of a test to justify its set-up [nats]; the first test may have less."""
MOST_ROUNDS = 20
"""Maximum number of rounds of exchanges; a round without an exchange ends them earlier."""


@dataclass(frozen=True)
class Choice:
    """One chosen test, or one more repeat of it.

    Attributes:
        index: index of the candidate.
        gain: information gained about the wanted constants, given the tests chosen earlier [nats]; mean over
            the alloys.
    """

    index: int
    gain: float


def choose(
    information: np.ndarray, minutes: np.ndarray, names: Sequence[str], wanted: Sequence[str], most: int
) -> list[Choice]:
    """The chosen tests of a campaign, in their recommended order.

    Args:
        information: Fisher information of 1, 2, ... repeats of each test in units of the prior, shape
            (alloys, tests, repeats, unknowns, unknowns).
        minutes: duration of each test with its set-up [min], shape (tests,).
        names: names of the unknowns.
        wanted: unknowns that the campaign is to determine.
        most: maximum number of tests, repeats included.
    """
    rows = [list(names).index(name) for name in wanted]
    worth = _Worth(information, minutes, rows)
    pool = Counter({k: information.shape[2] for k in range(information.shape[1])})
    first = worth.greedy(pool, most, LEAST_GAIN)
    better = worth.exchanged([choice.index for choice in first])
    return worth.greedy(Counter(better), len(better), -np.inf)


@dataclass(frozen=True)
class _Worth:
    """Arguments of `choose`, with the rows of the wanted unknowns."""

    fisher: np.ndarray
    minutes: np.ndarray
    rows: list[int]

    def greedy(self, pool: Counter, most: int, least: float) -> list[Choice]:
        """Tests one by one, each at most as often as in `pool`."""
        precision, done = _prior(self.fisher), Counter()
        chosen: list[Choice] = []
        while len(chosen) < most:
            available = [k for k in sorted(pool) if done[k] < pool[k]]
            if not available:
                break
            more = np.stack([self._next(k, done) for k in available], axis=1)
            gain = log_volume(precision, self.rows) - log_volume(precision[:, None] + more, self.rows)
            enough = gain >= least
            if chosen and not enough.any():
                break
            per_minute = gain / self.minutes[available]
            best = int(np.argmax(np.where(enough, per_minute, -np.inf) if enough.any() else per_minute))
            chosen.append(Choice(available[best], float(gain[best])))
            precision = precision + more[:, best]
            done[available[best]] += 1
        return chosen

    def exchanged(self, tests: list[int]) -> list[int]:
        """Tests after single exchanges that give more information in no more time, until none does
        (Fedorov)."""
        tests, limit = list(tests), self.minutes[tests].sum() + 1e-9
        everything = range(self.fisher.shape[1])
        for _ in range(MOST_ROUNDS):
            improved = False
            for k in range(len(tests)):
                others = tests[:k] + tests[k + 1 :]
                time = self.minutes[others].sum()
                done = Counter(others)
                able = [
                    j for j in everything
                    if done[j] < self.fisher.shape[2] and time + self.minutes[j] <= limit
                ]
                precision = _prior(self.fisher) + sum(self.fisher[:, j, n - 1] for j, n in done.items())
                more = np.stack([self._next(j, done) for j in able], axis=1)
                volume = log_volume(precision[:, None] + more, self.rows)
                best = able[int(np.argmin(volume))]
                if best != tests[k] and volume.min() < volume[able.index(tests[k])] - 1e-9:
                    tests[k], improved = best, True
            if not improved:
                break
        return tests

    def _next(self, test: int, done: Counter) -> np.ndarray:
        """Information that one more repeat of a test adds."""
        before = self.fisher[:, test, done[test] - 1] if done[test] else 0.0
        return self.fisher[:, test, done[test]] - before


def covariances(information: np.ndarray, order: Sequence[int]) -> np.ndarray:
    """Covariance after 0, 1, 2, ... tests in units of the prior.

    Args:
        information: Fisher information as for `choose`.
        order: indices of the tests, repeats included.

    Returns:
        Shape (1 + tests done, alloys, unknowns, unknowns).
    """
    steps, done = [_prior(information)], Counter()
    for index in order:
        before = information[:, index, done[index] - 1] if done[index] else 0.0
        steps.append(steps[-1] + information[:, index, done[index]] - before)
        done[index] += 1
    return np.linalg.inv(np.stack(steps))


def expected_sd(information: np.ndarray, order: Sequence[int]) -> np.ndarray:
    """Standard deviation of every unknown in units of the prior's, shape (1 + tests done, alloys,
    unknowns)."""
    return np.sqrt(np.diagonal(covariances(information, order), axis1=2, axis2=3))


def log_volume(known: np.ndarray, rows: list[int]) -> np.ndarray:
    """Half the log-determinant of the marginal covariance of some unknowns, mean over the alloys.

    Args:
        known: precision, shape (alloys, ..., unknowns, unknowns).
        rows: indices of the unknowns.
    """
    covariance = np.linalg.inv(known)[..., rows, :][..., rows]
    return np.mean(0.5 * np.linalg.slogdet(covariance)[1], axis=0)


def _prior(information: np.ndarray) -> np.ndarray:
    """Precision before any test, in units of the prior, shape (alloys, unknowns, unknowns)."""
    return np.broadcast_to(np.eye(information.shape[-1]), information[:, 0, 0].shape).copy()
