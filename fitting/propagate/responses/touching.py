"""Rows in which a body bends so far that it may touch itself, which the model does not know."""

import jax.numpy as jnp
from jaxtyping import Array

from pneusma_jax.serial_chain.shape import ChainShape

TOUCHING = "touching_deg"
"""Name under which an answer has the bend angle [deg] of a body that may touch itself, and 0 of any other. It
is no output, so that no expression can name it."""
POINTS = 17
"""Number of points on each segment's centre line: 3.5 mm apart on one of 56 mm. Overlaps of less than 0.3 mm
of a tube of 10 mm may be missed."""


def past(bend: Array, limit: float) -> Array:
    """Bend angles beyond a limit [deg], and 0 for others.

    Args:
        bend: bend angles [rad], of any shape and sign.
        limit: see `specimens.cautions.touching_angle`.
    """
    angle = jnp.rad2deg(jnp.abs(bend))
    return jnp.where(angle > limit, angle, 0.0)


def overlapping(shape: ChainShape) -> Array:
    """Bend angle of all segments of a chain together [deg] where its parts overlap, and 0 elsewhere.

    Distances are those between `POINTS` points of each centre line. `serial_chain.clearance` is exact, and
    took twenty times as long as the equilibria of a chain of two.
    """
    turns = jnp.linalg.norm(shape.bends, axis=-1)
    line = shape.polyline(POINTS)
    share = jnp.linspace(0.0, 1.0, POINTS)
    pieces = shape.lengths + shape.connectors
    before = (jnp.cumsum(pieces) - pieces)[:, None]
    along = jnp.append(jnp.ravel(before + shape.lengths[:, None] * share), jnp.sum(pieces))
    far = jnp.abs(along[:, None] - along) >= jnp.min(shape.lengths)
    apart = jnp.linalg.norm(line[:, None] - line, axis=-1)
    free = jnp.min(jnp.where(far, apart, jnp.inf)) - 2.0 * jnp.max(shape.radii)
    closed = jnp.any(turns >= 2.0 * jnp.pi)  # a full turn runs into itself, wherever its end may be
    return jnp.where(closed | (free < 0.0), jnp.rad2deg(shape.total_bend), 0.0)
