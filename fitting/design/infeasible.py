"""Search for the constraints of a study that contradict each other."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .log import Evaluator
from .optimise import ALLOWED, Outcome, Problem, best_of, optimise


def contradiction(
    problem: Problem, owners: np.ndarray, starts: Sequence[np.ndarray], evaluate: Evaluator
) -> tuple[list[int], float] | None:
    """A smallest set of constraints that no design in the box keeps together.

    The largest violation is minimised from all starts. Then each constraint is left out in turn; where the
    rest still cannot be kept, it stays out.

    Args:
        problem: whose rows are all constraints.
        owners: index of the constraint of every row.
        starts: places in the box.
        evaluate: evaluator of the model.

    Returns:
        Indices of the constraints, and the least scaled violation of their worst [1]; None if all can be
        kept.
    """

    def least(kept: list[int]) -> Outcome:
        rows = np.flatnonzero(np.isin(owners, kept))
        part = dataclasses.replace(
            problem,
            rows=problem.rows[rows],
            limits=problem.limits[rows],
            scales=problem.scales[rows],
            slack=True,
        )
        return best_of(optimise([part] * len(starts), starts, evaluate))

    kept = sorted({int(k) for k in owners})
    missed = least(kept).objective
    if missed <= ALLOWED:
        return None
    for k in list(kept):
        others = [j for j in kept if j != k]
        if others and (left := least(others).objective) > ALLOWED:
            kept, missed = others, left
    return kept, missed
