"""Predictive chi-square and density of recordings that were not fitted.

A fit leaves its numbers uncertain, within their priors and bounds. A recording contradicts the model only
by what no numbers explain that the fitted recordings allow. So the predictive chi-square is the growth of the
least objective when a recording is fitted, too. For a linear model it is the squared misfit in units of the
errors of prediction.

It is found by a fit to all of these recordings. That has two starts, and begins at the better one: the fit
itself, and the numbers that the first order about it promises. The least objective before is that where the
fit itself ends, or where this one ends without the further recordings. Neither needs to be the best minimum.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pneusma_jax.late import Late

from ..evaluate.program import Program
from ..settings import DEFAULT
from .misfit import reduced
from .refit import Fit, Refitter, Shown

optimize = Late("scipy.optimize")

OPTIMISER = DEFAULT.optimiser


@dataclass(frozen=True)
class Loss:
    """Values that were not fitted, under a model with effects and under the best one with fewer.

    Attributes:
        fewer, named: negative log predictive densities of both models, less constants [nat].
        values: number of values.
    """

    fewer: float
    named: float
    values: float

    @property
    def nats(self) -> float:
        """Log predictive density that the effects cost [nat]."""
        return self.named - self.fewer

    @property
    def before(self) -> float:
        """Predictive reduced chi-square without the effects, open numbers included [1]."""
        return 2.0 * self.fewer / max(self.values, 1.0)

    @property
    def growth(self) -> float:
        """Growth of the predictive reduced chi-square by the effects, open numbers included [1]."""
        return 2.0 * self.nats / max(self.values, 1.0)


def predictive_chi_square(
    program: Program, fit: Fit, chosen: np.ndarray, shown: Shown | None = None
) -> float:
    """Predictive chi-square per value: `reduced`, in units of the errors of the fit's predictions.

    For fitted recordings it is `reduced`.

    Args:
        program: program of the campaign.
        fit: model.
        chosen: mask of the recordings.
        shown: adds a saved discrepancy to an evaluation. The discrepancy stays as it is when numbers move.
    """
    if np.any(chosen & program.fitted):
        return reduced(program, with_shown(fit, shown), chosen)
    return _prediction(program, fit, chosen, shown)[0] / max(program.observations(chosen), 1)


def negative_log_predictive_density(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Negative log predictive density of recordings that were not fitted, less constants.

    For fitted recordings it is half their chi-square. What a latent trajectory follows by chance has no price
    here.
    """
    if np.any(chosen & program.fitted):
        return 0.5 * reduced(program, fit, chosen) * program.observations(chosen)
    return 0.5 * sum(_prediction(program, fit, chosen))


def with_shown(fit: Fit, shown: Shown | None) -> Fit:
    """A fit whose evaluation has a saved discrepancy, if there is one."""
    return fit if shown is None else replace(fit, evaluation=shown(fit.evaluation))


def _prediction(
    program: Program, fit: Fit, chosen: np.ndarray, shown: Shown | None = None
) -> tuple[float, float]:
    """Predictive chi-square of recordings that were not fitted, and log determinant of what it widens by.

    It is kept with the fit, unless a discrepancy is beside it.
    """
    if shown is not None:
        return _Growth(program, with_shown(fit, shown), chosen, shown).found()
    return fit.predicted("growth", program, chosen, lambda: _Growth(program, fit, chosen).found())


class _Growth:
    """Growth of the least objective when further recordings are fitted, too.

    Args:
        program: program of the campaign.
        fit: model, with its discrepancy.
        chosen: mask of the further recordings.
        shown: adds the discrepancy to an evaluation.
    """

    def __init__(self, program: Program, fit: Fit, chosen: np.ndarray, shown: Shown | None = None):
        self.program, self.fit, self.chosen = program, fit, chosen
        owners = (program.unknowns.items[k].effect for k in fit.free)
        self.slugs = tuple(dict.fromkeys(slug for slug in owners if slug))  # in the order of the free numbers
        self.alone = Refitter(program, program.fitted.astype(float), shown)
        self.both = Refitter(program, (program.fitted | chosen).astype(float), shown)

    def found(self) -> tuple[float, float]:
        """Twice the growth, and the log determinant by which the further recordings inform the numbers."""
        if not self.fit.free.size:  # nothing gives way
            return self.fit.evaluation.chi2(self.chosen.astype(float)), 0.0
        least = self._least(self.fit)
        starts = self.fit, self.both.at(self.fit, self._promised())
        start = min(starts, key=lambda one: self.both.objective(one.u, one.free, one.evaluation))
        both = self.both.fit(self.slugs, start)
        if self.alone.objective(both.u, both.free, both.evaluation) < least:  # a better minimum
            least = self._least(both)
        return 2.0 * (both.objective - least), self._widened(both)

    def _least(self, start: Fit) -> float:
        """Least objective of the fitted recordings alone, from a start, which may have a way to go there.

        Where steps fail, as at a kink, what the next one promises is not to be had.
        """
        fit = self.alone.fit(self.slugs, start, complete=False)
        return self.alone.promised(fit) if self.alone.ended(fit) else fit.objective

    def _promised(self) -> np.ndarray:
        """Step of the free numbers to the least objective to first order, within bounds."""
        fit, unknowns = self.fit, self.program.unknowns
        low, high = unknowns.low[fit.free] - fit.u[fit.free], unknowns.high[fit.free] - fit.u[fit.free]
        within = low - OPTIMISER.rounding, high + OPTIMISER.rounding
        r, A = fit.evaluation.joined(self.chosen.astype(float))
        held, pull = self._held
        rows, missed = np.concatenate([A, held]), np.concatenate([-r, -pull])
        step = optimize.lsq_linear(rows, missed, within, method="bvls").x
        return np.clip(step, low, high)

    def _widened(self, fit: Fit) -> float:
        """Log determinant by which the further recordings inform a fit's numbers, by its own derivatives."""
        held, _ = self._held
        span = self.program.unknowns.high[fit.free] - self.program.unknowns.low[fit.free]
        known = held.T @ held + np.diag(12.0 / span**2)  # numbers lie within their bounds at the widest
        _, A = fit.evaluation.joined(self.chosen.astype(float))
        return float(np.linalg.slogdet(known + A.T @ A)[1] - np.linalg.slogdet(known)[1])

    @cached_property
    def _held(self) -> tuple[np.ndarray, np.ndarray]:
        """A fit's objective as squares: matrix and vector, whose squared sum about the fit it is twice.

        The matrix is a square root of the inverse covariance, which may be singular to rounding.
        """
        variances, axes = np.linalg.eigh(self.fit.covariance)
        root = np.sqrt(np.maximum(variances, OPTIMISER.rounding * variances.max()))
        return (axes / root).T, root * (axes.T @ self.alone.gradient(self.fit))
