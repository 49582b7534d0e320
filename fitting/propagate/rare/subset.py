"""Subset simulation: a small probability as a product of large ones.

S.-K. Au, J. L. Beck, Probabilistic Engineering Mechanics 16 (2001) 263, doi:10.1016/S0266-8920(01)00019-4.
Chains move by conditional sampling with an adapted proposal width: I. Papaioannou et al., Probabilistic
Engineering Mechanics 41 (2015) 89, doi:10.1016/j.probengmech.2015.06.006.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import stats

LEVEL = 0.1
"""Probability of each level, the usual choice: the effort changes little up to 0.3 (Papaioannou 2015)."""
MOST_LEVELS = 12
"""Levels after which a probability is called smaller than 10^-12: no data of inputs reach so far."""
WANTED_ACCEPTANCE = 0.44
"""Acceptance rate to which widths are adapted [1]: conditional sampling mixes best (Papaioannou 2015)."""
FIRST_WIDTH, LEAST_WIDTH = 0.6, 0.02
"""First and minimum width of proposals, in standard deviations of a score [1]."""
NONE_SEEN = 3.0
"""Divided by the rows, the 95 % upper end of a probability of which nothing was seen: the rule of three."""


@dataclass(frozen=True)
class SubsetResult:
    """A probability by independent runs of subset simulation.

    Attributes:
        each: estimate of every run, shape (runs,).
        levels: number of levels of every run.
        stalled: runs that ended before the limit: its margin has steps, or it cannot be reached.
        samples: number of samples of a level.
        reached: probability of the last level of the run that came least far.
        failed_points: some scores that fail, at most one of each run, shape (n, scores).
    """

    each: Float[np.ndarray, " runs"]
    levels: tuple[int, ...]
    stalled: int
    samples: int
    reached: float
    failed_points: np.ndarray

    @property
    def probability(self) -> float:
        """Mean of the runs' estimates."""
        return float(self.each.mean())

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval from the spread of the runs; one-sided where nothing or everything fails."""
        runs = len(self.each)
        if not self.each.any():
            return 0.0, min(1.0, self.reached * NONE_SEEN / (self.samples * runs))
        if np.all(self.each == 1.0):
            return 1.0 - NONE_SEEN / (self.samples * runs), 1.0
        half = stats.t.ppf(0.975, runs - 1) * self.each.std(ddof=1) / np.sqrt(runs)
        return max(0.0, self.probability - half), min(1.0, self.probability + half)


def subset_simulation(
    margins: Callable[[np.ndarray], np.ndarray],
    dimension: int,
    samples: int,
    runs: int,
    random: np.random.Generator,
) -> SubsetResult:
    """Probability of a negative margin, by runs side by side: the model is asked for many rows at a time.

    Args:
        margins: function from rows of scores to their margins; a margin is negative where the limit fails.
        dimension: number of scores.
        samples: number of samples of a level of a run.
        runs: number of independent runs.
        random: generator of the random numbers.
    """
    seeds = max(1, int(LEVEL * samples))
    points = random.standard_normal((runs, samples, dimension))
    found = margins(points.reshape(-1, dimension)).reshape(runs, samples)
    weight, each = np.ones(runs), np.zeros(runs)
    levels, stalled, width = np.zeros(runs, int), np.zeros(runs, bool), np.full(runs, FIRST_WIDTH)
    active = np.ones(runs, bool)
    for level in range(MOST_LEVELS + 1):
        threshold = np.sort(found, axis=1)[:, seeds - 1]
        for run in np.flatnonzero(active):
            share = np.mean(found[run] <= threshold[run])
            levels[run] = level
            ends = threshold[run] < 0.0 or level == MOST_LEVELS
            flat = not np.isfinite(threshold[run]) or share == 1.0
            if ends or flat:
                each[run] = weight[run] * np.mean(found[run] < 0.0)
                stalled[run] = threshold[run] >= 0.0
                active[run] = False
            else:
                weight[run] *= share
        if not active.any():
            break
        who = np.flatnonzero(active)
        points[who], found[who], width[who] = _moved(
            margins, points[who], found[who], threshold[who], width[who], seeds, random
        )
    failing = [points[run][np.argmin(found[run])] for run in range(runs) if found[run].min() < 0.0]
    return SubsetResult(
        each, tuple(int(n) for n in levels), int(stalled.sum()), samples, float(weight.max()),
        np.array(failing).reshape(-1, dimension)[: runs // 2 + 1],
    )  # fmt: skip


def _moved(
    margins: Callable[[np.ndarray], np.ndarray],
    points: np.ndarray,
    found: np.ndarray,
    threshold: np.ndarray,
    width: np.ndarray,
    seeds: int,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The next level of some runs: chains from the rows below the threshold, none of which leaves it."""
    runs, samples, dimension = points.shape
    here, margin_here = np.empty((runs, seeds, dimension)), np.empty((runs, seeds))
    for run in range(runs):
        below = random.permutation(np.flatnonzero(found[run] <= threshold[run]))
        chosen = below[np.arange(seeds) % len(below)]
        here[run], margin_here[run] = points[run, chosen], found[run, chosen]
    places, values = [], []
    steps = -(-samples // seeds)
    for step in range(steps):
        spread = np.minimum(1.0, width)[:, None, None]
        keep = np.sqrt(1.0 - spread**2)
        tried = keep * here + spread * random.standard_normal(here.shape)
        value = margins(tried.reshape(-1, dimension)).reshape(runs, seeds)
        taken = value <= threshold[:, None]
        here = np.where(taken[..., None], tried, here)
        margin_here = np.where(taken, value, margin_here)
        places.append(here)
        values.append(margin_here)
        width = width * np.exp((taken.mean(axis=1) - WANTED_ACCEPTANCE) / np.sqrt(step + 1.0))
        width = np.clip(width, LEAST_WIDTH, 1.0)
    return (
        np.concatenate(places, axis=1)[:, :samples], np.concatenate(values, axis=1)[:, :samples], width
    )  # fmt: skip
