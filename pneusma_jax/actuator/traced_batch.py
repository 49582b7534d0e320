"""Rows inside of a transformation, such as `jax.jit`, whose numbers are not known: one program for all.

One loop does all: the grid of equilibria, the rows from their starts in it, and those that fail. So Newton's
method is compiled once. `batches` and `several` do the same where numbers are known.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..nitinol.spring import MartensiteFraction, Temperature
from ..numerics.newton import BoundedNewton
from ..numerics.safe import frozen
from . import Actuator
from .balance import Problem, all_finite, first_trial
from .batches import BLOCK, CHUNK, WORTHWHILE, is_resistance
from .implicit import attached
from .load_steps import LOAD_STEPS, at_rest, loaded_by
from .phase_map import as_map, grid_points
from .result import KEPT, Equilibrium, count_and_stability, equilibrium_of
from .root_find import Ended, newton
from .traced_several import traced_roots


def traced_batch(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> Equilibrium:
    """`solve_batch` of numbers that are not known; see there.

    Args:
        actuator: the same for every row.
        each: pressures, activations and states, arrays of shape (rows,).
        common: memories of the springs on the grid of equilibria.
        shared: true if every row has these memories.
    """
    each = jax.tree.map(jnp.asarray, each)  # a traced number does not index arrays of NumPy
    searched = frozen((actuator, each, common))
    if any(is_resistance(a) for a in each[1]):
        found = traced_roots(*searched, shared)
        roots, steps, count, stable = found.unknowns, found.steps, found.count, found.stable
        slopes = None
    else:
        ended = _at_phases(*searched)
        told = jax.vmap(lambda row, one: count_and_stability(Problem(actuator, *row), one))(each, ended)
        spread = lambda x: jnp.broadcast_to(x, each[0].shape)  # noqa: E731
        roots, steps, count, stable = ended.unknowns, ended.steps, *map(spread, told)
        # a row without equilibrium has no slope; a singular one would make every derivative NaN
        slopes = jnp.where(ended.good[:, None, None], ended.stiffness, jnp.eye(ended.stiffness.shape[-1]))
    return _finished(actuator, each, roots, slopes, steps, count, stable)


def finished_rows(
    actuator: Actuator, each: tuple, roots: Array, steps: Array, count: Array, stable: Array
) -> Equilibrium:
    """Results of rows whose roots are known, with derivatives by all their numbers.

    `CHUNK` rows go through a program at a time."""
    rows, parts = len(roots), []
    for first in range(0, rows, CHUNK):
        at = jnp.minimum(jnp.arange(first, first + CHUNK), rows - 1)
        some = jax.tree.map(lambda x: x[at], (each, roots, None, steps, count, stable))  # noqa: B023
        parts.append(_finished(actuator, *some))
    return jax.tree.map(lambda *x: jnp.concatenate(x)[:rows], *parts)


@eqx.filter_jit
def _finished(
    actuator: Actuator, each: tuple, roots: Array, slopes: Array | None, *more: Array
) -> Equilibrium:
    """See `finished_rows`; a block at a time. `slopes` are those at the roots, see `attached`, if known.

    What reverse derivatives need of a block is computed again when they come to it. Kept for all blocks, it
    took three times as long to write and read: 79 instead of 24 microseconds a row by every number.
    """

    def block(actuator: Actuator, items: tuple) -> Equilibrium:
        def finish(row: tuple, root: Array, slope: Array | None, *more: Array) -> Equilibrium:
            problem = Problem(actuator, *row)
            return equilibrium_of(problem, attached(problem, root, slope), *more)

        return jax.vmap(finish)(*items)

    rows, width = len(roots), min(BLOCK, len(roots))
    blocks = -(-rows // width)
    # the last block is filled up with its last row: one of another size would be a second program
    at = np.minimum(np.arange(blocks * width), rows - 1)
    cut = lambda x: (x if len(at) == rows else x[at]).reshape(blocks, width, *x.shape[1:])  # noqa: E731
    items = jax.tree.map(cut, (each, roots, slopes, *more))
    kept = jax.checkpoint_policies.save_only_these_names(KEPT)
    again = eqx.filter_checkpoint(block, policy=kept, prevent_cse=False)
    found = jax.lax.map(lambda some: again(actuator, some), items)
    return jax.tree.map(lambda x: x.reshape(blocks * width, *x.shape[2:])[:rows], found)


def _at_phases(actuator: Actuator, each: tuple, common: tuple) -> Ended:
    """End of Newton's method in every row: from the grid, else from rest in steps.

    An outer loop chooses rows: the grid, then all, then those that failed at a share of their load. An inner
    one solves them block by block. So Newton's method is compiled once, and rows are put in order only a few
    times.
    """
    size, every, points, ends = len(each[0]), each, None, None
    if size >= WORTHWHILE and all(isinstance(a, MartensiteFraction | Temperature) for a in each[1]):
        low, high, points = grid_points(each[0], len(actuator.springs))
        every, ends = _after_grid(actuator, each, common, points), (low, high)
    first = 0 if points is None else len(points)
    trial, wanted = first_trial(actuator), jnp.arange(first + size) >= first
    possible = jax.vmap(lambda row: all_finite(Problem(actuator, *row)))(every)
    return _Search(actuator, every, first, ends, possible, trial, wanted).ended()


CLOSELY = BoundedNewton(close=1e-10)
"""Root finder of rows whose derivatives take its last slope. With a last step of up to 1e-8, 1 % of the
derivatives by pressure were off by 1e-6 of themselves, and at worst by 6e-5. Now it is 1e-8 and 6e-7."""
_GRID, _ROWS = 0, 1
"""Stages of the outer loop; those after the second are steps of load."""


@dataclass(frozen=True)
class _Search:
    """Rows of one actuator while they are solved inside of a transformation.

    Attributes:
        actuator: the same for all rows.
        every: pressures, activations and states; those of the grid come first.
        first: number of rows of the grid.
        ends: ends of the grid, as `grid_points` gives them; None without a grid.
        possible: true for rows whose numbers are finite.
        trial: the usual start of Newton's method.
        wanted: true for rows that are not of the grid.
    """

    actuator: Actuator
    every: tuple
    first: int
    ends: tuple | None
    possible: Array
    trial: Array
    wanted: Array

    @property
    def total(self) -> int:
        """Number of rows, those of the grid included."""
        return len(self.every[0])

    @property
    def width(self) -> int:
        """Number of rows that are solved side by side."""
        return min(BLOCK, self.total - self.first)

    def ended(self) -> Ended:
        """Ends of all rows that are not of the grid."""
        none = Ended(
            jnp.broadcast_to(self.trial, (self.total, self.trial.size)), jnp.zeros(self.total, int),
            *[jnp.zeros(self.total, bool)] * 2, jnp.zeros((self.total, 2)), jnp.ones(self.total),
            jnp.zeros((self.total, self.trial.size, self.trial.size)),
        )  # fmt: skip
        begun = jnp.asarray(_ROWS if self.ends is None else _GRID), none
        known = jax.lax.while_loop(self._unfinished, self._advance, begun)[1]
        return jax.tree.map(lambda x: x[self.first :], known)

    def _unfinished(self, carry: tuple) -> Array:
        stage, known = carry
        left = jnp.any(self.wanted & self.possible & ~known.good)
        return (stage <= _ROWS) | ((stage <= _ROWS + LOAD_STEPS) & left)

    def _advance(self, carry: tuple) -> tuple:
        """One stage: its rows are put in front and solved block by block."""
        stage, known = carry
        step, row = stage - _ROWS, self.wanted
        chosen = jnp.where(stage == _GRID, ~row, row & self.possible & ((stage == _ROWS) | ~known.good))
        if self.ends is None:
            chosen &= row
        places = -(-self.total // self.width) * self.width
        order = jnp.argsort(~chosen, stable=True)
        order = jnp.concatenate([order, jnp.broadcast_to(order[-1], places - self.total)])
        blank = jax.tree.map(lambda x: jnp.zeros((places, *x.shape[1:]), x.dtype), known)
        block = lambda k, found: self._block(k, found, order, stage, known)  # noqa: E731
        found = jax.lax.fori_loop(0, -(-jnp.sum(chosen) // self.width), block, blank)
        found = jax.tree.map(lambda x: x[jnp.argsort(order[: self.total])], found)
        # a row counts as solved only under all of its load
        found = eqx.tree_at(
            lambda f: (f.steps, f.good), found,
            (known.steps * (step > 0) + found.steps, found.good & ((step <= 0) | (step == LOAD_STEPS))),
        )  # fmt: skip
        taken = lambda new, old: jnp.where(chosen.reshape(-1, *[1] * (old.ndim - 1)), new, old)  # noqa: E731
        return stage + 1, jax.tree.map(taken, found, known)

    def _block(self, k: Array, found: Ended, order: Array, stage: Array, known: Ended) -> Ended:
        """The rows of one block, in their order."""
        step = stage - _ROWS
        which = jax.lax.dynamic_slice_in_dim(order, k * self.width, self.width)
        begin = jnp.where(step > 1, known.unknowns[which], self.trial)
        begin = jnp.where(stage == _ROWS, self._from_grid(which, known), begin)
        share = jnp.where(step > 0, step / LOAD_STEPS, 1.0)

        def one(row: tuple, begin: Array) -> Ended:
            problem = Problem(self.actuator, *row)
            return newton(loaded_by(share, at_rest(problem), problem), begin, method=CLOSELY)

        ended = jax.vmap(one)(jax.tree.map(lambda x: x[which], self.every), begin)
        # brought on in steps, a row goes on from where it last balanced
        kept = jnp.where(((step > 0) & ~ended.good)[:, None], begin, ended.unknowns)
        ended = eqx.tree_at(lambda e: e.unknowns, ended, kept)
        put = lambda all_rows, some: jax.lax.dynamic_update_slice_in_dim(all_rows, some, k * self.width, 0)  # noqa: E731
        return jax.tree.map(put, found, ended)

    def _from_grid(self, which: Array, known: Ended) -> Array:
        """Starts of rows between the equilibria of the grid; the usual ones without a grid."""
        if self.ends is None:
            return jnp.broadcast_to(self.trial, (self.width, self.trial.size))
        springs, first = len(self.actuator.springs), self.first
        table = jnp.where(known.good[:first, None], known.unknowns[:first], self.trial)
        none = jnp.zeros((first, springs))
        grid = as_map(*self.ends, table, known.good[:first], none, none)
        fractions = [a.value[which] for a in self.every[1]]
        at = jnp.stack(fractions) if springs else jnp.zeros((0, self.width))
        return grid.at(self.every[0][which], at).T


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
