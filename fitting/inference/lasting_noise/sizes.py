"""Probable sizes of the zeros of one output, given its recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .evidence import RIDGE, log_evidence, probabilities
from .zeros import Series, squares

DRIFTS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Candidate standard deviations of a drift at the end of a recording, in units of the noise."""
OFFSETS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Candidate standard deviations of a constant offset, in units of the noise."""
SCALES = (0.5, 0.59, 0.71, 0.84, 1.0, 1.19, 1.41, 1.68, 2.0, 2.38, 2.83)
"""Candidate factors on the white noise, which may be stated wrongly."""
STEADY = 0.5
"""Prior probability of a zero without drift, and of one without offset."""
CLEAR = 3.0
"""Bayes factor from which zeros count as off or drifting. Where recordings cannot tell, it is 1."""


@dataclass(frozen=True)
class Sizes:
    """What recordings tell for each probable size of zeros: of one output, or of several that share a hidden
    trajectory.

    Attributes:
        size: drift, offset and scale of the noise of each output, shape (sizes, outputs, 3).
        before: logarithm of the prior probability, shape (sizes,).
        evidence: marginal log-likelihood from these outputs alone, shape (sizes,).
        information: information about the parameters, shape (sizes, parameters, parameters).
        slope: derivative of half the loss by the parameters, shape (sizes, parameters).
        loss: square of the whitened residuals plus the logarithm of the noise's determinant, shape (sizes,).
    """

    size: np.ndarray
    before: np.ndarray
    evidence: np.ndarray
    information: np.ndarray
    slope: np.ndarray
    loss: np.ndarray

    @property
    def weight(self) -> np.ndarray:
        """Probability of each size from these outputs alone, shape (sizes,)."""
        return probabilities(self.before + self.evidence)


def sizes_of(series: Sequence[Series], precision: np.ndarray, pull: np.ndarray) -> Sizes:
    """Probable sizes of one output's zeros, and what its recordings tell beside each."""
    grid = list(product(DRIFTS, OFFSETS))
    count, shape = len(precision), (len(grid), len(SCALES))
    information, slope = np.zeros((*shape, count, count)), np.zeros((*shape, count))
    loss = np.zeros(shape)
    for one in series:
        for k, (drift, offset) in enumerate(grid):
            square, determinant = squares(one, drift, offset, np.array(SCALES))
            information[k] += square[:, :count, :count]
            slope[k] += square[:, :count, count]
            loss[k] += square[:, count, count] + determinant
    size = np.array([[(d, o, s) for s in SCALES] for d, o in grid]).reshape(-1, 1, 3)
    information, slope, loss = (x.reshape(-1, *x.shape[2:]) for x in (information, slope, loss))
    evidence = log_evidence(information, slope, loss, precision, pull)
    before = np.repeat([before_of(d, o) for d, o in grid], len(SCALES))
    return Sizes(size, before, evidence, information, slope, loss)


def decided(sizes: Sizes) -> Sizes:
    """The sizes with another prior, once zeros clearly drift, or are off: they do, by any size.

    The prior that any order of magnitude is alike serves that decision. Beside few recordings it would then
    pull sizes to zero. A flat one does not (A. Gelman, Bayesian Anal. 1 (2006) 515).
    """
    change, weight = np.zeros(len(sizes.before)), sizes.weight
    for one in sizes.size[:, :, :2].reshape(len(change), -1).T:
        if in_favour(float(weight[one == 0.0].sum()), STEADY) > CLEAR:
            change += np.log(one, where=one > 0.0, out=np.full(len(one), -np.inf))
    return replace(sizes, before=sizes.before + change)


def in_favour(after: float, before: float) -> float:
    """Bayes factor against a hypothesis, from its probabilities after and before the recordings."""
    return (1.0 - after) / max(after, RIDGE) * before / (1.0 - before)


def before_of(drift: float, offset: float) -> float:
    """Logarithm of the prior probability of a zero."""
    return float(np.log(_before(drift, DRIFTS) * _before(offset, OFFSETS)))


def _before(size: float, sizes: Sequence[float]) -> float:
    """Prior probability of a size: zero, or any order of magnitude alike."""
    return STEADY if size == 0.0 else (1.0 - STEADY) / (len(sizes) - 1)
