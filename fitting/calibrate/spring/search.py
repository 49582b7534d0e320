"""The search for the best fit of an alloy: readings of the tests, stages, starts from everywhere."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from fitting.specimens import SPRING, priors
from pneusma_jax.calibration import available, load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy
from pneusma_jax.units import to_si

from .joint import Joint, alike, fit_jointly, shifted, try_others
from .memory_starts import memory_starts
from .problem import Problem
from .refits import decided_anew, held_at_ends, loosened, retried
from .stages import Stage, run_stages
from .stand_tests import LEVEL, SOFTER, STATED, Phase, Softer, StandTest, classify, contradicts, equally_stiff

CHANCE, MORE = 3.5, 6
"""CHANCE: a known alloy is fitted from further starts if the reduced chi-square exceeds 1 by this number of
standard deviations. A spring that remembers other rows can shut a fit in. MORE: number of these starts."""
FAR = 4.0
"""Standard deviations along the loosest direction at which one start is placed."""
ROUNDS = 3
"""Rounds of further trials of the residual strain, at most, each while the one before has helped."""


@dataclass(frozen=True)
class Reading:
    """The tests with their phases, and the phase that was taken as the softer one for that; None if known."""

    tests: list[StandTest]
    softer: Softer | None


@dataclass(frozen=True)
class Fitted:
    """One reading of the tests, fitted.

    Attributes:
        reading: the reading.
        start: values before any fit, SI.
        staged: values after the stages.
        stages: results of the stages; empty for a known alloy.
        single: the joint fit, with the errors of the best start alone.
        whole: true if it was fitted from all starts; false if only from the stages.
    """

    reading: Reading
    start: dict[str, float]
    staged: dict[str, float]
    stages: list[Stage]
    single: Joint
    whole: bool

    @property
    def chi_square(self) -> float:
        """Least chi-square of all starts; infinite where the model has no answer."""
        found = self.single.starts[0].result.chi_square
        return np.inf if found is None else float(found)


def readings_of(
    recordings: Sequence[Recording],
    phases: Mapping[str, Phase] | None,
    known: Alloy | None,
    softer: Softer | None,
) -> list[Reading]:
    """Readings of the tests: one, or two where stiffness and resistance at rest do not agree.

    They contradict each other, or resistance differs and stiffness does not.
    """
    first = Reading(classify(recordings, phases, known, softer or SOFTER[0]), softer or SOFTER[0])
    if known is not None:
        return [Reading(first.tests, None)]
    if softer is not None:
        return [first]
    if contradicts(first.tests):
        return [first, Reading(classify(recordings, phases, None, "austenite"), "austenite")]
    if equally_stiff(first.tests):
        return [first, Reading(classify(recordings, phases, None, "neither"), "neither")]
    return [first]


def order(found: Sequence[Fitted], best: int) -> list[str]:
    """Notices that two readings of the tests were fitted, and which one was taken."""
    if len(found) < 2:
        return []
    taken, other = found[best], found[1 - best]
    why = (
        "All tests are equally stiff at the beginning, but they resist differently at rest. They are of one "
        "phase, or both phases are equally stiff."
        if "neither" in (taken.reading.softer, other.reading.softer)
        else "The stiffest test resists most at rest. In nitinol the martensite is softer and resists "
        "more. One of the two does not hold here."
    )
    first = "" if other.whole else " The other was fitted from one start only: this one leaves only noise."
    return [
        f"{why} Both readings were fitted. With {taken.reading.softer} as the softer phase the chi-square is "
        f"{taken.chi_square:.4g}, with {other.reading.softer} {other.chi_square:.4g}.{first} The former was "
        f"taken; --softer {other.reading.softer} asks for the other."
    ]


def best_of_readings(
    campaign: Campaign,
    readings: Sequence[Reading],
    base: Any,
    identify: bool,
    adjust: Mapping[str, Mapping[str, Any]],
    starts: int,
    seed: int,
    progress: Callable[[str], None],
) -> tuple[list[Fitted], int]:
    """Every reading fitted, and the index of the best.

    All are fitted from the stages, then as by `best_of_begun`.
    """
    found = begun_readings(campaign, readings, base, identify, adjust, progress)
    return best_of_begun(found, identify, starts, seed, progress)


def begun_readings(
    campaign: Campaign,
    readings: Sequence[Reading],
    base: Any,
    identify: bool,
    adjust: Mapping[str, Mapping[str, Any]],
    progress: Callable[[str], None],
) -> list[Fitted]:
    """Every reading fitted from the stages alone."""
    return [_begun(campaign, reading, base, identify, adjust, progress) for reading in readings]


def best_of_begun(
    begun: Sequence[Fitted], identify: bool, starts: int, seed: int, progress: Callable[[str], None]
) -> tuple[list[Fitted], int]:
    """Every reading, of which the best is fitted from all starts, and the index of the best.

    So are the others if it leaves more than chance explains. Tests that are all of one phase come before a
    reading in which most are between two, as long as they leave only noise: fractions that are free fit
    noise, too.
    """
    found = list(begun)
    plain = found[-1].reading.softer == "neither" and not _suspicious(found[0].single)

    def rank(k: int) -> tuple[bool, float]:
        return plain and k > 0, found[k].chi_square

    for k in sorted(range(len(found)), key=rank):
        found[k] = _completed(found[k], identify, starts, seed, progress)
        if not _suspicious(found[k].single):
            break
    whole = [k for k, one in enumerate(found) if one.whole]
    return found, min(whole, key=rank)


def _begun(
    campaign: Campaign,
    reading: Reading,
    base: Any,
    identify: bool,
    adjust: Mapping[str, Mapping[str, Any]],
    progress: Callable[[str], None],
) -> Fitted:
    """Stages and the joint fit from their end."""
    problem = problem_of(campaign, reading.tests, base, identify, adjust)
    start = {name: entry.value for name, entry in problem.parameters.items()}
    staged, stages = run_stages(problem, progress) if identify else (start, [])
    return Fitted(reading, start, staged, stages, fit_jointly(problem, staged, progress), False)


def _completed(
    begun: Fitted, identify: bool, starts: int, seed: int, progress: Callable[[str], None]
) -> Fitted:
    """The joint fit from all starts."""
    joint, staged = begun.single, begun.staged
    if identify:
        again = memory_starts(joint.problem.inflated(1.0), staged, seed, progress)
        joint = retried(loosened(try_others(joint, again, progress), progress), progress)
    others = _other_starts(joint, begun.stages, identify, starts - 1, seed)
    single = try_others(joint, others, progress, anew=not identify)
    if not identify:
        single = decided_anew(single, progress)
    if not identify and _suspicious(single):
        more = _draws(single, MORE, np.random.default_rng([seed, 1]), "further draw")
        single = decided_anew(try_others(single, more, progress, anew=True), progress)
    if not identify:
        single = held_at_ends(single, progress)
    if identify:
        single = _remembered_anew(single, seed, progress)
    return replace(begun, single=single, whole=True)


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
        if not (joint.starts[0].result.chi_square or np.inf) < best - alike(joint.starts[0].problem):
            break
    return joint


def problem_of(
    campaign: Campaign, tests: Sequence[StandTest], base: Any, identify: bool, adjust: Mapping[str, Mapping]
) -> Problem:
    """A campaign as one least-squares problem.

    Args:
        campaign: recordings of springs.
        tests: the recordings, classified.
        base: table to start from; None for the one that the recordings name.
        identify: true to fit the constants of the alloy.
        adjust: changes of the parameters' starts, bounds and priors, by parameter.

    Raises:
        InputError: if nothing is open.
    """
    known = [t for t in tests if identify or t.reason == STATED]
    held = {t.name: level for t in known if (level := LEVEL[t.phase]) is not None}
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
