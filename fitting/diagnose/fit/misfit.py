"""Misfit of a fitted model, and its predictive chi-square and density on recordings that were not fitted."""

import numpy as np
from scipy.optimize import lsq_linear

from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit, Refitter

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


def predictive_chi_square(
    program: Program, fit: Fit, chosen: np.ndarray, only_to_first_order: bool = False
) -> float:
    """Predictive chi-square per value: `reduced`, in units of the errors of the fit's predictions.

    It is what the objective grows by if the recordings are fitted, too, to first order about the fit. Where
    that is more than noise leaves, the model is fitted to all of them: constants that a fit leaves open may
    have far to go. For fitted recordings it is `reduced`.

    Args:
        program: program of the campaign.
        fit: model.
        chosen: mask of the recordings.
        only_to_first_order: true for a model with a saved discrepancy, which cannot be fitted again.
    """
    if np.any(chosen & program.fitted):
        return reduced(program, fit, chosen)
    found = _to_first_order if only_to_first_order else _prediction
    return found(program, fit, chosen)[0] / max(program.observations(chosen), 1)


def negative_log_predictive_density(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Negative log predictive density of recordings that were not fitted, less constants.

    For fitted recordings it is half their chi-square.
    """
    if np.any(chosen & program.fitted):
        return 0.5 * reduced(program, fit, chosen) * program.observations(chosen)
    return 0.5 * sum(_prediction(program, fit, chosen))


def _prediction(program: Program, fit: Fit, chosen: np.ndarray) -> tuple[float, float]:
    """Predictive chi-square of recordings that were not fitted, and log determinant of what it widens by.

    It is kept with the fit.
    """
    key = id(program), fit.u.tobytes(), chosen.tobytes()
    known = fit.predictions.get(key)
    if known is None or known[0] is not program:  # a program that is kept keeps its id
        found = _to_first_order(program, fit, chosen)
        if found[0] > limit_of(program, chosen) * program.observations(chosen):
            found = _by_refit(program, fit, chosen)
        known = fit.predictions[key] = program, found
    return known[1]


def _to_first_order(program: Program, fit: Fit, chosen: np.ndarray) -> tuple[float, float]:
    """See `_prediction`; every number moves within its bounds."""
    r, A = fit.evaluation.joined(chosen.astype(float))
    at, unknowns = fit.u[fit.free], program.unknowns
    low, high = (
        unknowns.low[fit.free] - at - OPTIMISER.bound_gap,
        unknowns.high[fit.free] - at + OPTIMISER.bound_gap,
    )
    both = np.concatenate([A, _held(fit)]), np.concatenate([-r, np.zeros(len(at))])
    square = 2.0 * lsq_linear(*both, (low, high), method="bvls").cost
    known = _information(program, fit)
    return float(square), float(np.linalg.slogdet(known + A.T @ A)[1] - np.linalg.slogdet(known)[1])


def _by_refit(program: Program, fit: Fit, chosen: np.ndarray) -> tuple[float, float]:
    """See `_prediction`; the model is fitted to the recordings as well, from where it ended."""
    both = Refitter(program, (program.fitted | chosen).astype(float)).fit(fit.slugs, fit)
    alone = Refitter(program)
    before = min(alone.objective(one.u, one.free, one.evaluation) for one in (fit, both))
    widened = (np.linalg.slogdet(_information(program, one))[1] for one in (both, fit))
    return 2.0 * (both.objective - before), float(np.subtract(*widened))


def _information(program: Program, fit: Fit) -> np.ndarray:
    """Inverse covariance of a fit's numbers, which lie within their bounds at the widest."""
    span, held = program.unknowns.high[fit.free] - program.unknowns.low[fit.free], _held(fit)
    return held.T @ held + np.diag(12.0 / span**2)


def _held(fit: Fit) -> np.ndarray:
    """Square root of the inverse covariance of a fit's numbers, which may be singular to rounding."""
    variances, axes = np.linalg.eigh(fit.covariance)
    return (axes * np.maximum(variances, OPTIMISER.singular_share * variances.max()) ** -0.5).T


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
