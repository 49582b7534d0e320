"""Loads on a chain of segments in space, transmitted from segment to segment: weight, forces, moments.

Two rules hold for every load. A direction is given in the frame of the chain's base, unless the load follows
the section on which it acts. A place in a section is given in the segment's own axes, like the places of its
springs.

The balance of a segment needs the generalised force of all loads on its own coordinates. They are the length
l of its centre line and its bend angle vector theta. Seen from the segment's end, all loads there or beyond
it are a force F and a moment M. A small change of the coordinates moves the end by dp and turns it by dphi.
So the virtual work is `F . dp + M . dphi`. Seen from the segment's base,

    p = l (-theta c_2, c_1)
    dphi = J dphi_0,  phi_0 = theta x z,  J = 1 + c_2 [phi_0] + c_3 [phi_0]^2

with Stumpff's functions c_k of `theta . theta` (see `loads`) and `[a] b = a x b`. J is the left Jacobian of a
rotation. A load that is spread along the segment itself does work by the mean displacement of its fibre.
Forces and moments beyond each end are sums from the tip backwards, so the cost of the whole chain is
proportional to its segments.

A segment is an arc: along it the curvature is constant. A chain of ever shorter segments approaches a rod
that bends and stretches, without shear and twist. The error falls as the square of the segments' length.
"""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator.loads import Load, fibre_mean, generalised_along, generalised_at_end, stumpff
from .kinematics import rotate_in_section, rotation_vector, transform


class ChainLoad(eqx.Module):
    """The interface of a load on the segments of a chain."""

    @abc.abstractmethod
    def spread(self, rest_lengths: Float[Array, "n"]) -> tuple[Array, Array] | None:
        """Load that is spread evenly along segments, or None.

        Args:
            rest_lengths: rest lengths of the segments [m], shape (n,).

        Returns:
            Force on each segment [N], shape (n, 3), and the position of its fibre in the section [m], shape
            (n, 2).
        """

    @abc.abstractmethod
    def at_ends(self, rotations: Float[Array, "n 3 3"]) -> tuple[Array, Array] | None:
        """Load at the ends of segments, or None.

        Args:
            rotations: rotation matrices of the segments' own axes at their ends, relative to the chain's
                base, shape (n, 3, 3).

        Returns:
            Forces [N] and moments about the ends' centres [N m] in the frame of the base, both of shape (n,
            3).
        """

    def check(self, count: int) -> None:
        """Raise a ValueError if the load does not fit a chain of this number of segments."""


class ChainWeight(ChainLoad):
    """Weight of the segments, and of bodies at their ends; `serial_chain.weight.chain_weight` makes it from
    densities.

    Attributes:
        acceleration: acceleration of gravity [m/s2], shape (3,); see `actuator.loads.gravity_vector`.
        masses: mass of tube and springs of each segment, spread evenly [kg], shape (n,).
        places: centre of that mass in the section [m], shape (n, 2).
        end_masses: mass of the body at each segment's end, such as a connector or the end cap [kg], shape
            (n,).
        end_places: centre of that body from the middle of the end, z ahead of it [m], shape (n, 3).
    """

    acceleration: Float[Array, "3"] = eqx.field(converter=jnp.asarray)
    masses: Float[Array, "n"] = eqx.field(converter=jnp.asarray)
    places: Float[Array, "n 2"] = eqx.field(converter=jnp.asarray)
    end_masses: Float[Array, "n"] = eqx.field(converter=jnp.asarray)
    end_places: Float[Array, "n 3"] = eqx.field(converter=jnp.asarray)

    def spread(self, rest_lengths: Float[Array, "n"]) -> tuple[Array, Array]:
        """See `ChainLoad.spread`."""
        return self.masses[:, None] * self.acceleration, self.places

    def at_ends(self, rotations: Float[Array, "n 3 3"]) -> tuple[Array, Array]:
        """See `ChainLoad.at_ends`."""
        forces = self.end_masses[:, None] * self.acceleration
        return forces, _moment_of(forces, rotations, self.end_places)

    def check(self, count: int) -> None:
        """See `ChainLoad.check`."""
        for name, wanted in (
            ("acceleration", (3,)), ("masses", (count,)), ("places", (count, 2)),
            ("end_masses", (count,)), ("end_places", (count, 3)),
        ):  # fmt: skip
            _check_shape(f"`{name}` of a weight", getattr(self, name), wanted)


