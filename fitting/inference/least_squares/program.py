"""The compiled half of a fit. It is pure, so it may be mapped over starting points, data sets and bootstrap
replicas."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from pneusma_jax.errors import InputError
from pneusma_jax.late import optimistix as optx
from pneusma_jax.program_cache import stored_jit

from ..parameters import Layout
from .engine import BoxedTrustRegion
from .trust_region import Box


class Outcome(eqx.Module):
    """End of a solve, as arrays.

    Attributes:
        vector: fitting coordinates, shape (n,).
        residual: residual at the end, priors included, shape (m,).
        triangle: R of the Jacobian's QR factors, R^T R = J^T J, shape (min(m, n), n).
        offset: next undamped step, in standard errors of the fit.
        steps: number of residual evaluations, each with its derivative.
        converged: true if the offset is below the tolerance.
        precise: true if rounding prevents further progress.
        stalled: true if no step lowers the cost although the offset is not small.
        lingering: true if the last steps lowered chi-square by less than was asked for.
        finite: true if the residual and its derivative are finite.
    """

    vector: Float[Array, " n"]
    residual: Float[Array, " m"]
    triangle: Float[Array, "k n"]
    offset: Float[Array, ""]
    steps: Int[Array, ""]
    converged: Bool[Array, ""]
    precise: Bool[Array, ""]
    stalled: Bool[Array, ""]
    lingering: Bool[Array, ""]
    finite: Bool[Array, ""]

    @property
    def chi_square(self) -> Float[Array, ""]:
        """Sum of squared residuals, priors included."""
        return (self.residual**2).sum(axis=-1)


def solve(
    function: Callable[[Array, PyTree], Array],
    start: Float[Array, " n"],
    args: PyTree = None,
    *,
    box: Box | None = None,
    relative: Bool[Array, " n"] | None = None,
    rtol: float | Array = 1e-8,
    max_steps: int | Array = 2000,
    least: float | Array = 0.0,
) -> Outcome:
    """Minimise the sum of squares of `function(vector, args)`; may be traced, mapped and compiled.

    Args:
        function: function from shape (n,) to (m,).
        start: start within the box, shape (n,).
        args: further argument of the function.
        box: bounds, or None for none (a smaller program).
        relative: false for coordinates without a natural zero, such as logarithms, shape (n,); by default all
            true.
        rtol: maximum undamped step at convergence, in standard errors of the fit.
        max_steps: maximum number of residual evaluations.
        least: minimum fall of chi-square, see `BoxedTrustRegion`.
    """
    solver = BoxedTrustRegion(
        rtol=rtol,
        atol=0.0,
        norm=optx.max_norm,
        box=box,
        relative=jnp.ones(start.shape, bool) if relative is None else relative,
        most=max_steps,
        least=least,
    )
    solution = optx.least_squares(function, solver, start, args, max_steps=None, throw=False)
    state = solution.state
    return Outcome(
        vector=solution.value,
        residual=state.residual,
        triangle=state.model.triangle,
        offset=state.offset,
        steps=solution.stats["num_steps"],
        converged=state.converged,
        precise=state.precise,
        stalled=state.stalled,
        lingering=state.lingering,
        finite=solution.result != optx.RESULTS.nonfinite,
    )


class Problem(eqx.Module):
    """A fit, as numbers (traced) and structure (static).

    Attributes:
        residual: weighted residual, `residual(values, data)`.
        data: data for the residual.
        stored: values of the parameters that are not free, in the layout's order, shape (all,).
        prior_mean: prior means of the parameters `prior_names`, shape (p,).
        prior_sd: prior standard deviations of the same, shape (p,).
        box: bounds of the fitting coordinates, or None for none.
        rtol: tolerance of the solve.
        least: minimum fall of chi-square, see `BoxedTrustRegion`.
        layout: conversion of a vector to values.
        prior_names: names of the parameters whose priors are appended as residual rows.
    """

    residual: Callable[[dict[str, Array], PyTree], Array]
    data: PyTree
    stored: Float[Array, " all"]
    prior_mean: Float[Array, " p"]
    prior_sd: Float[Array, " p"]
    box: Box | None
    rtol: Float[Array, ""]
    least: Float[Array, ""]
    layout: Layout = eqx.field(static=True)
    prior_names: tuple[str, ...] = eqx.field(static=True)

    def rows(self, vector: Float[Array, " n"]) -> Float[Array, " m"]:
        """Weighted residuals of the data, then those of the priors."""
        values = self.layout.values(vector, self.stored)
        rows = jnp.ravel(self.residual(values, self.data)).astype(vector.dtype)
        if rows.size == 0:
            raise InputError("the residual has no rows: there is no data to fit")
        if not self.prior_names:
            return rows
        prior_values = jnp.stack([values[name] for name in self.prior_names])
        return jnp.concatenate([rows, (prior_values - self.prior_mean) / self.prior_sd])

    def stacked_values(self, vector: Float[Array, " n"]) -> Float[Array, " all"]:
        """All values in the layout's order."""
        values = self.layout.values(vector, self.stored)
        return jnp.stack([values[name] for name in self.layout.names])


def _rows(vector: Array, problem: Problem) -> Array:
    return problem.rows(vector)


@stored_jit(Outcome)
def run(
    problem: Problem, starts: Float[Array, "starts n"], max_steps: Int[Array, ""]
) -> tuple[Outcome, Any, Any]:
    """Solve from every start.

    The program is compiled once per residual function, layout and shapes. Numbers, bounds, data and
    the limit of steps may change. It is stored, and traced no more, if the residual has a lasting name.

    Returns:
        Outcomes, all values (starts, all) and their derivatives by the vector (starts, all, n).
    """

    def one(start):
        relative = ~jnp.asarray(problem.layout.logarithmic, bool)
        outcome = solve(
            _rows,
            start,
            problem,
            box=problem.box,
            relative=relative,
            rtol=problem.rtol,
            max_steps=max_steps,
            least=problem.least,
        )
        values = problem.stacked_values(outcome.vector)
        return outcome, values, jax.jacfwd(problem.stacked_values)(outcome.vector)

    if starts.shape[0] > 1:
        return jax.vmap(one)(starts)
    return jax.tree.map(lambda leaf: leaf[None], one(starts[0]))
