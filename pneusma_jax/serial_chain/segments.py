"""Chains: segments in series under one pressure, each with its own activation and its own memory.

The shape of a chain follows by placing one constant-curvature arc after the other. Without loads, segments
share the pressure only, and each is in an equilibrium of its own. Weight, forces and moments act from segment
to segment (`loads`), and the whole chain is one equilibrium (`balance`). Segments of equal structure are
solved together, as one batch of one compiled program, whatever their dimensions. Contact is not modelled.
"""

import dataclasses
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem
from ..actuator.equilibrium import solve
from ..actuator.result import Equilibrium, Status, raise_unless_converged, solved
from ..nitinol import MartensiteFraction, Resistance, SpringState
from ..nitinol.spring import Activation
from ..nitinol.thermal import Heating
from ..numerics.safe import is_concrete
from ..precision import require_float64
from ..section import Section
from ..simulate.history import History, simulate_history
from .balance import ChainProblem, chain_root, described, rest_of
from .history import check_course, loaded_history
from .loads import ChainLoad, own_loads
from .shape import ChainShape, place_segments

Drive = tuple[Activation | Heating, ...]  # one per spring of a segment


class SegmentChain(eqx.Module):
    """Segments in series from base to tip; `chain_of` builds one from fewer arguments.

    Attributes:
        segments: actuators. Their own loads, `Actuator.loads`, act on the whole chain, with directions of the
            chain's base and places of the segment's section.
        angles: mounting angle of each segment about z, against the base [rad], shape (n,).
        connectors: lengths of the rigid connectors between segments [m], shape (n - 1,).
        loads: loads on the chain beyond those of single segments; see `serial_chain.loads`.

    Raises:
        ValueError: if there is no segment, a shape does not fit, a connector has a negative length, or a
            segment's load cannot be transmitted.
    """

    segments: tuple[Actuator, ...]
    angles: Float[Array, "n"]
    connectors: Float[Array, "gaps"]
    loads: tuple[ChainLoad, ...] = ()

    def __check_init__(self) -> None:
        count = len(self.segments)
        if count == 0:
            raise ValueError("Argument `segments` must hold at least one actuator, but it is empty.")
        wanted_shapes = (("angles", self.angles, count), ("connectors", self.connectors, count - 1))
        for what, given, wanted in wanted_shapes:
            if jnp.shape(given) != (wanted,):
                raise ValueError(
                    f"Argument `{what}` must have shape ({wanted},) for {count} segments, "
                    f"but it has {jnp.shape(given)}."
                )
        if is_concrete(self.connectors) and np.any(np.asarray(self.connectors) < 0.0):
            raise ValueError("Argument `connectors` must not be negative, but one is.")
        own_loads(tuple(segment.loads for segment in self.segments))
        for load in self.loads:
            load.check(count)

    @property
    def loaded(self) -> bool:
        """True if anything acts on the chain but pressure."""
        return bool(self.loads) or any(segment.loads for segment in self.segments)

    @property
    def all_loads(self) -> tuple[ChainLoad, ...]:
        """Loads of the chain and of its segments."""
        return (*self.loads, *own_loads(tuple(segment.loads for segment in self.segments)))

    def with_loads(self, *loads: ChainLoad) -> "SegmentChain":
        """The same chain under other loads of its own. The segments' loads stay."""
        return dataclasses.replace(self, loads=loads)


class ChainEquilibrium(eqx.Module):
    """A solved chain: the equilibrium of each segment, and the shape of the chain.

    Attributes:
        segments: equilibria from base to tip. Under loads all of them are NaN where the chain has no
            equilibrium.
        shape: shape in space.
        stable: true if the equilibrium of a loaded chain is stable: the symmetric part of its stiffness is
            positive definite. A straight chain under a weight beyond its buckling load is in equilibrium, but
            not stable. None for a chain without loads.
    """

    segments: tuple[Equilibrium, ...]
    shape: ChainShape
    stable: Array | None = None

    @property
    def status(self) -> Array:
        """`Status` code of the whole chain: `converged`, or the most informative of the segments' codes."""
        return jnp.max(jnp.stack([segment.status for segment in self.segments], axis=-1), axis=-1)

    @property
    def converged(self) -> Array:
        """True if the whole chain is in equilibrium."""
        return solved(self.status)

    @property
    def frames(self) -> Float[Array, "n+1 4 4"]:
        """Frames of the segments, see `ChainShape`."""
        return self.shape.frames

    @property
    def end_pose(self) -> Float[Array, "4 4"]:
        """Frame at the tip."""
        return self.shape.end_pose


