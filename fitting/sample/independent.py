"""Proposals that do not depend on where a walker is: draws from the fit's approximation, with wide tails.

A posterior that is nearly its fit's Gaussian accepts most of them, and each is an independent draw. Walkers
that only step by differences of each other forget their place after some three steps for each dimension. A
posterior that is far from its fit's Gaussian accepts hardly any, and then all steps are differences.
"""

from dataclasses import dataclass

import numpy as np
from emcee.moves import MHMove
from jaxtyping import Float

from .chart import PROBES, Chart
from .laplace import Laplace, start_spread
from .target import LogDensity, Target

FREEDOM = 5.0
"""Degrees of freedom of the proposals' multivariate t distribution. A posterior with wider tails is sampled
by differences alone where it is far out."""
WIDENED = 1.05
"""Factor of the proposals' standard deviations over those of the approximation."""
LIKELY = 0.03
"""Minimum expected acceptance of these proposals for which they are made [1]. At this acceptance a walker is
drawn anew every 70 steps."""
SHARE = 0.5
"""Share of steps that are such proposals, if any are made. With nine in ten, walkers ended after 200 steps
without having seen a second mode that differences find."""


@dataclass(frozen=True)
class Proposals:
    """A multivariate t distribution about the fit.

    Attributes:
        centre: mode in the chart, shape (n,).
        root: root of its covariance, widened, shape (n, n).
        share: share of steps that are such proposals.
    """

    centre: Float[np.ndarray, " n"]
    root: Float[np.ndarray, "n n"]
    share: float

    def draw(self, count: int, random: np.random.RandomState) -> Float[np.ndarray, "count n"]:
        """Points of the distribution."""
        normal = random.standard_normal((count, len(self.centre)))
        wide = np.sqrt(FREEDOM / random.chisquare(FREEDOM, (count, 1)))
        return self.centre + (normal * wide) @ self.root.T

    def log_density(self, points: Float[np.ndarray, "count n"]) -> Float[np.ndarray, " count"]:
        """Logarithm of the density up to a constant."""
        away = np.linalg.solve(self.root, (points - self.centre).T)
        size = len(self.centre)
        return -0.5 * (FREEDOM + size) * np.log1p(np.sum(away**2, axis=0) / FREEDOM)

    @property
    def move(self) -> MHMove:
        """The proposals as a move of all walkers of an ensemble."""

        def proposed(points: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
            new = self.draw(len(points), random)
            return new, self.log_density(points) - self.log_density(new)

        return MHMove(proposed, ndim=len(self.centre))


def proposals_about(
    target: Target, found: Laplace, chart: Chart, evaluator: LogDensity, seed: int
) -> Proposals:
    """Proposals about a fit. Their share is 0 if the posterior would accept hardly any.

    The expected acceptance is that of a chain of such proposals alone, from their importance weights.

    Args:
        target: target to sample.
        found: Laplace approximation of the target.
        chart: coordinates in which walkers move.
        evaluator: evaluator of the target's log-probability.
        seed: seed of the probes.
    """
    root = WIDENED * chart.scaled_root(found, start_spread(target, found))
    own = Proposals(chart.to_chart(found.mode), root, 0.0)
    if np.linalg.matrix_rank(root / np.linalg.norm(root, axis=1, keepdims=True)) < len(root):
        return own
    probes = own.draw(PROBES, np.random.RandomState(seed))
    weight = chart.density(evaluator)(probes) - own.log_density(probes)
    weight = np.exp(weight - np.max(weight)) if np.isfinite(np.max(weight)) else np.zeros(len(probes))
    pairs = np.sum(np.minimum(weight[:, None], weight)) - np.sum(weight)  # none is proposed to itself
    expected = pairs / max((len(probes) - 1) * np.sum(weight), np.finfo(float).tiny)
    return Proposals(own.centre, root, SHARE if expected >= LIKELY else 0.0)
