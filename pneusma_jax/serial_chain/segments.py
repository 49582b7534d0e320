"""Chains as data: segments in series under one pressure, each with its own activation and its own memory.

The shape of a chain follows by placing one constant-curvature arc after the other. Contact is not modelled.
The module `solve` finds equilibria.
"""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.result import Equilibrium, solved
from ..numerics.safe import as_array, is_concrete, numpy_if_known
from ..section import Section
from ..simulate.history import History
from .loads import ChainLoad, own_loads
from .shape import ChainShape, place_segments


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
    def spread(x: Array, n: int) -> Array:
        xp = numpy_if_known(x)
        x = xp.asarray(x, dtype=float)
        return as_array(xp.broadcast_to(x, (n,)) if x.ndim == 0 else x)

    return SegmentChain(
        tuple(segments), spread(angles, len(segments)), spread(connectors, max(len(segments) - 1, 0))
    )


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
