"""Parameter sets that fit equally well although they are not the same: wrong-but-good fits, exposed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fitting.inference.least_squares.covariance import Uncertainty

from .joint import Joint
from .problem import came_to_an_end

EQUAL = 6.0
"""Maximum excess of chi-square of a fit that is as good (a p-value of 5 % for two directions)."""
APART = 5.0
"""Minimum distance from the best fit for another one, in standard errors of a linear model [sd]."""


@dataclass(frozen=True)
class Mode:
    """Another parameter set that fits as well as the best one.

    Attributes:
        start: start that led to it, in words.
        values: free parameters, SI.
        worse_by: chi-square above the best fit's; negative is better.
        distance: distance from the best fit, in standard deviations of the linear model.
        different: parameters that differ most, each with its change in standard errors, largest first.
        converged: true if that fit reports convergence.
    """

    start: str
    values: dict[str, float]
    worse_by: float
    distance: float
    different: tuple[tuple[str, float], ...]
    converged: bool


def other_modes(joint: Joint) -> list[Mode]:
    """Fits from other starts that are as good as the best one but not near it.

    A distance of d standard deviations should cost d^2 of chi-square. Where it costs next to nothing, the
    data do not choose: either there is a second minimum, or a curved valley between the two. A fit that
    stalled is another parameter set that explains the tests all the same. A fit is ignored if no parameter
    differs by more than one standard error, even if the distance is large.

    Args:
        joint: joint fit with all its starts and the errors of its best fit alone, before `spanned` adds
            the spread of the other fits.
    """
    best, errors = joint.starts[0].result, joint.result.uncertainty
    if best.chi_square is None:
        return []
    found: list[Mode] = []
    for start in joint.starts[1:]:
        result = start.result
        if result.chi_square is None:
            continue
        worse = result.chi_square - best.chi_square
        distance, different = apart(errors, best.values, result.values)
        if worse > EQUAL or not different or distance < max(APART, 2.0 * np.sqrt(max(worse, 0.0))):
            continue
        if any(apart(errors, known.values, result.values)[0] < APART for known in found):
            continue
        values = {name: result.values[name] for name in joint.problem.parameters}
        found.append(Mode(start.name, values, float(worse), distance, different, came_to_an_end(result)))
    return found


def apart(
    errors: Uncertainty, best: Mapping[str, float], other: Mapping[str, float]
) -> tuple[float, tuple[tuple[str, float], ...]]:
    """Mahalanobis distance of two parameter sets [sd], and up to four parameters that change most, each with
    its change [standard errors]."""
    names = errors.names
    if not names:
        return 0.0, ()
    change = np.array([other[name] - best[name] for name in names])
    scale = np.sqrt(np.diag(errors.covariance))
    correlation = errors.covariance / np.outer(scale, scale)
    inverse = np.linalg.pinv(correlation, rcond=1e-10, hermitian=True)
    distance = float(np.sqrt(max(change / scale @ inverse @ (change / scale), 0.0)))
    order = np.argsort(-np.abs(change / scale))
    different = tuple(
        (names[k], float(change[k] / scale[k])) for k in order[:4] if abs(change[k] / scale[k]) > 1.0
    )
    return distance, different
