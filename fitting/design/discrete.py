"""The best design that can be made, from the best continuous one.

A workshop has no wire between two gauges. The discrete parameters are fixed one after the other, the coarsest
first, each at the values just below and just above. Before the next one is fixed, the rest is solved anew, so
that it makes up for the rounding: many coils of a thick wire do what few of a thin one do. Then single steps
follow from the best design as long as one of them helps.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from .log import LoggedModel
from .optimise import ALLOWED, BETTER, Ends, Outcome, Problem, better_seen, optimise
from .space import Space

WIDTH = 4
"""Number of partly fixed designs that are followed side by side."""
MOST_ROUNDS = 20
"""Maximum of rounds of single steps from the best design."""
SAME = 1e-9
"""Distance in the box up to which a value counts as one that can be made [1]."""

Held = dict[int, float]
"""Places in the box at which discrete parameters are fixed, by the parameter's index."""
Beyond = Callable[[Outcome, Problem], Outcome]
"""A design at least as good, with the same discrete parameters, from a design and its problem."""


@dataclasses.dataclass(frozen=True)
class Step:
    """A step of a discrete parameter that the objective asks for, and that cannot be taken.

    Attributes:
        parameter: its index; up: true if the step goes to the next higher value.
        rows: indices of the evaluation's numbers that violate their limits after it; empty at the end of the
            range.
        lost: true if the design after it has no equilibrium.
    """

    parameter: int
    up: bool
    rows: tuple[int, ...] = ()
    lost: bool = False


def places_of(space: Space, k: int) -> np.ndarray:
    """Places in the box [1] at which a discrete parameter can be made, ascending."""
    one = space.free[k]
    return (np.array(one.values) - one.low.value) / (one.high.value - one.low.value)


def near(space: Space, k: int, x: float) -> list[float]:
    """Places of the values just below and just above; only one where `x` is such a value or beyond the
    last."""
    made = places_of(space, k)
    at = int(np.searchsorted(made, x))
    some = sorted({float(made[i]) for i in (max(at - 1, 0), min(at, made.size - 1))})
    return [place for place in some if abs(place - x) < SAME] or some


def all_made(space: Space, place: np.ndarray) -> bool:
    """True if every discrete parameter has a value that can be made."""
    discrete = [k for k, one in enumerate(space.free) if one.discrete]
    return all(np.min(np.abs(places_of(space, k) - place[k])) < SAME for k in discrete)


def held_at(space: Space, place: np.ndarray) -> Held:
    """Places at which a design that can be made holds its discrete parameters."""
    made = {k: places_of(space, k) for k in coarsest_first(space)}
    return {k: float(x[np.argmin(np.abs(x - place[k]))]) for k, x in made.items()}


def coarsest_first(space: Space) -> list[int]:
    """Indices of the discrete parameters: that with the longest steps, as parts of its range, first."""
    steps = {k: np.diff(places_of(space, k)).mean() for k, one in enumerate(space.free) if one.discrete}
    return sorted(steps, key=lambda k: -steps[k])


def steps_from(space: Space, held: Held) -> list[tuple[int, bool, float]]:
    """Single steps: the parameter, whether it goes up, and its new place."""
    found = []
    for k, x in held.items():
        made = places_of(space, k)
        at = int(np.argmin(np.abs(made - x)))
        found += [(k, i > at, float(made[i])) for i in (at - 1, at + 1) if 0 <= i < made.size]
    return found


def made_from(
    ideal: Outcome,
    problem: Problem,
    evaluate: LoggedModel,
    method: str,
    further: bool = True,
    ends: Ends = Ends(),
    objectives: int = 1,
    beyond: Beyond | None = None,
) -> tuple[Outcome, Problem] | None:
    """The best design near a continuous one that can be made, the rest of the parameters solved anew.

    Args:
        ideal: the continuous one.
        problem: the problem that it solves.
        evaluate: evaluator of the model.
        method: method of the optimiser.
        further: go on in single steps while that helps.
        ends: stopping rules of the optimiser.
        objectives: number of the study's objectives, see `better_seen`.
        beyond: search past jumps, from a design and the problem of the parameters that are left; single steps
            follow from a better design beyond. None where nothing jumps.

    Returns:
        The design, and the problem of the parameters that are left; None where no design that was tried keeps
        the constraints.
    """
    if ideal.evaluation is None:
        return None
    search = _Rounding(ideal, problem, evaluate, method, ends)
    search.fix_in_turn()
    if further:
        search.step_while_it_helps()
    while search.go_on_from_a_better_one(objectives) or (beyond and search.go_on_past_a_jump(beyond)):
        if further:
            search.step_while_it_helps()
    if search.best is None:
        return None
    held, best = search.best
    return (best, dataclasses.replace(problem, held=held)) if best.kept else None


