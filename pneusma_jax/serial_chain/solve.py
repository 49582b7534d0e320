"""Equilibrium of a chain, and its history.

Without loads, segments share the pressure only, and each is in an equilibrium of its own. Weight, forces and
moments act from segment to segment (`loads`), and the whole chain is one equilibrium (`balance`). Segments of
equal structure are solved together, as one batch of one compiled program, whatever their dimensions.
"""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem
from ..actuator.equilibrium import solve
from ..actuator.result import Equilibrium, Status, Validity, raise_unless_converged
from ..implausible import warn_of_pressure
from ..nitinol import MartensiteFraction, Resistance, SpringResponse, SpringState
from ..nitinol.spring import Activation
from ..nitinol.thermal import Heating
from ..numerics.safe import as_array, check_number, is_concrete, numpy_if_known
from ..precision import require_doubles, require_float64
from ..program_cache import stored_jit
from ..simulate.course import check_course
from ..simulate.history import History, simulate_history
from .balance import ChainProblem, chain_root, described, rest_of
from .by_structure import by_segment, groups_of_equal_structure, map_by_structure, stack_rows
from .history import loaded_history
from .segments import ChainEquilibrium, ChainHistory, SegmentChain, chain_shape
from .shape import ChainShape

Drive = tuple[Activation | Heating, ...]
"""Activations of a segment, one per spring."""


def solve_chain(
    chain: SegmentChain,
    pressure: Array,
    activations: Sequence[Drive] = (),
    states: Sequence[tuple[SpringState, ...]] | None = None,
    *,
    throw: bool = True,
) -> ChainEquilibrium:
    """Equilibrium and shape of a chain; differentiable in activations, pressure, loads and every dimension.

    Under loads the search finds the equilibrium connected with the chain at rest, cold and without pressure.
    `stable` tells if it is stable.

    Args:
        chain: chain of segments.
        pressure: gauge pressure in all segments [Pa].
        activations: activations for each segment, one per spring; cold where empty.
        states: memories of the springs for each segment, one per spring; fresh where None.
        throw: true to raise where there is no solution. Otherwise the `status` gives the reason, and missing
            results are NaN. A chain without loads misses those from the failed segment on, a loaded chain
            those of all segments.

    Raises:
        TypeError: if the pressure is no number.
        RuntimeError: if float64 is off, or, with `throw`, if there is no equilibrium. The message names the
            segment (or the loaded chain) and the reason.
        ValueError: if activations or states do not fit the segments and their springs.
    """
    check_number("pressure", pressure)
    warn_of_pressure(pressure)
    activations, states = _per_segment(chain, activations, states)
    rows = list(zip(_without_loads(chain), activations, states, strict=True))
    if chain.loaded:
        found = _solve_loaded(chain, jnp.asarray(pressure, dtype=float), rows)
        return _raise_for_chain(found) if throw else found
    together = len(groups_of_equal_structure(rows)) < len(rows) and is_concrete(chain, pressure, rows)
    if not together:
        return _each(chain, pressure, rows, throw)
    found = _each_together(chain, as_array(pressure), rows, False)
    if throw:
        for k, result in enumerate(found.segments, 1):
            _raise_for_segment(k, result)
    return found


def _each(chain: SegmentChain, pressure: Array, rows: list[tuple], throw: bool) -> ChainEquilibrium:
    """Equilibrium of every segment by itself, and the shape of the chain."""
    results = map_by_structure(
        lambda body, drive, memory: solve(body, pressure, drive, memory, throw=False), rows
    )
    if throw:
        results = [_raise_for_segment(k, result) for k, result in enumerate(results, 1)]
    bends = jnp.stack([result.bend for result in results])
    lengths = jnp.stack([result.length for result in results])
    return ChainEquilibrium(tuple(results), chain_shape(chain, bends, lengths))


_each_together = stored_jit(ChainEquilibrium, ChainShape, Equilibrium, Validity, SpringResponse)(_each)