class ChainHistory(eqx.Module):
    """A simulated history of a chain: that of each segment, and the shapes, with a leading axis of rows."""

    segments: tuple[History, ...]
    shape: ChainShape

    @property
    def converged(self) -> Array:
        """Rows in which every segment found an equilibrium, shape (rows,)."""
        return jnp.all(jnp.stack([segment.converged for segment in self.segments]), axis=0)


def chain_of(
    segments: Actuator | Sequence[Actuator],
    count: int | None = None,
    *,
    angles: Array | Sequence[float] = 0.0,
    connectors: Array | Sequence[float] = 0.0,
) -> SegmentChain:
    """Chain of one actuator repeated, or of several.

    Args:
        segments: one actuator, or one per segment from base to tip.
        count: number of segments, where one actuator is given; 1 by default.
        angles: mounting angle of each segment about z against the base [rad], or one for all. `(0, pi / 2)`
            makes an alternating orthogonal pair of planar segments.
        connectors: lengths of the rigid connectors between segments [m], or one for all.

    Raises:
        ValueError: if the numbers do not fit each other.
    """
    if isinstance(segments, Actuator):
        count = 1 if count is None else count
        segments = (segments,) * count
    elif count is not None:
        raise ValueError(
            "Argument `count` must be left out where one actuator per segment is given, but it is not."
        )
    spread = lambda x, n: jnp.broadcast_to(x, (n,)) if jnp.ndim(x) == 0 else x  # noqa: E731
    angles, connectors = jnp.asarray(angles, dtype=float), jnp.asarray(connectors, dtype=float)
    return SegmentChain(
        tuple(segments), spread(angles, len(segments)), spread(connectors, max(len(segments) - 1, 0))
    )


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
        RuntimeError: if float64 is off, or, with `throw`, if there is no equilibrium. The message names the
            segment (or the loaded chain) and the reason.
        ValueError: if activations or states do not fit the segments and their springs.
    """
    activations, states = _per_segment(chain, activations, states)
    rows = list(zip(_without_loads(chain), activations, states, strict=True))
    if chain.loaded:
        found = _solve_loaded(chain, jnp.asarray(pressure, dtype=float), rows)
        return _raise_for_chain(found) if throw else found
    results = _map_by_structure(
        lambda body, drive, memory: solve(body, pressure, drive, memory, throw=False), rows
    )
    if throw:
        results = [_raise_for_segment(k, result) for k, result in enumerate(results, 1)]
    bends = jnp.stack([result.bend for result in results])
    lengths = jnp.stack([result.length for result in results])
    return ChainEquilibrium(tuple(results), chain_shape(chain, bends, lengths))


def _without_loads(chain: SegmentChain) -> list[Actuator]:
    """The segments without their own loads."""
    return [segment.with_loads() if segment.loads else segment for segment in chain.segments]


def _solve_loaded(chain: SegmentChain, pressure: Array, rows: list[tuple]) -> ChainEquilibrium:
    """`solve_chain` under loads."""
    require_float64()
    members = tuple(tuple(group) for group in _groups_of_equal_structure(rows))
    stacked = tuple(_stack(rows, group) for group in members)
    parts = tuple(
        Problem(body, jnp.broadcast_to(pressure, (len(m),)), drive, memory)
        for m, (body, drive, memory) in zip(members, stacked, strict=True)
    )
    problem = joined(chain, parts, members)
    return _joint(chain, problem, rest_of(problem) or _unloaded(problem))


def _unloaded(problem: ChainProblem) -> tuple[ChainProblem, Array]:
    """The chain without loads, and its solution: every segment alone."""
    alone = lambda part: solve(  # noqa: E731
        part.actuator, part.pressure, part.activations, part.states, throw=False
    )
    unknowns = [jax.vmap(alone)(part).unknowns[:, : part.actuator.freedoms].ravel() for part in problem.parts]
    return dataclasses.replace(problem, share=jnp.zeros_like(problem.share)), jnp.concatenate(unknowns)


@eqx.filter_jit
def _joint(chain: SegmentChain, problem: ChainProblem, begin: tuple[ChainProblem, Array]) -> ChainEquilibrium:
    """Equilibrium of a loaded chain from a start: one compiled program per kind of chain."""
    stand = chain_root(begin[0], problem, begin[1])
    results = _by_segment(described(problem, stand), problem.members)
    bends = jnp.stack([result.bend for result in results])
    lengths = jnp.stack([result.length for result in results])
    return ChainEquilibrium(tuple(results), chain_shape(chain, bends, lengths), stand.stable & stand.found)


def joined(
    chain: SegmentChain, parts: tuple[Problem, ...], members: tuple[tuple[int, ...], ...]
) -> ChainProblem:
    """The chain's balance: stacked segments under all its loads."""
    return ChainProblem(parts, members, chain.angles, jnp.append(chain.connectors, 0.0), chain.all_loads)


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
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    rows = jnp.shape(pressure)[:1]
    activations, states = _per_segment(chain, activations, states)
    spread = lambda x: jnp.broadcast_to(x, rows) if jnp.ndim(x) == 0 else x  # noqa: E731  # alike in shape
    arguments = list(zip(_without_loads(chain), jax.tree.map(spread, activations), states, strict=True))
    if chain.loaded:
        check_course(pressure, activations, time)
        results = _loaded_history(chain, jnp.asarray(pressure, dtype=float), arguments, time)
    else:
        results = _map_by_structure(
            lambda body, drive, memory: simulate_history(body, pressure, drive, memory, time=time), arguments
        )
    bends = jnp.stack([result.rows.bend for result in results], axis=1)
    lengths = jnp.stack([result.rows.length for result in results], axis=1)
    return ChainHistory(tuple(results), chain_shape(chain, bends, lengths))


