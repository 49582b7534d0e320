"""The search of one model: its starts, the best continuous design, the front, and what can be made."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneusma_jax.errors import InputError
from pneusma_jax.units import to_si

from .discrete import blocked_steps, made_from
from .infeasible import why_nothing
from .log import Evaluation, Log, LoggedModel
from .neighbours import jumps, search_past_jumps
from .optimality import conditions
from .optimise import (
    ON_FRONTS,
    Outcome,
    Problem,
    best_of,
    better_seen,
    from_starts,
    from_within,
    optimise,
)
from .pareto import as_point, front_of, none_better
from .program import Model
from .result import Choice, Limits
from .study import Study

STILL = 1e-10
"""Change of an objective over the whole range of a parameter that is rounding error [1]. It is part of the
objective's size, or of one in its unit; equilibria are exact to 1e-10."""
LEAST_SIZE = 8
"""Least number of places that go through the program at once."""


@dataclass
class Solved:
    """A combination of choices, solved."""

    choice: Choice
    evaluate: LoggedModel
    problem: Problem
    starts: list[np.ndarray]
    outcomes: list[Outcome]
    ideal: Outcome
    made: tuple[Outcome, Problem] | None = None
    pairs: list[tuple[Outcome, Problem]] | None = None
    rounded: bool = True

    @property
    def final(self) -> Outcome:
        """The design that can be made, or the continuous one where no neighbour keeps the constraints."""
        return self.made[0] if self.made else self.ideal

    @property
    def limits(self) -> Limits:
        """Conditions at the final design."""
        outcome, problem = self.made or (self.ideal, self.problem)
        blocked = blocked_steps(outcome, problem, self.evaluate) if self.made else []
        return Limits(conditions(problem, outcome.evaluation), tuple(blocked))


def start_places(study: Study, model: Model) -> list[np.ndarray]:
    """The tables' own design, where it is one, and a Latin hypercube.

    SciPy's sequences would spread as few places no better, and its statistics take half a second to load.
    """
    base = base_place(model)
    count = study.starts - (base is not None)
    random = np.random.default_rng(study.seed)
    cells = np.stack([random.permutation(count) for _ in range(len(model.space))], axis=1)
    spread = (cells + random.random(cells.shape)) / max(count, 1)
    return [*([np.clip(base, 0.0, 1.0)] if base is not None else []), *spread]


def base_place(model: Model) -> np.ndarray | None:
    """Place of the tables' own dimensions in the box; None if a parameter has no such value."""
    table, values = model.plan.tables[0].values(), {}
    for one in model.space.free:
        plain = one.name.partition(".")[2] if one.name[0].isdecimal() else one.name
        if plain not in table:
            return None
        values[one.name] = table[plain]
    return model.space.place(values)


def search_design(
    study: Study, choice: Choice, model: Model, number: int, log: Log, said: Callable[[str], object],
    begin: list[np.ndarray],
) -> Solved:  # fmt: skip
    """Solve one model: continuous, front, rounded."""
    phase = ["starts"]
    evaluate = LoggedModel(model, log, number, max(study.starts + len(begin), LEAST_SIZE))
    evaluate.said = lambda: said(f"{phase[0]}: {evaluate.asked} evaluations")
    starts = [*begin, *start_places(study, model)]
    first = evaluate(starts)
    good = [one for one in first if one.finite]
    if not good:
        raise InputError(f"{study.path}: {why_nothing(model, first[0], choice.words(study))}")
    still = unchanging(study, good)
    if still and len(study.designs) * len(study.alloys) * len(study.materials) == 1:  # a choice may change it
        raise InputError(
            f"{study.path}: objective {still[0]!r} changes with nothing that is free: its derivative is "
            f"zero at all {len(good)} starts"
        )
    count = len(study.objectives)
    sizes = np.array([max(abs(float(np.median([o.values[j] for o in good]))), 1e-12) for j in range(count)])
    total = good[0].values.size
    rows = np.arange(count, count + len(model.groups))
    problems = [
        Problem(np.eye(total)[j] / sizes[j], rows, np.zeros(rows.size), np.ones(rows.size))
        for j in range(count)
    ]
    phase[0] = "continuous design"
    outcomes = [from_starts(problem, starts, evaluate, study.optimiser) for problem in problems]
    if rows.size and not any(one.kept for one in outcomes[0]):
        inside = [one.place for one in good]
        found_inside = [from_within(problem, inside, evaluate, study.optimiser) for problem in problems]
        outcomes = [ended + more for ended, more in zip(outcomes, found_inside, strict=True)]
    anchors = [best_of(ended) for ended in outcomes]
    past = lambda best, rest: search_past_jumps(best, rest, evaluate, study.optimiser)  # noqa: E731
    beyond = past if jumps(study) else None
    for j, problem in enumerate(problems):
        if anchors[j].kept and beyond:
            phase[0] = "beyond jumps"
            anchors[j] = beyond(anchors[j], problem)
        anchors[j] = _none_better(anchors[j], problem, evaluate, study.optimiser)
    found = Solved(choice, evaluate, problems[0], starts, outcomes[0], anchors[0])
    if not all(anchor.kept for anchor in anchors):
        return found
    discrete = any(one.discrete for one in model.space.free)
    if count == 1:
        phase[0] = "rounding"
        if discrete:
            found.made = made_from(found.ideal, found.problem, evaluate, study.optimiser, beyond=beyond)
            found.rounded = found.made is not None
        return found
    phase[0] = "front"
    found.pairs = front_of(anchors, problems[0], evaluate, study.points, study.optimiser)
    if not discrete:
        found.pairs = none_better(found.pairs, evaluate, count)
    chosen = found.pairs[_knee([o for o, _ in found.pairs], count)]
    found.ideal, found.problem = chosen
    if discrete:
        phase[0] = "rounding"
        once = {"further": False, "ends": ON_FRONTS, "objectives": count}
        made = [made_from(o, p, evaluate, study.optimiser, **once) for o, p in found.pairs]
        if not any(made):  # the limits on the other objectives may leave no room, as where a front is a point
            own = zip(anchors, problems, strict=True)
            alone = [made_from(o, p, evaluate, study.optimiser) for o, p in own]
            made = [as_point(pair, problems[0], count) for pair in alone if pair]
        found.rounded = any(made)
        if found.rounded:
            found.pairs = none_better([pair for pair in made if pair], evaluate, count)
            found.made = found.pairs[_knee([o for o, _ in found.pairs], count)]
    return found


def _none_better(best: Outcome, problem: Problem, evaluate: LoggedModel, method: str) -> Outcome:
    """The end of a search, or of one from a better design that another search has evaluated."""
    while (seen := better_seen(best, problem, evaluate)) is not None:
        best = best_of([seen, *optimise([problem], [seen.evaluation.place], evaluate, method)])
    return best


def unchanging(study: Study, at: list[Evaluation]) -> list[str]:
    """Names of objectives whose derivatives are zero, to rounding error, in all of some designs."""
    found = []
    for j, one in enumerate(study.objectives):
        size = max(abs(float(to_si(1.0, one.unit, True))), *(abs(o.values[j]) for o in at))
        if one.quantity != "failure_probability" and all(
            np.max(np.abs(o.jacobian[j])) <= STILL * size for o in at
        ):
            found.append(one.name)
    return found


def _knee(outcomes: list[Outcome], count: int) -> int:
    """The point nearest to the best of every objective, each measured by its range on the front."""
    values = np.array([o.evaluation.values[:count] for o in outcomes])
    span = np.ptp(values, axis=0)
    away = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    return int(np.argmin(np.linalg.norm(away, axis=1)))
