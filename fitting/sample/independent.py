"""Proposals that do not depend on where a walker is: draws from an approximation of the posterior.

At first that is the fit's approximation, with wide tails. Once walkers have spread, it is a Gaussian with
their mean and covariance, where that is accepted more often.

A posterior that is nearly its fit's Gaussian accepts most of them, and each is an independent draw. Walkers
that only step by differences of each other forget their place after some three steps for each dimension. A
posterior that is far from its fit's Gaussian accepts hardly any, and then all steps are differences.
"""

from collections.abc import Callable
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
SPREAD_AFTER = 200
"""Number of steps after which walkers tell their mean and covariance, by the second half of these steps."""
SPREAD_FREEDOM = 30.0
"""Degrees of freedom of proposals by the walkers' spread. With an open alloy of 22 constants 26 % of them are
accepted, and with 5 degrees 17 %. Of draws about the fit 8 % are."""
SHARE = 0.5
"""Share of steps that are such proposals, if any are made. With nine in ten, walkers ended after 200 steps
without having seen a second mode that differences find."""


@dataclass(frozen=True)
class Proposals:
    """A multivariate t distribution about the fit, or about the walkers' mean.

    Attributes:
        centre: its centre in the chart, shape (n,).
        root: root of its covariance, widened, shape (n, n).
        share: share of steps that are such proposals.
        freedom: degrees of freedom.
    """

    centre: Float[np.ndarray, " n"]
    root: Float[np.ndarray, "n n"]
    share: float
    freedom: float = FREEDOM

    def draw(self, count: int, random: np.random.RandomState) -> Float[np.ndarray, "count n"]:
        """Points of the distribution."""
        normal = random.standard_normal((count, len(self.centre)))
        wide = np.sqrt(self.freedom / random.chisquare(self.freedom, (count, 1)))
        return self.centre + (normal * wide) @ self.root.T

    def log_density(self, points: Float[np.ndarray, "count n"]) -> Float[np.ndarray, " count"]:
        """Logarithm of the density up to a constant."""
        away = np.linalg.solve(self.root, (points - self.centre).T)
        size = len(self.centre)
        return -0.5 * (self.freedom + size) * np.log1p(np.sum(away**2, axis=0) / self.freedom)

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


def proposals_by_spread(
    proposals: Proposals,
    points: Float[np.ndarray, "m n"],
    walkers: Float[np.ndarray, "k n"],
    log_densities: Float[np.ndarray, " k"],
    density: Callable[[np.ndarray], np.ndarray],
    seed: int,
) -> Proposals:
    """Proposals by the spread of walkers, if these would accept them more often; else those there are.

    The expected acceptance is that of the walkers where they are now. Proposals that are too narrow would
    look good from their own draws.

    Args:
        proposals: proposals until now.
        points: where walkers have been, in the chart.
        walkers: where they are.
        log_densities: their log-densities in the chart.
        density: log-density of points in the chart.
        seed: seed of the probes.
    """
    covariance = np.cov(points.T)
    scale = np.sqrt(np.diag(np.atleast_2d(covariance)))
    if not np.all(scale > 0.0):
        return proposals
    try:
        root = scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale))
    except np.linalg.LinAlgError:  # walkers have not left a plane
        return proposals
    own = Proposals(np.mean(points, axis=0), root, SHARE, SPREAD_FREEDOM)

    def expected(each: Proposals) -> float:
        """Mean probability that a walker accepts a proposal."""
        probes = each.draw(PROBES, np.random.RandomState(seed))
        there = density(probes) - each.log_density(probes)
        here = log_densities - each.log_density(walkers)
        gain = np.where(np.isfinite(there), there, -np.inf) - here[:, None]
        return float(np.mean(np.exp(np.minimum(gain, 0.0))))

    chance, before = expected(own), 0.0 if proposals.share == 0.0 else expected(proposals)
    return own if chance > before and chance >= LIKELY else proposals