def blocked_steps(best: Outcome, problem: Problem, evaluate: LoggedModel) -> list[Step]:
    """Steps that the objective asks for, and that limits or ends of ranges forbid, the rest left as it is.

    A step that a slope asks for, but that turns out to help nothing, is none of them.

    Args:
        best: a design that can be made; problem: that of the parameters that are left.
        evaluate: evaluator of the model.
    """
    space, place = evaluate.model.space, best.evaluation.place
    slope = problem.weights @ best.evaluation.jacobian
    steps = [s for s in steps_from(space, problem.held) if slope[s[0]] * (s[2] - place[s[0]]) < -BETTER]
    ends = {k for k in problem.held if abs(slope[k]) > BETTER} - {k for k, _, _ in steps}
    found = [Step(k, bool(slope[k] < 0.0)) for k in sorted(ends)]
    moved = [np.where(np.arange(place.size) == k, x, place) for k, _, x in steps]
    for (k, up, _), one in zip(steps, evaluate(moved) if moved else [], strict=True):
        over = problem.rows[problem.excess(one) > ALLOWED] if one.finite else ()
        if not one.finite:
            found.append(Step(k, up, lost=True))
        elif len(over) and problem.objective(one) < best.objective:
            found.append(Step(k, up, tuple(int(row) for row in over)))
    return found


class _Rounding:
    """The search from one continuous design; every set of fixed parameters is solved once."""

    def __init__(self, ideal: Outcome, problem: Problem, evaluate: LoggedModel, method: str, ends: Ends):
        self.ideal, self.problem, self.evaluate = ideal, problem, evaluate
        self.method, self.ends = method, ends
        self.space = evaluate.model.space
        self.order = coarsest_first(self.space)
        self.tried: dict[tuple, Outcome] = {}

    def solved(self, many: Sequence[tuple[Held, np.ndarray]]) -> list[Outcome]:
        """Outcomes with parameters fixed, each from a start; those that are known are not solved again."""
        new = {_key(held): (held, start) for held, start in many if _key(held) not in self.tried}
        problems = [dataclasses.replace(self.problem, held=held) for held, _ in new.values()]
        starts = [start for _, start in new.values()]
        outcomes = optimise(problems, starts, self.evaluate, self.method, self.ends)
        self.tried.update(zip(new, outcomes, strict=True))
        return [self.tried[_key(held)] for held, _ in many]

    @property
    def best(self) -> tuple[Held, Outcome] | None:
        """The best design that can be made of all that were tried; None if none was."""
        whole = [(dict(key), one) for key, one in self.tried.items() if len(key) == len(self.order)]
        return min(whole, key=lambda pair: _rank(pair[1]), default=None)

    def fix_in_turn(self) -> None:
        """Fix one parameter after the other, and follow the best few sets.

        Where none of the sets could be evaluated, the next parameter is fixed near its ideal place.
        """
        followed: list[tuple[Held, Outcome]] = [({}, self.ideal)]
        for k in self.order:
            known = [pair for pair in followed if pair[1].evaluation is not None] or followed
            starts = [(held, self._start(one)) for held, one in known]
            grown = [(held | {k: x}, at) for held, at in starts for x in near(self.space, k, float(at[k]))]
            pairs = [(held, one) for (held, _), one in zip(grown, self.solved(grown), strict=True)]
            kept = [pair for pair in pairs if pair[1].kept]
            followed = sorted(kept or pairs, key=lambda pair: _rank(pair[1]))[:WIDTH]

    def step_while_it_helps(self) -> None:
        """Single steps from the best design until none is better."""
        best = self.best
        for _ in range(MOST_ROUNDS if best else 0):
            held, one = best
            self.solved([(held | {k: x}, self._start(one)) for k, _, x in steps_from(self.space, held)])
            best = self.best
            if _key(best[0]) == _key(held):
                return

    def go_on_from_a_better_one(self, objectives: int) -> bool:
        """Solve the rest anew from a design that can be made, was evaluated, and is better than the best.

        Returns:
            True if there was one. The best is at least as good afterwards.
        """
        best = self.best[1] if self.best else Outcome(None, np.inf, np.inf, "", 0)
        made_at = lambda place: all_made(self.space, place)  # noqa: E731
        seen = better_seen(best, self.problem, self.evaluate, made_at, objectives)
        if seen is None:
            return False
        place = seen.evaluation.place
        held = held_at(self.space, place)
        self.tried.clear()  # all are worse, and steps from here may end elsewhere
        (again,) = self.solved([(held, place)])
        self.tried[_key(held)] = min(again, seen, key=_rank)
        return True

    def go_on_past_a_jump(self, beyond: Beyond) -> bool:
        """Look past jumps from the best design.

        Returns:
            True if there was a better one, with the same discrete parameters. It is the best afterwards.
        """
        if self.best is None or not self.best[1].kept:
            return False
        held, one = self.best
        new = beyond(one, dataclasses.replace(self.problem, held=held))
        if not new.objective < one.objective - BETTER:
            return False
        self.tried = {_key(held): new}  # all others are worse, and steps from here may end elsewhere
        return True

    def _start(self, one: Outcome) -> np.ndarray:
        """Place from which a search with one more parameter fixed begins."""
        return self.ideal.evaluation.place if one.evaluation is None else one.evaluation.place


def _key(held: Held) -> tuple:
    return tuple(sorted(held.items()))


def _rank(one: Outcome) -> tuple[bool, float]:
    """Order of outcomes: those that keep the constraints by their objective, then the others by their
    violation."""
    return (not one.kept, one.objective if one.kept else one.violation)
