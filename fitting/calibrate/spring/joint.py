"""The joint fit of everything to everything, from several starts, with errors that know about misfit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fitting.calibrate.information import with_errors
from fitting.calibrate.profile_likelihood import ALIKE
from fitting.inference.lasting_noise import Size
from fitting.inference.least_squares import FitResult
from fitting.inference.noise import correlation_time, inflation_of
from fitting.inference.parameters import Parameters
from fitting.specimens.rows import numbers
from fitting.specimens.spring_rows import MARGIN, OUTPUTS, spring_of

from .information import information
from .problem import Problem, residuals_and_freedom, values_of
from .stand_tests import STATED, level_at_rest

MISFIT = 1.3
"""Minimum reduced chi-square that counts as misfit."""
RETRIES = 6
"""Maximum number of fits that start from the values of the other tests."""
FEWEST = 3
"""Minimum number of tests for one of them to be left out."""
WIDE_MARGIN = 0.15
"""Part of the residual strain by which turning points may be off the rule at first."""
MOST_ENDS = 3
"""Maximum number of fits, the best first, that a search goes on from."""
MOST_REPEATS = 3
"""Maximum number of times that each of them is fitted again, while it helps."""
DEVIATIONS = 3.0
"""Maximum excess of chi-square over what is expected that chance makes [sd]."""
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
    return _settled((Start("stages", result, problem),), progress)


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
    starts = _ranked(starts)
    if starts[0] is joint.starts[0]:
        return replace(joint, starts=tuple(starts))
    return _settled(tuple(starts), progress)


def retried(joint: Joint, progress: Callable[[str], None] = lambda _: None) -> Joint:
    """Fit again from where the others end without a test that is badly missed, while that helps.

    The rule decides from rough constants, and its decisions in a test can hold them where they are. Then its
    row of memory is wrong, but the constants have adapted to it, so that it looks right from there. The other
    tests, fitted without that one, lead to better decisions.

    Args:
        joint: any fit.
        progress: called with a word for each fit that begins.
    """
    tried: set[int] = set()
    for _ in range(RETRIES):
        problem, best = joint.starts[0].problem, joint.starts[0].result
        series = force_misfit(problem, best.values)
        square = {k: float(np.mean(misfit**2)) for k, misfit in series.items()}
        worst = [k for k in sorted(square, key=lambda k: -square[k]) if square[k] > MISFIT and k not in tried]
        if not worst or len(square) < FEWEST:
            break
        tried.add(worst[0])
        name = f"the tests without {problem.tests[worst[0]].name}"
        progress(f"from {name}")
        rest, _ = problem.fitted_with(tests=[k for k in square if k != worst[0]])
        start = Start(name, *problem.at(rest.values).fitted_with())
        starts = _ranked([*joint.starts, start])
        better = starts[0] is start and _cost(start.result) < _cost(best) - ALIKE
        joint = replace(joint, starts=tuple(starts if better else [*joint.starts, start]))
        tried = set() if better else tried
    if joint.starts[0].problem is joint.problem or joint.starts[0].result is joint.result:
        return joint  # it is settled already: no start is better
    return _settled(joint.starts, progress)


def loosened(joint: Joint, progress: Callable[[str], None] = lambda _: None) -> Joint:
    """Fit again from where the best fits end, with turning points farther off the rule at first.

    Constants that have given way to one wrong renewal of the memory keep it: by the rule it is right at these
    constants. The force says otherwise as soon as the rule may be wrong by more.

    Args:
        joint: joint fit with all its starts.
        progress: called with a word for each fit that begins.
    """

    def wider_first(problem: Problem) -> Problem:
        return problem.with_turning_margin(WIDE_MARGIN).fitted_with()[1].with_turning_margin(MARGIN)

    return _gone_on(joint, joint.starts[:MOST_ENDS], wider_first, "turning points freed", progress)


def decided_anew(joint: Joint, progress: Callable[[str], None] = lambda _: None) -> Joint:
    """Fit again from where the best fits end, without the decisions that they were found with.

    A fit decides again and again, and its last decisions are among those that it may choose from. They fit
    best at its constants, as these have adapted to them. So a fit, and all that begin with its decisions, may
    stay with wrong ones. Decided from the readings alone, another history of the memory takes their place.

    Args:
        joint: joint fit with all its starts.
        progress: called with a word for each fit that begins.
    """
    how = "decided anew"
    ends = [start for start in _ends(joint) if not start.name.endswith(how)]
    return _gone_on(joint, ends, Problem.undecided, how, progress)


def held_at_ends(joint: Joint, progress: Callable[[str], None] = lambda _: None) -> Joint:
    """The fit with tests held at full cold or full heat, where a free fraction explains them no better.

    Such a trajectory is at its limit, which noise crosses one way only. It then follows the noise and draws
    the constants after it: the austenite's stiffness by half an error. A free trajectory is expected to
    explain as much noise as it has degrees of freedom. A test is held unless it explains clearly more. One
    whose phase is stated is left as it is stated.

    Args:
        joint: joint fit of a known alloy.
        progress: called with a word for each fit that begins.
    """
    best, levels = joint.starts[0], {}
    if best.result.chi_square is None:
        return joint
    problem, cost = best.problem.inflated(1.0), best.result.chi_square
    rows = problem.data()["rows"]
    values = values_of(problem.parameters, best.result.values)
    taken = residuals_and_freedom(values, rows)[1]
    for k in problem.free_tests:
        level = level_at_rest(spring_of(numbers(values, problem.rows[k])), problem.tests[k])
        if level is None or problem.tests[k].reason == STATED:
            continue
        progress(f"{problem.tests[k].name} held at its phase")
        found = _cost(problem.with_phases({**levels, k: level}).fit())
        if found <= cost + taken[k] + DEVIATIONS * np.sqrt(2.0 * max(taken[k], 1.0)):
            levels[k], cost = level, found
    if not levels:
        return joint
    starts = []
    for end in _ends(joint):
        alike = [start.name for start in joint.starts if abs(_cost(start.result) - _cost(end.result)) < ALIKE]
        progress(f"from {end.name}, phases held")
        held = end.problem.inflated(1.0).with_phases(levels).fitted_with()
        starts += [Start(f"{name}, phases held", *held) for name in alike]
    return _settled(tuple(_ranked(starts)), progress)


def beside_zeros(
    joint: Joint,
    sizes: Mapping[str, Size],
    progress: Callable[[str], None] = lambda _: None,
    steady: bool = False,
) -> Joint:
    """The fit with noise that zeros of these sizes correlate; the same where they do not explain it.

    A zero is the reading of an instrument without load. It may be off by a constant, and drift.

    Each end of the fit goes on by itself, as the order of two may change. The variances of the walks are
    found anew beside these zeros: a fraction that walked as a zero drifts would take its place. All ends have
    those of the best one, so that their chi-squares compare.

    Args:
        joint: joint fit with all its starts.
        sizes: sizes of the zeros by output.
        progress: called with a word for each fit that begins.
        steady: true if the fractions of cold wires are taken as steady.
    """
    starts, how = [], ", beside zeros"
    walking = joint.problem.with_zeros(sizes).with_process_noise(joint.values)
    walking = walking.with_steady_cold_tests() if steady else walking
    for start in _ends(joint):
        name = start.name.removesuffix(how) + how
        progress(f"from {name}")
        problem = start.problem.inflated(1.0).with_zeros(sizes).with_walks_of(walking).at(start.result.values)
        starts.append(Start(name, *problem.fitted_with()))
    starts = _ranked(starts)
    if not (starts[0].result.reduced_chi_square or np.inf) <= MISFIT:
        return joint
    return _settled(tuple(starts), progress)


def _ends(joint: Joint) -> list[Start]:
    """The best starts, one from each end, so that fits that agree stay independent of each other."""
    ends: list[Start] = []
    for start in joint.starts:
        if not any(abs(_cost(start.result) - _cost(one.result)) < ALIKE for one in ends):
            ends.append(start)
    return ends[:MOST_ENDS]


def _gone_on(
    joint: Joint,
    begun: Sequence[Start],
    change: Callable[[Problem], Problem],
    how: str,
    progress: Callable[[str], None],
) -> Joint:
    """Fit again from where some fits end, with a changed problem each, while that helps."""
    starts = list(joint.starts)
    for start in begun:
        known = start
        for _ in range(MOST_REPEATS):
            name = f"{start.name}, {how}"
            progress(f"from {name}")
            found = Start(name, *change(known.problem).fitted_with())
            if not _cost(found.result) < _cost(known.result) - ALIKE:
                break
            known = found
        if known is not start:
            starts.append(known)
    starts = _ranked(starts)
    if starts[0] is joint.starts[0]:
        return replace(joint, starts=tuple(starts))
    return _settled(tuple(starts), progress)


def spanned(joint: Joint) -> Joint:
    """The same fit with errors that span the other fits which are nearly as good.

    With other turning points in the memory other constants fit as well. The curvature about one of them knows
    nothing of the others. Every fit gets the probability that its chi-square implies, in units of
    `chi_square_unit`, and the second moment about the best one is added. That is nothing if all starts end at
    one place.

    Args:
        joint: joint fit with all its starts.
    """
    best = joint.result
    names = best.uncertainty.names
    if not names or len(joint.starts) < 2:
        return joint
    least, unit = min(_cost(start.result) for start in joint.starts), chi_square_unit(joint)
    centre = np.array([joint.starts[0].result.values[n] for n in names])
    more, total = np.zeros((len(names), len(names))), 0.0
    for start in joint.starts:
        weight = float(np.exp(-0.5 * (_cost(start.result) - least) / unit))
        away = np.array([start.result.values[n] for n in names]) - centre
        more, total = more + weight * np.outer(away, away), total + weight
    covariance = best.uncertainty.covariance + more / total
    sd = np.sqrt(np.diag(covariance))
    parameters, errors = best.parameters.copy(), dict(best.uncertainty.standard_errors)
    for name, error in zip(names, map(float, sd), strict=True):
        parameters[name].set(standard_error=error)
        errors[name] = error
    wider = replace(
        best.uncertainty,
        standard_errors=errors,
        covariance=covariance,
        correlation=covariance / np.outer(sd, sd),
    )
    return replace(joint, result=replace(best, parameters=parameters, uncertainty=wider))


def lead(joint: Joint) -> float:
    """Chi-square by which the best fit is better than all others; 0 where another start ended there."""
    costs = sorted(_cost(start.result) for start in joint.starts)
    return costs[1] - costs[0] if len(costs) > 1 and costs[1] - costs[0] > ALIKE else 0.0


def chi_square_unit(joint: Joint) -> float:
    """Chi-square for the noise as stated that counts as 1 between fits: the noise's inflation squared.

    If no other start ends at the best fit, nobody knows that it is the best. Then it is at least the best
    fit's lead over the next.
    """
    return max(joint.inflation**2, lead(joint))


def missed(problem: Problem, values: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Root mean square misfit at values over the noise as stated, by fitted test and output [1]."""
    found, _ = residuals_and_freedom(values_of(problem.parameters, values), problem.stacked)
    return {
        (problem.tests[k].name, output): float(np.sqrt(np.mean(series**2)))
        for output in OUTPUTS
        for k, series in _misfit_by_test(problem, found, output).items()
    }


