"""Choice of one equilibrium among several, for a history of measured resistances.

One pair of resistances may belong to several configurations. Where two of these meet, a row by itself cannot
tell which way the actuator went. The phases can: they move evenly, and a path that turns back where two
branches meet has a kink. So several paths are followed side by side, each with its own memories. The path
whose configuration and phases change most evenly over the whole history is taken. The search has no
derivatives.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PyTree

from ..nitinol.spring import MartensiteFraction
from ..numerics.newton import solve_blocks
from ..numerics.safe import frozen
from .balance import Problem, at_phases, freedoms, joint_residual, measured, start
from .root_find import DISTINCT, newton

PATHS = 8
"""Number of paths that are followed side by side. With 8, the thermal cycles of PneuSMA1, PneuSMA2 and the
triad come back at all pressures to 50 kPa; fewer were not tried."""
ASIDE = 0.02
"""Minimum distance at which a neighbouring branch is sought, along the direction in which they meet [1]."""
FIRST = 10.0
"""Weight of the heat of a first equilibrium: the least heated one begins a history, whatever follows."""
LOST = 10.0
"""Cost of a row in which a path has no equilibrium [1]; the right paths of those cycles cost 0.1 in all."""


class Branch(eqx.Module):
    """The path that was taken.

    Attributes:
        unknowns: joint unknowns of every row, shape (rows, n).
        good: true where a row is in equilibrium, shape (rows,).
        equilibria: number of equilibria that the paths had in each row, shape (rows,); from the first row
            with several on, at least 2.
        steps: number of Newton steps on the chosen path, shape (rows,).
    """

    unknowns: Float[Array, "rows n"]
    good: Bool[Array, "rows"]
    equilibria: Int[Array, "rows"]
    steps: Int[Array, "rows"]


class _Path(eqx.Module):
    """State of a path: memory of its rows, its joint unknowns, their last change, its cost, and whether it
    has had an equilibrium."""

    carried: PyTree
    unknowns: Array
    change: Array
    cost: Array
    begun: Array


def follow(
    begin: PyTree,
    rows: PyTree,
    problem_of: Callable[[PyTree, PyTree], tuple[Problem, Any]],
    commit: Callable[[PyTree, Problem, Any, Array, Array], PyTree],
) -> Branch:
    """The path through a history.

    Args:
        begin: memory that the first row starts from.
        rows: the history, a pytree of arrays with a leading axis of rows.
        problem_of: the problem of a row from what it is given and the row, and whatever `commit` needs of it.
        commit: function that makes the next row's memory. Its arguments are this row's memory, its problem
            with the rest of `problem_of`, its joint unknowns, and whether they are an equilibrium.
    """
    begin, rows = frozen((begin, rows))
    first_row = jax.tree.map(lambda x: x[0], rows)
    first, _ = problem_of(begin, first_row)
    paths = _first_paths(begin, first)

    def step(paths: _Path, row: PyTree) -> tuple[_Path, tuple]:
        grown = jax.vmap(lambda path: _grown(path, row, problem_of, commit))(paths)
        many, roots, good, steps = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), grown)
        order = jnp.argsort(_without_doubles(many))[:PATHS]
        kept, good = jax.tree.map(lambda x: x[order], (many, good))
        parent = order // TRIES
        found = (kept.unknowns, good, parent, steps[order], _different(kept.unknowns, good))
        return kept, found

    paths, (unknowns, good, parents, steps, equilibria) = jax.lax.scan(step, paths, rows)

    def back(which: Array, row: tuple) -> tuple[Array, tuple]:
        unknowns, good, parents, steps = row
        return parents[which], (unknowns[which], good[which], steps[which])

    best = jnp.argmin(paths.cost)
    _, (unknowns, good, steps) = jax.lax.scan(back, best, (unknowns, good, parents, steps), reverse=True)
    # where paths parted, a history may have gone on along the wrong one ever since
    parted = jnp.cumsum(equilibria > 1) > 0
    return Branch(unknowns, good, jnp.where(parted, jnp.maximum(equilibria, 2), equilibria), steps)


TRIES = 4
"""Number of starts of each path in each row: straight on, to either side, and where it was."""


def _first_paths(begin: PyTree, problem: Problem) -> _Path:
    """Paths that begin at various phases, all cold first."""
    count, springs = freedoms(problem), len(measured(problem))
    corners = np.array(np.meshgrid(*[[1.0, 0.5, 0.1]] * springs, indexing="ij")).reshape(springs, -1).T
    corners = corners[np.argsort(1.0 - corners.min(axis=1), kind="stable")]
    corners = np.resize(corners, (PATHS, springs))
    corners = jnp.asarray(corners)
    first = start(problem.actuator)
    begun = jax.vmap(lambda x: newton(at_phases(problem, x, MartensiteFraction), first).unknowns)(corners)
    begun = jnp.where(jnp.all(jnp.isfinite(begun), axis=1, keepdims=True), begun, first)
    unknowns = jnp.concatenate([begun, corners], axis=1)
    carried = jax.tree.map(lambda x: jnp.broadcast_to(x, (PATHS, *jnp.shape(x))), begin)
    none = jnp.zeros(PATHS)
    return _Path(carried, unknowns, jnp.zeros((PATHS, count + springs)), none, none > 0.0)


def _grown(
    path: _Path, row: PyTree, problem_of: Callable, commit: Callable
) -> tuple[_Path, Array, Array, Array]:
    """The ways on of one path: paths, roots, whether they are equilibria, and steps."""
    problem, more = problem_of(path.carried, row)
    count = freedoms(problem)
    held = lambda y: jnp.concatenate([y[:count], jnp.clip(y[count:], 0.0, 1.0)])  # noqa: E731
    ahead = held(path.unknowns + path.change)
    slope = jax.jacfwd(lambda y: joint_residual(y, problem, 1))(ahead)
    # the direction in which branches meet is that of the smallest eigenvalue; one inverse iteration finds it
    aside = solve_blocks(slope, jnp.ones_like(ahead), count)
    size = jnp.max(jnp.abs(aside))
    aside = jnp.where(jnp.isfinite(size) & (size > 0.0), aside / jnp.where(size > 0.0, size, 1.0), 0.0)
    reach = jnp.maximum(2.0 * jnp.max(jnp.abs(path.change)), ASIDE)
    starts = jnp.stack([ahead, ahead + reach * aside, ahead - reach * aside, path.unknowns])
    ended = jax.vmap(lambda y: newton(problem, held(y)))(starts)
    roots, steps, good = ended.unknowns, ended.steps, ended.good

    def on(root: Array, good: Array) -> _Path:
        root = jnp.where(good, root, path.unknowns)
        heated = FIRST * (1.0 - jnp.min(root[count:]))
        uneven = jnp.where(path.begun, jnp.sum(jnp.abs(root - ahead)), heated)
        cost = path.cost + jnp.where(good, uneven, LOST)
        change = jnp.where(path.begun & good, root - path.unknowns, 0.0)
        carried = commit(path.carried, problem, more, root, good)
        return _Path(carried, root, change, cost, path.begun | good)

    return jax.vmap(on)(roots, good), roots, good, steps


def _without_doubles(paths: _Path) -> Array:
    """Costs, with those of paths that only repeat a cheaper one made infinite."""
    cost = jnp.where(jnp.isfinite(paths.cost), paths.cost, jnp.inf)
    order = jnp.argsort(cost)
    both = jnp.concatenate([paths.unknowns, paths.change], axis=1)[order]
    same = jnp.max(jnp.abs(both[:, None] - both[None]), axis=-1) < DISTINCT
    earlier = np.tril(np.ones(same.shape, bool), -1)
    double = jnp.any(same & earlier, axis=1)
    return cost.at[order].set(jnp.where(double, jnp.inf, cost[order]))


def _different(unknowns: Array, good: Array) -> Array:
    """Number of different equilibria among paths."""
    same = jnp.max(jnp.abs(unknowns[:, None] - unknowns[None]), axis=-1) < DISTINCT
    earlier = np.tril(np.ones(same.shape, bool), -1)
    return jnp.sum(good & ~jnp.any(same & earlier & good[None], axis=1))