class PointLoad(ChainLoad):
    """A force and a moment at the end of one segment, by default at the tip.

    Attributes:
        force: force [N], shape (3,).
        moment: moment [N m], shape (3,).
        place: point of action of the force from the middle of the end, z ahead of it [m], shape (3,). A place
            in the section has shape (2,).
        segment: static; index of the segment from the base, -1 for the last.
        follows: static; false for a fixed direction, in the frame of the base. True for a force and a moment
            that turn with the end, in the segment's own axes.
    """

    force: Float[Array, "3"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0, 0.0))
    moment: Float[Array, "3"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0, 0.0))
    place: Array = eqx.field(converter=jnp.asarray, default=(0.0, 0.0, 0.0))
    segment: int = eqx.field(static=True, default=-1)
    follows: bool = eqx.field(static=True, default=False)

    def spread(self, rest_lengths: Float[Array, "n"]) -> None:
        """See `ChainLoad.spread`."""
        return None

    def at_ends(self, rotations: Float[Array, "n 3 3"]) -> tuple[Array, Array]:
        """See `ChainLoad.at_ends`."""
        rotation, force, moment = rotations[self.segment], self.force, self.moment
        if self.follows:
            force, moment = rotation @ force, rotation @ moment
        arm = rotation[:, : self.place.shape[0]] @ self.place
        none = jnp.zeros((rotations.shape[0], 3))
        return none.at[self.segment].set(force), none.at[self.segment].set(moment + _cross(arm, force))

    def check(self, count: int) -> None:
        """See `ChainLoad.check`."""
        for name in ("force", "moment"):
            _check_shape(f"`{name}` of a point load", getattr(self, name), (3,))
        if jnp.shape(self.place) not in ((2,), (3,)):
            _check_shape("`place` of a point load", self.place, (3,))
        if not -count <= self.segment < count:
            raise ValueError(
                f"Argument `segment` of a point load must be an index into {count} segments, "
                f"but it is {self.segment}."
            )


class LineLoad(ChainLoad):
    """A distributed force along the segments that keeps its direction and moves with the material, such as a
    field's.

    Attributes:
        per_length: force per length at rest, in the frame of the base [N/m], shape (3,) for all segments or
            (n, 3).
        place: position of its fibre in the section [m], shape (2,) or (n, 2).
    """

    per_length: Array = eqx.field(converter=jnp.asarray)
    place: Array = eqx.field(converter=jnp.asarray, default=(0.0, 0.0))

    def spread(self, rest_lengths: Float[Array, "n"]) -> tuple[Array, Array]:
        """See `ChainLoad.spread`."""
        count = rest_lengths.shape[0]
        return self.per_length * rest_lengths[:, None], jnp.broadcast_to(self.place, (count, 2))

    def at_ends(self, rotations: Float[Array, "n 3 3"]) -> None:
        """See `ChainLoad.at_ends`."""
        return None

    def check(self, count: int) -> None:
        """See `ChainLoad.check`."""
        for name, size in (("per_length", 3), ("place", 2)):
            if jnp.shape(getattr(self, name)) != (size,):
                _check_shape(f"`{name}` of a line load", getattr(self, name), (count, size))


class SegmentLoads(ChainLoad):
    """One load of every segment's own, from its `Actuator.loads`; zero for a segment that has fewer.

    Attributes:
        forces, places: force spread along each segment [N], shape (n, 3), and its position in the section
            [m].
        end_forces, end_places: force at each segment's end and its position, likewise.
    """

    forces: Float[Array, "n 3"]
    places: Float[Array, "n 2"]
    end_forces: Float[Array, "n 3"]
    end_places: Float[Array, "n 2"]

    def spread(self, rest_lengths: Float[Array, "n"]) -> tuple[Array, Array]:
        """See `ChainLoad.spread`."""
        return self.forces, self.places

    def at_ends(self, rotations: Float[Array, "n 3 3"]) -> tuple[Array, Array]:
        """See `ChainLoad.at_ends`."""
        return self.end_forces, _moment_of(self.end_forces, rotations, self.end_places)


def own_loads(loads: tuple[tuple[Load, ...], ...]) -> tuple[SegmentLoads, ...]:
    """Loads of single segments as loads of the chain that they make: first the first load of each, and so on.

    Args:
        loads: loads of each segment, with directions in the frame of the chain's base.

    Raises:
        ValueError: if one of them cannot be passed on from segment to segment.
    """
    of_chain = []
    nothing = (jnp.zeros(3), jnp.zeros(2), jnp.zeros(3), jnp.zeros(2))
    for k in range(max((len(own) for own in loads), default=0)):
        carried = [own[k].carried() if k < len(own) else nothing for own in loads]
        of_chain.append(SegmentLoads(*(jnp.stack(parts) for parts in zip(*carried, strict=True))))
    return tuple(of_chain)


