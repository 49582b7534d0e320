"""Newton's method for equilibria, as an optimistix root finder."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PyTree

from ..late import optimistix as optx
from .linear import solve_small


class _State(eqx.Module):
    """State of `BoundedNewton`: length of the last step [1], largest residual and slope before it [1], and
    steps so far. `left` is the residual that quadratic convergence predicts after that step [1]. `stuck` is
    true if an unknown was and stays at a bound, though its equation is missed."""

    moved: Array
    excess: Array
    slope: Float[Array, "n n"]
    count: Int[Array, ""]
    left: Array
    stuck: Array


class BoundedNewton(eqx.Module):
    """Newton's method with short steps, and unknowns at the end that are held to [0, 1].

    The function must be of one flat array. Its value and Jacobian come from one pass. `options["free"]` is
    the number of unknowns without bounds, which come first (all, where it is absent). The linear system is
    solved block by block: the first block of an equilibrium is its stiffness at given phases, which is
    regular. `options["count"]` is the number of steps that were made before, 0 where it is absent. After
    `options["few"]` steps an attempt with a residual above `options["closing"]` is given up, if these are
    given. With `options["stuck"]`, one whose unknown stays at a bound and misses its equation by more than
    `options["closing"]` is given up after so many steps.

    `stats` of the solution has the largest residual `excess` and the Jacobian `slope` before the last step.

    The methods are those of `optimistix.AbstractRootFinder`, which `optimistix.root_find` calls. It is no
    base class: loading optimistix takes 0.13 s, and a program from disk is not traced.

    Attributes:
        close: length of a step after which the method ends [1]. It converges quadratically, so that the error
            is then of the order of its square.
        longest: longest step of an unknown [1].
        patience: steps after which every other one is shortened. Laws with corners (friction, contact) send
            Newton's method to and fro between the two sides of a corner.
        shorter: part of such a step that is taken [1].
        corner: steps below this length are taken in full [1].
        balanced: residual that ends the method as soon as it is predicted [1]. Quadratic convergence squares
            the ratio of neighbouring residuals with every step. Zero asks for a short step instead.
    """

    close: float = 1e-8
    longest: float = 0.3
    patience: int = 8
    shorter: float = 0.35
    corner: float = 1e-4
    balanced: float = 0.0

    def init(
        self, fn: Any, y: Array, args: Any, options: dict, f_struct: Any, aux_struct: Any, tags: Any
    ) -> _State:
        """See optimistix."""
        far, count = jnp.asarray(jnp.inf, y.dtype), jnp.asarray(options.get("count", 0))
        return _State(far, far, jnp.eye(y.size, dtype=y.dtype), count, far, jnp.asarray(False))

    def step(
        self, fn: Callable, y: Array, args: Any, options: dict, state: _State, tags: Any
    ) -> tuple[Array, _State, Any]:
        """One step; value and slope of the function in one pass."""

        def twice(y: Array) -> tuple[Array, tuple]:
            value, aux = fn(y, args)
            return value, (value, aux)

        slope, (value, aux) = jax.jacfwd(twice, has_aux=True)(y)
        free = options.get("free", y.size)
        step = jnp.clip(solve_blocks(slope, value, free), -self.longest, self.longest)
        early = (state.count < self.patience) | (state.count % 2 == 0)
        share = jnp.where(early | (jnp.max(jnp.abs(step)) < self.corner), 1.0, self.shorter)
        after, stuck = y - share * step, jnp.asarray(False)
        if free < y.size:
            after = jnp.concatenate([after[:free], jnp.clip(after[free:], 0.0, 1.0)])
            stuck = jnp.any((after == y)[free:] & (jnp.abs(value[free:]) > options.get("closing", 0.0)))
        moved, excess = jnp.max(jnp.abs(after - y)), jnp.max(jnp.abs(value))
        left = state.left
        if self.balanced > 0.0:  # nothing is predicted before the second step, or for a shortened one
            predicted = excess * (excess / state.excess) ** 2
            left = jnp.where(jnp.isfinite(state.excess) & (share == 1.0), predicted, jnp.inf)
        return after, _State(moved, excess, slope, state.count + 1, left, stuck), aux

    def terminate(
        self, fn: Any, y: Array, args: Any, options: dict, state: _State, tags: Any
    ) -> tuple[Bool[Array, ""], Any]:
        """End after a short step, where numbers are no longer finite, or where an attempt is given up."""
        # both are infinite before the first step
        lost = jnp.isnan(state.moved + state.excess) | (jnp.isfinite(state.moved) & jnp.isinf(state.excess))
        if "few" in options:
            lost |= (state.count >= options["few"]) & (state.excess > options["closing"])
        if "stuck" in options:
            lost |= (state.count >= options["stuck"]) & state.stuck
        result = optx.RESULTS.where(lost, optx.RESULTS.nonlinear_divergence, optx.RESULTS.successful)
        return (state.moved <= self.close) | (state.left < self.balanced) | lost, result

    def postprocess(
        self, fn: Any, y: Array, aux: Any, args: Any, options: dict, state: _State, tags: Any, result: Any
    ) -> tuple[Array, Any, dict]:
        """Nothing more to do."""
        return y, aux, {"excess": state.excess, "slope": state.slope}


def newton_rows(
    function: Callable, rows: PyTree, begin: Float[Array, "rows n"], options: dict, ended: Array, block: int,
    most: Array,
) -> tuple[Array, _State]:
    """Steps of `BoundedNewton` for many systems, `block` of them side by side. No derivatives.

    After a round of steps, systems that ended are put behind those that did not, where that spares a block.
    So none waits for a slower one, and a round costs what its systems cost.

    Args:
        function: function of the unknowns and a row.
        rows: data of each system, arrays of shape (rows, ...).
        begin: unknowns to start from; the number of rows is a multiple of `block`.
        options: see `BoundedNewton`; `options["count"]` of shape (rows,).
        ended: systems that are left alone, shape (rows,).
        block: number of systems that are computed side by side.
        most: maximum of steps.

    Returns:
        Unknowns, and the state of the method: see `excess`, `slope` and `count` there; `moved` is infinite
        before the first step.
    """
    solver, size = BoundedNewton(), len(begin)
    of_all = {name: value for name, value in options.items() if name != "count"}

    def step(row: PyTree, y: Array, state: _State, ended: Array) -> tuple:
        evaluated = lambda y, _: (function(y, row), None)  # noqa: E731
        after, now, _ = solver.step(evaluated, y, None, of_all, state, frozenset())
        over, _ = solver.terminate(evaluated, after, None, of_all, now, frozenset())
        kept = jax.tree.map(lambda old, new: jnp.where(ended, old, new), (y, state), (after, now))
        return *kept, ended | over

    def advance(carry: tuple) -> tuple:
        count, place, rows, *moving = carry

        def part(k: Array, moving: list) -> list:
            cut = lambda x: jax.lax.dynamic_slice_in_dim(x, k * block, block)  # noqa: E731
            put = lambda x, new: jax.lax.dynamic_update_slice_in_dim(x, new, k * block, 0)  # noqa: E731
            found = jax.vmap(step)(*jax.tree.map(cut, (rows, *moving)))
            return jax.tree.map(put, moving, list(found))

        blocks = -(-jnp.sum(~moving[-1]) // block)
        moving = jax.lax.fori_loop(0, blocks, part, moving)

        def in_order(carried: tuple) -> tuple:
            order = jnp.argsort(carried[-1], stable=True)
            return jax.tree.map(lambda x: x[order], carried)

        spared = -(-jnp.sum(~moving[-1]) // block) < blocks
        return count + 1, *jax.lax.cond(spared, in_order, lambda carried: carried, (place, rows, *moving))

    state = jax.vmap(lambda y, count: solver.init(None, y, None, {"count": count}, None, None, None))(
        begin, options["count"]
    )
    begun = (jnp.asarray(0), jnp.arange(size), rows, begin, state, ended)
    unfinished = lambda carry: (carry[0] < most) & ~jnp.all(carry[-1])  # noqa: E731
    _, place, _, unknowns, state, _ = jax.lax.while_loop(unfinished, advance, begun)
    back = jnp.argsort(place)
    return jax.tree.map(lambda x: x[back], (unknowns, state))


def solve_blocks(
    matrix: Float[Array, "n n"], vector: Float[Array, "n"], first: int
) -> Float[Array, "n"]:
    """Solution of `matrix @ x = vector` by eliminating the first block, at most three by three.

    Args:
        matrix: whose leading `first` rows and columns are regular; the rest is at most three by three.
        vector: right-hand side.
        first: size of the first block; n or 0 where there is only one.
    """
    if first in (0, vector.size):
        return solve_small(matrix, vector)
    (a, b), (c, d) = ((half[:, :first], half[:, first:]) for half in (matrix[:first], matrix[first:]))
    # apart from each other: the vector alone is linear, and is transposed for reverse derivatives
    across = jax.vmap(solve_small, (None, 1), 1)(a, b)
    own = solve_small(a, vector[:first])
    rest = solve_small(d - c @ across, vector[first:] - c @ own)
    return jnp.concatenate([own - across @ rest, rest])
