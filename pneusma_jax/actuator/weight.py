"""Weight of an actuator or a chain from its own dimensions and densities."""


import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics.safe import as_numpy, is_concrete
from . import Actuator
from .loads import Gravity


def mass_of(actuator: Actuator, silicone_density: Array) -> tuple[Array, Float[Array, "2"]]:
    """Mass of tube and springs [kg], and its centre in the section [m], shape (2,).

    Fibre wrapping, leads and the springs' inactive ends are not counted; an end cap is a tip mass.

    Args:
        actuator: dimensions and alloys.
        silicone_density: density of the wall [kg/m3].
    """
    given = (actuator.section, actuator.springs, actuator.spring_places, actuator.length, silicone_density)
    section, springs, spring_places, length, density = as_numpy(given) if is_concrete(given) else given
    area, first, _ = section.moments()
    per_area = density * length
    wires = [
        spring.alloy.density * 0.25 * np.pi * spring.geometry.wire_diameter**2 * spring.geometry.wire_length
        for spring in springs
    ]
    mass = per_area * area + sum(wires)
    turning = per_area * first + sum(m * r for m, r in zip(wires, spring_places, strict=True))
    return mass, turning / mass


def weight(
    actuator: Actuator,
    silicone_density: Array,
    acceleration: Float[Array, "3"],
    tip_mass: Array = 0.0,
    tip_place: Float[Array, "2"] | None = None,
) -> Gravity:
    """Gravity on an actuator: `actuator.with_loads(weight(actuator, 1070.0, gravity_vector("horizontal")))`.

    Args:
        actuator: dimensions and alloys.
        silicone_density: density of the wall [kg/m3].
        acceleration: acceleration of gravity in the base frame [m/s2], shape (3,); see
            `actuator.loads.gravity_vector`.
        tip_mass: mass of the end cap and of its payload [kg].
        tip_place: centre of the tip mass in the section [m]; the bore's centroid if None.
    """
    mass, place = mass_of(actuator, silicone_density)
    tip_place = actuator.section.enclosed_centroid if tip_place is None else tip_place
    return Gravity(jnp.asarray(acceleration), mass, place, tip_mass, tip_place)




