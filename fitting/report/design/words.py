"""Sentences of a design study, and its numbers as text."""

import math

import numpy as np

from fitting.design.discrete import all_made
from fitting.design.neighbours import DISTANCES, jumps
from fitting.design.optimise import ALLOWED
from fitting.design.result import Design, DesignResult
from fitting.design.study import Free, Objective, Study
from fitting.design.workspace import FINER
from fitting.inference.notes import capital, joined
from fitting.specimens.model_objects import BASE
from pneusma_jax.errors import counted
from pneusma_jax.units import UNITS, amount, from_si, to_si

STEPS = {"length": (0.1, "mm"), "pressure": (1.0, "kPa")}
"""Step of a parameter for sensitivities, by dimension: a typical error of a workshop or a regulator."""
STEP_OF_NUMBERS = {"active_coils": 1.0}
SMALL_STEP = 0.01
"""Step of other plain numbers for sensitivities, such as fractions [1]."""
NEGLIGIBLE = 0.005
"""Share of a gradient below which it is told as none [%]: half of the last digit of 0.01 %."""
ROUNDING = 1e-9
"""By how much a logarithm may exceed a whole number from rounding alone [1]."""
MET = 1e-5
"""Distance up to which a target counts as met, as part of it, or of one unit where it is zero [1]. It is ten
times the rounding of such distances (`seen.TINY`): searches ended at 1.0 to 1.1 times that rounding."""
STEEP = 0.01
"""Gradient over a whole range, as part of the objective, up to which a design counts as an optimum [1]. Three
optima inside all limits had up to 0.004; two searches that stopped where equilibria end had 0.3."""
NOTHING = 1e-9
"""Part of a parameter's range that is rounding error: an optimiser ends at a bound of zero within it [1]."""


def shown(value: float, unit: str, difference: bool = False) -> str:
    """A value in SI, or a difference of values, as text with its unit."""
    return amount(f"{from_si(value, unit, difference):.4g}", unit)


def objective_shown(one: Objective, value: float) -> str:
    """Value of an objective [SI] as text with its unit."""
    return amount(f"{one.in_unit(value):.4g}", one.unit)


def parameter_value(free: Free, value: float) -> float:
    """A parameter's value, or zero where it is rounding error."""
    ends = [b.value for b in (free.low, free.high) if b.parameter is None]
    return 0.0 if abs(value) < NOTHING * max(map(abs, ends), default=0.0) else value


def objective_words(result: DesignResult, design: Design) -> list[str]:
    """Every objective of a design in words, as `area 8840 mm2`."""
    study, words = result.study, []
    for k, (one, value) in enumerate(zip(study.objectives, design.objectives, strict=True)):
        if not one.aims:
            words.append(f"{one.name} {objective_shown(one, value)}")
            continue
        target = shown(one.target[0], one.unit)
        if is_met(one, value):
            words.append(f"{one.name} {target}, which meets its target")
        else:
            away = f"{objective_shown(one, value)} away from its target {target}"
            words.append(f"{one.name} {shown(design.reached[k], one.unit)}, {away}")
    return words


def is_met(one: Objective, value: float) -> bool:
    """True if an objective's distance from its target is no more than rounding."""
    return one.aims and value <= MET * (abs(one.target[0]) or abs(float(to_si(1.0, one.unit, True))))


def label_of(one: Objective) -> str:
    """Name of an objective's value: of one with a target it is a distance."""
    return f"{one.name}, from its target" if one.aims else one.name


def verdict(result: DesignResult) -> list[str]:
    """The findings, the most important first."""
    study, made = result.study, result.made
    choice = made.choice.words(study)
    first = f"The design{f' ({choice})' if choice else ''}: {', '.join(objective_words(result, made))}."
    sentences = [first + _comparison_with_base(result), *measure_words(study), _limit_words(result)]
    if result.made is not result.ideal and any(f.discrete for f in study.free):
        sentences.append(rounding_words(result))
    if result.front is not None:
        kind = "that can be made" if result.front.made else "before rounding"
        sentences.append(
            f"The front has {counted(len(result.front.designs), 'design')} {kind}, and dominates "
            f"{100.0 * result.front.hypervolume:.3g} % of the box up to its reference."
        )
    sentences += [*_area_words(result), *chance_words(result)]
    return sentences


