"""A limit as a function of independent standard normal variables, here called scores."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..problem import Problem
from ..quantities import Limit, margin


class LimitState:
    """Margins of rows to a limit; negative where it fails.

    Args:
        problem: problem of a study.
        limit: limit of one quantity.
    """

    def __init__(self, problem: Problem, limit: Limit):
        self._problem, self._limit = problem, limit
        self._margin = lambda y: margin(y[None], limit, problem.columns)[0]
        self.rows = self.without_result = 0

    @property
    def dimension(self) -> int:
        """Number of scores."""
        return len(self._problem.inputs.names)

    def margins(self, n: Float[np.ndarray, "rows scores"]) -> Float[np.ndarray, " rows"]:
        """Margins in the quantity's unit. They are infinite where a row has no result, which counts as not
        failed."""
        y, _ = self._problem.evaluator(self._problem.inputs.values(n @ self._problem.inputs.lower.T))
        found = np.asarray(margin(jnp.asarray(y), self._limit, self._problem.columns))
        return self._counted(found)

    def with_gradient(self, n: Float[np.ndarray, "rows scores"]) -> tuple[np.ndarray, np.ndarray]:
        """Margins, and their derivatives by the scores, exact to rounding, shape (rows, scores)."""
        inputs = self._problem.inputs
        z = n @ inputs.lower.T
        found, by_value = self._problem.evaluator.with_gradient(self._margin, inputs.values(z))
        return self._counted(found), np.nan_to_num(by_value * inputs.slopes(z)) @ inputs.lower

    def _counted(self, margins: np.ndarray) -> np.ndarray:
        lost = np.isnan(margins)
        self.rows += len(margins)
        self.without_result += int(lost.sum())
        return np.where(lost, np.inf, margins)
