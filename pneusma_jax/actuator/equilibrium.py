"""Configurations in which force and moment balance, one row or many: Section 3.5.

The balance is in `balance`, the root-find in `root_find`, what a solved row is in `result`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from ..implausible import warn_of_pressure
from ..nitinol import SpringState
from ..nitinol.spring import Activation, MartensiteFraction, check_fractions, drives_of
from ..numerics.safe import check_number, evaluated, frozen, is_concrete, numpy_if_known
from ..precision import require_doubles, require_float64
from . import Actuator
from .all_starts import every_root, every_root_at_phases
from .balance import (
    Problem,
    configuration,
    first_trial,
    freedoms,
    imbalance,
    measured,
    residual,
    spring_responses,
)
from .batches import BLOCK, Rows, is_resistance, solved_at_phases
from .implicit import attached
from .known_derivatives import with_derivatives
from .load_steps import at_given_phases
from .result import Equilibrium, Status, Validity, count_and_stability, equilibrium_of, raise_unless_converged
from .root_find import BALANCED
from .root_search import MOST_ROOTS, all_roots
from .several import solved_by_resistance, unusable
from .traced_batch import traced_batch

__all__ = [
    "BALANCED", "BLOCK", "Equilibrium", "Problem", "Status", "Validity", "configuration", "first_trial",
    "imbalance", "residual", "solve", "solve_all", "solve_batch", "spring_responses",
]  # fmt: skip


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

    Without loads, given phases have one equilibrium. Newton's method finds it from the start, or from rest
    with pressure, heat and loads applied in steps. Under loads, an unstable equilibrium also has the status
    `several_equilibria`; `guess` leads to the others.

    Measured resistances may have several. Then all are looked for, and the one whose hottest spring is the
    least heated is returned, with the status `several_equilibria`. With one measured spring, that is the
    first which a heating from rest meets.

    Derivatives come from the implicit function theorem: of any order for bending in a plane, to the third
    otherwise.

    Args:
        actuator: the actuator to be solved.
        pressure: gauge [Pa], scalar (use `jax.vmap` or `solve_batch` for many).
        activations: one per spring, in the order of `actuator.spring_numbers`; cold where empty.
        states: memory of each spring; None for fresh springs with the actuator's own pre-strain.
        guess: scaled unknowns of a neighbouring solution, to start from. Of several equilibria the nearest to
            it is returned.
        throw: raise where there is no solution; otherwise return NaN with a `status`.

    Raises:
        RuntimeError: if float64 is off, or, with `throw`, the sentence of the status.
        TypeError: if the activations are no drives, or the pressure is no number.
        ValueError: if the number of activations or states is not the number of springs, one of them or the
            pressure is no scalar, a fraction is not between 0 and 1, or the guess has another shape.
    """
    problem = _problem(actuator, pressure, activations, states)
    warn_of_pressure(pressure)
    _check_guess(problem, guess)
    searched = frozen((problem, guess))
    if is_concrete(searched):
        with evaluated():  # numbers are known, though the call may stand in a traced function
            result, root = _known(*searched)
        if not is_concrete(problem, guess):
            result = _finished(problem, root, result.steps, result.equilibria, result.stable)
    else:
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
        actuator, pressure, activations, states: the same as for `solve`.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of `MOST_ROOTS`. Its first `equilibria[0]` entries
        are the configurations; the rest have the status `no_equilibrium` and are NaN.

    Raises:
        RuntimeError: if float64 is off.
        ValueError: as `solve`.
    """
    problem = _problem(actuator, pressure, activations, states)
    warn_of_pressure(pressure)
    searched = frozen(problem)
    if not is_concrete(searched):
        return _solve_all(problem)
    with evaluated():
        result, roots, real = _all_known(searched)
    if is_concrete(problem):
        return result
    return _all_finished(problem, roots, real, result.steps, result.equilibria, result.stable)


def solve_batch(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
) -> Equilibrium:
    """`solve` for many rows at once; a row without solution reports its `status` and stops no other.

    Outside of `jax.jit` the rows go through one compiled program, whatever their number, and memory beyond
    that of the result does not grow with it. By resistance there is a second one, for the grid of starts.

    Args:
        actuator: the same for every row.
        pressure: gauge [Pa], shape (rows,).
        activations: one per spring, their arrays of shape (rows,) or ().
        states: one per spring, their arrays of shape (rows,) or (); fresh where None.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of rows.

    Raises:
        RuntimeError: if float64 is off.
        ValueError: as `solve`, or for an array of another shape.
    """
    require_float64()
    check_number("pressure", pressure)
    warn_of_pressure(pressure)
    pressure = _floats(pressure)
    if pressure.ndim != 1:
        raise ValueError(f"Argument `pressure` must have the shape (rows,), but it has {pressure.shape}.")
    rows = pressure.shape[0]
    activations, states = _filled(actuator, activations, states)
    for what, given in (("activations", activations), ("states", states)):
        _check_shape(what, given, (rows,))
    repeated = lambda x: numpy_if_known(x).broadcast_to(x, (rows, *jnp.shape(x)[1:]))  # noqa: E731
    spread = lambda tree: jax.tree.map(repeated, tree)  # noqa: E731
    shared = all(jnp.ndim(leaf) == 0 for leaf in jax.tree.leaves(states))
    common = states if shared or rows == 0 else jax.tree.map(lambda x: numpy_if_known(x).ravel(x)[0], states)
    each = (pressure, spread(activations), spread(states))
    if rows == 0:
        return _none(actuator, each)
    searched = frozen((actuator, each, common))
    if not is_concrete(searched):
        return traced_batch(actuator, each, common, shared)
    with evaluated():  # numbers are known, though the call may stand in a traced function
        result, roots = _batch(*searched, shared)
        result = jax.device_put(result)
    if is_concrete(actuator, each):
        return result
    return with_derivatives(actuator, each, searched[:2], roots, result)


def _filled(
    actuator: Actuator, activations: tuple[Activation, ...], states: tuple[SpringState, ...] | None
) -> tuple[tuple[Activation, ...], tuple[SpringState, ...]]:
    """Activations and states, with what stands for none; checked where their numbers are known."""
    count = len(actuator.springs)
    activations = drives_of(activations) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = tuple(states) if states is not None else actuator.fresh_states()
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
    check_fractions(actuator.spring_numbers, activations)
    return jax.tree.map(_floats, activations), jax.tree.map(_floats, states)


def _check_shape(what: str, given: PyTree, shape: tuple[int, ...]) -> None:
    """Check that every array of an argument has a shape, or is one number that serves all rows.

    Raises:
        ValueError: if one has another shape.
    """
    for found in map(jnp.shape, jax.tree.leaves(given)):
        if found not in ((), shape, (1,) * len(shape)):
            needed = f"be scalar or of shape {shape}" if shape else "be scalar (see `solve_batch` for rows)"
            raise ValueError(f"Argument `{what}` must {needed}, but one array has the shape {found}.")


def _floats(x: Array) -> Array:
    """An array in double precision; of NumPy where it is known, which compiles nothing."""
    if is_concrete(x):
        return np.asarray(x, dtype=float)
    return x if jnp.result_type(x) == np.float64 else jnp.asarray(x, dtype=float)


def _problem(
    actuator: Actuator, pressure: Array, activations: tuple, states: tuple | None
) -> Problem:
    """One row, checked."""
    require_float64()
    require_doubles(actuator)
    activations, states = _filled(actuator, activations, states)
    check_number("pressure", pressure)
    pressure = _floats(pressure)
    for what, given in (("pressure", pressure), ("activations", activations), ("states", states)):
        _check_shape(what, given, ())
    return Problem(actuator, pressure, activations, states)


def _check_guess(problem: Problem, guess: Array | None) -> None:
    """Check that a guess has the unknowns of the shape, and perhaps the fractions of measured springs.

    Raises:
        ValueError: if it has another shape.
    """
    shape, fractions = freedoms(problem), len(measured(problem))
    if guess is not None and jnp.shape(guess) not in ((shape,), (shape + fractions,)):
        raise ValueError(
            f"Argument `guess` must be the `unknowns` of an equilibrium, of shape ({shape},) here, "
            f"but it has {jnp.shape(guess)}."
        )


def _rows_of(problem: Problem) -> Rows:
    """One row of known numbers as a batch."""
    row = (problem.pressure, problem.activations, problem.states)
    return Rows(problem.actuator, jax.tree.map(lambda x: np.asarray(x)[None], row))


def _known(problem: Problem, guess: Array | None) -> tuple[Equilibrium, Array]:
    """`solve` of known numbers, and the joint unknowns: those of the shape, then fractions by resistance."""
    rows = _rows_of(problem)
    if not measured(problem):
        common = jax.tree.map(np.asarray, problem.states)
        found = solved_at_phases(rows, common, None if guess is None else np.asarray(guess)[None])
        result, roots = found.result, found.unknowns
    elif not rows.usable[0]:
        result, roots = solved_by_resistance(rows, True)
    else:
        known, which = every_root(rows), 0
        if guess is not None:
            shape = freedoms(problem)  # fractions of springs with a measured resistance stand behind
            found = known.every.unknowns[known.which[0]]
            away = np.max(np.abs(found[:, :shape] - np.asarray(guess)[:shape]), axis=1)
            which = int(np.argmin(np.where(known.real[0], away, np.inf)))
        result, roots = known.result(which)
    return jax.device_put(jax.tree.map(lambda x: x[0], (result, roots)))


def _all_known(problem: Problem) -> tuple[Equilibrium, Array, Array]:
    """`solve_all` of known numbers, joint unknowns, and which are equilibria, each with an axis of roots."""
    rows = _rows_of(problem)
    if measured(problem) and rows.usable[0]:
        known = every_root(rows)
    else:
        known = every_root_at_phases(rows) if not measured(problem) else unusable(rows)
    parts = [known.result(k) for k in range(known.which.shape[1])]
    result, roots = jax.tree.map(lambda *x: np.concatenate(x), *parts)
    real = known.real[0]
    blank = lambda x: np.where(real.reshape(-1, *[1] * (x.ndim - 1)), x, np.nan) if x.dtype.kind == "f" else x  # noqa: E731
    status = np.where(real | (result.status != 0), result.status, int(Status.no_equilibrium))
    count = np.full(len(real), real.sum())
    result = eqx.tree_at(lambda r: (r.status, r.equilibria), jax.tree.map(blank, result), (status, count))
    return jax.device_put((result, roots, real))


def _batch(actuator: Actuator, each: tuple, common: tuple, shared: bool) -> tuple[Equilibrium, np.ndarray]:
    """`solve_batch` of known numbers, and the joint unknowns, shape (rows, unknowns).

    Args:
        actuator: the same for every row.
        each: pressure, activations and states of the rows.
        common: states of the first row, for the grid of equilibria by resistance.
        shared: true if all rows have these states.
    """
    require_doubles(actuator)
    rows = Rows(actuator, jax.tree.map(np.asarray, each))
    if any(is_resistance(a) for a in each[1]):
        return solved_by_resistance(rows, shared)
    found = solved_at_phases(rows, jax.tree.map(np.asarray, common))
    return found.result, found.unknowns


@eqx.filter_jit
def _finished(problem: Problem, root: Array, steps: Array, count: Array, stable: Array) -> Equilibrium:
    """The result of a row whose root is known, with derivatives by all its numbers."""
    return equilibrium_of(problem, attached(problem, root), steps, count, stable)


@eqx.filter_jit
def _solve(problem: Problem, guess: Array | None) -> Equilibrium:
    """`solve` inside of a transformation: one compiled program per design."""
    if not measured(problem):
        ended = at_given_phases(problem, first_trial(problem.actuator) if guess is None else guess)
        root, steps = ended.unknowns, ended.steps
        count, stable = count_and_stability(problem, ended)
    else:
        roots = all_roots(problem)
        which = jnp.asarray(0)
        if guess is not None:
            shape = freedoms(problem)  # fractions of springs with a measured resistance stand behind
            away = jnp.max(jnp.abs(roots.unknowns[:, :shape] - guess[:shape]), axis=1)
            which = jnp.argmin(jnp.where(roots.real, away, jnp.inf))
        root, steps = roots.unknowns[which], roots.steps
        count, stable = roots.count, roots.signs[which] > 0.0
    return equilibrium_of(problem, attached(problem, root), steps, count, stable)


@eqx.filter_jit
def _solve_all(problem: Problem) -> Equilibrium:
    """`solve_all` inside of a transformation; without measured resistances the one of `solve`."""
    if not measured(problem):
        ended = at_given_phases(problem, first_trial(problem.actuator))
        real = jnp.arange(MOST_ROOTS) == 0
        found = jnp.broadcast_to(ended.unknowns, (MOST_ROOTS, ended.unknowns.size))
        count, steps, stable = ended.good.astype(int), ended.steps, count_and_stability(problem, ended)[1]
        stable = jnp.broadcast_to(stable, MOST_ROOTS)
    else:
        roots = all_roots(problem)
        found, real, steps, count, stable = (
            roots.unknowns, roots.real, roots.steps, roots.count, roots.signs > 0.0
        )  # fmt: skip
    spread = lambda x: jnp.broadcast_to(x, MOST_ROOTS)  # noqa: E731
    return _all_finished(problem, found, real, spread(steps), spread(count), stable)


@eqx.filter_jit
def _all_finished(
    problem: Problem, roots: Array, real: Array, steps: Array, count: Array, stable: Array
) -> Equilibrium:
    """Results of known roots of a row; NaN where one is none."""

    def one(root: Array, real: Array, steps: Array, count: Array, stable: Array) -> Equilibrium:
        root = jnp.where(real, attached(problem, root), jnp.nan)
        return equilibrium_of(problem, root, steps, count, stable)

    return jax.vmap(one)(roots, real, steps, count, stable)


def _none(actuator: Actuator, each: tuple) -> Equilibrium:
    """The result of no rows."""
    one = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], x.dtype), each)
    unknowns = actuator.freedoms + sum(is_resistance(a) for a in each[1])

    def found(row: tuple) -> Equilibrium:
        return equilibrium_of(Problem(actuator, *row), jnp.zeros(unknowns), jnp.asarray(0))

    shapes = eqx.filter_eval_shape(found, one)
    return jax.tree.map(lambda x: jnp.zeros((0, *x.shape), x.dtype), shapes)
