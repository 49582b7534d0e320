"""Coordinates in which walkers move: a parameter's own, or its logarithm where the posterior is rounder in
that.

Moduli, wall thicknesses and stiffness factors multiply each other, so that what the data determine is a
product: a curved, thin valley in the values, a straight one in their logarithms. Exponents are the other way
round. Affine invariant samplers forgive any linear change of coordinates but no bend, so the chart is worth
choosing. The density carries the Jacobian: what is sampled stays the same, priors included.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from .laplace import Laplace
from .target import Evaluator, Target

CLEAR = 4.0  # standard errors between the mode and zero, for a logarithm to be considered
PROBES = 64
WORTH = 0.9  # a bend must shrink at least to this fraction for another coordinate
WORST = 1e6  # difference of log-densities of a probe that is not possible at all


class Chart:
    """Which parameters move by their logarithm, and the way there and back.

    Args:
        sign: (n,) 0 for a parameter's own coordinate, 1 for its logarithm, -1 for that of minus its value.
    """

    def __init__(self, sign: Int[np.ndarray, " n"]):
        self.sign = np.asarray(sign, int)
        self._bent = self.sign != 0

    def forth(self, vector: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Coordinates of walkers from those of the target; values must have the chart's signs."""
        return np.where(self._bent, np.log(np.where(self._bent, self.sign * vector, 1.0)), vector)

    def back(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Coordinates of the target from those of walkers."""
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
    """The chart in which the posterior is nearest to its own Gaussian approximation, found greedily.

    Nearness is the mean of `log(1 + |difference of log-densities|)` over draws from the approximation, zero
    for a Gaussian. The descent begins both from plain coordinates and from logarithms wherever they are
    possible.

    Args:
        target: what is sampled.
        found: its Laplace approximation.
        spread: root of the covariance to probe.
        evaluator: of its log-probability.
        seed: of the probes.
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
    """Change one coordinate at a time, the best first, while that is worth it."""
    least = bend(sign)
    while candidates:
        trials = [np.where(np.arange(len(sign)) == i, s - sign[i], sign) for i, s in candidates.items()]
        bends = [bend(trial) for trial in trials]
        if not min(bends) < WORTH * least:
            break
        sign, least = trials[int(np.argmin(bends))], min(bends)
    return sign, least


def _candidates(target: Target, found: Laplace) -> list[tuple[int, int]]:
    """Parameters of one sign that stay clear of zero, with that sign; not those fitted by their logarithm
    already."""
    lower, upper = np.asarray(target.lower), np.asarray(target.upper)
    sd = np.sqrt(np.diag(found.covariance))
    clear = found.known & (np.abs(found.mode) > CLEAR * sd) & ~np.asarray(target.layout.logarithmic, bool)
    return [
        (i, 1 if lower[i] >= 0.0 else -1) for i in np.flatnonzero(clear & ((lower >= 0.0) | (upper <= 0.0)))
    ]
