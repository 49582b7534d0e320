"""FORM from several starts, and importance sampling about the design points that it finds.

The design point is the most probable failure in the space of standard normal scores. It is searched with
exact gradients by the improved method of Y. Zhang, A. Der Kiureghian, IFIP TC7 WG 7.5 (1995) 297. FORM's own
number takes the limit for a plane; importance sampling does not, and has an interval.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, ndtr

MOST_STEPS = 60
"""Maximum number of steps of a search. Those that end at a design point took at most 20 on the shipped
designs."""
SHORTER = 0.5 ** np.arange(7)
"""Lengths of a step that are tried at once."""
CLOSE = 1e-4
"""Distance to the limit, in its first scale, and of the next step, at which a search ends."""
APART = 0.3
"""Distance of two design points of which the second one counts, too."""
FARTHER = 3.0
"""Beyond the nearest design point, one that lies so much farther is a thousandth as likely, or less."""
PLAIN = 0.1
"""Share of importance samples that are drawn as the inputs are, so that no weight is boundless."""
FEW = 20
"""Failed samples below which an interval by their spread is not to be trusted."""
NONE_SEEN = 3.0


@dataclass(frozen=True)
class FormResult:
    """Design points and what importance sampling makes of them.

    Attributes:
        points: design points, the nearest first, shape (points, scores).
        betas: their distance from the origin; negative where the origin fails.
        probability: estimate by importance sampling.
        standard_error: standard error of the probability.
        samples: number of samples of importance sampling.
        failed: number of these samples that fail.
        searches: started, and how many of them ended at a design point.
    """

    points: Float[np.ndarray, "points scores"]
    betas: Float[np.ndarray, " points"]
    probability: float
    standard_error: float
    samples: int
    failed: int
    searches: tuple[int, int]

    @property
    def by_form(self) -> float | None:
        """FORM's own number, the sum over design points as if each were alone; None where there is none."""
        return float(min(1.0, ndtr(-self.betas).sum())) if len(self.betas) else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 %; one-sided where nothing or everything fails, wide where few samples do."""
        plain = PLAIN * self.samples if len(self.betas) else self.samples
        if self.failed == 0:
            return 0.0, min(1.0, NONE_SEEN / plain)
        if self.failed == self.samples:
            return max(0.0, 1.0 - NONE_SEEN / self.samples), 1.0
        half = 1.96 * self.standard_error
        if self.failed < FEW:
            return 0.0, min(1.0, self.probability + 2.0 * half)
        return max(0.0, self.probability - half), min(1.0, self.probability + half)


def form(
    margins: Callable[[np.ndarray], np.ndarray],
    with_gradient: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    starts: Float[np.ndarray, "starts scores"],
    samples: int,
    random: np.random.Generator,
) -> FormResult:
    """Search design points and sample about them.

    Args:
        margins: function from rows of scores to their margins; a margin is negative where the limit fails.
        with_gradient: the same with derivatives.
        starts: starting points of the searches, the origin first.
        samples: number of samples of importance sampling.
        random: numbers.
    """
    points, sign = design_points(margins, with_gradient, starts)
    betas = sign * np.linalg.norm(points, axis=1)
    distinct, kept = [], []
    for k in np.argsort(np.abs(betas)):
        far = np.abs(betas[k]) > FARTHER + np.abs(betas[kept[0]]) if kept else False
        if not far and all(np.linalg.norm(points[k] - other) > APART for other in distinct):
            distinct.append(points[k])
            kept.append(k)
    chosen = np.array(distinct).reshape(-1, starts.shape[1])
    betas = betas[kept] if kept else np.zeros(0)
    probability, error, failed = importance_sampling(margins, chosen, betas, samples, random)
    return FormResult(chosen, betas, probability, error, samples, failed, (len(starts), len(points)))


def design_points(
    margins: Callable[[np.ndarray], np.ndarray],
    with_gradient: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    starts: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Ends of searches on the limit, shape (found, scores), and the sign of beta."""
    here = starts.copy()
    margin, slope = with_gradient(here)
    finite = np.abs(margin[np.isfinite(margin)])
    scale = max(float(np.median(finite)) if finite.size else 1.0, 1e-300)
    sign = -1.0 if margin[0] < 0.0 else 1.0
    done = np.zeros(len(here), bool)
    for _ in range(MOST_STEPS):
        steep = np.sum(slope**2, axis=1)
        usable = np.isfinite(margin) & (steep > 0.0) & np.all(np.isfinite(slope), axis=1)
        steep = np.where(usable, steep, 1.0)
        safe = np.where(usable, margin, 0.0)
        towards = ((np.sum(slope * here, axis=1) - safe) / steep)[:, None] * slope
        done |= (
            usable
            & (np.abs(safe) < CLOSE * scale)
            & (np.linalg.norm(towards - here, axis=1) < CLOSE * np.maximum(1.0, np.linalg.norm(here, axis=1)))
        )
        moving = np.flatnonzero(usable & ~done)
        if not len(moving):
            break
        direction = (towards - here)[moving]
        weight = 2.0 * np.linalg.norm(towards[moving], axis=1) / np.sqrt(steep[moving]) + 10.0 / scale
        tried = here[moving][:, None] + SHORTER[:, None] * direction[:, None]
        value = margins(tried.reshape(-1, here.shape[1])).reshape(len(moving), -1)
        merit = 0.5 * np.sum(tried**2, axis=2) + weight[:, None] * np.abs(value)
        now = 0.5 * np.sum(here[moving] ** 2, axis=1) + weight * np.abs(margin[moving])
        better = merit < now[:, None]
        step = np.where(better.any(axis=1), better.argmax(axis=1), len(SHORTER) - 1)
        here[moving] = tried[np.arange(len(moving)), step]
        margin[moving], slope[moving] = with_gradient(here[moving])
    return here[done], sign


def importance_sampling(
    margins: Callable[[np.ndarray], np.ndarray],
    points: np.ndarray,
    betas: np.ndarray,
    samples: int,
    random: np.random.Generator,
) -> tuple[float, float, int]:
    """Probability, its standard error, and the number of samples that fail.

    Samples are of a mixture of standard normal distributions about the design points and about the origin.
    """
    dimension = points.shape[1]
    if len(points):
        share = np.maximum(ndtr(-betas), 1e-300)
        shares = np.concatenate([[PLAIN], (1.0 - PLAIN) * share / share.sum()])
    else:
        shares = np.ones(1)
    centres = np.concatenate([np.zeros((1, dimension)), points])
    which = random.choice(len(shares), size=samples, p=shares)
    n = centres[which] + random.standard_normal((samples, dimension))
    failed = margins(n) < 0.0
    # log of the density against that about the origin, of each part of the mixture
    logs = n @ centres.T - 0.5 * np.sum(centres**2, axis=1) + np.log(shares)
    weights = np.where(failed, np.exp(-logsumexp(logs, axis=1)), 0.0)
    return float(weights.mean()), float(weights.std(ddof=1) / np.sqrt(samples)), int(failed.sum())
