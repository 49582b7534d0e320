"""Further joint fits from where one ended: decided anew, held at its ends, beside zeros of instruments."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fitting.inference.lasting_noise import Size
from fitting.specimens.rows import numbers
from fitting.specimens.spring_rows import MARGIN, spring_of

from .joint import Joint, Start, alike, best_of_all, cost_of, ranked, settled
from .misfit import force_misfit
from .problem import MISFIT, Problem
from .residuals import residuals_and_freedom, values_of
from .stand_tests import STATED, level_at_rest

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
    begun = joint.starts[0]
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
        starts = ranked([*joint.starts, start])
        better = starts[0] is start and cost_of(start.result) < cost_of(best) - alike(problem)
        joint = replace(joint, starts=tuple(starts if better else [*joint.starts, start]))
        tried = set() if better else tried
    if joint.starts[0] is begun:
        return joint  # it is settled already: no start is better
    return settled(joint.starts, progress)


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
        found = cost_of(problem.with_phases({**levels, k: level}).fit())
        if found <= cost + taken[k] + DEVIATIONS * np.sqrt(2.0 * max(taken[k], 1.0)):
            levels[k], cost = level, found
    if not levels:
        return joint
    starts = []
    for end in _ends(joint):
        least, near = cost_of(end.result), alike(best.problem)
        names = [start.name for start in joint.starts if abs(cost_of(start.result) - least) < near]
        progress(f"from {end.name}, phases held")
        held = end.problem.inflated(1.0).with_phases(levels).fitted_with()
        starts += [Start(f"{name}, phases held", *held) for name in names]
    return settled(tuple(ranked(starts)), progress)


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
    starts = ranked(starts)
    if not (starts[0].result.reduced_chi_square or np.inf) <= MISFIT:
        return joint
    return settled(tuple(starts), progress)


def _ends(joint: Joint) -> list[Start]:
    """The best starts, one from each end, so that fits that agree stay independent of each other."""
    ends: list[Start] = []
    near = alike(joint.starts[0].problem)
    for start in joint.starts:
        if not any(abs(cost_of(start.result) - cost_of(one.result)) < near for one in ends):
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
            if not cost_of(found.result) < cost_of(known.result) - alike(known.problem):
                break
            known = found
        if known is not start:
            starts.append(known)
    return best_of_all(joint, starts, progress)
