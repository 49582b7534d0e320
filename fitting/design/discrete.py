"""The best design that can be made, from the best continuous one."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from .log import Evaluator
from .optimise import Ends, Outcome, Problem, best_of, optimise
from .space import Space

MOST = 64
"""Maximum of neighbours that are tried together; those nearest to the continuous design come first."""
MOST_ROUNDS = 20
"""Maximum of rounds of single steps from the best neighbour."""


def places_of(space: Space, k: int) -> np.ndarray:
    """Places in the box [1] at which a discrete parameter can be made, ascending."""
    one = space.free[k]
    return (np.array(one.values) - one.low.value) / (one.high.value - one.low.value)


def neighbours(space: Space, place: np.ndarray) -> list[dict[int, float]]:
    """Every combination of the values just below and just above, nearest first; at most `MOST`."""
    options = []
    for k, one in enumerate(space.free):
        if not one.discrete:
            continue
        made = places_of(space, k)
        at = int(np.searchsorted(made, place[k]))
        near = {float(made[i]) for i in (max(at - 1, 0), min(at, made.size - 1))}
        exact = [x for x in near if abs(x - place[k]) < 1e-9]
        options.append([(k, x) for x in (exact or sorted(near))])
    combined = [dict(pairs) for pairs in itertools.product(*options)]
    return sorted(combined, key=lambda held: sum((x - place[k]) ** 2 for k, x in held.items()))[:MOST]


def steps_from(space: Space, held: dict[int, float]) -> list[dict[int, float]]:
    """The same with one parameter one step further down or up."""
    found = []
    for k, x in held.items():
        made = places_of(space, k)
        at = int(np.argmin(np.abs(made - x)))
        found += [held | {k: float(made[i])} for i in (at - 1, at + 1) if 0 <= i < made.size]
    return found


def made_from(
    ideal: Outcome,
    problem: Problem,
    evaluate: Evaluator,
    method: str,
    further: bool = True,
    ends: Ends = Ends(),
) -> Outcome | None:
    """The best design near a continuous one that can be made, the rest of the parameters solved anew.

    Args:
        ideal: the continuous one.
        problem: the problem that it solves.
        evaluate: evaluator of the model.
        method: method of the optimiser.
        further: go on in single steps while that helps.
        ends: stopping rules of the optimiser.

    Returns:
        None where no neighbour keeps the constraints.
    """
    space = evaluate.model.space
    tried: dict[tuple, Outcome] = {}

    def solved(choices: Sequence[dict[int, float]]) -> None:
        new = [held for held in choices if tuple(sorted(held.items())) not in tried]
        problems = [dataclasses.replace(problem, held=held) for held in new]
        outcomes = optimise(problems, [ideal.evaluation.place] * len(new), evaluate, method, ends)
        tried.update((tuple(sorted(held.items())), o) for held, o in zip(new, outcomes, strict=True))

    solved(neighbours(space, ideal.evaluation.place))
    for _ in range(MOST_ROUNDS if further else 0):
        key = min(
            tried,
            key=lambda k: (not tried[k].kept, tried[k].objective if tried[k].kept else tried[k].violation),
        )
        before = len(tried)
        solved(steps_from(space, dict(key)))
        best = best_of(list(tried.values()))
        if len(tried) == before or (tried[key].kept and best is tried[key]):
            break
    found = best_of(list(tried.values()))
    return found if found.kept else None