def measure_words(study: Study) -> list[str]:
    """The sentence on what is told of an objective that has a spread; none where nothing is uncertain."""
    given = study.uncertainty
    if given is None:
        return []
    names = [repr(one.name) for one in study.objectives if one.quantity != "failure_probability"]
    measure = {
        "mean": "the mean",
        "mean_plus_sigma": f"the mean, made worse by {given.k:g} standard deviation{'s' * (given.k != 1.0)},",
        "cvar": f"the mean of the worst {100.0 * (1.0 - given.level):.3g} %",
    }[given.objective]
    return [f"What is told of {joined(names)} is {measure} of {counted(given.draws, 'draw')}."]


def _area_words(result: DesignResult) -> list[str]:
    """Sentences on areas of workspaces, which are those of polygons."""
    words, sweeps = [], result.model.states.sweeps
    for one in result.study.objectives:
        if one.name in result.finer_areas:
            first, last = sweeps[one.name]
            count = last - first
            finer = [shown(area, one.unit) for area in result.finer_areas[one.name]]
            of_tables = f", and {finer[1]} of {whose(result)} own dimensions" if len(finer) > 1 else ""
            words.append(
                f"{one.name!r} is the area of a polygon through {count} states of the edge. "
                f"Through {FINER * count} states it is {finer[0]}{of_tables}."
            )
    return words


def _comparison_with_base(result: DesignResult) -> str:
    base, one = result.base, result.study.objectives[0]
    if base is None:
        return ""
    before, after = base.objectives[0], result.made.objectives[0]
    caveat = "" if base.violation <= ALLOWED else ", which does not keep all constraints"
    factor = ""
    if before > 0.0 and after > 0.0 and not one.aims:
        factor = f"; that is a factor of {after / before:.3g}"
    value = shown(base.reached[0], one.unit) if one.aims else objective_shown(one, before)
    return f" {capital(whose(result))} own dimensions give {one.name} {value}{caveat}{factor}."


def whose(result: DesignResult) -> str:
    """Owner of the dimensions that a study begins at: the tables, or the fitted model that it names."""
    return "the tables'" if result.study.model is BASE else f"the model {result.study.model.name}'s"


def _limit_words(result: DesignResult) -> str:
    """Sentence on what keeps the design from being better."""
    first, limits = result.study.objectives[0], _active_limits(result)
    if is_met(first, result.made.objectives[0]):
        return f"Nothing could make {first.name} better: its target is met."
    if limits:
        return f"It is limited by {joined(limits)}."
    steep = result.limits.conditions.steepness
    if steep <= STEEP:
        return "Nothing limits it: it lies within all constraints and ranges."
    return (
        "No constraint is active and no range ends there, but the search could not go on: over a range the "
        f"objective would change by {100.0 * steep:.2g} %. Next to the design there may be no equilibrium."
    )


def _active_limits(result: DesignResult) -> list[str]:
    """What limits the final design: active constraints, ends of ranges, and what forbids a step."""
    study, free, limits = result.study, result.model.space.free, result.limits
    groups, count = result.model.groups, len(study.objectives)
    rows = [k + count for k in np.flatnonzero(limits.conditions.rows[: len(groups)] > 0.0)]
    rows += [row for step in limits.blocked for row in step.rows]
    names = [row_words(result, row) for row in rows]
    for end, multipliers in (("lower", limits.conditions.low), ("upper", limits.conditions.high)):
        names += [f"the {end} end of {free[k].name}" for k in np.flatnonzero(multipliers > 0.0)]
    names += [
        f"the {'upper' if step.up else 'lower'} end of {free[step.parameter].name}"
        for step in limits.blocked
        if not step.rows and not step.lost
    ]
    return list(dict.fromkeys(names))


def row_words(result: DesignResult, row: int) -> str:
    """Name of one of an evaluation's numbers that has a limit.

    Args:
        result: solved study.
        row: index of the number: objectives come first, they have limits on fronts.
    """
    study, count = result.study, len(result.study.objectives)
    if row < count:
        return f"the other objective {study.objectives[row].name!r}"
    return f"constraint {study.constraints[result.model.groups[row - count].constraint].name!r}"


def rounding_words(result: DesignResult) -> str:
    """Sentence on the cost of rounding."""
    one = result.study.objectives[0]
    if not all_made(result.model.space, result.made.evaluation.place):
        return "It cannot be made: no design next to it that can be made keeps all constraints."
    before, after = result.ideal.objectives[0], result.made.objectives[0]
    lost = one.sign * (after - before)
    share = f" ({100.0 * lost / abs(before):.2g} %)" if before and not one.aims else ""
    if lost <= 0.0 or is_met(one, after):
        return "Rounding to what can be made costs nothing."
    cost = shown(lost, one.unit, difference=True)
    return f"Rounding to what can be made costs {cost} of {one.name}{share}."


