"""Rows inside of a transformation, such as `jax.jit`, whose numbers are not known: one program for all.

One loop does all: the grid of equilibria, the rows from their starts in it, and those that fail. So Newton's
method is compiled once. `batches` and `several` do the same where numbers are known.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol.spring import MartensiteFraction, Temperature
from ..numerics.safe import frozen
from . import Actuator
from .balance import Problem, all_finite, start
from .batches import BLOCK, CHUNK, WORTHWHILE, is_resistance
from .phase_map import as_map, grid_points
from .result import Equilibrium, at_phases_told, equilibrium_of
from .root_find import LOAD_STEPS, Ended, at_rest, attached, loaded_by, newton
from .traced_several import traced_roots


def traced_batch(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> Equilibrium:
    """`solve_batch` of numbers that are not known; see there.

    Args:
        actuator: the same for every row.
        each: pressures, activations and states, arrays of shape (rows,).
        common: what springs remember on the grid of equilibria.
        shared: whether that is what they remember in every row.
    """
    searched = frozen((actuator, each, common))
    if any(is_resistance(a) for a in each[1]):
        found = traced_roots(*searched, shared)
        roots, steps, count, stable = found.unknowns, found.steps, found.count, found.stable
    else:
        ended = _at_phases(*searched)
        told = jax.vmap(lambda row, one: at_phases_told(Problem(actuator, *row), one))(each, ended)
        spread = lambda x: jnp.broadcast_to(x, each[0].shape)  # noqa: E731
        roots, steps, count, stable = ended.unknowns, ended.steps, *map(spread, told)
    return _finished(actuator, each, roots, steps, count, stable)


def finished_rows(
    actuator: Actuator, each: tuple, roots: Array, steps: Array, count: Array, stable: Array
) -> Equilibrium:
    """Results of rows whose roots are known, with derivatives by all their numbers.

    `CHUNK` rows go through a program at a time."""
    rows, parts = len(roots), []
    for first in range(0, rows, CHUNK):
        at = jnp.minimum(jnp.arange(first, first + CHUNK), rows - 1)
        some = jax.tree.map(lambda x: x[at], (each, roots, steps, count, stable))  # noqa: B023
        parts.append(_finished(actuator, *some))
    return jax.tree.map(lambda *x: jnp.concatenate(x)[:rows], *parts)


@eqx.filter_jit
def _finished(
    actuator: Actuator, each: tuple, roots: Array, steps: Array, count: Array, stable: Array
) -> Equilibrium:
    """See `finished_rows`."""

    def finish(item: tuple) -> Equilibrium:
        row, root, *more = item
        problem = Problem(actuator, *row)
        return equilibrium_of(problem, attached(problem, root), *more)

    items = (each, roots, steps, count, stable)
    if not actuator.springs:  # `lax.map` cannot cut arrays without entries
        return jax.vmap(finish)(items)
    return jax.lax.map(finish, items, batch_size=min(BLOCK, len(roots)))


def _at_phases(actuator: Actuator, each: tuple, common: tuple) -> Ended:
    """Where Newton's method ends in every row: from the grid, else from rest in steps."""
    size, every, points = len(each[0]), each, None
    if size >= WORTHWHILE and all(isinstance(a, MartensiteFraction | Temperature) for a in each[1]):
        low, high, points = grid_points(each[0], len(actuator.springs))
        every = _after_grid(actuator, each, common, points)
    first = 0 if points is None else len(points)
    total, width = first + size, min(BLOCK, size)
    last_of_grid, last = -(-first // width), -(-first // width) - (-size // width)
    trial = start(actuator)
    possible = jnp.arange(total) >= first
    possible &= jax.vmap(lambda row: all_finite(Problem(actuator, *row)))(every)

    def starts(which: Array, known: Array) -> Array:
        if points is None:
            return jnp.broadcast_to(trial, (width, trial.size))
        springs = len(actuator.springs)
        table = jnp.where(known.good[:first, None], known.unknowns[:first], trial)
        none = jnp.zeros((first, springs))
        grid = as_map(low, high, table, known.good[:first], none, none)
        return grid.at(every[0][which], jnp.stack([a.value[which] for a in every[1]])
                       if springs else jnp.zeros((0, width))).T  # fmt: skip

    def advance(carry: tuple) -> tuple:
        k, stage, known, left = carry
        on_grid, apart = k < last_of_grid, k >= last
        which = jnp.where(on_grid, k * width, first + (k - last_of_grid) * width) + jnp.arange(width)
        which = jnp.minimum(which, jnp.where(on_grid, max(first - 1, 0), total - 1))
        which = jnp.where(apart, jnp.argsort(~left, stable=True)[:width], which)
        begin = jnp.where(on_grid | (apart & (stage == 1)), trial, starts(which, known))
        begin = jnp.where(apart & (stage > 1), known.unknowns[which], begin)
        share = jnp.where(apart, stage / LOAD_STEPS, 1.0)

        def one(row: tuple, begin: Array) -> Ended:
            problem = Problem(actuator, *row)
            return newton(loaded_by(share, at_rest(problem), problem), begin)

        found = jax.vmap(one)(jax.tree.map(lambda x: x[which], every), begin)
        ended = apart & (stage == LOAD_STEPS)
        # brought on in steps, a row goes on from where it last balanced
        kept = jnp.where((apart & ~found.good)[:, None], begin, found.unknowns)
        taken = ~apart | left[which]
        found = Ended(kept, known.steps[which] * apart + found.steps, found.good, found.signs)
        put = lambda whole, part: whole.at[which].set(  # noqa: E731
            jnp.where(taken.reshape(-1, *[1] * (part.ndim - 1)), part, whole[which])
        )
        known = jax.tree.map(put, known, found)
        left = jnp.where(apart, left.at[which].set(left[which] & ~ended), possible & ~known.good)
        return jnp.where(apart, k, k + 1), jnp.where(apart & ~ended, stage + 1, 1), known, left

    none = Ended(
        jnp.broadcast_to(trial, (total, trial.size)), jnp.zeros(total, int), jnp.zeros(total, bool),
        jnp.zeros((total, 2)),
    )  # fmt: skip
    begun = (jnp.asarray(0), jnp.asarray(1), none, jnp.zeros(total, bool))
    known = jax.lax.while_loop(lambda c: (c[0] < last) | jnp.any(c[3]), advance, begun)[2]
    return jax.tree.map(lambda x: x[first:], known)


def _after_grid(actuator: Actuator, each: tuple, common: tuple, points: Array) -> tuple:
    """Rows by given fractions, those of the grid first."""
    pressure, activations, states = each
    phases = []
    for k, (spring, activation) in enumerate(zip(actuator.springs, activations, strict=True)):
        read = lambda a, s=spring: a.read(s.alloy, jnp.zeros(()), s.geometry.wire_length).xi0  # noqa: E731
        at = jax.vmap(read)(activation)
        phases.append(MartensiteFraction(jnp.concatenate([points[:, 1 + k], at])))
    spread = lambda one, own: jnp.concatenate([jnp.broadcast_to(one, (len(points),)), own])  # noqa: E731
    states = jax.tree.map(spread, common, states)
    return jnp.concatenate([points[:, 0], pressure]), tuple(phases), states
