"""Levenberg-Marquardt in Moré's form (1978), inside a box, as a solver for `optimistix.least_squares`.

Three reasons speak against `optimistix.LevenbergMarquardt` unchanged. It knows no bounds. Its damping adds a
multiple of the identity, so its path depends on the units of the parameters. It stops by comparing each
residual with its own last value, which says nothing in standard errors.

Both were run on the 27 NIST problems, from the near and the far starts. The library solves all but one (MGH10
from the far start; `Dogleg` fails 6 fits of 54, `IndirectLevenbergMarquardt` 9). From the near starts it
takes 2990 steps, against 634 here. From the far starts that both manage it takes 3447, against 2821.

Keeping its loop and replacing only descent and search (column scaling, Nielsen's damping) takes 1760. It
loses BoxBOD and MGH10 from the far start. The two share nothing but a step size, so they cannot share the
metric of a trust region. Geodesic acceleration (Transtrum and Sethna, arXiv:1201.5885) saved a further third
of the steps, for one more residual, compiled and run, in each. So the step is ours. The loop, its results and
its implicit derivatives stay optimistix's.

A box is used instead of a change of variables for two reasons. A transform that reaches its bound (MINUIT's
sine, lmfit's) has zero slope there. A parameter that touches the bound then cannot leave it, and its standard
error is lost. A transform that does not reach it (logit, softplus) sends such a solution to infinity. In a
box a linear problem stays linear, a bound is reached exactly, and leaving it costs nothing.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree, Scalar

from pneusma_jax.late import optimistix as optx

from .trust_region import Box, Linearised, Proposal, linearise, propose, undamped

RESOLVED = 1e-10
"""Minimum resolvable reduction, relative to the cost. Below it rounding dominates, and steps are judged by
their size."""
SETTLED = 1e-3
"""Maximum step, in standard errors, that changes no conclusion (Bates and Watts' relative offset, 1981)."""
PATIENCE, PATIENCE_SETTLED = 40, 8
"""Maximum numbers of consecutive refusals, each a quarter of the last step, before giving up: in general, and
after the fit has settled. The second also limits steps that are too small to matter."""
LINGERING = 20
"""Number of steps within which a fit must lower chi-square by `least`, if a caller states one."""


class EngineState(eqx.Module):
    """State of the solver from step to step; `trial` is the next point to be judged."""

    first: Bool[Array, ""]
    trial: Float[Array, " n"]
    aux: PyTree
    residual: Float[Array, " m"]
    model: Linearised
    proposal: Proposal
    radius: Float[Array, ""]
    offset: Float[Array, ""]
    taken: Int[Array, ""]
    refused: Int[Array, ""]
    negligible: Int[Array, ""]
    reached: Float[Array, ""]
    since: Int[Array, ""]
    converged: Bool[Array, ""]
    precise: Bool[Array, ""]
    stalled: Bool[Array, ""]
    lingering: Bool[Array, ""]
    result: Any


class BoxedTrustRegion(eqx.Module):
    """Trust-region Levenberg-Marquardt with MINPACK's column scaling, between bounds, for flat vectors.

    The solve has converged when the undamped step is below `rtol` standard errors of the fit (relative
    offset). Two other states count as the precision of the arithmetic. In the first, the cost no longer
    resolves a step and steps no longer shrink. In the second, steps stay below `atol + rtol * size` in every
    component without becoming a small part of a standard error. This happens where the residual itself
    vanishes. The size is a component's magnitude (`relative`) or one.

    The methods are those of `optimistix.AbstractLeastSquaresSolver`, see `pneusma_jax.late.optimistix`.

    Attributes:
        rtol: relative tolerance, see above.
        atol: absolute tolerance, see above.
        norm: norm of a step whose components are each divided by their allowance.
        box: lower and upper bounds, shape (n,), or None for none, which leaves their handling out of the
            compiled program.
        relative: false for coordinates without a natural zero, such as logarithms, shape (n,).
        most: maximum number of steps. It is a number of the program, not of its source, unlike optimistix's
            `max_steps`: fits that may take more or fewer steps share one program.
        least: minimum fall of chi-square in `LINGERING` steps, else the fit ends; 0 for no such end. It is a
            number of the program, like `most`.
        first_radius: first trust radius, as a fraction of the scaled length of the starting point.
    """

    rtol: float | Float[Array, ""]
    atol: float
    norm: Callable[[PyTree], Scalar]
    box: Box | None
    relative: Bool[Array, " n"]
    most: int | Int[Array, ""]
    least: float | Float[Array, ""] = 0.0
    first_radius: float = 1.0

    def init(self, fn, y, args, options, f_struct, aux_struct, tags) -> EngineState:
        """State before any evaluation. The first step judges the starting point itself."""
        del fn, args, options, tags
        count, size = y.size, f_struct.size
        kind = y.dtype
        zero, false = jnp.zeros((), kind), jnp.asarray(False)
        return EngineState(
            first=jnp.asarray(True),
            trial=y,
            aux=jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), aux_struct),
            residual=jnp.zeros(size, kind),
            model=Linearised(
                jnp.zeros((min(size, count), count), kind),
                jnp.zeros(min(size, count), kind),
                jnp.zeros(count, kind),
            ),
            proposal=Proposal(jnp.zeros(count, kind), zero, zero),
            radius=zero,
            offset=jnp.asarray(jnp.inf, kind),
            taken=jnp.asarray(0),
            refused=jnp.asarray(0),
            negligible=jnp.asarray(0),
            reached=jnp.asarray(jnp.inf, kind),
            since=jnp.asarray(0),
            converged=false,
            precise=false,
            stalled=false,
            lingering=false,
            result=optx.RESULTS.successful,
        )

    def step(self, fn, y, args, options, state, tags) -> tuple[Array, EngineState, Any]:
        """Judge the trial point, accept or refuse it, and propose the next."""
        del options, tags
        residual, tangent, aux = jax.linearize(lambda point: fn(point, args), state.trial, has_aux=True)
        finite = jnp.all(jnp.isfinite(residual))
        # It is computed from differences of the residuals: subtracting two sums of squares loses all digits.
        actual = 0.5 * jnp.dot(state.residual - residual, state.residual + residual)
        promised = state.proposal.reduction
        ratio = jnp.where(promised > 0, actual / jnp.where(promised > 0, promised, 1.0), -1.0)
        lowers = finite & (ratio > 1e-4)
        unresolved = finite & (state.offset**2 <= RESOLVED * self._freedom(residual, y))
        model = jax.lax.cond(
            state.first | lowers | unresolved,
            lambda: linearise(tangent, residual, state.model.scale),
            lambda: state.model,
        )
        full_step, gain = undamped(model, state.trial, self.box)
        tiny = jnp.finfo(y.dtype).tiny
        offset = jnp.sqrt(gain * self._freedom(residual, y) / jnp.maximum(jnp.sum(residual**2), tiny))
        usable = jnp.all(jnp.isfinite(model.triangle))
        accept = state.first | (usable & (lowers | (unresolved & (offset < state.offset))))

        accepted = (state.trial, residual, aux, model, offset)
        stayed = (y, state.residual, state.aux, state.model, state.offset)
        new_y, residual, aux, model, offset = jax.tree.map(
            lambda a, b: jnp.where(accept, a, b), accepted, stayed
        )
        refused = jnp.where(accept, 0, state.refused + 1)
        radius = jnp.where(state.first, self._first_radius(model, new_y), self._next_radius(state, ratio))
        proposal = propose(model, new_y, radius, self.box)
        negligible = jnp.where(self._negligible(full_step, state.trial), state.negligible + 1, 0)
        chi_square = jnp.sum(residual**2)
        fell = chi_square < state.reached - self.least
        since = jnp.where(fell, 0, state.since + 1)
        near_minimum = offset < SETTLED
        fit_to_start = jnp.all(jnp.isfinite(residual)) & jnp.all(jnp.isfinite(model.triangle))
        new_state = EngineState(
            first=jnp.asarray(False),
            trial=new_y + proposal.step if self.box is None else self.box.added(new_y, proposal.step),
            aux=aux,
            residual=residual,
            model=model,
            proposal=proposal,
            radius=radius,
            offset=offset,
            taken=state.taken + 1,
            refused=refused,
            negligible=negligible,
            reached=jnp.where(fell, chi_square, state.reached),
            since=since,
            converged=offset <= self.rtol,
            precise=(unresolved & ~accept)
            | (near_minimum & (refused >= PATIENCE_SETTLED))
            | (negligible >= PATIENCE_SETTLED),
            stalled=~near_minimum & (refused >= PATIENCE),
            lingering=(self.least > 0.0) & (since >= LINGERING),
            result=optx.RESULTS.where(fit_to_start, optx.RESULTS.successful, optx.RESULTS.nonfinite),
        )
        return new_y, new_state, aux

    @staticmethod
    def _freedom(residual: Array, y: Array) -> int:
        return max(residual.size - y.size, 1)

    def _negligible(self, step: Array, y: Array) -> Array:
        allowance = self.atol + self.rtol * jnp.where(self.relative, jnp.abs(y), 1.0)
        parts = step / jnp.maximum(allowance, jnp.finfo(y.dtype).tiny)
        return self.norm(parts) <= 1

    def _first_radius(self, model: Linearised, y: Array) -> Array:
        size = jnp.linalg.norm(model.scale * jnp.where(self.relative, jnp.abs(y), 1.0))
        return self.first_radius * jnp.where(size > 0, size, 1.0)

    @staticmethod
    def _next_radius(state: EngineState, ratio: Array) -> Array:
        """Next trust radius by Powell's rule: a quarter of a refused step, twice a radius that limited a good
        step."""
        at_edge = state.proposal.length > 0.95 * state.radius
        enlarged = jnp.where((ratio > 0.75) & at_edge, 2.0 * state.radius, state.radius)
        # A ratio of NaN, from a residual of NaN, fails both comparisons and shrinks the radius.
        return jnp.where(ratio >= 0.25, enlarged, 0.25 * state.proposal.length)

    def terminate(self, fn, y, args, options, state, tags) -> tuple[Bool[Array, ""], Any]:
        """True where the state ends the solve."""
        del fn, y, args, options, tags
        ended = state.converged | state.precise | state.stalled | state.lingering
        return ended | (state.taken >= self.most), state.result

    def postprocess(
        self, fn, y, aux, args, options, state, tags, result
    ) -> tuple[Array, Any, dict[str, Any]]:
        """No change: the state itself is part of optimistix's solution."""
        del fn, args, options, state, tags, result
        return y, aux, {}