def _without_loads(chain: SegmentChain) -> list[Actuator]:
    """The segments without their own loads."""
    return [segment.with_loads() if segment.loads else segment for segment in chain.segments]


def _solve_loaded(chain: SegmentChain, pressure: Array, rows: list[tuple]) -> ChainEquilibrium:
    """`solve_chain` under loads."""
    members = tuple(tuple(group) for group in groups_of_equal_structure(rows))
    stacked = tuple(stack_rows(rows, group) for group in members)
    spread = lambda n: as_array(numpy_if_known(pressure).broadcast_to(pressure, (n,)))  # noqa: E731
    parts = tuple(
        Problem(body, spread(len(m)), drive, memory)
        for m, (body, drive, memory) in zip(members, stacked, strict=True)
    )
    problem = joined(chain, parts, members)
    return _joint(chain, problem, rest_of(problem) or _unloaded(problem))


def _unloaded(problem: ChainProblem) -> tuple[ChainProblem, Array]:
    """The chain without loads, and its solution: every segment alone."""
    return dataclasses.replace(problem, share=jnp.zeros_like(problem.share)), _alone(problem.parts)


@stored_jit()
def _alone(parts: tuple[Problem, ...]) -> Array:
    """Unknowns of all segments, each in equilibrium without the others."""
    one = lambda part: solve(  # noqa: E731
        part.actuator, part.pressure, part.activations, part.states, throw=False
    )
    unknowns = [jax.vmap(one)(part).unknowns[:, : part.actuator.freedoms].ravel() for part in parts]
    return jnp.concatenate(unknowns)


@stored_jit(ChainEquilibrium, ChainShape, Equilibrium, Validity, SpringResponse)
def _joint(chain: SegmentChain, problem: ChainProblem, begin: tuple[ChainProblem, Array]) -> ChainEquilibrium:
    """Equilibrium of a loaded chain from a start: one compiled program per kind of chain."""
    root = chain_root(begin[0], problem, begin[1])
    results = by_segment(described(problem, root), problem.members)
    bends = jnp.stack([result.bend for result in results])
    lengths = jnp.stack([result.length for result in results])
    return ChainEquilibrium(tuple(results), chain_shape(chain, bends, lengths), root.stable & root.found)


def joined(
    chain: SegmentChain, parts: tuple[Problem, ...], members: tuple[tuple[int, ...], ...]
) -> ChainProblem:
    """The chain's balance: stacked segments under all its loads."""
    gaps = as_array(numpy_if_known(chain.connectors).append(chain.connectors, 0.0))  # none after the last one
    return ChainProblem(parts, members, chain.angles, gaps, chain.all_loads)