def generalised_forces(
    loads: tuple[ChainLoad, ...],
    lengths: Float[Array, "n"],
    bends: Float[Array, "n 2"],
    angles: Float[Array, "n"],
    connectors: Float[Array, "n"],
    rest_lengths: Float[Array, "n"],
) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
    """Generalised forces of the loads on each segment's length and bend, summed from the tip to the base.

    Args:
        loads: loads on the chain.
        lengths: lengths of the segments' centre lines [m], shape (n,).
        bends: bend angle vector of each segment in its own axes [rad], shape (n, 2).
        angles: mounting angle of each segment about z, against the base [rad], shape (n,).
        connectors: length of the rigid connector after each segment [m], also after the last.
        rest_lengths: rest lengths of the segments [m], shape (n,).

    Returns:
        Pulls along the centre lines [N], shape (n,), and moments on the bend angle vectors in the segments'
        own axes [N m], shape (n, 2). They are the negative virtual work per change of length and of bend, as
        in `Load.generalised_force`.
    """
    bends = rotate_in_section(bends, angles)
    shared = jax.vmap(lambda bend: stumpff(bend @ bend))(bends)
    bases, ends = _placed(lengths, bends, connectors, shared)
    rotations = ends[:, :3, :3] @ jax.vmap(_own_axes)(angles)
    inwards = jnp.swapaxes(bases[:, :3, :3], 1, 2)
    pull, turn = jnp.zeros_like(lengths), jnp.zeros_like(bends)
    along = about = force = moment = jnp.zeros((lengths.shape[0], 3))  # `along`, `about`: spread loads
    for load in loads:
        spread, at_ends = load.spread(rest_lengths), load.at_ends(rotations)
        if spread is not None:
            forces, places = spread[0], rotate_in_section(spread[1], angles)
            local_forces = jnp.einsum("nij,nj->ni", inwards, forces)
            more = jax.vmap(generalised_along)(local_forces, lengths, bends, places, shared)
            pull, turn = pull + more[0], turn + more[1]
            middle = transform(bases, jax.vmap(fibre_mean)(lengths, bends, places, shared))
            along, about = along + forces, about + _cross(middle, forces)
        if at_ends is not None:
            force, moment = force + at_ends[0], moment + at_ends[1]
    place = ends[:, :3, 3]
    beyond = _from_tip(force + along) - along
    turned = _from_tip(moment + _cross(place, force) + about) - about - _cross(place, beyond)
    seen_force, seen_moment = (jnp.einsum("nij,nj->ni", inwards, x) for x in (beyond, turned))
    by_force = jax.vmap(generalised_at_end)(seen_force, lengths, bends, jnp.zeros_like(bends), shared)
    turn = turn + by_force[1] + jax.vmap(_generalised_moment)(seen_moment, bends, shared)
    return pull + by_force[0], rotate_in_section(turn, -angles)


def _placed(
    lengths: Array, bends: Array, connectors: Array, shared: tuple[Array, ...]
) -> tuple[Array, Array]:
    """Frames at the segments' bases and ends, shape (n, 4, 4): `kinematics` from shared Stumpff functions."""
    c_1, c_2, *_ = shared
    (x, y), zero, one = bends.T, jnp.zeros_like(lengths), jnp.ones_like(lengths)
    rows = [
        [1.0 - c_2 * x**2, -c_2 * x * y, -c_1 * x, -c_2 * x * lengths],
        [-c_2 * x * y, 1.0 - c_2 * y**2, -c_1 * y, -c_2 * y * lengths],
        [c_1 * x, c_1 * y, 1.0 - c_2 * (x**2 + y**2), c_1 * lengths],
        [zero, zero, zero, one],
    ]
    arcs = jnp.moveaxis(jnp.stack([jnp.stack(row) for row in rows]), -1, 0)

    def add(base: Array, segment: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        arc, connector = segment
        end = base @ arc
        return end.at[:3, 3].add(connector * end[:3, 2]), (base, end)

    return jax.lax.scan(add, jnp.eye(4) + 0.0 * arcs[0], (arcs, connectors))[1]


def _generalised_moment(moment: Array, bend: Array, shared: tuple[Array, ...]) -> Array:
    """Negative virtual work of a moment on a segment's end per change of bend [N m], seen from its base."""
    _, c_2, c_3, *_ = shared
    axis = rotation_vector(bend)
    across = _cross(axis, moment)
    work = moment - c_2 * across + c_3 * _cross(axis, across)  # the left Jacobian, transposed
    return jnp.stack([work[1], -work[0]])


_LEVI_CIVITA = np.array([[np.cross(np.eye(3)[i], np.eye(3)[j]) for j in range(3)] for i in range(3)])


def _cross(one: Array, other: Array) -> Array:
    """Cross product; as one contraction it compiles faster than `jnp.cross`."""
    return jnp.einsum("...i,...j,ijk->...k", one, other, _LEVI_CIVITA)


def _own_axes(angle: Array) -> Float[Array, "3 3"]:
    """Rotation about z by a mounting angle [rad]."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([jnp.stack([c, -s, zero]), jnp.stack([s, c, zero]), jnp.stack([zero, zero, one])])


def _moment_of(forces: Array, rotations: Array, places: Array) -> Array:
    """Moments about the ends' centres of forces at places of the own axes, shape (n, 2) or (n, 3)."""
    arms = jnp.einsum("nij,nj->ni", rotations[:, :, : places.shape[-1]], places)
    return _cross(arms, forces)


def _from_tip(values: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Sums from each segment to the last."""
    return jnp.cumsum(values[::-1], axis=0)[::-1]


def _check_shape(what: str, given: Array, wanted: tuple[int, ...]) -> None:
    """Raise a ValueError if an array has another shape than is wanted."""
    if jnp.shape(given) != wanted:
        raise ValueError(f"Argument {what} must have shape {wanted}, but it has {jnp.shape(given)}.")
