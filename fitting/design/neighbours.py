"""Searches past a jump of a quantity.

The stress of a spring over its strain has a corner where the plateau of the detwinning begins. The tangent
stiffness jumps there: that of PneuSMA2 by 3 to 36 %. A search by gradients ends where a limit is met before
the jump, and sees nothing of a better design beyond it.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .log import Evaluation, LoggedModel
from .optimise import ALLOWED, BETTER, JOINED, Outcome, Problem, best_of, optimise
from .quantities import QUANTITIES
from .study import Study

DISTANCES = (0.01, 0.03, 0.1, 0.25)
"""Distances of the neighbours in the box, along their longest parameter [1]."""
BEYOND = 4
"""Maximum number of neighbours from which a search starts anew."""
ROUNDS = 5
"""Maximum number of rounds of neighbours; each begins at the best design so far."""
SUDDEN = 1e-3
"""Least gain over the linear forecast at which a neighbour counts as beyond a jump [1]."""


def jumps(study: Study) -> list[str]:
    """Names of the study's quantities that jump with a design."""
    names = [one.quantity for one in (*study.objectives, *study.constraints) if one.file is None]
    return [
        n for n in dict.fromkeys(names) if n == "stiffness_range" or (n in QUANTITIES and QUANTITIES[n].jumps)
    ]


def search_past_jumps(best: Outcome, problem: Problem, evaluate: LoggedModel, method: str) -> Outcome:
    """A design at least as good, from neighbours on the other side of jumps.

    Neighbours lie along every parameter and along the objective's slope. Those that are better than a linear
    forecast from the design are starts of new searches.

    Args:
        best: the end of a search that keeps all constraints; problem: its problem.
        evaluate: evaluator of the model.
        method: method of the optimiser.
    """
    for _ in range(ROUNDS):
        starts = _beyond(best, problem, evaluate(_neighbours(best.evaluation, problem)))
        if not starts:
            return best
        ended = optimise([problem] * len(starts), starts, evaluate, method, known=[best])
        new = best_of([best, *(one for one in ended if one.message != JOINED)])
        if not new.objective < best.objective - BETTER:
            return best
        best = new
    return best


def _neighbours(one: Evaluation, problem: Problem) -> list[np.ndarray]:
    """Places around a design, along every free parameter and against the objective's slope."""
    free = problem.free(one.place.size)
    axes = [sign * np.eye(one.place.size)[k] for k in free for sign in (1.0, -1.0)]
    slope = np.zeros(one.place.size)
    slope[free] = -(problem.weights @ one.jacobian)[free]
    stuck = ((one.place <= 0.0) & (slope < 0.0)) | ((one.place >= 1.0) & (slope > 0.0))
    slope[stuck] = 0.0
    if np.any(slope):
        axes.append(slope / np.max(np.abs(slope)))
    moved = [np.clip(one.place + size * axis, 0.0, 1.0) for axis in axes for size in DISTANCES]
    unique = {place.tobytes(): place for place in moved if np.any(place != one.place)}
    return list(unique.values())


def _beyond(best: Outcome, problem: Problem, around: Sequence[Evaluation]) -> list[np.ndarray]:
    """Places of the neighbours that promise more than the linear forecast, the most promising first."""
    here = best.evaluation
    found = []
    for one in around:
        if not one.finite:
            continue
        foreseen = dataclasses.replace(one, values=here.values + here.jacobian @ (one.place - here.place))
        objective, violation = problem.objective(one), problem.violation(one)
        gain = problem.objective(foreseen) - objective
        room = problem.violation(foreseen) - max(violation, 0.0)
        if violation <= ALLOWED and objective < best.objective:
            found.append((np.inf, -objective, one.place))
        elif max(gain, room) > SUDDEN and (objective < best.objective or gain > SUDDEN):
            found.append((max(gain, room), -objective, one.place))
    found.sort(key=lambda row: row[:2], reverse=True)
    return [place for *_, place in found[:BEYOND]]