def simulate_chain_history(
    chain: SegmentChain,
    pressure: Float[Array, "rows"],
    activations: Sequence[Drive] = (),
    states: Sequence[tuple[SpringState, ...]] | None = None,
    *,
    time: Float[Array, "rows"] | None = None,
) -> ChainHistory:
    """Chain under histories of pressure and activation, memories carried; see `simulate_history`.

    Loads are constant. A row of a loaded chain continues from the last solved one. A row without equilibrium
    is NaN in all segments, commits nothing, and stops no later row.

    Args:
        chain: chain of segments.
        pressure: gauge pressure in all segments [Pa], shape (rows,).
        activations: activations for each segment, one per spring, with arrays of shape (rows,) or (); cold
            where empty.
        states: memories before the first row, for each segment one per spring; fresh where None.
        time: time [s], shape (rows,); needed by `Heating`.

    Raises:
        TypeError: if the pressures are no numbers.
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    check_number("pressure", pressure)
    rows = jnp.shape(pressure)[:1]
    activations, states = _per_segment(chain, activations, states)
    spread = lambda x: jnp.broadcast_to(x, rows) if jnp.ndim(x) == 0 else x  # noqa: E731  # alike in shape
    arguments = list(zip(_without_loads(chain), jax.tree.map(spread, activations), states, strict=True))
    if chain.loaded:
        warn_of_pressure(pressure)
        check_course(pressure, activations, time)
        results = _loaded_history(chain, jnp.asarray(pressure, dtype=float), arguments, time)
    else:
        results = map_by_structure(
            lambda body, drive, memory: simulate_history(body, pressure, drive, memory, time=time), arguments
        )
    bends = jnp.stack([result.rows.bend for result in results], axis=1)
    lengths = jnp.stack([result.rows.length for result in results], axis=1)
    return ChainHistory(tuple(results), chain_shape(chain, bends, lengths))


def _loaded_history(
    chain: SegmentChain, pressure: Array, rows: list[tuple], time: Array | None
) -> list[History]:
    """Histories of the segments of a loaded chain."""
    members = tuple(tuple(group) for group in groups_of_equal_structure(rows))
    stacked = tuple(stack_rows(rows, group) for group in members)
    parts = tuple(
        Problem(
            body, jnp.broadcast_to(pressure[0], (len(m),)), jax.tree.map(lambda x: x[..., 0], drive), memory
        )
        for m, (body, drive, memory) in zip(members, stacked, strict=True)
    )
    balance, guess = joined(chain, parts, members), None
    if any(isinstance(a, Resistance) for part in parts for a in part.activations):
        warm = tuple(
            dataclasses.replace(
                part,
                activations=tuple(
                    MartensiteFraction(jnp.ones_like(a.ambient)) if isinstance(a, Heating) else a
                    for a in part.activations
                ),
            )
            for part in parts
        )
        guess = _unloaded(joined(chain, warm, members))[1]
    clock = jnp.zeros(pressure.shape[0]) if time is None else jnp.asarray(time, dtype=float)
    found = loaded_history(balance, stacked, pressure, clock, guess)
    ordered: list = [None] * len(rows)
    for result, group in zip(found, members, strict=True):
        for at, k in enumerate(group):
            ordered[k] = jax.tree.map(lambda leaf, at=at: leaf[:, at], result)
    return ordered


def _per_segment(
    chain: SegmentChain, activations: Sequence[Drive], states: Sequence[tuple[SpringState, ...]] | None
) -> tuple[tuple[Drive, ...], tuple[tuple[SpringState, ...], ...]]:
    """Activations and states of every spring, defaults filled in.

    Raises:
        RuntimeError: if float64 is off, or the chain was built in single precision.
        ValueError: if they do not fit the chain.
    """
    require_float64()
    require_doubles(chain)
    springs = [len(segment.springs) for segment in chain.segments]
    activations = tuple(activations) or tuple(() for _ in springs)
    states = tuple(states) if states is not None else tuple(None for _ in springs)  # type: ignore[misc]
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != len(springs):
            raise ValueError(
                f"Argument `{what}` must have one entry per segment, {len(springs)} here, "
                f"but it has {len(given)}."
            )
    cold = MartensiteFraction(1.0)
    activations = tuple(tuple(a) or (cold,) * n for a, n in zip(activations, springs, strict=True))
    pairs = zip(states, chain.segments, strict=True)
    states = tuple(body.fresh_states() if s is None else tuple(s) for s, body in pairs)
    return activations, states


def _raise_for_chain(found: ChainEquilibrium) -> ChainEquilibrium:
    """Raise the sentence of a loaded chain without equilibrium; under `jit` by a check in the program."""
    if is_concrete(found.status):
        if not bool(found.converged):
            raise RuntimeError(f"The loaded chain: {Status(int(found.status)).sentence}")
        return found
    bad = ~found.converged
    return eqx.branched_error_if(found, bad, found.status, [s.sentence for s in Status])


def _raise_for_segment(number: int, result: Equilibrium) -> Equilibrium:
    """Raise the sentence of a segment that is not in equilibrium; under `jit` by a check in the program."""
    if is_concrete(result.status) and not bool(result.converged):
        raise RuntimeError(f"Segment {number}: {Status(int(result.status)).sentence}")
    return raise_unless_converged(result)
