"""Chains: segments in series under one pressure, each with its own activation and its own memory.

Segments share the pressure and hand no other load to each other (a chain without weight and without contact),
so each is in an equilibrium of its own and the shape follows by placing one constant-curvature arc after the
other. Segments alike in structure are solved together, as one batch of one compiled program, whatever their
dimensions.
"""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._numerics import is_concrete
from .actuator import Actuator
from .chain_shape import ChainShape, place_segments
from .equilibrium import solve
from .history import History, simulate_history
from .nitinol import MartensiteFraction, SpringState
from .nitinol.spring import Activation
from .nitinol.thermal import Heating
from .result import Equilibrium, Status, raise_unless_converged
from .section import Section

Drive = tuple[Activation | Heating, ...]  # one per spring of a segment


class SegmentChain(eqx.Module):
    """Segments in series from base to tip; `chain_of` builds one from fewer words.

    Attributes:
        segments: the actuators.
        angles: by which each segment is mounted turned about z, against the base [rad], shape (n,).
        connectors: lengths of the rigid connectors between segments [m], shape (n - 1,).

    Raises:
        ValueError: if there is no segment, a shape does not fit, a connector is shorter than nothing, or one
            of several segments carries loads.
    """

    segments: tuple[Actuator, ...]
    angles: Float[Array, "n"]
    connectors: Float[Array, "gaps"]

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
        if count > 1 and any(segment.loads for segment in self.segments):
            raise ValueError(
                "A segment of a chain must not carry loads of its own, but one does: "
                "a chain does not model how weight and tip forces pass from segment to segment."
            )
        if is_concrete(self.connectors) and np.any(np.asarray(self.connectors) < 0.0):
            raise ValueError("Argument `connectors` must not be negative, but one is.")


class ChainEquilibrium(eqx.Module):
    """A solved chain: the equilibrium of each segment, and the shape they make."""

    segments: tuple[Equilibrium, ...]
    shape: ChainShape

    @property
    def frames(self) -> Float[Array, "n+1 4 4"]:
        """See `ChainShape`."""
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
        angles: of each segment about z against the base [rad], or one for all; `(0, pi / 2)` makes an
            alternating orthogonal pair of planar segments.
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
    """Equilibrium and shape of a chain; differentiable in activations, pressure and every dimension.

    Args:
        chain: the segments.
        pressure: gauge [Pa], in all segments.
        activations: for each segment one per spring; cold where empty.
        states: what the springs remember, for each segment one per spring; fresh where None.
        throw: raise where a segment has no solution; otherwise its configuration, and what comes after it, is
            NaN and its `status` says why.

    Raises:
        RuntimeError: if float64 is off, or, with `throw`, which segment is not in equilibrium and why.
        ValueError: if activations or states do not fit the segments and their springs.
    """
    activations, states = _per_segment(chain, activations, states)
    results = _alike_together(
        lambda body, drive, memory: solve(body, pressure, drive, memory, throw=False),
        list(zip(chain.segments, activations, states, strict=True)),
    )
    if throw:
        results = [_raise_for_segment(k, result) for k, result in enumerate(results, 1)]
    bends = jnp.stack([result.bend for result in results])
    lengths = jnp.stack([result.length for result in results])
    return ChainEquilibrium(tuple(results), chain_shape(chain, bends, lengths))


def simulate_chain_history(
    chain: SegmentChain,
    pressure: Float[Array, "rows"],
    activations: Sequence[Drive] = (),
    states: Sequence[tuple[SpringState, ...]] | None = None,
    *,
    time: Float[Array, "rows"] | None = None,
) -> ChainHistory:
    """Chain under histories of pressure and activation, memories carried; see `simulate_history`.

    Args:
        chain: the segments.
        pressure: gauge [Pa], in all segments, shape (rows,).
        activations: for each segment one per spring, their arrays of shape (rows,) or (); cold where empty.
        states: memories before the first row, for each segment one per spring; fresh where None.
        time: [s], shape (rows,); needed by `Heating`.

    Raises:
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    rows = jnp.shape(pressure)[:1]
    activations, states = _per_segment(chain, activations, states)
    spread = lambda x: jnp.broadcast_to(x, rows) if jnp.ndim(x) == 0 else x  # noqa: E731  # alike in shape
    results = _alike_together(
        lambda body, drive, memory: simulate_history(body, pressure, drive, memory, time=time),
        list(zip(chain.segments, jax.tree.map(spread, activations), states, strict=True)),
    )
    bends = jnp.stack([result.rows.bend for result in results], axis=1)
    lengths = jnp.stack([result.rows.length for result in results], axis=1)
    return ChainHistory(tuple(results), chain_shape(chain, bends, lengths))


def chain_shape(
    chain: SegmentChain, bends: Float[Array, "*rows n 2"], lengths: Float[Array, "*rows n"]
) -> ChainShape:
    """Shape of a chain whose segments are bent by given angles.

    Args:
        chain: mounting angles, connectors and radii are taken from it.
        bends: bend angle vector of each segment in its own axes [rad].
        lengths: of the segments' centre lines [m].
    """
    radii = jnp.stack([enclosing_radius(segment.section) for segment in chain.segments])
    return place_segments(bends, lengths, chain.angles, jnp.append(chain.connectors, 0.0), radii)


def enclosing_radius(section: Section) -> Array:
    """Radius about the centre line of a tube that holds the section, to 0.1 % unless it is round [m]."""
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
    states = tuple(states) if states is not None else tuple(None for _ in springs)
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != len(springs):
            raise ValueError(
                f"Argument `{what}` must have one entry per segment, {len(springs)} here, "
                f"but it has {len(given)}."
            )
    cold, fresh = MartensiteFraction(1.0), SpringState.fresh(0.1924)
    activations = tuple(tuple(a) or (cold,) * n for a, n in zip(activations, springs, strict=True))
    states = tuple((fresh,) * n if s is None else tuple(s) for s, n in zip(states, springs, strict=True))
    return activations, states


def _alike_together(function: Callable, rows: list[tuple]) -> list:
    """A function of every row, rows of equal structure and shapes in one vmapped call."""
    groups: dict[tuple, list[int]] = {}
    rows = [jax.tree.map(jnp.asarray, row) for row in rows]
    for k, row in enumerate(rows):
        leaves, structure = jax.tree.flatten(row)
        groups.setdefault((structure, *((leaf.shape, leaf.dtype) for leaf in leaves)), []).append(k)
    results: list = [None] * len(rows)
    for members in groups.values():
        if len(members) == 1:
            results[members[0]] = function(*rows[members[0]])
            continue
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(rows[k] for k in members))
        together = jax.vmap(function)(*stacked)
        for at, k in enumerate(members):
            results[k] = jax.tree.map(lambda leaf, at=at: leaf[at], together)
    return results


def _raise_for_segment(number: int, result: Equilibrium) -> Equilibrium:
    """Raise the sentence of a segment that is not in equilibrium; under `jit` by a check in the program."""
    if is_concrete(result.status) and int(result.status) != Status.converged:
        raise RuntimeError(f"Segment {number}: {Status(int(result.status)).sentence}")
    return raise_unless_converged(result)
