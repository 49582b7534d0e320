"""Kalman-like smoother of a latent state, which profiles it out of a fit.

The martensite fraction behind a noisy resistance is such a state. It follows a random walk, and resistance
and force depend on it, strongly or weakly according to the alloy. Its best trajectory for given parameters
minimises the same sum of squares as the fit. Rows are coupled to their neighbours and to the few that they
remember, so each Gauss-Newton step is one elimination of rows.

A fit sees the profile of the joint problem as a function of the parameters alone. The standard errors then
contain the state's own uncertainty. A row whose resistance does not depend on the phase says nothing about
the parameters through it either.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

from pneusma_jax.numerics.safe import frozen

from .elimination import Elimination
from .gauss_newton import banded_side_by_side, ended, largest, settle, solve_coupled

ROUNDS = 20
"""Maximum number of candidate states."""
SETTLED = 2e-3
"""Maximum change of the state in measured rows at which the search ends; it makes one further step of this
size."""
LONGEST = 0.3
"""Maximum step of the state in one round."""
OVERSHOOT = 0.01
"""Standard deviation of an overshoot of the state beyond 0 and 1. The physics ends there, but noise does
not."""


class Walk(eqx.Module):
    """Random-walk prior of the state.

    Attributes:
        weight: inverse standard deviation of the increment from the row before, shape (rows,); zero for the
            first row and in the padding.
        level: expected initial state [1].
        level_weight: inverse standard deviation of the initial state.
    """

    weight: Float[Array, " rows"]
    level: Float[Array, ""]
    level_weight: Float[Array, ""]

    @classmethod
    def over(cls, time: Array, mask: Array, process_noise: Array, level: Array, level_sd: Array) -> "Walk":
        """A walk whose variance grows by `process_noise` per second."""
        step = jnp.maximum(jnp.diff(time, prepend=time[:1]), 1e-6)
        weight = jnp.where(mask & (jnp.arange(time.size) > 0), 1.0 / jnp.sqrt(process_noise * step), 0.0)
        return cls(weight, level, 1.0 / level_sd)

    def residual(self, state: Float[Array, " rows"]) -> Float[Array, " more"]:
        """Increments, start and overshoot in standard deviations."""
        increments = self.weight[1:] * jnp.diff(state)
        start = self.level_weight * (state[:1] - self.level)
        return jnp.concatenate([start, increments, _outside(state) / OVERSHOOT])

    def gradient(self, state: Array) -> Array:
        """Derivative of half the sum of squares of `residual`."""
        pull = jnp.concatenate([jnp.zeros(1), self.weight[1:] ** 2 * jnp.diff(state)])
        ends = pull - jnp.concatenate([pull[1:], jnp.zeros(1)])
        return ends.at[0].add(self.level_weight**2 * (state[0] - self.level)) + _outside(state) / OVERSHOOT**2

    def curvature(self, state: Array) -> tuple[Array, Array]:
        """Diagonal and upper diagonal (last entry zero) of the second derivative."""
        square = self.weight**2
        after = jnp.concatenate([square[1:], jnp.zeros(1)])
        return square + after + self.held(state), -after

    def held(self, state: Array) -> Array:
        """Part of the second derivative that each row has alone: the initial state and the overshoot."""
        outside = (_outside(state) != 0.0) / OVERSHOOT**2
        return outside.at[0].add(self.level_weight**2)


def _outside(state: Array) -> Array:
    return jnp.minimum(state, 0.0) + jnp.maximum(state - 1.0, 0.0)


class Local(eqx.Module):
    """Linearisation of the law about a trajectory.

    Attributes:
        predicted: outputs, shape (k, rows).
        slope: derivative of the outputs by the state of the same row, shape (k, rows).
        remembered: derivative of the outputs by the state of the row `source`, shape (k, rows); zero where
            none is remembered.
        source: index of the earlier row whose state a row remembers, shape (rows,).
    """

    predicted: Float[Array, "k rows"]
    slope: Float[Array, "k rows"]
    remembered: Float[Array, "k rows"]
    source: Int[Array, " rows"]

    def along(self, direction: Float[Array, " rows"]) -> Float[Array, "k rows"]:
        """Change of the outputs with the state."""
        return self.slope * direction + self.remembered * direction[self.source]

    def back(self, force: Float[Array, "k rows"]) -> Float[Array, " rows"]:
        """Transpose of `along`."""
        later = jnp.sum(self.remembered * force, axis=0)
        return jnp.sum(self.slope * force, axis=0) + jnp.zeros_like(later).at[self.source].add(later)


Outputs = Callable[[PyTree, Array], Local]
"""Function of `(model, state)` that gives the outputs and their linearisation."""
Independent = Callable[[Array], Array]
"""Symmetric linear function that makes weighted outputs, shape (k, rows), independent of each other."""


def weighed(
    values: Float[Array, "k rows"], weight: Float[Array, "k rows"], independent: Independent | None
) -> Float[Array, "k rows"]:
    """Outputs times the inverse covariance of their noise, which may be correlated along the rows."""
    if independent is None:
        return weight**2 * values
    return weight * independent(independent(weight * values))


def profile(
    outputs: Outputs,
    model: PyTree,
    measured: Float[Array, "k rows"],
    weight: Float[Array, "k rows"],
    walk: Walk,
    start: Float[Array, " rows"],
    independent: Independent | None = None,
) -> Float[Array, " rows"]:
    """Trajectory of the state that explains the measurements best.

    The iterations carry no tangents. One step after them does: its derivative by `model` and `measured` is
    that of the implicit function, to the accuracy of Gauss-Newton. The gradient of the profiled sum of
    squares is exact even so, because the trajectory minimises it. The exception is a trajectory that ends at
    a limit of the state, which is a corner.

    Args:
        outputs: law, row by row.
        model: parameters of the law.
        measured: measured outputs, zero where missing, shape (k, rows).
        weight: inverse standard deviation of the outputs, zero where missing, shape (k, rows).
        walk: random-walk prior of the state.
        start: first guess of the state, shape (rows,).
        independent: transformation that makes correlated noise independent; None for white noise.
    """
    known = outputs, model, measured, weight, walk, independent
    fixed, measured_rows = frozen(known), jnp.any(weight > 0.0, axis=0)

    def step(state: Array) -> tuple[Array, Array, Array]:
        """Step of the search, see `inference.latent_trajectory.gauss_newton.Step`."""
        change, square = _step(fixed, state)
        return change, square, change

    solution, change = settle(step, start, measured_rows, SETTLED, ROUNDS, jnp.zeros_like(start))
    change = _known_step(known, solution, change)
    return ended(solution, change, largest(change, measured_rows) <= SETTLED)


Known = tuple[Outputs, PyTree, Array, Array, Walk, Independent | None]
"""The problem of a trajectory: arguments of `profile` without the first guess."""


def _step(known: Known, state: Array) -> tuple[Array, Array]:
    """Limited step of a trajectory, and the sum of squares at it."""
    outputs, model, measured, weight, walk, independent = known
    local = outputs(model, state)
    residual = local.predicted - measured
    pull = local.back(weighed(residual, weight, independent)) + walk.gradient(state)
    left = weight * residual if independent is None else independent(weight * residual)
    square = jnp.sum(left**2) + jnp.sum(walk.residual(state) ** 2)
    change = -solve(jax.lax.stop_gradient(local), weight, walk, state, pull, independent)
    return jnp.clip(change, -LONGEST, LONGEST), square


@eqx.filter_custom_jvp
def _known_step(known: Known, state: Array, change: Array) -> Array:
    """The step from the end of a search, which knows it: its derivatives alone need the law once more."""
    return change


@_known_step.def_jvp
def _known_step_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    known, state, change = primals
    return change, eqx.filter_jvp(lambda known: _step(known, state)[0], primals[:1], tangents[:1])[1]


def solve(
    local: Local,
    weight: Array,
    walk: Walk,
    state: Array,
    right: Array,
    independent: Independent | None = None,
) -> Array:
    """Solution of the Gauss-Newton system of the state.

    With white noise the rows are eliminated exactly. Noise that is correlated along the rows couples all of
    them, by a few strong modes. There this elimination preconditions conjugate gradients, which need one
    iteration for each mode.
    """
    square, none = walk.weight**2, jnp.zeros_like(weight)
    held = walk.held(state)
    after = jnp.concatenate([square[1:], jnp.zeros(1)])
    alone = held + square + after + information(local, weight) == 0.0  # padding is not coupled to any row
    renews = jnp.concatenate([local.source[1:] == jnp.arange(state.size - 1), jnp.zeros(1, bool)])
    system = Elimination.of(
        local.slope, local.remembered, renews, weight**2, none, square, jnp.where(alone, 1.0, held)
    )

    def times(direction: Array) -> Array:
        rise = square * jnp.diff(direction, prepend=direction[:1])
        walked = rise - jnp.concatenate([rise[1:], jnp.zeros(1)]) + held * direction
        return walked + local.back(weighed(local.along(direction), weight, independent))

    if independent is None:
        exact = lambda _, right: system.solve(right)  # noqa: E731
        return jax.lax.custom_linear_solve(times, right, exact, symmetric=True)
    return solve_coupled(times, right, system.solve)


def _remembered(local: Local, weight: Array) -> Array:
    """Contribution of later rows to the diagonal of the rows that they remember."""
    square = jnp.sum((weight * local.remembered) ** 2, axis=0)
    return jnp.zeros_like(square).at[local.source].add(square)


def information(local: Local, weight: Array) -> Float[Array, " rows"]:
    """Information of the readings about the state in each row."""
    return jnp.sum((weight * local.slope) ** 2, axis=0) + _remembered(local, weight)


def hessian(local: Local, weight: Array, walk: Walk, state: Array) -> tuple[Array, Array]:
    """Diagonal and upper diagonal of the Gauss-Newton matrix of the state."""
    diagonal, upper = walk.curvature(state)
    diagonal = diagonal + information(local, weight)
    return jnp.where(diagonal == 0.0, 1.0, diagonal), upper  # padding is not coupled to any row


def log_determinant(diagonal: Array, upper: Array) -> Array:
    """Log-determinant of a symmetric positive tridiagonal matrix."""

    def pivot(before: Array, row: tuple[Array, Array]) -> tuple[Array, Array]:
        here, square = row
        now = here - square / before
        return now, jnp.log(now)

    coupled = jnp.concatenate([jnp.zeros(1), upper[:-1] ** 2])
    return jnp.sum(jax.lax.scan(pivot, jnp.ones(()), (diagonal, coupled))[1])


def log_determinant_less(diagonal: Array, upper: Array, taken: Float[Array, "rows columns"]) -> Array:
    """Log-determinant of a symmetric positive tridiagonal matrix less `taken taken'`.

    It is that of the matrix plus that of `I - taken' inverse taken` (the matrix determinant lemma).
    """
    inverse = jax.vmap(banded_side_by_side(diagonal, upper), in_axes=1, out_axes=1)
    left = jnp.eye(taken.shape[1]) - taken.T @ inverse(taken)
    return log_determinant(diagonal, upper) + jnp.linalg.slogdet(left)[1]


def variances(diagonal: Array, upper: Array) -> Array:
    """Diagonal of the inverse of a symmetric positive tridiagonal matrix, shape (rows,).

    It follows from the pivots of both directions: `1 / (forward + backward - diagonal)`.
    """

    def pivot(before: Array, row: tuple[Array, Array]) -> tuple[Array, Array]:
        now = row[0] - row[1] / before
        return now, now

    coupled = jnp.concatenate([jnp.zeros(1), upper[:-1] ** 2])
    forward = jax.lax.scan(pivot, jnp.ones(()), (diagonal, coupled))[1]
    ahead = jnp.concatenate([coupled[1:], jnp.zeros(1)])
    backward = jax.lax.scan(pivot, jnp.ones(()), (diagonal, ahead), reverse=True)[1]
    return 1.0 / (forward + backward - diagonal)
