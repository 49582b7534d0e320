"""Rows by resistance inside of a transformation: what `several` does where numbers are known, in one loop.

The loop first goes through the grid of equilibria, then through all rows from the likeliest cell. Next come
rows that may have several equilibria, from all their cells, and those that need all starts. Every pass solves
one block, so that Newton's method is compiled once.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..nitinol.spring import MartensiteFraction, Resistance
from . import Actuator
from .balance import END_DEVIATIONS, END_TOLERANCE, Problem, all_finite, at_phases, configuration, first_trial
from .batches import BLOCK, is_resistance
from .cells import Reading, all_cells, examined
from .further_roots import FLAT
from .likely_cells import MOST_CELLS
from .phase_map import PhaseMap, as_map, fraction_at, grid_points
from .root_find import FEW_STEPS, Ended, newton
from .root_search import MOST_ROOTS, STAGES, Roots, distinct, holds_fractions, next_starts, no_roots
from .starts import trial_fractions


class Answers(eqx.Module):
    """Solutions of rows, arrays with a leading axis of rows.

    Attributes:
        unknowns: joint unknowns of the least heated equilibrium.
        steps: number of Newton steps.
        count: number of equilibria.
        stable: true if that equilibrium is stable.
    """

    unknowns: Array
    steps: Array
    count: Array
    stable: Array


class _Grid(eqx.Module):
    """Solutions at the points of the grid so far, see `phase_map.as_map`."""

    unknowns: Array
    good: Array
    ohms: Array
    contrasts: Array


class _Loop(eqx.Module):
    """State of the loop.

    Attributes:
        block: number of blocks of the grid and of rows that were solved.
        grid, answers: results so far.
        doubtful: rows that may have several equilibria.
        open: rows that need all starts.
        stage, begin, held, known: the pass of the row that has them now, its starts, which of their fractions
            are held, and its equilibria.
    """

    block: Array
    grid: _Grid
    answers: Answers
    doubtful: Array
    open: Array
    stage: Array
    begin: Array
    held: Array
    known: Roots


class _Pass(eqx.Module):
    """Kind of a pass (one of the first four is true), and the row of each attempt.

    Attributes:
        grid: points of the grid.
        ahead: rows, each from its likeliest cell.
        several: a few rows, from all their cells.
        every: one row, from all starts.
        point: points of the grid, shape (width,).
        some: the few rows.
        row: row of each attempt, shape (width,).
    """

    grid: Array
    ahead: Array
    several: Array
    every: Array
    point: Array
    some: Array
    row: Array


def traced_roots(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> Answers:
    """The least heated equilibria of rows.

    Args:
        actuator, each, common, shared: the same as those of `traced_batch`; without derivatives.
    """
    search = _Search(actuator, each, common, shared)
    return jax.lax.while_loop(search.unfinished, search.advance, search.begun()).answers


class _Search:
    """All that stays the same in the loop."""

    def __init__(self, actuator: Actuator, each: tuple, common: tuple, shared: bool) -> None:
        self.actuator, self.each, self.common, self.shared = actuator, each, common, shared
        pressure, activations, _ = each
        self.measured = np.asarray([is_resistance(a) for a in activations])
        self.readings = tuple(_reading(actuator, k, a) for k, a in enumerate(activations))
        self.low, self.high, self.points = grid_points(pressure, len(activations))
        trials = trial_fractions(int(self.measured.sum()))
        self.rows, self.width, self.count = len(pressure), max(BLOCK, len(trials)), actuator.freedoms
        self.size = self.count + trials.shape[1]
        self.trials = jnp.asarray(trials[np.arange(self.width) % len(trials)])
        self.together = self.width // MOST_CELLS
        self.grid_blocks = -(-len(self.points) // self.width)
        self.blocks = self.grid_blocks - (-self.rows // self.width)
        self.first, self.cells = first_trial(actuator), all_cells(len(activations))
        self.usable = jax.vmap(lambda row: all_finite(Problem(actuator, *row)))(each)

    def begun(self) -> _Loop:
        """Before the first pass."""
        points, springs, rows = len(self.points), len(self.measured), self.rows
        grid = _Grid(
            jnp.zeros((points, self.count)), jnp.zeros(points, bool), jnp.zeros((points, springs)),
            jnp.ones((points, springs)),
        )  # fmt: skip
        answers = Answers(
            jnp.zeros((rows, self.size)), jnp.zeros(rows, int), jnp.ones(rows, int), jnp.ones(rows, bool)
        )
        none = jnp.zeros(rows, bool)
        zero = jnp.asarray(0)
        return _Loop(zero, grid, answers, none, none, zero, *self.all_held(), no_roots(self.size))

    def unfinished(self, loop: _Loop) -> Array:
        """True if there is more to do."""
        return (loop.block < self.blocks) | jnp.any(loop.doubtful) | jnp.any(loop.open)

    def advance(self, loop: _Loop) -> _Loop:
        """One pass."""
        now = self.now(loop)
        table = jnp.where(loop.grid.good[:, None], loop.grid.unknowns, self.first)
        grid = as_map(self.low, self.high, table, loop.grid.good, loop.grid.ohms, loop.grid.contrasts)
        looked = jnp.where(now.ahead, now.row, now.some[np.arange(self.width) % self.together])
        fractions, possible, sure, whole = self.looked(grid, looked)
        begin = self.starts(now, loop, grid, fractions)
        ended, lonely, solved = self.solved(now, loop, begin)
        loop = eqx.tree_at(lambda x: x.grid, loop, _set(loop.grid, now.grid, now.point, solved))
        loop = self.after_ahead(now, loop, ended, lonely, sure)
        possible, whole = possible[: self.together], whole[: self.together]
        loop = self.after_several(now, loop, ended, lonely, possible, whole)
        loop = self.after_every(now, loop, ended, begin)
        more = (now.grid | now.ahead).astype(int)
        return eqx.tree_at(lambda x: x.block, loop, loop.block + more)

    def now(self, loop: _Loop) -> _Pass:
        """The next pass."""
        grid = loop.block < self.grid_blocks
        ahead = ~grid & (loop.block < self.blocks)
        several = ~grid & ~ahead & jnp.any(loop.doubtful)
        every = ~grid & ~ahead & ~several
        steps = jnp.arange(self.width)
        point = jnp.minimum(loop.block * self.width + steps, len(self.points) - 1)
        block = jnp.clip((loop.block - self.grid_blocks) * self.width + steps, 0, self.rows - 1)
        # all rows are put in order only where the pass asks for it
        first = lambda doubtful: jnp.argsort(~doubtful, stable=True)  # noqa: E731
        order = jax.lax.cond(several, first, lambda _: jnp.arange(self.rows), loop.doubtful)
        some = order[np.minimum(np.arange(self.together), self.rows - 1)]
        attempts = some[np.minimum(np.arange(self.width) // MOST_CELLS, self.together - 1)]
        row = jnp.where(ahead, block, jnp.where(several, attempts, jnp.argmax(loop.open)))
        return _Pass(grid, ahead, several, every, point, some, row)

    def looked(self, grid: PhaseMap, rows: Array) -> tuple[Array, Array, Array, Array]:
        """The likeliest cells of rows.

        Returns:
            Fractions to start from in `MOST_CELLS` cells, shape (springs, rows, cells), the likeliest first.
            Then three flags: which cells may hold an equilibrium, whether only the first may, and whether
            these are all. For the last two the grid must be sound there.
        """
        every = self.cells.shape[1]
        readings = tuple(Reading(jnp.repeat(r.value[rows], every), r.measured) for r in self.readings)
        pressure = self.each[0][rows]
        cells = jnp.asarray(np.tile(self.cells, len(rows)))
        seen = examined(grid, jnp.repeat(pressure, every), readings, cells)
        holds, may_fold, away, step = (x.reshape(*x.shape[:-1], len(rows), every) for x in seen)
        possible = holds | may_fold
        likely = jnp.where(holds, away, jnp.where(possible, 1e6 + away, jnp.inf))
        order = jnp.argsort(likely, axis=1)[:, :MOST_CELLS]
        nearest = lambda x: jnp.take_along_axis(x, order, axis=-1)  # noqa: E731
        place = jnp.stack([jnp.asarray(own)[order] for own in self.cells])
        place = place - 0.5 + jnp.stack([nearest(own) for own in step])
        sound = grid.holds(pressure)
        sure = jnp.any(holds, axis=1) & ~jnp.any(may_fold, axis=1) & sound
        whole = (jnp.sum(possible, axis=1) <= MOST_CELLS) & sound
        return fraction_at(place, grid.size), nearest(possible), sure, whole

    def starts(self, now: _Pass, loop: _Loop, grid: PhaseMap, fractions: Array) -> Array:
        """Joint unknowns from which a pass starts, shape (width, unknowns)."""
        places = np.arange(self.width) % (self.together * MOST_CELLS)
        several = fractions[:, places // MOST_CELLS, places % MOST_CELLS]
        begin = jnp.where(now.ahead, fractions[:, :, 0], several)
        from_grid = jnp.concatenate([grid.at(self.each[0][now.row], begin), begin[self.measured]]).T
        on_grid = jnp.concatenate([self.spread(self.first), self.held_at(now)], axis=1)
        return jnp.where(now.every, loop.begin, jnp.where(now.grid, on_grid, from_grid))

    def held_at(self, now: _Pass) -> Array:
        """Fractions of the measured springs at points of the grid, shape (width, measured)."""
        return self.points[now.point][:, 1:][:, self.measured]

    def spread(self, configuration: Array) -> Array:
        return jnp.broadcast_to(configuration, (self.width, self.count))

    def all_held(self) -> tuple[Array, Array]:
        """Starts with all trial fractions, which are held."""
        starts = jnp.concatenate([self.spread(self.first), self.trials], axis=1)
        return starts, jnp.ones(self.trials.shape, bool)

    def solved(self, now: _Pass, loop: _Loop, begin: Array) -> tuple[Ended, Array, _Grid]:
        """Ends of a pass, whether no other equilibrium can be close by, and their part of the grid."""
        fixed, springs = now.grid | (now.every & loop.held), self.actuator.springs

        def one(row: tuple, begin: Array, fixed: Array) -> tuple[Ended, Array, _Grid]:
            problem = Problem(self.actuator, *row)
            ended = newton(problem, begin, held=(fixed, begin[self.count :]), few=FEW_STEPS)
            here, phases = ended.unknowns[: self.count], ended.unknowns[self.count :]
            fractions = [a.value for a in at_phases(problem, phases, MartensiteFraction).activations]
            centre, bend = configuration(self.actuator, here)
            elongations = centre + self.actuator.spring_places @ bend
            gamma = [s.shear_strain(x) for s, x in zip(springs, elongations, strict=True)]
            read = [
                s.alloy.resistivity(xi0, g) * s.geometry.wire_length
                for s, xi0, g in zip(springs, fractions, gamma, strict=True)
            ]
            contrasts = [s.contrast(g) for s, g in zip(springs, gamma, strict=True)]
            lonely = ended.slope >= FLAT
            for k, activation in enumerate(problem.activations):
                if isinstance(activation, Resistance):
                    least = END_TOLERANCE * springs[k].contrast_at_rest + END_DEVIATIONS * activation.noise
                    lonely &= (fractions[k] < 1.0) | (jnp.abs(read[k] - activation.value) <= least)
            return ended, lonely, _Grid(here, ended.good, jnp.stack(read), jnp.stack(contrasts))

        return jax.vmap(one)(self.problems(now), begin, fixed)

    def problems(self, now: _Pass) -> tuple:
        """Points of the grid, or rows; the resistances of the former are not looked at."""
        pressure, activations, states = self.each
        at, chosen = self.points[now.point], lambda a, b: jnp.where(now.grid, a, b)
        drive = []
        for k, (activation, reading) in enumerate(zip(activations, self.readings, strict=True)):
            if reading.measured:
                value, noise = activation.value[now.row], activation.noise[now.row]
                drive.append(Resistance(chosen(1.0, value), chosen(0.0, noise)))
            else:
                drive.append(MartensiteFraction(chosen(at[:, 1 + k], reading.value[now.row])))
        remembered = jax.tree.map(lambda one, own: chosen(one, own[now.row]), self.common, states)
        return chosen(at[:, 0], pressure[now.row]), tuple(drive), remembered

    def after_ahead(
        self, now: _Pass, loop: _Loop, ended: Ended, lonely: Array, sure: Array
    ) -> _Loop:
        """Rows are certain where no other cell may hold an equilibrium, nor their own another one."""
        found = Answers(
            ended.unknowns, ended.steps, jnp.ones(self.width, int), ended.signs[:, 1] > 0.0
        )
        sure &= ended.good & self.shared
        doubt, left = ~sure & self.usable[now.row], sure & ~lonely
        return eqx.tree_at(
            lambda x: (x.answers, x.doubtful, x.open), loop,
            _set((loop.answers, loop.doubtful, loop.open), now.ahead, now.row, (found, doubt, left)),
        )  # fmt: skip

    def after_several(
        self, now: _Pass, loop: _Loop, ended: Ended, lonely: Array, possible: Array, whole: Array
    ) -> _Loop:
        """A few rows are certain where the signs of all their equilibria add up to one.

        A single one must also be lonely.
        """
        shape = (self.together, MOST_CELLS)
        apart = lambda x: x[: shape[0] * shape[1]].reshape(*shape, *x.shape[1:])  # noqa: E731
        unknowns, signs = apart(ended.unknowns), apart(ended.signs[:, 1])
        good = apart(ended.good) & (signs != 0.0) & possible
        best, real = distinct(unknowns, good, self.count)
        unknowns = jnp.take_along_axis(unknowns, best[..., None], axis=1)
        signs = jnp.where(real, jnp.take_along_axis(signs, best, axis=1), 0.0)
        number = jnp.sum(real, axis=1)
        sure = (jnp.sum(signs, axis=1) == 1.0) & (number < MOST_ROOTS) & whole & self.shared
        sure &= (number > 1) | jnp.take_along_axis(apart(lonely), best[:, :1], axis=1)[:, 0]
        steps = jnp.sum(apart(ended.steps), axis=1)
        found = Answers(unknowns[:, 0], steps, number, signs[:, 0] > 0.0)
        there = now.several & loop.doubtful[now.some]
        answers = _set(loop.answers, there & sure, now.some, found)
        over = (jnp.zeros_like(sure), ~sure)
        doubtful, left = _set((loop.doubtful, loop.open), there, now.some, over)
        return eqx.tree_at(lambda x: (x.answers, x.doubtful, x.open), loop, (answers, doubtful, left))

    def after_every(self, now: _Pass, loop: _Loop, ended: Ended, begin: Array) -> _Loop:
        """The passes of `root_search.all_roots` for one row."""
        known = loop.known.joined(ended, ~holds_fractions(loop.stage), self.count)
        later = next_starts(loop.stage, begin, ended, known, self.count)
        done = now.every & (loop.stage == STAGES - 1)
        found = Answers(known.unknowns[0], known.steps, known.count, known.signs[0] > 0.0)
        row = now.row[0]
        answers, left = _set((loop.answers, loop.open), done, row, (found, jnp.asarray(False)))
        goes_on = lambda new, old: jnp.where(now.every & ~done, new, old)  # noqa: E731
        return _Loop(
            loop.block, loop.grid, answers, loop.doubtful, left, goes_on(loop.stage + 1, 0),
            *jax.tree.map(goes_on, (*later, known), (*self.all_held(), no_roots(self.size))),
        )  # fmt: skip


def _reading(actuator: Actuator, k: int, activation: object) -> Reading:
    """Reading of one spring in all rows."""
    if is_resistance(activation):
        return Reading(activation.value, True)
    spring = actuator.springs[k]
    read = lambda a: a.read(spring.alloy, jnp.zeros(()), spring.geometry.wire_length).xi0  # noqa: E731
    return Reading(jax.vmap(read)(activation), False)


def _set(whole: object, there: Array, at: Array, part: object) -> object:
    """Entries put in their places, as far as they are there."""
    size = len(jax.tree.leaves(whole)[0])
    at = jnp.where(there, at, size)
    return jax.tree.map(lambda x, new: x.at[at].set(new, mode="drop"), whole, part)
