"""Shape of bent segments: forward kinematics of piecewise constant curvature, as 4 x 4 matrices of SE(3).

The base frame has z along the straight tube and x, y along the section's axes (side 1 at y = +R). A
cross-section stays plane and normal to the centre line, so the line through place r of the section is `p(s) +
R(s) r`. With `R' = R [u]x` its length over a segment of length L is `L + L (u x r) . z = L + L (u_x r_y - u_y
r_x)`. It has to be `L + theta . r` (Eq. 3.26), hence `L u = (theta_y, -theta_x, 0) = theta x z`. The section
turns about `theta x z`, so that z tilts towards `-theta`, the shorter side. A positive planar bend angle
(theta along +y, side 1 the longer) turns about +x. It bends towards side 2 at -y.

Everything is an analytic function of theta. Values and derivatives of all orders hold at the straight tube
too.
"""

import functools
import math

import jax.numpy as jnp
from jaxtyping import Array, Float

_SERIES_TERMS = 11  # Number of terms of sinc below 1 rad; the first omitted one is 1e-22


def sinc_root(x: Array) -> Array:
    """`sin(sqrt(x)) / sqrt(x)` for x >= 0, analytic at 0 [1].

    A function of the squared angle, because the angle itself, a norm, has no derivative at the straight tube.
    """
    small = x < 1.0
    y = jnp.where(small, x, 0.0)
    series = jnp.zeros_like(y)
    for k in reversed(range(_SERIES_TERMS)):
        series = series * y + (-1.0) ** k / math.factorial(2 * k + 1)
    angle = jnp.sqrt(jnp.where(small, 1.0, x))
    return jnp.where(small, series, jnp.sin(angle) / angle)


def rotation_vector(bend: Float[Array, "*n 2"]) -> Float[Array, "*n 3"]:
    """Rotation vector of a segment's end against its base, `theta x z` [rad]."""
    return jnp.stack([bend[..., 1], -bend[..., 0], jnp.zeros_like(bend[..., 0])], axis=-1)


def bend_rotation(bend: Float[Array, "*n 2"]) -> Float[Array, "*n 3 3"]:
    """Rotation matrix of a bend angle vector [rad], Rodrigues' formula for the axis `theta x z`."""
    x, y = bend[..., 0], bend[..., 1]
    square = x**2 + y**2
    turn = sinc_root(square)  # sin(phi) / phi
    tilt = 0.5 * sinc_root(0.25 * square) ** 2  # (1 - cos(phi)) / phi^2
    rows = [
        [1.0 - tilt * x**2, -tilt * x * y, -turn * x],
        [-tilt * x * y, 1.0 - tilt * y**2, -turn * y],
        [turn * x, turn * y, 1.0 - tilt * square],
    ]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def arc_points(
    bend: Float[Array, "*n 2"], length: Float[Array, "*n"], fraction: Float[Array, "*n"] = 1.0
) -> Float[Array, "*n 3"]:
    """Points of the centre line of a segment, in its base frame [m].

    Args:
        bend: bend angle vector of the whole segment [rad].
        length: length of its centre line [m].
        fraction: position along the segment, 0 at the base and 1 at the end. The arguments broadcast against
            each other.
    """
    length, fraction = jnp.asarray(length), jnp.asarray(fraction)
    part = bend * fraction[..., None]
    square = jnp.sum(part**2, axis=-1)
    run = length * fraction
    aside = -part * (0.5 * run * sinc_root(0.25 * square) ** 2)[..., None]
    return jnp.concatenate([aside, (run * sinc_root(square))[..., None]], axis=-1)


def arc_frame(
    bend: Float[Array, "*n 2"], length: Float[Array, "*n"], fraction: Float[Array, "*n"] = 1.0
) -> Float[Array, "*n 4 4"]:
    """Frame at a place along a segment, relative to the segment's base; arguments as for `arc_points`."""
    fraction = jnp.asarray(fraction)
    return make_frame(bend_rotation(bend * fraction[..., None]), arc_points(bend, length, fraction))


def side_points(
    bend: Float[Array, "*n 2"],
    length: Float[Array, "*n"],
    place: Float[Array, "*n 2"],
    fraction: Float[Array, "*n"] = 1.0,
) -> Float[Array, "*n 3"]:
    """Points of the line that runs at `place` of the section [m], in the segment's base frame [m].

    The line's arc length is `length + bend . place`: its rest length plus its elongation, Eq. 3.26.
    """
    flat = jnp.concatenate([place, jnp.zeros_like(place[..., :1])], axis=-1)
    return transform(arc_frame(bend, length, fraction), flat)


def make_frame(rotation: Float[Array, "*n 3 3"], position: Float[Array, "*n 3"]) -> Float[Array, "*n 4 4"]:
    """Homogeneous matrix of a rotation and a position [m]; leading axes broadcast."""
    lead = jnp.broadcast_shapes(rotation.shape[:-2], position.shape[:-1])
    above = jnp.concatenate(
        [jnp.broadcast_to(rotation, (*lead, 3, 3)), jnp.broadcast_to(position, (*lead, 3))[..., None]],
        axis=-1,
    )
    below = jnp.broadcast_to(jnp.asarray([0.0, 0.0, 0.0, 1.0]), (*lead, 1, 4))
    return jnp.concatenate([above, below], axis=-2)


def shift_along(distance: Float[Array, "*n"]) -> Float[Array, "*n 4 4"]:
    """Frame that lies ahead along z by a distance [m]."""
    distance = jnp.asarray(distance, dtype=float)
    zero = jnp.zeros_like(distance)
    return make_frame(jnp.eye(3), jnp.stack([zero, zero, distance], axis=-1))


def rotate_in_section(vector: Float[Array, "*n 2"], angle: Float[Array, "*n"]) -> Float[Array, "*n 2"]:
    """A vector of the section turned about z by an angle [rad]."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y = vector[..., 0], vector[..., 1]
    return jnp.stack([c * x - s * y, s * x + c * y], axis=-1)


def compose(*frames: Float[Array, "*n 4 4"]) -> Float[Array, "*n 4 4"]:
    """Frames one after the other, each given relative to the one before it."""
    return functools.reduce(jnp.matmul, frames)


def transform(frame: Float[Array, "*n 4 4"], points: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """Points given in a frame, seen from where the frame is given [m]; leading axes broadcast."""
    return jnp.einsum("...ij,...j->...i", frame[..., :3, :3], points) + frame[..., :3, 3]


def position(frame: Float[Array, "*n 4 4"]) -> Float[Array, "*n 3"]:
    """Origin of a frame [m]."""
    return frame[..., :3, 3]


def rotation(frame: Float[Array, "*n 4 4"]) -> Float[Array, "*n 3 3"]:
    """Rotation matrix of a frame: its columns are its axes."""
    return frame[..., :3, :3]


def tangent(frame: Float[Array, "*n 4 4"]) -> Float[Array, "*n 3"]:
    """Direction of the centre line in a frame, its z axis [1]."""
    return frame[..., :3, 2]