def force_misfit(problem: Problem, values: Mapping[str, float]) -> dict[int, np.ndarray]:
    """Misfit of the force over its noise as stated, of every fitted test with a force, by its index.

    Each is in the order of sampling, shape (samples with a force,).
    """
    found, _ = residuals_and_freedom(values_of(problem.parameters, values), problem.stacked)
    return _misfit_by_test(problem, found, "force")


def _misfit_by_test(problem: Problem, residuals: np.ndarray, output: str) -> dict[int, np.ndarray]:
    """Misfit of an output over its noise, of every fitted test that has it, by its index.

    Args:
        problem: the problem.
        residuals: those of all tests, the outputs one after the other, shape (tests, outputs * rows).
        output: name of the output.
    """
    rows, place = problem.stacked.mask.shape[1], OUTPUTS.index(output)
    weight = np.asarray(problem.stacked.weight[output])
    series = {k: residuals[k, place * rows : (place + 1) * rows][weight[k] > 0.0] for k in problem.fitted}
    return {k: misfit for k, misfit in series.items() if misfit.size}


def _settled(starts: tuple[Start, ...], progress: Callable[[str], None]) -> Joint:
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


def _ranked(starts: Sequence[Start]) -> list[Start]:
    """Best first: the smaller chi-square; of alike ones those that converged.

    A fit that stops on a kink of the residual strain is a fit nevertheless, only not as exactly at its end.
    """
    least = min(_cost(start.result) for start in starts)

    def rank(start: Start) -> tuple[bool, bool, float]:
        cost = _cost(start.result)
        return cost > least + ALIKE, cost <= least + ALIKE and not start.result.success, cost

    return sorted(starts, key=rank)


def _cost(result: FitResult) -> float:
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
