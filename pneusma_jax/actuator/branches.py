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
from .balance import Problem, at_phases, first_trial, freedoms, joint_residual, measured
from .root_find import newton, newton_side_by_side
from .root_search import DISTINCT

PATHS = 8
"""Number of paths that are followed side by side. With 8, thermal cycles of PneuSMA1, PneuSMA2 and the triad
to 50 kPa come back, or their rows are said to be one of several. Fewer were not tried."""
ASIDE = 0.02
"""Minimum distance at which a neighbouring branch is sought, along the direction in which they meet [1]."""
FIRST = 10.0
"""Weight of the heat of a first equilibrium: the least heated one begins a history, whatever follows."""
LOST = 10.0
"""Cost of a row in which a path has no equilibrium [1]; the right paths of those cycles cost 0.1 in all."""

BEHIND = 10.0 * LOST
"""Cost over that of the cheapest path from which a path is given up [1]. Paths that began where there was no
equilibrium had lost a hundred rows, and took half of the time."""


class Branch(eqx.Module):
    """The path that was taken.

    Attributes:
        unknowns: joint unknowns of every row, shape (rows, n).
        good: true where a row is in equilibrium, shape (rows,).
        equilibria: number of equilibria to which the paths' starts led in each row, shape (rows,); from the
            first row with several on, at least 2.
        steps: number of Newton steps on the chosen path, shape (rows,).
    """

    unknowns: Float[Array, "rows n"]
    good: Bool[Array, "rows"]
    equilibria: Int[Array, "rows"]
    steps: Int[Array, "rows"]


class _Path(eqx.Module):
    """State of a path: memory of its rows, its joint unknowns, their last change, its cost, and whether it
    has had an equilibrium. The cost is infinite where it is given up."""

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

    count = freedoms(first)

    def step(paths: _Path, row: PyTree) -> tuple[_Path, tuple]:
        ahead = _held(paths.unknowns + paths.change, count)
        idle = _idle(paths)
        roots, good, steps = _roots(paths, ahead, idle, row, problem_of)
        several = _different(roots, good)
        tried = _tried(paths, ahead, roots, good, idle, count)
        order = jnp.argsort(tried.cost)[:PATHS]
        parent = order // TRIES

        def on(carried: PyTree, root: Array, good: Array) -> PyTree:
            return commit(carried, *problem_of(carried, row), root, good)

        kept, good = jax.tree.map(lambda x: x[order], (tried, good))
        carried = jax.vmap(on)(jax.tree.map(lambda x: x[parent], paths.carried), kept.unknowns, good)
        kept = eqx.tree_at(lambda k: k.carried, kept, carried, is_leaf=lambda x: x is None)
        return kept, (kept.unknowns, good, parent, steps[order], several)

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
    first = first_trial(problem.actuator)
    begun = jax.vmap(lambda x: newton(at_phases(problem, x, MartensiteFraction), first).unknowns)(corners)
    begun = jnp.where(jnp.all(jnp.isfinite(begun), axis=1, keepdims=True), begun, first)
    unknowns = jnp.concatenate([begun, corners], axis=1)
    carried = jax.tree.map(lambda x: jnp.broadcast_to(x, (PATHS, *jnp.shape(x))), begin)
    none = jnp.zeros(PATHS)
    return _Path(carried, unknowns, jnp.zeros((PATHS, count + springs)), none, none > 0.0)


def _held(unknowns: Array, count: int) -> Array:
    """Joint unknowns with fractions between 0 and 1."""
    return jnp.concatenate([unknowns[..., :count], jnp.clip(unknowns[..., count:], 0.0, 1.0)], axis=-1)


def _idle(paths: _Path) -> Array:
    """Starts from which no root is looked for, shape (PATHS * TRIES,).

    They are those of paths of infinite cost, and those where a path was that hardly moves: it goes on there.
    """
    given_up = jnp.repeat(~jnp.isfinite(paths.cost)[:, None], TRIES, axis=1)
    resting = jnp.max(jnp.abs(paths.change), axis=1) < 0.5 * ASIDE
    return given_up.at[:, -1].max(resting).reshape(-1)


