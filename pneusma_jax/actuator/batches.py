"""Rows of known numbers, as many as there are: two compiled programs, and NumPy for all that decides.

The programs solve rows from given starts: one where fractions are given, one where resistances are measured.
They take `CHUNK` rows at a time in blocks of `BLOCK`, so that any number of rows runs the same code in
bounded memory. Which starts rows get, and what is tried where one fails, costs little and compiles nothing.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..nitinol.spring import MartensiteFraction, Resistance, Spring, SpringResponse
from ..numerics.rows import filled, first_rows
from ..program_cache import stored_jit
from . import Actuator
from .balance import Problem, first_trial, measured
from .load_steps import LOAD_STEPS
from .phase_map import PhaseMap, as_map, grid_points
from .result import Equilibrium, Validity, count_and_stability, equilibrium_of
from .root_find import MOST_STEPS, Ended, newton_many

BLOCK = 64
"""Number of rows that are computed side by side. Larger blocks leave the processor's cache."""
CHUNK = 1024
"""Maximum of rows of one call of a compiled program; it bounds the memory."""
AT_ONCE = 6
"""Maximum of Newton steps of the first call of a program. Rows that need more go on in a second call, among
themselves: the last few of a chunk would fill a block each time. From the grid, rows of PneuSMA2 take 3.0
steps on average, and 0.3 % take 5 or more."""
WORTHWHILE = 1000
"""Number of rows from which on a grid of starts costs less than the steps that it saves: three a row."""


class Rows(NamedTuple):
    """Rows of one actuator, arrays with a leading axis of rows.

    Attributes:
        actuator: the actuator that all rows share.
        each: pressures [Pa], activations and states.
    """

    actuator: Actuator
    each: tuple

    def __len__(self) -> int:
        return len(self.each[0])

    def taken(self, which: Any) -> "Rows":
        """Some of the rows."""
        return Rows(self.actuator, jax.tree.map(lambda x: x[which], self.each))

    @property
    def usable(self) -> np.ndarray:
        """True if the numbers of a row can be solved at all."""
        good = np.all([np.isfinite(leaf) for leaf in jax.tree.leaves(self.each)], axis=0)
        given = [a.value for a in self.each[1] if isinstance(a, MartensiteFraction)]
        return good & np.all([np.ones(len(self), bool)] + [(x >= 0.0) & (x <= 1.0) for x in given], axis=0)


class Solved(eqx.Module):
    """Rows that were solved from given starts.

    Attributes:
        result: solution of each row, counted as its only equilibrium.
        unknowns: joint unknowns, whether they are a root or not.
        good: true where the unknowns are a root.
        moving: true where more steps may lead to a root.
        sign: sign of the determinant of the stiffness, see `Ended`.
        slope: least slope of resistances over fractions, see `Ended`.
        contrasts: resistance of each spring's martensite, less that of its austenite [ohm], shape (springs,).
    """

    result: Equilibrium
    unknowns: Array
    good: Array
    moving: Array
    sign: Array
    slope: Array
    contrasts: Array


