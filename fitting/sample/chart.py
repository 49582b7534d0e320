"""Sampling coordinates: a parameter, or its logarithm where that makes the posterior rounder.

Moduli, wall thicknesses and stiffness factors multiply each other, so the data determine a product. That is a
curved, thin valley in the values and a straight one in their logarithms. Exponents are better left plain.

Affine invariant samplers are insensitive to any linear change of coordinates, but not to a curvature, so the
chart matters. The density carries the Jacobian: the sampled distribution stays the same, priors included.
"""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .laplace import Laplace
from .plateaus import Plateaus, plateaus_of
from .target import LogDensity, Target

CLEAR = 4.0  # Minimum distance of the mode from zero for a logarithm, in standard errors
PROBES = 64  # Number of draws from the approximation that judge a chart
WORTH = 0.9  # Maximum ratio of the new to the old distance from a Gaussian for another coordinate
WORST = 1e6  # Difference of log-densities that stands for an impossible probe


class Chart:
    """Choice of the parameters that move by their logarithm or by a law's ends, and both conversions.

    Args:
        sign: 0 for a parameter's own coordinate, 1 for its logarithm, -1 for that of minus its value; shape
            (n,).
        plateaus: law whose constants move by its ends; None for none.
    """

    def __init__(self, sign: Int[np.ndarray, " n"], plateaus: Plateaus | None = None):
        self.sign, self.plateaus = np.asarray(sign, int), plateaus
        self._log = self.sign != 0

    def to_chart(self, vector: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Sampling coordinates from those of the target; values must have the chart's signs."""
        if self.plateaus is not None:
            vector = self.plateaus.straight(np.asarray(vector))
        return np.where(self._log, np.log(np.where(self._log, self.sign * vector, 1.0)), vector)

    def to_target(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Coordinates of the target from sampling coordinates."""
        # what is not finite is outside any bound
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            vector = np.where(self._log, self.sign * np.exp(np.where(self._log, point, 0.0)), point)
            return vector if self.plateaus is None else self.plateaus.plain(vector)

    def log_jacobian(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "..."]:
        """Logarithm of the Jacobian determinant of `to_target`; `plateaus` keep volumes."""
        return np.sum(np.where(self._log, point, 0.0), axis=-1)

    def density(self, evaluator: LogDensity) -> Callable[[np.ndarray], np.ndarray]:
        """Log-probability of sampling coordinates, as emcee's `vectorize=True` wants it."""
        return lambda point: evaluator(self.to_target(point)) + self.log_jacobian(point)

    def scaled_root(self, found: Laplace, spread: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
        """Square root of a covariance of the target in sampling coordinates, to first order at the mode."""
        scale = np.where(self._log, np.abs(found.mode), 1.0)
        if self.plateaus is not None:
            spread = np.asarray(jax.jacfwd(self.plateaus.straight)(jnp.asarray(found.mode))) @ spread
        return spread / np.where(scale > 0.0, scale, 1.0)[:, None]


def choose_chart(
    target: Target, found: Laplace, spread: Float[np.ndarray, "n n"], evaluator: LogDensity, seed: int
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

    def non_gaussianity(sign: np.ndarray, plateaus: Plateaus | None) -> float:
        chart = Chart(sign, plateaus)
        points = chart.to_chart(found.mode) + normal @ chart.scaled_root(found, spread).T
        density = chart.density(evaluator)(points) + 0.5 * np.sum(normal**2, axis=1)
        usable = np.isfinite(density)
        difference = np.full(PROBES, WORST)
        if usable.any():
            difference[usable] = np.abs(density[usable] - np.median(density[usable]))
        return float(np.mean(np.log1p(difference)))

    candidates = dict(_candidates(target, found))
    plain = np.zeros(target.dimension, int)
    plateaus = _law_by_its_ends(partial(non_gaussianity, plain), target)
    if plateaus is not None:
        candidates = {k: sign for k, sign in candidates.items() if k not in (plateaus.mean, plateaus.span)}
    distance = partial(non_gaussianity, plateaus=plateaus)
    logarithmic = np.array([candidates.get(i, 0) for i in range(target.dimension)])
    best, least = _descend(distance, plain, candidates)
    if candidates:
        other, its = _descend(distance, logarithmic, candidates)
        best = other if its < WORTH * least else best
    return Chart(best, plateaus)


def _law_by_its_ends(distance: Callable[[Plateaus | None], float], target: Target) -> Plateaus | None:
    """The ends by which a law's constants are best moved; None where the constants themselves are as good."""
    if target.sigmoid_law is None:
        return None
    offered = plateaus_of(target.sigmoid_law, target.layout, np.asarray(target.stored))
    distances = [distance(one) for one in offered]
    if not offered or not min(distances) < WORTH * distance(None):
        return None
    return offered[int(np.argmin(distances))]


def _descend(
    non_gaussianity: Callable[[np.ndarray], float], sign: np.ndarray, candidates: dict[int, int]
) -> tuple[np.ndarray, float]:
    """Change one coordinate at a time, the best first, while that reduces the distance enough."""
    least = non_gaussianity(sign)
    while candidates:
        trials = [np.where(np.arange(len(sign)) == i, s - sign[i], sign) for i, s in candidates.items()]
        values = [non_gaussianity(trial) for trial in trials]
        if not min(values) < WORTH * least:
            break
        sign, least = trials[int(np.argmin(values))], min(values)
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