def _roots(
    paths: _Path, ahead: Array, idle: Array, row: PyTree, problem_of: Callable
) -> tuple[Array, Array, Array]:
    """Roots to which the starts of all paths lead, whether they are equilibria, and steps.

    There are `TRIES` starts of each path.

    Args:
        paths: paths up to the row before.
        ahead: joint unknowns of paths that go on as before, shape (PATHS, n).
        idle: see `_idle`.
        row, problem_of: see `follow`.
    """

    def aside_of(carried: PyTree, ahead: Array) -> Array:
        # branches meet along the direction of the smallest eigenvalue; one inverse iteration finds it
        problem = problem_of(carried, row)[0]
        slope = jax.jacfwd(lambda y: joint_residual(y, problem, 1))(ahead)
        aside = solve_blocks(slope, jnp.ones_like(ahead), freedoms(problem))
        size = jnp.max(jnp.abs(aside))
        return jnp.where(jnp.isfinite(size) & (size > 0.0), aside / jnp.where(size > 0.0, size, 1.0), 0.0)

    aside = jax.vmap(aside_of)(paths.carried, ahead)
    reach = jnp.maximum(2.0 * jnp.max(jnp.abs(paths.change), axis=1, keepdims=True), ASIDE)
    starts = jnp.stack([ahead, ahead + reach * aside, ahead - reach * aside, paths.unknowns], axis=1)
    carried = _each_try(paths.carried)
    return newton_side_by_side(
        lambda carried: problem_of(carried, row)[0], carried, starts.reshape(-1, ahead.shape[1]), idle, TRIES
    )


def _each_try(tree: PyTree) -> PyTree:
    """Arrays of paths, repeated for every start of each."""
    return jax.tree.map(lambda x: jnp.repeat(x, TRIES, axis=0), tree)


def _tried(
    paths: _Path, ahead: Array, roots: Array, good: Array, idle: Array, count: int
) -> _Path:
    """Paths that go on to roots, without what they carry.

    Those that can no longer become the cheapest have an infinite cost.

    Args:
        paths, ahead, idle: see `_roots`.
        roots, good: roots, and whether they are equilibria, `TRIES` a path.
        count: number of unknowns before the fractions.
    """
    before, ahead = _each_try((eqx.tree_at(lambda p: p.carried, paths, None), ahead))
    root = jnp.where(good[:, None], roots, before.unknowns)
    heated = FIRST * (1.0 - jnp.min(root[:, count:], axis=1))
    uneven = jnp.where(before.begun, jnp.sum(jnp.abs(root - ahead), axis=1), heated)
    cost = before.cost + jnp.where(good, uneven, jnp.where(idle, jnp.inf, LOST))
    change = jnp.where((before.begun & good)[:, None], root - before.unknowns, 0.0)
    return _Path(None, root, change, _without_doubles(cost, root, change), before.begun | good)


def _without_doubles(cost: Array, unknowns: Array, change: Array) -> Array:
    """Costs of paths, with those of paths that can no longer become the cheapest made infinite.

    Costs of the next row differ between paths at one equilibrium at most by the difference of their changes.
    """
    cost = jnp.where(cost <= jnp.min(cost) + BEHIND, cost, jnp.inf)
    same = jnp.max(jnp.abs(unknowns[:, None] - unknowns[None]), axis=-1) < DISTINCT
    further = jnp.sum(jnp.abs(change[:, None] - change[None]), axis=-1)
    worse = cost[None] + further <= cost[:, None] + DISTINCT
    # of two that are as good as each other the first one stays
    first = jnp.argsort(jnp.argsort(cost))
    double = jnp.any(same & worse & (first[None] < first[:, None]), axis=1)
    return jnp.where(double, jnp.inf, cost)


def _different(unknowns: Array, good: Array) -> Array:
    """Number of different equilibria among paths."""
    same = jnp.max(jnp.abs(unknowns[:, None] - unknowns[None]), axis=-1) < DISTINCT
    earlier = np.tril(np.ones(same.shape, bool), -1)
    return jnp.sum(good & ~jnp.any(same & earlier & good[None], axis=1))