@stored_jit(Solved, Equilibrium, Validity, SpringResponse)
def _chunk(
    actuator: Actuator, each: tuple, guess: Array, before: Array, held: Array, count: Array, most: Array
) -> Solved:
    """The first `count` of `CHUNK` rows, which made `before` steps already, after `most` more; see
    `solved_from`."""
    usual = first_trial(actuator)
    usual = jnp.concatenate([usual, jnp.ones(guess.shape[1] - usual.size)])
    begin = jnp.where(jnp.isnan(guess), usual, guess)
    ended = newton_many(actuator, each, begin, before, held, jnp.arange(CHUNK) >= count, BLOCK, most)

    def finish(row: tuple, before: Array, held: Array, ended: Ended) -> Solved:
        problem = Problem(actuator, *row)
        steps = before + ended.steps
        told = (1, ended.signs[1] > 0.0) if measured(problem) else count_and_stability(problem, ended)
        result = equilibrium_of(problem, ended.unknowns, steps, *told, held)
        pairs = zip(actuator.springs, result.springs, strict=True)
        contrasts = [spring.contrast(response.gamma) for spring, response in pairs]
        contrasts = jnp.stack(contrasts) if contrasts else jnp.zeros(0)
        moving = ~ended.good & jnp.all(jnp.isfinite(ended.unknowns)) & (ended.steps == most)
        return Solved(
            result, ended.unknowns, ended.good, moving, ended.signs[1], ended.slope, contrasts
        )

    def block(k: Array, rows: tuple) -> Solved:
        cut = jax.tree.map(lambda x: jax.lax.dynamic_slice_in_dim(x, k * BLOCK, BLOCK), rows)
        return jax.vmap(finish)(*cut)

    # traced once: for its shapes, and for the loop
    rows = (each, before, held, ended)
    traced = eqx.filter_closure_convert(block, jnp.asarray(0), rows)

    def advance(k: Array, found: Solved) -> Solved:
        put = lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, k * BLOCK, 0)  # noqa: E731
        return jax.tree.map(put, found, traced(k, rows))

    blank = jax.tree.map(lambda x: jnp.zeros((CHUNK, *x.shape[1:]), x.dtype), traced.out_struct)
    return jax.lax.fori_loop(0, -(-count // BLOCK), advance, blank)


def solved_from(
    rows: Rows, guess: np.ndarray, held: np.ndarray | bool = False, patient: bool = True
) -> Solved:
    """Every row from its own start.

    Args:
        rows: the rows, at least one.
        guess: joint unknowns to start from, shape (rows, unknowns); the usual start where NaN.
        held: true for fractions of measured springs that stay as guessed whatever was measured, shape (rows,
            measured) or one for all.
        patient: false to give up after `AT_ONCE` steps.

    Returns:
        What was found, in NumPy arrays.
    """
    held = np.broadcast_to(held, (len(rows), guess.shape[1] - rows.actuator.freedoms))
    found = _in_chunks(rows, guess, np.zeros(len(rows), int), held, AT_ONCE)
    left = np.flatnonzero(found.moving)
    if patient and left.size:
        before = found.unknowns[left], found.result.steps[left], held[left]
        more = _in_chunks(rows.taken(left), *before, MOST_STEPS - AT_ONCE)
        jax.tree.map(lambda all_rows, some: put(all_rows, left, some), found, more)
    return found


def _in_chunks(rows: Rows, guess: np.ndarray, before: np.ndarray, held: np.ndarray, most: int) -> Solved:
    """One call of the program for every chunk of rows."""
    whole = None
    for first in range(0, len(rows), CHUNK):
        size = min(CHUNK, len(rows) - first)
        part = taken((rows.each, guess, before, held), slice(first, first + size))
        found = _chunk(rows.actuator, *filled(part, CHUNK), np.asarray(size), np.asarray(most))
        found = first_rows(found, size)
        if whole is None:
            whole = jax.tree.map(lambda x: np.empty((len(rows), *x.shape[1:]), x.dtype), found)
        jax.tree.map(lambda all_rows, some: put(all_rows, slice(first, first + size), some), whole, found)  # noqa: B023
    return whole


def put(whole: np.ndarray, where: Any, part: np.ndarray) -> None:
    """Set a part of an array."""
    whole[where] = part


def taken(tree: PyTree, which: Any) -> PyTree:
    """Rows of a pytree of arrays."""
    return jax.tree.map(lambda x: x[which], tree)


def map_of(rows: Rows, common: tuple) -> PhaseMap:
    """Grid of equilibria that spans the pressures of rows, see `phase_map`.

    Where resistances are measured, the program that solves them makes the grid, too: it holds the fractions.

    Args:
        rows: rows of one actuator.
        common: memories of the springs on the grid.
    """
    low, high, points = grid_points(rows.each[0], len(rows.actuator.springs))
    phases, held = [], []
    for activation, xi0 in zip(rows.each[1], points[:, 1:].T, strict=True):
        if is_resistance(activation):
            held.append(xi0)
        phases.append(
            jax.tree.map(np.ones_like, Resistance(xi0, xi0)) if is_resistance(activation)
            else jax.tree.map(np.asarray, MartensiteFraction(xi0))
        )  # fmt: skip
    states = jax.tree.map(lambda x: np.broadcast_to(np.asarray(x), (len(points), *np.shape(x))), common)
    grid = Rows(rows.actuator, (points[:, 0], tuple(phases), states))
    usual = np.full((len(points), rows.actuator.freedoms), np.nan)
    found = solved_from(grid, np.column_stack([usual, *held]), held=True)
    springs = found.result.springs
    ohms = np.stack([s.resistance for s in springs], axis=1) if springs else np.zeros((len(points), 0))
    # where there is no equilibrium, neighbours are interpolated with what is nearest
    unknowns = np.where(found.good[:, None], found.unknowns, 0.0)[:, : rows.actuator.freedoms]
    return as_map(low, high, unknowns, found.good, np.nan_to_num(ohms), np.nan_to_num(found.contrasts))


def starts_at(grid: PhaseMap, pressure: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Scaled unknowns that the grid promises at fractions, shape (rows, freedoms), in bounded memory."""
    parts = [
        grid.at(pressure[first : first + CHUNK], fractions[:, first : first + CHUNK]).T
        for first in range(0, len(pressure), CHUNK)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, len(grid.unknowns)))


@eqx.filter_jit
def _fractions(actuator: Actuator, activations: tuple) -> Array:
    """Fractions of springs whose phase does not depend on strain, shape (springs, rows)."""
    pairs = zip(actuator.springs, activations, strict=True)
    rows = lambda spring, a: jax.vmap(  # noqa: E731
        lambda one: one.read(spring.alloy, jnp.zeros(()), spring.geometry.wire_length).xi0
    )(a)
    return jnp.stack([rows(spring, a) for spring, a in pairs])


def fractions_of(rows: Rows) -> np.ndarray:
    """Fractions of all springs of rows without measured resistances, shape (springs, rows)."""
    activations = rows.each[1]
    if all(isinstance(a, MartensiteFraction) for a in activations):
        given = [a.value for a in activations]
        return np.stack(given) if given else np.zeros((0, len(rows)))
    return np.asarray(_fractions(rows.actuator, activations))


@stored_jit()
def _contrasts_at_rest(springs: tuple[Spring, ...]) -> Array:
    """`Spring.contrast_at_rest` of springs, in one program; its operations would be a program each."""
    return jnp.stack([spring.contrast_at_rest for spring in springs])


def contrasts_at_rest(actuator: Actuator) -> np.ndarray:
    """Size of each spring's contrast between the phases at zero strain [ohm], shape (springs,)."""
    return np.asarray(_contrasts_at_rest(actuator.springs))


def solved_at_phases(rows: Rows, common: tuple, guess: np.ndarray | None = None) -> Solved:
    """Rows without measured resistances: from a guess or the grid, else from rest in steps.

    Args:
        rows: the rows, at least one.
        common: memories of the springs in the grid.
        guess: scaled unknowns to start from, shape (rows, freedoms).
    """
    if guess is None:
        guess = np.full((len(rows), rows.actuator.freedoms), np.nan)
        if len(rows) >= WORTHWHILE:
            guess = starts_at(map_of(rows, common), rows.each[0], fractions_of(rows))
    found = solved_from(rows, guess)
    left = np.flatnonzero(~found.good & rows.usable)
    if left.size:
        again = _from_rest(rows.taken(left))
        jax.tree.map(lambda all_rows, some: put(all_rows, left, some), found, again)
    return found


def _from_rest(rows: Rows) -> Solved:
    """Rows whose pressure, heat and loads are brought on in `LOAD_STEPS` steps from rest."""
    pressure, activations, states = rows.each
    begin, steps = np.full((len(rows), rows.actuator.freedoms), np.nan), 0
    for stage in range(1, LOAD_STEPS + 1):
        share = stage / LOAD_STEPS
        loads = jax.tree.map(lambda x: np.asarray(x) * share, rows.actuator.loads)  # noqa: B023
        part = tuple(
            eqx.tree_at(lambda a: a.value, a, 1.0 + share * (a.value - 1.0))
            if isinstance(a, MartensiteFraction) else a
            for a in activations
        )  # fmt: skip
        # the last stage is the row itself, to the last bit
        part = activations if stage == LOAD_STEPS else part
        actuator = rows.actuator if stage == LOAD_STEPS else rows.actuator.with_loads(*loads)
        found = solved_from(Rows(actuator, (pressure * share, part, states)), begin)
        begin = np.where(found.good[:, None], found.unknowns, begin)
        steps = steps + found.result.steps
    return eqx.tree_at(lambda s: s.result.steps, found, steps)


def is_resistance(activation: Any) -> bool:
    """True if a spring's phase follows from its measured resistance."""
    return isinstance(activation, Resistance)
