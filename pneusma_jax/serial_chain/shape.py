"""The shape of a chain of segments: positions in space, lines, clearance."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.safe import safe_norm
from ..program_cache import stored_jit
from .clearance import Clearance, Pieces, chain_clearance
from .kinematics import arc_frame, arc_points, compose, rotate_in_section, shift_along, side_points, transform


class ChainShape(eqx.Module):
    """A chain in space, in the frame of its base. The arrays of a history have a leading axis of rows.

    Attributes:
        bends: bend angle vector of each segment along the base's x and y [rad], shape (n, 2).
        lengths: lengths of the segments' centre lines [m], shape (n,).
        connectors: length of the rigid connector after each segment [m], shape (n,); none after the last.
        radii: radii of the tubes about their centre lines [m], shape (n,).
        angles: mounting angles of the segments [rad], shape (n,).
        frames: frame of the base, and one after each segment and its connector, shape (n + 1, 4, 4). A frame
            does not turn with a segment's mounting: on a straight chain all frames are parallel.
    """

    bends: Float[Array, "*rows n 2"]
    lengths: Float[Array, "*rows n"]
    connectors: Float[Array, "*rows n"]
    radii: Float[Array, "*rows n"]
    angles: Float[Array, "*rows n"]
    frames: Float[Array, "*rows n+1 4 4"]

    @property
    def end_pose(self) -> Float[Array, "*rows 4 4"]:
        """Frame at the tip."""
        return self.frames[..., -1, :, :]

    @property
    def total_bend(self) -> Float[Array, "*rows"]:
        """Bend angles of all segments together, each without its direction [rad]. On a straight chain, where
        it has a kink, its derivative is zero."""
        return jnp.sum(safe_norm(self.bends), axis=-1)

    def row(self, index: int) -> "ChainShape":
        """The shape in one row of a history."""
        return jax.tree.map(lambda leaf: leaf[index], self)

    @stored_jit()
    def line(
        self, segment: int, place: Array = (0.0, 0.0), points: int = 25
    ) -> Float[Array, "*rows points 3"]:
        """Points along one segment at a place of its section [m]; the centre line by default [m].

        Args:
            segment: index of the segment from the base.
            place: position in the segment's own axes, such as `actuator.spring_places[k]` [m].
            points: number of points, ends included.
        """
        place = rotate_in_section(jnp.asarray(place, dtype=float), self.angles[..., segment, None])
        arc = side_points(
            self.bends[..., segment, None, :],
            self.lengths[..., segment, None],
            jnp.broadcast_to(place, (*place.shape[:-2], points, 2)),
            jnp.linspace(0.0, 1.0, points),
        )
        return transform(self.frames[..., segment, None, :, :], arc)

    @stored_jit()
    def polyline(self, points: int = 25) -> Float[Array, "*rows m 3"]:
        """The centre line from base to tip, `points` on every segment and straight between them [m]."""
        share = jnp.linspace(0.0, 1.0, points)
        arcs = arc_points(self.bends[..., None, :], self.lengths[..., None], share)
        lines = transform(self.frames[..., :-1, None, :, :], arcs)  # all segments at once: compiles faster
        lines = lines.reshape(*lines.shape[:-3], -1, 3)
        return jnp.concatenate([lines, self.end_pose[..., None, :3, 3]], axis=-2)

    def clearance(self) -> Clearance:
        """Free space between parts of the chain; see `serial_chain.clearance.chain_clearance`."""
        pieces = Pieces(self.bends, self.lengths, self.connectors, self.radii, self.frames[..., :-1, :, :])
        find = chain_clearance
        for _ in range(self.lengths.ndim - 1):
            find = jax.vmap(find)
        return find(pieces)


@stored_jit(ChainShape)
def place_segments(
    bends: Float[Array, "*rows n 2"],
    lengths: Float[Array, "*rows n"],
    angles: Float[Array, "n"],
    connectors: Float[Array, "n"],
    radii: Float[Array, "n"],
) -> ChainShape:
    """Shape of segments in series.

    Args:
        bends: bend angle vector of each segment in its own axes [rad]; may have leading axes of rows.
        lengths: lengths of the segments' centre lines [m].
        angles: mounting angle of each segment about z, against the base [rad].
        connectors: length of the rigid connector after each segment [m], also after the last.
        radii: radii of the tubes about their centre lines [m].
    """
    angles, connectors, radii = (jnp.broadcast_to(x, lengths.shape) for x in (angles, connectors, radii))
    bends = rotate_in_section(bends, angles)
    steps = compose(arc_frame(bends, lengths), shift_along(connectors))
    base = jnp.broadcast_to(jnp.eye(4), (*lengths.shape[:-1], 1, 4, 4))
    after = jax.lax.associative_scan(
        jnp.matmul, steps, axis=lengths.ndim - 1
    )  # a loop would compile for longer
    return ChainShape(bends, lengths, connectors, radii, angles, jnp.concatenate([base, after], axis=-3))
