"""The search for the best fit of an alloy: readings of the tests, stages, starts from everywhere."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.calibrate.profile_likelihood import ALIKE
from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from fitting.specimens import SPRING, priors
from pneusma_jax.calibration import available, load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy
from pneusma_jax.units import to_si

from .joint import Joint, fit_jointly, loosened, retried, shifted, try_others
from .memory_starts import memory_starts
from .problem import Problem
from .stages import Stage, run_stages
from .stand_tests import LEVEL, SOFTER, Phase, Softer, StandTest, classify, contradicts

CHANCE, MORE = 3.5, 6
"""CHANCE: a known alloy is fitted from further starts if the reduced chi-square exceeds 1 by this number of
standard deviations. A spring that remembers other rows can shut a fit in. MORE: number of these starts."""
FAR = 4.0
"""Standard deviations along the loosest direction at which one start is placed."""
ROUNDS = 3
"""Rounds of further trials of the residual strain, at most, each while the one before has helped."""


@dataclass(frozen=True)
class Fitted:
    """One reading of the tests, fitted.

    Attributes:
        start: values before any fit, SI.
        stages: results of the stages; empty for a known alloy.
        single: the joint fit from all starts, with the errors of the best alone.
    """

    start: dict[str, float]
    stages: list[Stage]
    single: Joint


def readings_of(
    recordings: Sequence[Recording],
    phases: Mapping[str, Phase] | None,
    known: Alloy | None,
    softer: Softer | None,
) -> list[list[StandTest]]:
    """Readings of the tests: one, or two if stiffness and resistance at rest contradict each other."""
    first = classify(recordings, phases, known, softer or SOFTER[0])
    if known is not None or softer is not None or not contradicts(first):
        return [first]
    return [first, classify(recordings, phases, None, SOFTER[1])]


def order(found: Sequence[Fitted], best: int) -> list[str]:
    """Notices that two readings of the tests were fitted, and which one was taken."""
    if len(found) < 2:
        return []
    costs = [one.single.starts[0].result.chi_square for one in found]
    return [
        "The stiffest test resists most at rest. Of a nitinol the martensite is softer and resists more, so "
        f"one of the two does not hold here. Both readings were fitted. With {SOFTER[0]} as the softer phase "
        f"the chi-square is {costs[0]:.4g}, with {SOFTER[1]} {costs[1]:.4g}. The {SOFTER[best]} was taken as "
        f"the softer phase; --softer {SOFTER[1 - best]} asks for the other."
    ]


def fitted_from(
    campaign: Campaign,
    tests: Sequence[StandTest],
    base: Any,
    identify: bool,
    adjust: Mapping[str, Mapping[str, Any]],
    starts: int,
    seed: int,
    progress: Callable[[str], None],
) -> Fitted:
    """Stages and the joint fit from all starts, of one reading of the tests."""
    problem = _problem(campaign, tests, base, identify, adjust)
    start = {name: entry.value for name, entry in problem.parameters.items()}
    staged, stages = run_stages(problem, progress) if identify else (start, [])
    joint = fit_jointly(problem, staged, progress)
    if identify:
        again = memory_starts(joint.problem.inflated(1.0), staged, seed, progress)
        joint = retried(loosened(try_others(joint, again, progress), progress), progress)
    others = _other_starts(joint, stages, identify, starts - 1, seed)
    single = try_others(joint, others, progress)
    if not identify and _suspicious(single):
        more = _draws(single, MORE, np.random.default_rng([seed, 1]), "further draw")
        single = try_others(single, more, progress)
    return Fitted(start, stages, _remembered_anew(single, seed, progress) if identify else single)


def _remembered_anew(joint: Joint, seed: int, progress: Callable[[str], None]) -> Joint:
    """The fit after further trials of the residual strain, while more is left than chance leaves.

    The first trials have the constants of the stages beside them, which are rough. With those of a fit, even
    of one that is caught, trials rank truly.
    """
    for k in range(1, ROUNDS + 1):
        if not _suspicious(joint):
            break
        best = joint.starts[0].result.chi_square or np.inf
        starts = memory_starts(joint.problem.inflated(1.0), joint.values, seed + k, progress)
        named = {f"{name}, round {k + 1}": values for name, values in starts.items()}
        joint = retried(try_others(joint, named, progress), progress)
        if not (joint.starts[0].result.chi_square or np.inf) < best - ALIKE:
            break
    return joint


def _problem(
    campaign: Campaign, tests: Sequence[StandTest], base: Any, identify: bool, adjust: Mapping[str, Mapping]
) -> Problem:
    held = {t.name: LEVEL[t.phase] for t in tests if LEVEL[t.phase] is not None} if identify else {}
    parameters = SPRING.parameters_for(campaign, base=base)
    if not parameters:
        raise InputError(
            f"{campaign.path}: the alloy is known and the tolerances leave nothing open; "
            'state alloy = "fit", or a [tolerance]'
        )
    changes = {name: _in_si(parameters, name, change) for name, change in adjust.items()}
    rows = SPRING.rows_for(campaign, base=base, held_at=held)
    return Problem.of(tests, rows, priors.adjusted(parameters, changes))


def _in_si(parameters: Parameters, name: str, change: Mapping[str, Any]) -> dict[str, Any]:
    """A change in the unit of files, in SI."""
    if name not in parameters:
        return dict(change)
    unit = parameters[name].unit
    return {
        key: to_si(value, unit) if key in ("value", "min", "max") else value for key, value in change.items()
    }


def _other_starts(
    joint: Joint, stages: Sequence[Stage], identify: bool, count: int, seed: int
) -> dict[str, dict[str, float]]:
    """Further places to start from: along the loosest direction, the published alloys, then drawn from the
    priors.
    """
    free = joint.problem.parameters
    found = {"the loosest direction": shifted(joint.result, FAR)}
    last = stages[-1] if stages else None
    if last is not None and last.result is not None:
        found["what unloading gave alone"] = {n: last.result.values[n] for n in last.parameters}
    if identify:
        for name in available("alloy"):
            table = load_calibration(name).values()
            if set(free) <= set(table):
                found[f"the constants of {name}"] = {n: table[n] for n in free}
    found |= _draws(joint, max(count - len(found), 0), np.random.default_rng(seed), "draw")
    return dict(list(found.items())[: max(count, 0)])


def _draws(joint: Joint, count: int, random: np.random.Generator, name: str) -> dict[str, dict[str, float]]:
    """Starts drawn from the priors."""
    priors_of = {n: p.prior for n, p in joint.problem.parameters.items() if p.prior is not None}
    return {
        f"{name} {k + 1} from the priors": {n: random.normal(p.mean, p.sd) for n, p in priors_of.items()}
        for k in range(count)
    }


def _suspicious(joint: Joint) -> bool:
    """True if the misfit is more than chance explains, so that the fit may have been shut in."""
    freedom = max(joint.starts[0].result.degrees_of_freedom, 1)
    return joint.reduced_chi_square > 1.0 + CHANCE * float(np.sqrt(2.0 / freedom))
