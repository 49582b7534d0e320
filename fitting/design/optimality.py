"""First-order conditions of optimality at a design: which limits hold it, and the gain of relaxing them."""

from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

from .log import Evaluation
from .optimise import BETTER, Problem

optimize = Late("scipy.optimize")

ACTIVE = 1e-4
"""Scaled slack up to which a constraint counts as active [1]."""
ROUNDING = BETTER
"""Multiplier below which it counts as a rounding error [1]. Relaxing that limit by one scale would gain less
than a search tells apart."""


@dataclass(frozen=True)
class Conditions:
    """First-order conditions at a design.

    Attributes:
        rows: multiplier of every constraint row [1]: gain of the scaled objective if its limit is relaxed by
            one scale. It is zero where the constraint is not active.
        low, high: multipliers of the ends of the box [1], shape (parameters,).
        left: size of the gradient that no multiplier explains, over that of the objective's gradient [1].
        steepness: size of the part that no multiplier explains: change of the scaled objective over a whole
            range [1].
    """

    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray
    left: float
    steepness: float

    @property
    def inside(self) -> bool:
        """True if neither a constraint nor an end of a range holds the design."""
        return not (self.rows.any() or self.low.any() or self.high.any())


def conditions(problem: Problem, one: Evaluation) -> Conditions:
    """Multipliers by non-negative least squares on the gradients of what is active."""
    size, room = one.place.size, -problem.excess(one)
    free = problem.free(size)
    gradient = problem.weights @ one.jacobian
    active = np.flatnonzero(room <= ACTIVE)
    below = np.array([k for k in free if one.place[k] <= ACTIVE], dtype=int)
    above = np.array([k for k in free if one.place[k] >= 1.0 - ACTIVE], dtype=int)
    steep = one.jacobian[problem.rows[active]] / problem.scales[active, None]
    matrix = np.vstack([steep, -np.eye(size)[below], np.eye(size)[above]])[:, free].T
    found = np.zeros(matrix.shape[1])
    left = float(np.linalg.norm(gradient[free]))
    if matrix.size:
        found, left = optimize.nnls(matrix, -gradient[free])
        found[found < ROUNDING] = 0.0
    rows, low, high = np.zeros(room.size), np.zeros(size), np.zeros(size)
    rows[active] = found[: active.size]
    low[below] = found[active.size : active.size + below.size]
    high[above] = found[active.size + below.size :]
    norm = float(np.linalg.norm(gradient[free])) or 1.0
    return Conditions(rows, low, high, left / norm, left)