def chance_words(result: DesignResult) -> list[str]:
    """Sentences on probabilities of failure."""
    words = []
    for name, chance in result.chances.items():
        low, high = chance.interval
        words.append(
            f"Of {chance.draws} fresh draws the {name} fails in {100.0 * chance.probability:.3g} % "
            f"(95 % interval {100.0 * low:.3g} to {100.0 * high:.3g} %)."
        )
    return words


def step_of(free: Free) -> tuple[float, str]:
    """Step of a parameter for sensitivities [SI], and the step in words.

    A parameter that is made in steps has its own. Otherwise it is a tenth, a hundredth and so on of the usual
    step where that is longer than half the range.
    """
    if free.made == "steps" and len(free.values) > 1:
        own = float(np.min(np.diff(free.values)))
        return own, amount(f"{from_si(own, free.unit, difference=True):.4g}", free.unit)
    usual = STEP_OF_NUMBERS.get(free.name.rpartition(".")[2], SMALL_STEP)
    size, unit = STEPS.get(UNITS[free.unit].dimension, (usual, ""))
    in_si = to_si(size, unit) if unit else size
    if free.made != "integer" and free.low.parameter is None and free.high.parameter is None:
        half = 0.5 * (free.high.value - free.low.value)
        tenths = max(0, math.ceil(math.log10(in_si / half) - ROUNDING))
        size, in_si = size / 10**tenths, in_si / 10**tenths
    return in_si, f"{size:g} {unit}".rstrip()


def sensitivities(result: DesignResult, design: Design) -> np.ndarray:
    """Change of every objective [SI, own sign] for a step of every parameter, the others left as they are.

    Of an objective with a target it is the change of the quantity, and not of its distance from the target.
    That distance has no slope where the target is met. Shape (parameters, objectives).
    """
    one, space, aims = design.evaluation, result.model.space, result.model.aims
    signs = np.array([1.0 if o.aims else o.sign for o in result.study.objectives])
    steps = np.array([step_of(f)[0] for f in space.free])
    rows = one.jacobian[[aims.get(k, k) for k in range(signs.size)]]
    slopes = np.linalg.solve(space.slopes(one.place).T, rows.T)
    return slopes * steps[:, None] * signs


def how_it_was_found(result: DesignResult) -> list[str]:
    """Sentences on starts, effort and optimality of the design."""
    first = result.study.objectives[0]
    feasible = [value for value, violation in result.starts if violation <= 1e-6]
    ends = [objective_shown(first, end(feasible, default=math.nan)) for end in (min, max)]
    lost = f"{counted(result.lost, 'was', 'were')} not solved, " if result.lost else ""
    count = len(result.starts) + result.lost
    stopped = counted(result.joined, "was", "were")
    joined_words = f" {stopped} stopped near an optimum that was found already." if result.joined else ""
    return [
        f"{counted(count, 'start')}; {lost}{len(feasible)} ended with all constraints kept, at {ends[0]} to "
        f"{ends[1]}{' from the target' if first.aims else ''}.{joined_words}",
        f"{counted(result.evaluations, 'evaluation')} with exact derivatives, "
        f"{counted(result.equilibria, 'equilibrium', 'equilibria')}.",
        _gradient_words(result),
        *_on_jumps(result),
    ]


def _gradient_words(result: DesignResult) -> str:
    """Sentence on how near the continuous design is to an exact optimum."""
    found = result.conditions
    if found.inside:
        return (
            f"The continuous design is at no limit. Over a range the objective would change by "
            f"{100.0 * found.steepness:.2g} %; at an exact optimum it would not."
        )
    left = 100.0 * found.left
    balanced = "all of it" if left < NEGLIGIBLE else f"all but {left:.2g} % of it"
    return (
        "At an exact optimum the limits that hold the design balance the gradient of the objective. "
        f"Here they balance {balanced}."
    )


def _on_jumps(result: DesignResult) -> list[str]:
    """Sentence on quantities that jump with a design, and how far the search looked beyond."""
    names = jumps(result.study)
    if not names:
        return []
    verb = "jumps" if len(names) == 1 else "jump"
    whose = "" if result.front is None else " of the best design of each objective alone, not of the others,"
    return [
        f"{joined(names)} {verb} with the design. So neighbours{whose} were looked at, up to "
        f"{100.0 * DISTANCES[-1]:g} % of each range away, and the search went on from those beyond a jump. "
        "A better design farther away may be missed."
    ]
