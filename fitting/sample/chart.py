"""Coordinates in which walkers move: a parameter, or its logarithm where that makes the posterior rounder.

Moduli, wall thicknesses and stiffness factors multiply each other, so the data determine a product. That is a
curved, thin valley in the values and a straight one in their logarithms. For exponents it is the other way
round.

Affine invariant samplers are insensitive to any linear change of coordinates, but not to a curvature, so the
chart matters. The density carries the Jacobian: the sampled distribution stays the same, priors included.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from .laplace import Laplace
from .target import Evaluator, Target

CLEAR = 4.0  # Minimum distance of the mode from zero for a logarithm, in standard errors
PROBES = 64
WORTH = 0.9  # Maximum ratio of the new to the old distance from a Gaussian for another coordinate
WORST = 1e6  # Difference of log-densities that stands for an impossible probe


class Chart:
    """Choice of the parameters that move by their logarithm, and both conversions.

    Args:
        sign: 0 for a parameter's own coordinate, 1 for its logarithm, -1 for that of minus its value; shape
            (n,).
    """

    def __init__(self, sign: Int[np.ndarray, " n"]):
        self.sign = np.asarray(sign, int)
        self._bent = self.sign != 0

    def forth(self, vector: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Walkers' coordinates from those of the target; values must have the chart's signs."""
        return np.where(self._bent, np.log(np.where(self._bent, self.sign * vector, 1.0)), vector)

    def back(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Target's coordinates from those of walkers."""
        with np.errstate(over="ignore"):  # infinite is outside any bound
            return np.where(self._bent, self.sign * np.exp(np.where(self._bent, point, 0.0)), point)

    def log_slope(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "..."]:
        """Logarithm of the Jacobian of `back`."""
        return np.sum(np.where(self._bent, point, 0.0), axis=-1)

    def density(self, evaluator: Evaluator) -> Callable[[np.ndarray], np.ndarray]:
        """Log-probability of the walkers' own coordinates, as emcee's `vectorize=True` wants it."""
        return lambda point: evaluator(self.back(point)) + self.log_slope(point)

    def root(self, found: Laplace, spread: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
        """A matrix root of a covariance of the target's coordinates, in those of walkers near the mode."""
        scale = np.where(self._bent, np.abs(found.mode), 1.0)
        return spread / np.where(scale > 0.0, scale, 1.0)[:, None]


def choose_chart(
    target: Target, found: Laplace, spread: Float[np.ndarray, "n n"], evaluator: Evaluator, seed: int
) -> Chart:
    """The chart in which the posterior is closest to its own Gaussian approximation, found greedily.

    The distance is the mean of `log(1 + |difference of log-densities|)` over draws from the approximation; it
    is zero for a Gaussian. The descent starts both from plain coordinates and from logarithms wherever they
    are possible.

    Args:
        target: target to sample.
        found: Laplace approximation of the target.
        spread: root of the covariance of the probes.
        evaluator: evaluator of its log-probability.
        seed: seed of the probes.
    """
    normal = np.random.default_rng(seed).standard_normal((PROBES, target.dimension))

    def bend(sign: np.ndarray) -> float:
        chart = Chart(sign)
        points = chart.forth(found.mode) + normal @ chart.root(found, spread).T
        density = chart.density(evaluator)(points) + 0.5 * np.sum(normal**2, axis=1)
        usable = np.isfinite(density)
        difference = np.full(PROBES, WORST)
        if usable.any():
            difference[usable] = np.abs(density[usable] - np.median(density[usable]))
        return float(np.mean(np.log1p(difference)))

    candidates = dict(_candidates(target, found))
    plain = np.zeros(target.dimension, int)
    bent = np.array([candidates.get(i, 0) for i in range(target.dimension)])
    best, least = _descend(bend, plain, candidates)
    if candidates:
        other, its = _descend(bend, bent, candidates)
        best = other if its < WORTH * least else best
    return Chart(best)


def _descend(
    bend: Callable[[np.ndarray], float], sign: np.ndarray, candidates: dict[int, int]
) -> tuple[np.ndarray, float]:
    """Change one coordinate at a time, the best first, while that reduces the distance enough."""
    least = bend(sign)
    while candidates:
        trials = [np.where(np.arange(len(sign)) == i, s - sign[i], sign) for i, s in candidates.items()]
        bends = [bend(trial) for trial in trials]
        if not min(bends) < WORTH * least:
            break
        sign, least = trials[int(np.argmin(bends))], min(bends)
    return sign, least


def _candidates(target: Target, found: Laplace) -> list[tuple[int, int]]:
    """Parameters whose values have one sign and stay clear of zero, with that sign. Parameters that are
    already fitted by their logarithm are left out."""
    lower, upper = np.asarray(target.lower), np.asarray(target.upper)
    sd = np.sqrt(np.diag(found.covariance))
    clear = found.known & (np.abs(found.mode) > CLEAR * sd) & ~np.asarray(target.layout.logarithmic, bool)
    return [
        (i, 1 if lower[i] >= 0.0 else -1) for i in np.flatnonzero(clear & ((lower >= 0.0) | (upper <= 0.0)))
    ]
