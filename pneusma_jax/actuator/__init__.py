"""Actuators as data: a section, a silicone law, springs and fibres placed on the section.

A new arrangement is a new list of places, not new code. The configuration is the elongation `delta_c` of the
centre line and the bend angle vector `theta`. The elongation at a place r of the section is `delta(r) =
delta_c + theta . r` (Eq. 3.26 for any direction).
"""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..nitinol import Alloy, Spring, SpringGeometry, SpringState
from ..numerics.safe import as_array, evaluated, is_concrete
from ..section import Section, annulus
from ..section.placement import Layout, check_places, place_on, unit_vectors
from ..silicone import SiliconeLaw
from .loads import Load


class Geometry(eqx.Module):
    """Dimensions of an actuator in SI; the keys of a recording's `[geometry]` table.

    Attributes:
        outer_diameter, wall_thickness: dimensions of a round tube [m]; `build_actuator` does without them.
        length: length of the tube at rest [m].
        wire_diameter, mandrel_diameter, initial_pitch: dimensions of the springs [m]; active_coils: their
            number of coils [1].
        free_length: length of an unstretched spring [m]; attached_length: its length on the actuator at rest
            [m].
        prestrain: shear strain that the springs saw before they were attached [1].
        fibre_stiffness: stiffness of a strain-limiting fibre that is not taken as inextensible [N/m].
    """

    outer_diameter: Array = eqx.field(converter=as_array, default=10e-3)
    wall_thickness: Array = eqx.field(converter=as_array, default=1e-3)
    length: Array = eqx.field(converter=as_array, default=56e-3)
    wire_diameter: Array = eqx.field(converter=as_array, default=0.25e-3)
    mandrel_diameter: Array = eqx.field(converter=as_array, default=0.9e-3)
    initial_pitch: Array = eqx.field(converter=as_array, default=0.269e-3)
    active_coils: Array = eqx.field(converter=as_array, default=52.0)
    free_length: Array = eqx.field(converter=as_array, default=14e-3)
    attached_length: Array = eqx.field(converter=as_array, default=56e-3)
    prestrain: Array = eqx.field(converter=as_array, default=0.1924)
    fibre_stiffness: Array = eqx.field(converter=as_array, default=1e6)


class Actuator(eqx.Module):
    """One segment of uniform bending.

    Attributes:
        section: wall and bore.
        silicone: axial law of the wall.
        length: length at rest [m].
        springs: the nitinol springs, in the order of `spring_numbers`.
        spring_places: places of the section at which the springs pull [m], shape (springs, 2).
        fibre_place: place of a strain-limiting fibre [m], shape (2,), or None.
        fibre_stiffness: stiffness of the fibre [N/m], or None for an inextensible one.
        spring_numbers: static; how recordings number the springs.
        bending_plane: static; direction of side 1 in the plane of bending, from the x axis [deg]. None: the
            actuator can bend in any direction.
        loads: weight and forces from outside.
        prestrain: shear strain that the springs saw before they were attached [1].
    """

    section: Section
    silicone: SiliconeLaw
    length: Array
    springs: tuple[Spring, ...]
    spring_places: Float[Array, "springs 2"]
    fibre_place: Float[Array, "2"] | None
    fibre_stiffness: Array | None
    spring_numbers: tuple[int, ...] = eqx.field(static=True)
    bending_plane: float | None = eqx.field(static=True, default=90.0)
    loads: tuple[Load, ...] = ()
    prestrain: Array = eqx.field(converter=as_array, default=0.1924)

    @property
    def planar(self) -> bool:
        """True if bending is held in a plane."""
        return self.bending_plane is not None

    @property
    def freedoms(self) -> int:
        """Number of free directions: stretch unless a fibre ties it to the bend, and one or two bends."""
        tied = self.fibre_place is not None and self.fibre_stiffness is None
        return (not tied) + (1 if self.planar else 2)

    @property
    def side_direction(self) -> Float[np.ndarray, "2"]:
        """Unit vector from the centre towards side 1: in the bending plane, else along y."""
        return unit_vectors((90.0 if self.bending_plane is None else self.bending_plane,))[0]

    @property
    def basis(self) -> Float[Array, "3 freedoms"]:
        """Columns: the free directions of the scaled configuration (delta_c / L0, theta R / L0).

        A planar actuator cannot bend out of its plane; an inextensible fibre at place r ties
        `delta_c = -theta . r`.
        """
        bends = jnp.asarray(self.side_direction[:, None]) if self.planar else jnp.eye(2)
        if self.fibre_place is not None and self.fibre_stiffness is None:
            tied = -(self.fibre_place / self.section.radius) @ bends
            return jnp.concatenate([tied[None, :], bends])
        free = jnp.zeros((3, 1)).at[0, 0].set(1.0)
        return jnp.concatenate([free, jnp.concatenate([jnp.zeros((1, bends.shape[1])), bends])], axis=1)

    def fibres(self) -> tuple[Array, Array]:
        """Fixed fibres of the wall that effects follow: places [m], shape (fibres, 2), and areas [m2]."""
        return self.section.fibres(self.side_direction if self.planar else None)

    def fresh_states(self) -> tuple[SpringState, ...]:
        """Memory of newly attached springs, one per spring: stretched cold to the pre-strain."""
        return tuple(SpringState.fresh(self.prestrain) for _ in self.springs)

    def with_loads(self, *loads: Load) -> "Actuator":
        """The same actuator under other loads; under none if no load is given."""
        return dataclasses.replace(self, loads=loads)


