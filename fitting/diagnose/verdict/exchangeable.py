"""Constants within their tolerances and errors of instruments that explain the same misfit.

A rest length that is known to 2 % takes up an offset of the pressure, and leaves noise. So a report
says how far a constant moved. It says which error of an instrument fits as well, with the constant at its
nominal value. All of it is to first order about a fit: one evaluation, then normal equations.
"""

from dataclasses import dataclass

import numpy as np

from fitting.specimens import specimen_of
from fitting.specimens.priors import identifies
from fitting.specimens.rows import MARK
from fitting.specimens.silicones import FACTOR
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.effects import CATALOGUE

from ..evaluate.program import Program
from ..fit.evidence import inflation_of
from ..fit.refit import Fit, prior_sd
from ..settings import DEFAULT

CHANCE = DEFAULT.chance
EVIDENCE = DEFAULT.evidence
OPTIMISER = DEFAULT.optimiser

INSTRUMENT = "sensor"
"""Component of effects that are errors of instruments."""


@dataclass(frozen=True)
class Exchange:
    """A constant of the base model, and a strength that would do the same.

    Attributes:
        constant: index of the constant among the unknowns.
        strength: index of the strength.
        value: scaled strength that fits as well with the constant at its nominal value.
        named: true if the model has the effect already, beside the constant that moved.
    """

    constant: int
    strength: int
    value: float
    named: bool


def exchanges_of(program: Program, fit: Fit) -> list[Exchange]:
    """Constants that moved, each with the strengths of instruments that would explain the same.

    Those of an alloy or a material that is to be identified are left out: nobody states them. A law that was
    fitted to the recordings before the search is one of these.

    Args:
        program: program of the campaign.
        fit: model whose constants are asked about.
    """
    unknowns = program.unknowns
    slugs = [slug for slug in unknowns.slugs if CATALOGUE[slug].component == INSTRUMENT]
    strengths = np.concatenate([np.zeros(0, int), *(unknowns.amplitudes(slug) for slug in slugs)]).astype(int)
    absent = np.setdiff1d(strengths, fit.free)
    columns = np.concatenate([fit.free, absent]).astype(int)
    here = program.evaluate(fit.u, columns, near=fit.evaluation, chosen=program.fitted)
    misfit, J = here.joined(program.fitted.astype(float))
    inflation = inflation_of(program, fit)
    prior = np.concatenate([prior_sd(unknowns, fit.free) ** -2, np.zeros(len(absent))])
    gradient = J.T @ misfit / inflation + prior * (fit.u[columns] - unknowns.neutral[columns])
    normal = _Normal(J.T @ J / inflation + np.diag(prior), gradient)
    own, found = np.arange(len(fit.free)), []
    place = {int(k): n for n, k in enumerate(columns)}
    identified = _to_identify(program)
    for k in np.intersect1d(unknowns.base, fit.free):
        if unknowns.items[k].name.partition(MARK)[0] in identified:
            continue
        j = place[int(k)]
        cost, step = normal.rise(own, j, -fit.u[k])  # with the constant back at its nominal value
        for e in strengths:
            n = place[int(e)]
            named = e not in absent
            if named:  # without the constant's move it fits as well, at another strength
                there = fit.u[e] + step[n]
                moved = abs(step[n]) > CHANCE.deviations * normal.sd(own[own != j], n)
                alike = cost < EVIDENCE.minimum_difference and moved
            else:  # the constant's move is needed without the effect, and not with it
                beside, other = normal.rise(np.append(own, n), j, -fit.u[k])
                there = other[n]
                alike = cost >= EVIDENCE.minimum_first and beside < EVIDENCE.minimum_difference
            if alike and unknowns.low[e] <= there <= unknowns.high[e]:
                found.append(Exchange(int(k), int(e), float(there), bool(named)))
    return found


def _to_identify(program: Program) -> set[str]:
    """Names of the constants of an alloy or a material that the recordings are to tell."""
    names: set[str] = set()
    for key in specimen_of(program.kind).identified:
        if identifies(program.recordings, [key]):
            names |= set(QUANTITIES["alloy"]) if key == "alloy" else {FACTOR, *QUANTITIES["silicone"]}
    return names


class _Normal:
    """Normal equations of a fit to first order: an objective that is quadratic in the numbers.

    Args:
        information: second derivatives, (numbers, numbers).
        gradient: first derivatives, (numbers,).
    """

    def __init__(self, information: np.ndarray, gradient: np.ndarray):
        self._information, self._gradient = information, gradient

    def rise(self, free: np.ndarray, held: int, step: float) -> tuple[float, np.ndarray]:
        """Rise of the objective if one free number makes a step and the others follow, and all steps.

        Args:
            free: places of the numbers that are free, the held one among them.
            held: place of that number.
            step: its step, scaled.

        Returns:
            The rise [nat], and the steps, (numbers,); zero for numbers that are not free.
        """
        steps = np.zeros(len(self._gradient))
        steps[held] = step
        others = free[free != held]
        steps[others] = -self._inverse(others) @ (
            self._gradient[others] + self._information[others, held] * step
        )
        rise = self._gradient @ steps + 0.5 * steps @ self._information @ steps
        return float(rise), steps

    def sd(self, free: np.ndarray, one: int) -> float:
        """Standard deviation of one number while `free` ones are open, itself among them."""
        (place,) = np.flatnonzero(free == one)
        return float(np.sqrt(self._inverse(free)[place, place]))

    def _inverse(self, free: np.ndarray) -> np.ndarray:
        """Covariance of free numbers; numbers that nothing tells do not move."""
        return np.linalg.pinv(self._information[np.ix_(free, free)], OPTIMISER.rounding, hermitian=True)
