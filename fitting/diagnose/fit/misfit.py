"""Misfit of a fitted model, and its predictive chi-square and density on recordings that were not fitted."""

import numpy as np
from scipy.optimize import lsq_linear

from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit

OPTIMISER = DEFAULT.optimiser
VERDICT = DEFAULT.verdict


def reduced(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value of some recordings, given by a mask."""
    return fit.evaluation.chi2(chosen.astype(float)) / max(program.observations(chosen), 1)


def scored(program: Program) -> tuple[np.ndarray, np.ndarray]:
    """Masks of fitted and of scored recordings: the fitted ones again where none is for validation."""
    return program.fitted, program.unseen if np.any(program.unseen) else program.fitted


def spread(program: Program, chosen: np.ndarray) -> float:
    """Standard deviation of the reduced chi-square of some recordings by chance."""
    return float(np.sqrt(2.0 / max(program.observations(chosen), 1)))


def limit_of(program: Program, chosen: np.ndarray) -> float:
    """Reduced chi-square of some recordings up to which nothing counts as left over."""
    return 1.0 + max(VERDICT.minimum_excess, VERDICT.minimum_deviations * spread(program, chosen))


def predictive_chi_square(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Predictive chi-square per value: `reduced`, in units of the errors of the fit's predictions.

    It is computed to first order, with every number within its bounds. For fitted recordings it is `reduced`.
    """
    if np.any(chosen & program.fitted):
        return reduced(program, fit, chosen)
    r, A = fit.evaluation.joined(chosen.astype(float))
    variances, axes = np.linalg.eigh(fit.covariance)  # which may be singular to rounding
    held = (axes * np.maximum(variances, OPTIMISER.singular_share * variances.max()) ** -0.5).T
    at, unknowns = fit.u[fit.free], program.unknowns
    low, high = (
        unknowns.low[fit.free] - at - OPTIMISER.bound_gap,
        unknowns.high[fit.free] - at + OPTIMISER.bound_gap,
    )
    both = np.concatenate([A, held]), np.concatenate([-r, np.zeros(len(at))])
    square = 2.0 * lsq_linear(*both, (low, high), method="bvls").cost
    return float(square) / max(program.observations(chosen), 1)


def negative_log_predictive_density(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Negative log predictive density of recordings that were not fitted, less constants.

    For fitted recordings it is half their chi-square.
    """
    square = predictive_chi_square(program, fit, chosen) * program.observations(chosen)
    if np.any(chosen & program.fitted):
        return 0.5 * square
    _, A = fit.evaluation.joined(chosen.astype(float))
    span = program.unknowns.high[fit.free] - program.unknowns.low[fit.free]
    known = np.linalg.inv(fit.covariance) + np.diag(12.0 / span**2)  # within bounds at the widest
    widened = np.linalg.slogdet(known + A.T @ A)[1] - np.linalg.slogdet(known)[1]
    return 0.5 * float(square + widened)


def floor(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value that noise explains: 1, or that of second differences of the misfit.

    Noise that grows with its signal leaves more in recordings of large signals. Physics leaves slow misfit.
    """
    steps = [np.zeros(0)]
    for k in np.flatnonzero(chosen):
        first = 0
        for channel in program.channels[k]:
            size = len(channel.measured)
            r = fit.evaluation.misfit[k][first : first + size][np.isfinite(channel.sigma)]
            steps.append(np.diff(r, 2) ** 2 / 6.0)
            first += size
    total = float(np.sum(np.concatenate(steps)))
    return max(1.0, total / max(program.observations(chosen), 1))