def build_actuator(
    section: Section,
    arrangement: Layout,
    geometry: Geometry,
    alloy: Alloy | None,
    silicone: SiliconeLaw,
    inextensible: bool = True,
) -> Actuator:
    """Actuator with any section; differentiable in every number of its arguments.

    Args:
        section: wall and bore.
        arrangement: places of springs and fibre; see `actuator.designs.layout`.
        geometry: lengths and the springs' dimensions; its outer diameter and wall are not used.
        alloy: the alloy of every spring; None is allowed if there are no springs.
        silicone: law of the wall.
        inextensible: take a strain-limiting fibre as exactly inextensible (the limit of Eq. 3.39), not as a
            spring of `geometry.fibre_stiffness`.

    Raises:
        ValueError: if springs are wanted without an alloy, overlap, or lie away from the wall; for dimensions
            that cannot be, see `_check_dimensions`.
    """
    if arrangement.spring_angles and alloy is None:
        raise ValueError("Argument `alloy` must be given for a design with springs, but it is None.")
    dimensions = SpringGeometry(
        geometry.wire_diameter,
        geometry.mandrel_diameter,
        geometry.initial_pitch,
        geometry.active_coils,
        geometry.free_length,
    )
    spring = None if alloy is None else Spring(dimensions, alloy, geometry.attached_length)
    stiff = inextensible or (arrangement.fibre_angle is None and arrangement.fibre_place is None)
    _check_dimensions(geometry, dimensions if arrangement.spring_angles else None, not stiff)
    spring_places, fibre_place = place_on(section, arrangement)
    check_places(section, arrangement, spring_places, fibre_place, dimensions)
    return Actuator(
        section=section,
        silicone=silicone,
        length=jnp.asarray(geometry.length),
        springs=tuple(spring for _ in arrangement.spring_angles),  # type: ignore[misc]
        spring_places=spring_places,
        fibre_place=fibre_place,
        fibre_stiffness=None if inextensible or fibre_place is None else geometry.fibre_stiffness,
        spring_numbers=arrangement.spring_numbers,
        bending_plane=arrangement.bending_plane,
        prestrain=jnp.asarray(geometry.prestrain),
    )


SLACK = 0.02
"""Part of the free length by which the attached length may be smaller [1]; priors of lengths are so wide."""


def _check_dimensions(geometry: Geometry, spring: SpringGeometry | None, fibre: bool) -> None:
    """Refuse dimensions that cannot be, where their numbers are known.

    Args:
        geometry: dimensions of the actuator.
        spring: dimensions of its springs, None where there is none.
        fibre: true if a fibre stretches.

    Raises:
        ValueError: naming the dimension, what it is and what it must be.
    """
    positive = ["length", *["attached_length"] * (spring is not None), *["fibre_stiffness"] * fibre]
    for name in positive:
        value = getattr(geometry, name)
        if is_concrete(value) and not np.all((np.asarray(value) > 0.0) & np.isfinite(np.asarray(value))):
            raise ValueError(f"Argument `{name}` must be positive, but it is {value}.")
    if spring is None or not is_concrete((geometry, spring)):
        return
    if not np.all(np.asarray(geometry.prestrain) >= 0.0):
        raise ValueError(f"Argument `prestrain` must not be negative, but it is {geometry.prestrain}.")
    with evaluated():  # known dimensions, perhaps in a traced function
        wire = np.asarray(spring.wire_length)
    attached, free = np.asarray(geometry.attached_length), np.asarray(spring.free_length)
    if np.any(attached < free * (1.0 - SLACK)):
        raise ValueError(
            f"Argument `attached_length` must be at least the free length of the spring, "
            f"{np.max(free) * 1e3:.4g} mm, but it is {np.min(attached) * 1e3:.4g} mm."
        )
    if np.any(attached >= wire):
        raise ValueError(
            f"Argument `attached_length` must be below the {np.min(wire) * 1e3:.4g} mm of wire "
            f"in the coils, but it is {np.max(attached) * 1e3:.4g} mm."
        )


def round_actuator(
    arrangement: Layout,
    geometry: Geometry,
    alloy: Alloy | None,
    silicone: SiliconeLaw,
    inextensible: bool = True,
) -> Actuator:
    """`build_actuator` with a round tube of the geometry's outer diameter and wall thickness.

    Raises:
        ValueError: as `build_actuator`, and for an impossible tube.
    """
    section = annulus(geometry.outer_diameter, geometry.wall_thickness)
    return build_actuator(section, arrangement, geometry, alloy, silicone, inextensible)