def _loaded_history(
    chain: SegmentChain, pressure: Array, rows: list[tuple], time: Array | None
) -> list[History]:
    """Histories of the segments of a loaded chain."""
    members = tuple(tuple(group) for group in _groups_of_equal_structure(rows))
    stacked = tuple(_stack(rows, group) for group in members)
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
    by_segment: list = [None] * len(rows)
    for result, group in zip(found, members, strict=True):
        for at, k in enumerate(group):
            by_segment[k] = jax.tree.map(lambda leaf, at=at: leaf[:, at], result)
    return by_segment


def chain_shape(
    chain: SegmentChain, bends: Float[Array, "*rows n 2"], lengths: Float[Array, "*rows n"]
) -> ChainShape:
    """Shape of a chain whose segments are bent by given angles.

    Args:
        chain: chain with mounting angles, connectors and radii.
        bends: bend angle vector of each segment in its own axes [rad].
        lengths: lengths of the segments' centre lines [m].
    """
    radii = jnp.stack([enclosing_radius(segment.section) for segment in chain.segments])
    return place_segments(bends, lengths, chain.angles, jnp.append(chain.connectors, 0.0), radii)


def enclosing_radius(section: Section) -> Array:
    """Radius about the centre line of a tube that encloses the section, to 0.1 % unless it is round [m]."""
    angles = jnp.linspace(0.0, 2.0 * jnp.pi, 72, endpoint=False)
    directions = jnp.stack([jnp.cos(angles), jnp.sin(angles)], axis=-1)
    return jnp.max(jax.vmap(lambda n: section.sides(n)[0])(directions))


def _per_segment(
    chain: SegmentChain, activations: Sequence[Drive], states: Sequence[tuple[SpringState, ...]] | None
) -> tuple[tuple[Drive, ...], tuple[tuple[SpringState, ...], ...]]:
    """Activations and states of every spring, defaults filled in.

    Raises:
        ValueError: if they do not fit the chain.
    """
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


def _groups_of_equal_structure(rows: list[tuple]) -> list[list[int]]:
    """Groups of rows with equal structure and shapes."""
    groups: dict[tuple, list[int]] = {}
    for k, row in enumerate(rows):
        leaves, structure = jax.tree.flatten(jax.tree.map(jnp.asarray, row))
        groups.setdefault((structure, *((leaf.shape, leaf.dtype) for leaf in leaves)), []).append(k)
    return list(groups.values())


def _stack(rows: list[tuple], members: Sequence[int]) -> tuple:
    """Some rows along a leading axis."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *(rows[k] for k in members))


def _by_segment(results: Sequence, members: Sequence[Sequence[int]]) -> list:
    """Stacked results, segment by segment from base to tip."""
    by_segment: list = [None] * sum(map(len, members))
    for result, group in zip(results, members, strict=True):
        for at, k in enumerate(group):
            by_segment[k] = jax.tree.map(lambda leaf, at=at: leaf[at], result)
    return by_segment


def _map_by_structure(function: Callable, rows: list[tuple]) -> list:
    """Results of a function for every row; rows of equal structure and shapes share one vmapped call."""
    groups = _groups_of_equal_structure(rows)
    if all(len(members) == 1 for members in groups):
        return [function(*row) for row in rows]
    return _by_segment([jax.vmap(function)(*_stack(rows, members)) for members in groups], groups)


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
