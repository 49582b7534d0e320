"""Configurations in which force and moment balance, one row or many: Section 3.5.

The balance is in `balance`, the root-finds in `root_find`, what a solved row is in `result`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..nitinol import SpringState
from ..nitinol.spring import Activation, MartensiteFraction, Resistance, check_fractions
from ..numerics.safe import frozen, is_concrete
from ..precision import require_doubles, require_float64
from . import Actuator
from .balance import (
    Problem,
    all_finite,
    configuration,
    freedoms,
    imbalance,
    measured,
    residual,
    spring_responses,
    start,
)
from .phase_map import PhaseMap, phase_map, start_of
from .result import Equilibrium, Status, Validity, equilibrium_of, raise_unless_converged
from .root_find import BALANCED, MOST_ROOTS, all_roots, at_given_phases, attached, newton, stiffness_signs
from .several import least_heated

__all__ = [
    "BALANCED", "Equilibrium", "Problem", "Status", "Validity", "configuration", "imbalance", "residual",
    "solve", "solve_all", "solve_batch", "spring_responses", "start",
]  # fmt: skip

BLOCK = 64
"""Number of rows that are solved side by side. Larger blocks leave the processor's cache, and their rows wait
for the slowest."""
CHUNK = 4096
"""Maximum of rows of one call of the compiled program; it bounds the memory."""


def solve(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
    *,
    guess: Array | None = None,
    throw: bool = True,
) -> Equilibrium:
    """Configuration in which force and moment balance.

    Without loads, given phases have one equilibrium: Newton's method finds it from the start, or from rest
    with pressure, heat and loads brought on in steps. Under loads an unstable one has the status
    `several_equilibria`, too; `guess` leads to the others.

    Measured resistances may have several. Then all are looked for, and the one whose hottest spring is the
    least heated is returned, with the status `several_equilibria`. With one measured spring, that is the
    first which a heating from rest meets.

    Derivatives come from the implicit function theorem: of any order for bending in a plane, to the third
    otherwise.

    Args:
        actuator: what is loaded.
        pressure: gauge [Pa], scalar (use `jax.vmap` or `solve_batch` for many).
        activations: one per spring, in the order of `actuator.spring_numbers`; cold where empty.
        states: what each spring remembers; fresh with the actuator's own pre-strain where None.
        guess: scaled unknowns of a neighbouring solution, to start from. Of several equilibria the nearest
            to it is returned.
        throw: raise where there is no solution; otherwise return NaN with a `status`.

    Raises:
        RuntimeError: if float64 is off, or, with `throw`, the sentence of the status.
        ValueError: if the number of activations or states is not the number of springs, or a fraction is not
            between 0 and 1.
    """
    problem = _problem(actuator, pressure, activations, states)
    result = _solve(problem, guess)
    return raise_unless_converged(result) if throw else result


def solve_all(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
) -> Equilibrium:
    """Every configuration in which force and moment balance, the least heated first.

    Args:
        actuator, pressure, activations, states: as for `solve`.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of `MOST_ROOTS`. Its first `equilibria[0]` entries
        are the configurations; the rest have the status `no_equilibrium` and are NaN.
    """
    return _solve_all(_problem(actuator, pressure, activations, states))


def solve_batch(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
) -> Equilibrium:
    """`solve` for many rows at once; a row without solution reports its `status` and stops no other.

    Outside of `jax.jit` the rows go through one compiled program, whatever their number, and memory beyond
    that of the result does not grow with it. Rows that are hard are solved afterwards, by another program.

    Args:
        actuator: the same for every row.
        pressure: gauge [Pa], shape (rows,).
        activations: one per spring, their arrays of shape (rows,).
        states: one per spring, their arrays of shape (rows,) or (); fresh where None.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of rows.
    """
    require_float64()
    pressure = jnp.asarray(pressure, dtype=float)
    rows = pressure.shape[0]
    activations, states = _filled(actuator, activations, states)
    spread = lambda tree: jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *jnp.shape(x)[1:])), tree)  # noqa: E731
    shared = all(jnp.ndim(leaf) == 0 for leaf in jax.tree.leaves(states))
    common = states if shared or rows == 0 else jax.tree.map(lambda x: jnp.ravel(x)[0], states)
    each = (pressure, spread(activations), spread(states))
    if rows == 0:
        return _none(actuator, each)
    if not is_concrete(actuator, each):
        return _traced(actuator, each, common, shared)
    with jax.ensure_compile_time_eval():  # numbers are known, though the call may stand in a traced function
        return _in_chunks(actuator, each, common, shared)


def _filled(
    actuator: Actuator, activations: tuple[Activation, ...], states: tuple[SpringState, ...] | None
) -> tuple[tuple[Activation, ...], tuple[SpringState, ...]]:
    """Activations and states, with what stands for none; checked where their numbers are known."""
    count = len(actuator.springs)
    activations = tuple(activations) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = tuple(states) if states is not None else actuator.fresh_states()
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
    check_fractions(actuator.spring_numbers, activations)
    activations = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), activations)
    return activations, jax.tree.map(lambda x: jnp.asarray(x, dtype=float), states)


def _problem(
    actuator: Actuator, pressure: Array, activations: tuple, states: tuple | None
) -> Problem:
    """One row, checked."""
    require_float64()
    require_doubles(actuator)
    activations, states = _filled(actuator, activations, states)
    return Problem(actuator, jnp.asarray(pressure, dtype=float), activations, states)


@eqx.filter_jit
def _solve(problem: Problem, guess: Array | None) -> Equilibrium:
    """`solve` after its arguments are checked: one compiled program per design."""
    return _solved(problem, guess)


def _solved(problem: Problem, guess: Array | None) -> Equilibrium:
    """A row, whatever drives it."""
    if not measured(problem):
        root, steps, _ = at_given_phases(problem, start(problem.actuator) if guess is None else guess)
        return _at_phases(problem, root, steps)
    roots = all_roots(problem)
    which = jnp.asarray(0)
    if guess is not None:
        count = freedoms(problem)
        away = jnp.max(jnp.abs(roots.unknowns[:, :count] - guess[:count]), axis=1)
        which = jnp.argmin(jnp.where(roots.real, away, jnp.inf))
    root = roots.unknowns[which]
    stable = stiffness_signs(problem, root)[1] > 0.0
    return equilibrium_of(problem, attached(problem, root), roots.steps, roots.count, stable)


def _at_phases(problem: Problem, root: Array, steps: Array) -> Equilibrium:
    """Result of a root at given phases; under loads it may be one of several, as of a buckled column."""
    if not problem.actuator.loads:
        return equilibrium_of(problem, attached(problem, root), steps)
    stable = stiffness_signs(problem, root)[0] > 0.0
    return equilibrium_of(problem, attached(problem, root), steps, jnp.where(stable, 1, 3), stable)


@eqx.filter_jit
def _solve_all(problem: Problem) -> Equilibrium:
    """`solve_all` after its arguments are checked."""
    if not measured(problem):
        root, steps, good = at_given_phases(problem, start(problem.actuator))
        real = jnp.arange(MOST_ROOTS) == 0
        found, count = jnp.broadcast_to(root, (MOST_ROOTS, root.size)), good.astype(int)
    else:
        roots = all_roots(problem)
        found, real, steps, count = roots.unknowns, roots.real, roots.steps, roots.count

    def one(root: Array, real: Array) -> Equilibrium:
        stable = stiffness_signs(problem, root)[1] > 0.0
        root = jnp.where(real, attached(problem, root), jnp.nan)
        return equilibrium_of(problem, root, steps, count, stable)

    return jax.vmap(one)(found, real)


def _none(actuator: Actuator, each: tuple) -> Equilibrium:
    """The result of no rows."""
    one = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], x.dtype), each)

    def found(row: tuple) -> Equilibrium:
        root = jnp.zeros(_unknowns(actuator, row))
        return equilibrium_of(_row_problem(actuator, row), root, jnp.asarray(0))

    shapes = eqx.filter_eval_shape(found, one)
    return jax.tree.map(lambda x: jnp.zeros((0, *x.shape), x.dtype), shapes)


def _unknowns(actuator: Actuator, row: tuple) -> int:
    return actuator.basis.shape[1] + sum(isinstance(a, Resistance) for a in row[1])


def _hot(problem: Problem, grid: PhaseMap) -> tuple[Array, Array, Array]:
    """Joint unknowns of a row from the grid, steps, and whether they are certainly its only equilibrium."""
    guess, alone = start_of(problem, grid)
    root, steps, good = newton(problem, guess)
    return root, steps, good & alone


def _row_problem(actuator: Actuator, row: tuple) -> Problem:
    pressure, activations, states = row
    return Problem(actuator, pressure, activations, states)


@eqx.filter_jit
def _chunk(actuator: Actuator, each: tuple, grid: PhaseMap, blocks: Array) -> tuple[Equilibrium, Array]:
    """The first `blocks` blocks of a chunk of `CHUNK` rows, and which of their rows are done."""

    def rows_of(k: Array) -> tuple:
        return jax.tree.map(lambda x: jax.lax.dynamic_slice_in_dim(x, k * BLOCK, BLOCK), each)

    def one(row: tuple) -> tuple[Equilibrium, Array]:
        problem = _row_problem(actuator, row)
        root, steps, done = _hot(problem, grid)
        return equilibrium_of(problem, root, steps), done

    def advance(k: Array, found: tuple) -> tuple:
        block = jax.vmap(one)(rows_of(k))
        put = lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, k * BLOCK, 0)  # noqa: E731
        return jax.tree.map(put, found, block)

    shapes = eqx.filter_eval_shape(lambda: jax.vmap(one)(rows_of(0)))
    blank = jax.tree.map(lambda x: jnp.zeros((CHUNK, *x.shape[1:]), x.dtype), shapes)
    return jax.lax.fori_loop(0, blocks, advance, blank)


@eqx.filter_jit
def _grid(actuator: Actuator, states: tuple, pressure: Array) -> PhaseMap:
    return phase_map(actuator, states, pressure)


@eqx.filter_jit
def _hard(actuator: Actuator, row: tuple) -> Equilibrium:
    """One row that the hot program left over."""
    return _solved(_row_problem(actuator, row), None)


def _in_chunks(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> Equilibrium:
    """Rows of concrete numbers, a chunk at a time; those left over in groups, the last of them one by one."""
    require_doubles(actuator)
    each = jax.tree.map(np.asarray, each)
    pressure = each[0]
    finite = pressure[np.isfinite(pressure)]
    ends = np.array([finite.min(), np.median(finite), finite.max()]) if finite.size else np.zeros(3)
    grid = _grid(actuator, common, ends)
    counting = any(isinstance(a, Resistance) for a in each[1])
    whole = None
    for first in range(0, len(pressure), CHUNK):
        part = jax.tree.map(lambda x: x[first : first + CHUNK], each)  # noqa: B023
        size = len(part[0])
        padded = jax.tree.map(lambda x: np.concatenate([x, np.repeat(x[-1:], CHUNK - size, axis=0)]), part)  # noqa: B023
        found, done = _chunk(actuator, padded, grid, jnp.asarray(-(-size // BLOCK)))
        found, done = jax.tree.map(lambda x: np.asarray(x)[:size].copy(), (found, done))  # noqa: B023
        left = ~done
        if counting and not shared:  # the grid is that of other memories, and counts nothing
            left[:] = True
        left &= found.status != int(Status.fraction_out_of_range)
        left &= np.all([np.isfinite(leaf) for leaf in jax.tree.leaves(part)], axis=0)
        again = np.flatnonzero(left)
        if counting and shared and again.size:
            several, sure = least_heated(actuator, jax.tree.map(lambda x: x[again], part), grid)  # noqa: B023
            jax.tree.map(lambda all_rows, some: all_rows.__setitem__(again, some), found, several)  # noqa: B023
            again = again[~sure]
        for k in again:
            row = jax.tree.map(lambda x: x[k], part)  # noqa: B023
            one = jax.tree.map(np.asarray, _hard(actuator, row))
            jax.tree.map(lambda all_rows, one: all_rows.__setitem__(k, one), found, one)  # noqa: B023
        if whole is None:
            whole = jax.tree.map(lambda x: np.empty((len(pressure), *x.shape[1:]), x.dtype), found)
        jax.tree.map(lambda x, some: x.__setitem__(slice(first, first + size), some), whole, found)  # noqa: B023
    return jax.tree.map(jnp.asarray, whole)


@eqx.filter_jit
def _traced(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> Equilibrium:
    """Rows inside of a transformation: the same, with the hard rows in a loop of their own."""
    rows = each[0].shape[0]
    block = min(BLOCK, max(rows, 1))
    searched = frozen((actuator, each, common))
    grid = phase_map(searched[0], searched[2], searched[1][0])
    counting = any(isinstance(a, Resistance) for a in each[1])

    def hot(row: tuple) -> tuple:
        return _hot(_row_problem(searched[0], row), grid)

    roots, steps, done = jax.lax.map(hot, searched[1], batch_size=block)
    possible = jax.vmap(lambda row: all_finite(_row_problem(searched[0], row)))(searched[1])
    left = possible & (~done if shared or not counting else jnp.ones_like(done))
    count, stable = jnp.ones(rows, int), jnp.ones(rows, bool)

    def again(carry: tuple) -> tuple:
        left, roots, steps, count, stable = carry
        k = jnp.argmax(left)
        problem = _row_problem(searched[0], jax.tree.map(lambda x: x[k], searched[1]))
        if counting:
            found = all_roots(problem)
            root, more, several = found.unknowns[0], found.steps, found.count
            firm = stiffness_signs(problem, root)[1] > 0.0
        else:
            root, more, _ = at_given_phases(problem, start(problem.actuator))
            several, firm = 1, True
        return (
            left.at[k].set(False), roots.at[k].set(root), steps.at[k].add(more), count.at[k].set(several),
            stable.at[k].set(firm),
        )  # fmt: skip

    carry = (left, roots, steps, count, stable)
    _, roots, steps, count, stable = jax.lax.while_loop(lambda c: jnp.any(c[0]), again, carry)

    def finish(item: tuple) -> Equilibrium:
        row, root, steps, count, stable = item
        problem = _row_problem(actuator, row)
        return equilibrium_of(problem, attached(problem, root), steps, count, stable)

    items = (each, roots, steps, count, stable)
    if not actuator.springs:  # `lax.map` cannot cut arrays without entries
        return jax.vmap(finish)(items)
    return jax.lax.map(finish, items, batch_size=block)
