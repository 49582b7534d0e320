"""The joint fit of everything to everything, from several starts, with errors that know about misfit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fitting.calibrate.information import with_errors
from fitting.calibrate.profile_likelihood import ALIKE
from fitting.inference.least_squares import FitResult
from fitting.inference.parameters import Parameters
from fitting.inference.serial_correlation import correlation_time, inflation_of

from .information import information
from .misfit import force_misfit
from .problem import Problem

PROCESS_NOISE_ROUNDS = 2
"""Number of rounds of fitting and of estimating the process noise."""


@dataclass(frozen=True)
class Start:
    """Start and end of one joint fit.

    Attributes:
        name: name in words.
        result: result of the fit.
        problem: problem at the end of the fit, with the rule's decisions there.
    """

    name: str
    result: FitResult
    problem: Problem = field(repr=False)


@dataclass(frozen=True)
class Joint:
    """The joint fit.

    Attributes:
        problem: problem at the values found, its walks and inflation settled.
        result: the best fit.
        starts: every fit, the best one first.
        reduced_chi_square: reduced chi-square for the noise as stated, before any inflation; beside the zeros
            of the problem, if it has any.
        correlation_time: samples of the force's misfit that make one independent one.
    """

    problem: Problem
    result: FitResult
    starts: tuple[Start, ...]
    reduced_chi_square: float
    correlation_time: float

    @property
    def values(self) -> dict[str, float]:
        """Free parameters at the best fit, in SI."""
        return self.result.values

    @property
    def parameters(self) -> Parameters:
        """Free parameters with values and standard errors, in SI."""
        return self.result.parameters

    @property
    def inflation(self) -> float:
        """Factor on the noise, and so on the standard errors."""
        return self.problem.inflation


def fit_jointly(
    problem: Problem, staged: Mapping[str, float], progress: Callable[[str], None] = lambda _: None
) -> Joint:
    """Fit all free parameters to all tests.

    Args:
        problem: problem to be fitted.
        staged: values to start from, as the stages left them.
        progress: called with a word for each fit that begins.
    """
    values = dict(staged)
    for _ in range(PROCESS_NOISE_ROUNDS):
        progress("from the first values")
        problem = problem.at(values).with_process_noise(values)
        result, problem = problem.fitted_with()
        values = result.values
    return settled((Start("stages", result, problem),), progress)


def try_others(
    joint: Joint,
    others: Mapping[str, Mapping[str, float]],
    progress: Callable[[str], None] = lambda _: None,
    anew: bool = False,
) -> Joint:
    """Fit from further starts too, and keep the best.

    Args:
        joint: the fit from the stages.
        others: starts by name, each of them some of the values.
        progress: called with a word for each fit that begins.
        anew: true if these starts know nothing of the decisions of the fit so far.
    """
    if not others:
        return joint
    problem = joint.problem.inflated(1.0)
    problem = problem.undecided() if anew else problem
    starts = list(joint.starts)
    for name, other in others.items():
        progress(f"from {name}")
        starts.append(Start(name, *problem.at({**joint.values, **other}).fitted_with()))
    return best_of_all(joint, starts, progress)


def best_of_all(joint: Joint, starts: Sequence[Start], progress: Callable[[str], None]) -> Joint:
    """The joint fit with more starts: settled anew where another one is the best."""
    best = ranked(starts)
    if best[0] is joint.starts[0]:
        return replace(joint, starts=tuple(best))
    return settled(tuple(best), progress)


def settled(starts: tuple[Start, ...], progress: Callable[[str], None]) -> Joint:
    """The best fit with errors that know about misfit and serial correlation."""
    best, problem = starts[0].result, starts[0].problem
    misfit = list(force_misfit(problem, best.values).values())
    time, reduced = correlation_time(misfit), best.reduced_chi_square or np.nan
    factor = inflation_of(reduced, misfit)
    if factor > 1.0:
        progress("with the noise as found")
        problem = problem.inflated(factor)
        best, problem = problem.fitted_with()
    return Joint(problem, with_errors(best, lambda p: information(problem, p)), starts, float(reduced), time)


def ranked(starts: Sequence[Start]) -> list[Start]:
    """Best first: the smaller chi-square; of alike ones those that converged.

    A fit that stops on a kink of the residual strain is a fit nevertheless, only not as exactly at its end.
    """
    least = min(cost_of(start.result) for start in starts)

    def rank(start: Start) -> tuple[bool, bool, float]:
        cost = cost_of(start.result)
        return cost > least + ALIKE, cost <= least + ALIKE and not start.result.success, cost

    return sorted(starts, key=rank)


def alike(problem: Problem) -> float:
    """Chi-square, for the noise as stated, within which two fits are as good.

    It counts in the unit of the noise as found (`Problem.found`).
    """
    return ALIKE * problem.found**2


def cost_of(result: FitResult) -> float:
    """Chi-square of a fit; infinite where it has none."""
    return np.inf if result.chi_square is None else result.chi_square


def shifted(result: FitResult, sizes: float) -> dict[str, float]:
    """Values moved along the loosest direction of a fit, by a number of its standard deviations."""
    names = result.uncertainty.names
    covariance = result.uncertainty.covariance
    if not names:
        return {}
    scale = np.sqrt(np.diag(covariance))
    width, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    step = sizes * np.sqrt(width[-1]) * axes[:, -1] * scale
    changes = dict(zip(names, step, strict=True))
    entries = {name: result.parameters[name] for name in names}
    return {name: float(np.clip(e.value + changes[name], e.min, e.max)) for name, e in entries.items()}
