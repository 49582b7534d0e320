"""Rows by resistance inside of a transformation, whose numbers are not known: what `several` does, in one loop.

The loop goes through the grid of equilibria, through all rows from the likeliest cell, through rows that may
have several equilibria from all their cells, and through those that need all starts. Every pass solves one
block, so that Newton's method is compiled once.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..nitinol.spring import MartensiteFraction, Resistance
from . import Actuator
from .balance import Problem, all_finite, configuration, start
from .batches import BLOCK, is_resistance
from .cells import Reading, all_cells, examined
from .phase_map import PhaseMap, as_map, fraction_at, grid_points
from .root_find import (
    FEW_STEPS,
    MOST_ROOTS,
    Ended,
    Roots,
    distinct,
    in_between,
    newton,
    no_roots,
    trial_fractions,
)
from .several import MOST_CELLS


class _Grid(eqx.Module):
    """What was found at the points of the grid so far."""

    unknowns: Array
    good: Array
    ohms: Array
    contrasts: Array


class _Answers(eqx.Module):
    """What was found of the rows so far."""

    unknowns: Array
    steps: Array
    count: Array
    stable: Array


class _Loop(eqx.Module):
    """State of the loop: blocks that were solved, rows that may have several equilibria, rows that need all
    starts; of the one that has them the pass, its starts and what is known."""

    block: Array
    grid: _Grid
    answers: _Answers
    doubtful: Array
    open: Array
    stage: Array
    begin: Array
    known: Roots


def traced_roots(
    actuator: Actuator, each: tuple, common: tuple, shared: bool
) -> tuple[Array, Array, Array, Array]:
    """Joint unknowns of the least heated equilibria of rows, steps, numbers of equilibria, and stability.

    Args:
        actuator, each, common, shared: as of `traced_batch`; without derivatives.
    """
    pressure, activations, states = each
    measured = np.asarray([is_resistance(a) for a in activations])
    fractions = [_fraction(actuator, k, a) for k, a in enumerate(activations)]
    readings = tuple(
        Reading(a.value, True) if own else Reading(x, False)
        for a, own, x in zip(activations, measured, fractions, strict=True)
    )
    low, high, points = grid_points(pressure, len(activations))
    trials = jnp.asarray(trial_fractions(int(measured.sum())))
    rows, width, count = len(pressure), max(BLOCK, len(trials)), actuator.freedoms
    on_grid, last = -(-len(points) // width), -(-len(points) // width) - (-rows // width)
    trial, cells, together = start(actuator), all_cells(len(activations)), width // MOST_CELLS
    spread = lambda z: jnp.concatenate([jnp.broadcast_to(z, (width, count)), padded], axis=1)  # noqa: E731
    padded = trials[np.arange(width) % len(trials)]
    usable = jax.vmap(lambda row: all_finite(Problem(actuator, *row)))(each)

    def problems(at: Array, first: Array, which: Array) -> tuple:
        """Points of the grid, or rows."""
        chosen = lambda a, b: jnp.where(first, a, b)  # noqa: E731
        drive = []
        for k, activation in enumerate(activations):
            if measured[k]:
                noise = chosen(0.0, activation.noise[which])
                drive.append(Resistance(chosen(1.0, activation.value[which]), noise))
            else:
                drive.append(MartensiteFraction(chosen(at[:, 1 + k], fractions[k][which])))
        held = jax.tree.map(lambda one, own: chosen(one, own[which]), common, states)
        return chosen(at[:, 0], pressure[which]), tuple(drive), held

    def on(loop: _Loop) -> _Loop:
        first, hot = loop.block < on_grid, loop.block < last
        several = ~first & ~hot & jnp.any(loop.doubtful)
        every = ~first & ~hot & ~several
        point = jnp.minimum(loop.block * width + jnp.arange(width), len(points) - 1)
        ahead = jnp.clip((loop.block - on_grid) * width + jnp.arange(width), 0, rows - 1)
        some = _first_of(loop.doubtful, together)
        alone_row = jnp.argmax(loop.open)
        seen_rows = jnp.where(hot, ahead, some[np.arange(width) % together])
        table = jnp.where(loop.grid.good[:, None], loop.grid.unknowns[:, :count], trial)
        grid = as_map(low, high, table, loop.grid.good, loop.grid.ohms, loop.grid.contrasts)
        looked = _looked(grid, cells, pressure[seen_rows], [Reading(r.value[seen_rows], r.measured) for r in readings])
        nearest, possible, sure, whole_cells = looked
        starts = jnp.where(hot, nearest[:, :, 0].T, nearest[:, :together].reshape(len(measured), -1, order="C").T)
        which = jnp.where(hot, ahead, jnp.where(several, jnp.repeat(some, MOST_CELLS), alone_row))
        at = points[point]
        begin = jnp.concatenate([grid.at(pressure[which], starts.T).T, starts[:, measured]], axis=1)
        begin = jnp.where(every, loop.begin, begin)
        begin = jnp.where(first, jnp.concatenate([jnp.broadcast_to(trial, (width, count)), at[:, 1:][:, measured]], axis=1), begin)
        fixed = jnp.full(int(measured.sum()), first | (every & (loop.stage == 0)))
        targets = jnp.where(first, at[:, 1:][:, measured], padded)

        def solve(row: tuple, begin: Array, at: Array) -> tuple[Ended, Array, Array]:
            problem = Problem(actuator, *row)
            ended = newton(problem, begin, FEW_STEPS, (fixed, at))
            centre, bend = configuration(actuator, ended.unknowns[:count])
            gamma = [s.shear_strain(x) for s, x in zip(actuator.springs, centre + actuator.spring_places @ bend, strict=True)]
            return ended, jnp.stack(gamma), jnp.stack([s.contrast(g) for s, g in zip(actuator.springs, gamma, strict=True)])

        found, gamma, contrasts = jax.vmap(solve)(problems(at, first, which), begin, targets)
        read = [
            jax.vmap(lambda xi0, g, s=s: s.alloy.resistivity(xi0, g) * s.geometry.wire_length)(at[:, 1 + k], gamma[:, k])
            for k, s in enumerate(actuator.springs)
        ]
        # the grid
        here = _Grid(found.unknowns, found.good, jnp.stack(read, axis=1), contrasts)
        kept = jax.tree.map(lambda whole, part: whole.at[jnp.where(first, point, len(points))].set(part, mode="drop"), loop.grid, here)
        # rows from the likeliest cell, which are certain where no other may hold an equilibrium
        certain = found.good & sure & shared
        own = _Answers(found.unknowns, found.steps, jnp.ones(width, int), found.signs[:, 1] > 0.0)
        answers = _set(loop.answers, jnp.where(hot & ~first, ahead, rows), own)
        doubtful = loop.doubtful.at[jnp.where(hot & ~first, ahead, rows)].set(~certain & usable[ahead], mode="drop")
        # rows from all their cells
        group = lambda x: x[: together * MOST_CELLS].reshape(together, MOST_CELLS, *x.shape[1:])  # noqa: E731
        real = group(found.good & (found.signs[:, 1] != 0.0)) & possible[:together]
        best, real = jax.vmap(lambda f, g: distinct(f, g, count))(group(found.unknowns), real)
        pick = lambda x: jnp.take_along_axis(group(x), best.reshape(*best.shape, *[1] * (x.ndim - 1)), axis=1)  # noqa: E731
        signs = jnp.where(real, pick(found.signs[:, 1]), 0.0)
        number = jnp.sum(real, axis=1)
        good = (jnp.sum(signs, axis=1) == 1.0) & (number < MOST_ROOTS) & whole_cells[:together] & shared
        more = _Answers(pick(found.unknowns)[:, 0], jnp.sum(group(found.steps), axis=1), number, signs[:, 0] > 0.0)
        answers = _set(answers, jnp.where(several & good, some, rows), more)
        there = jnp.where(several & loop.doubtful[some], some, rows)
        open_rows = loop.open.at[there].set(~good, mode="drop")
        doubtful = doubtful.at[there].set(False, mode="drop")
        # one row from all starts
        known = loop.known.joined(found, every & (loop.stage > 0), count)
        between = in_between(known.unknowns, known.real, count)[np.arange(width) % (2 * 12)]
        seen = spread(jnp.where(found.good[:, None], found.unknowns[:, :count], trial))
        ended = every & (loop.stage == 2)
        own = _Answers(known.unknowns[0], known.steps, known.count, known.signs[0] > 0.0)
        answers = _set(answers, jnp.where(ended, alone_row, rows), own)
        open_rows = open_rows.at[jnp.where(ended, alone_row, rows)].set(False, mode="drop")
        fresh = lambda new, old: jnp.where(every & ~ended, new, old)  # noqa: E731
        return _Loop(
            jnp.where(first | hot, loop.block + 1, loop.block), kept, answers, doubtful, open_rows,
            fresh(loop.stage + 1, 0), fresh(jnp.where(loop.stage == 0, seen, between), spread(trial)),
            jax.tree.map(fresh, known, no_roots(count + int(measured.sum()))),
        )  # fmt: skip

    size = count + int(measured.sum())
    blank = lambda n: _Answers(jnp.zeros((n, size)), jnp.zeros(n, int), jnp.ones(n, int), jnp.ones(n, bool))  # noqa: E731
    springs = len(activations)
    begun = _Loop(
        jnp.asarray(0), _Grid(jnp.zeros((len(points), size)), jnp.zeros(len(points), bool),
                              jnp.zeros((len(points), springs)), jnp.ones((len(points), springs))),
        blank(rows), jnp.zeros(rows, bool), jnp.zeros(rows, bool), jnp.asarray(0), spread(trial), no_roots(size),
    )  # fmt: skip
    left = lambda loop: (loop.block < last) | jnp.any(loop.doubtful) | jnp.any(loop.open)  # noqa: E731
    answers = jax.lax.while_loop(left, on, begun).answers
    return answers.unknowns, answers.steps, answers.count, answers.stable


def _fraction(actuator: Actuator, k: int, activation: object) -> Array | None:
    """Fractions of a spring that is not measured."""
    if is_resistance(activation):
        return None
    spring = actuator.springs[k]
    return jax.vmap(lambda a: a.read(spring.alloy, jnp.zeros(()), spring.geometry.wire_length).xi0)(activation)


def _first_of(which: Array, number: int) -> Array:
    """Indices of the first that are true, then others."""
    order = jnp.argsort(~which, stable=True)
    return order[np.minimum(np.arange(number), len(which) - 1)]


def _set(whole: _Answers, at: Array, part: _Answers) -> _Answers:
    """Answers of some rows put in their places; those beyond the end are dropped."""
    return jax.tree.map(lambda x, new: x.at[at].set(new, mode="drop"), whole, part)


def _looked(grid: PhaseMap, cells: np.ndarray, pressure: Array, readings: list[Reading]) -> tuple:
    """The likeliest cells of rows.

    Returns:
        Fractions to start from in the nearest `MOST_CELLS` cells, shape (springs, rows, cells), the likeliest one
        first; which of these cells may hold an equilibrium; whether only the first may; and whether these
        are all, and the grid is sound there.
    """
    rows, every = len(pressure), cells.shape[1]
    many = tuple(Reading(jnp.repeat(r.value, every), r.measured) for r in readings)
    seen = examined(grid, jnp.repeat(pressure, every), many, jnp.asarray(np.tile(cells, rows)))
    shaped = lambda x: x.reshape(*x.shape[:-1], rows, every)  # noqa: E731
    holds, turned, away, step = (shaped(x) for x in seen)
    possible = holds | turned
    order = jnp.argsort(jnp.where(holds, away, jnp.where(possible, 1e6 + away, jnp.inf)), axis=1)[:, :MOST_CELLS]
    taken = lambda x: jnp.take_along_axis(x, order, axis=-1)  # noqa: E731
    place = jnp.stack([jnp.asarray(c)[order] for c in cells]) - 0.5 + jnp.stack([taken(x) for x in step])
    sound = grid.holds(pressure)
    sure = jnp.any(holds, axis=1) & ~jnp.any(turned, axis=1) & sound
    whole = (jnp.sum(possible, axis=1) <= MOST_CELLS) & sound
    return fraction_at(place, grid.size), taken(possible), sure, whole

