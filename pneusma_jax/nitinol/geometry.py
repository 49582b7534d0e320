"""Geometry of a close-wound helical spring: Section 2.2 of the source, Eqs. 2.1 to 2.19.

All lengths in metres, strains dimensionless, angles in radians, forces in newtons, stresses in pascals. The
spring strain `eps` is elongation over free length; the shear strain `gamma` is that of the wire's surface.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._numerics import is_concrete

POISSON_RATIO = 0.33  # of nitinol, used throughout the source


def spring_index(coil_diameter: Array, wire_diameter: Array) -> Array:
    """Spring index C = D / d [1]."""
    return coil_diameter / wire_diameter


def wahl_factor(index: Array) -> Array:
    """Wahl's correction of the wire's shear stress for curvature, Eq. 2.7 [1]."""
    return (4.0 * index - 1.0) / (4.0 * index - 4.0) + 0.615 / index


def coil_slope(pitch: Array, coil_diameter: Array, helix: str = "printed") -> Array:
    """Rise of the coils over their run, the tangent of their inclination [1].

    Args:
        pitch: rise per coil [m].
        coil_diameter: mean coil diameter D [m].
        helix: `"printed"` for `p / 2D` (Eq. 2.10), in which every published constant was identified;
            `"true"` for the helix `p / pi D`, which Eq. 2.1 implies, for new alloys (correction 6).

    Raises:
        ValueError: if `helix` is neither.
    """
    if helix not in HELIX_FACTOR:
        raise ValueError(f"Argument `helix` must be one of {sorted(HELIX_FACTOR)}, but it is {helix!r}.")
    return pitch / (HELIX_FACTOR[helix] * coil_diameter)


HELIX_FACTOR = {"printed": 2.0, "true": jnp.pi}


def shear_strain(
    spring_strain: Array,
    initial_pitch: Array,
    coil_diameter: Array,
    wire_diameter: Array,
    poisson_ratio: Array = POISSON_RATIO,
    helix: str = "printed",
) -> Array:
    """Shear strain of the wire from the strain of the spring, Eqs. 2.13 to 2.17 [1].

    Args:
        spring_strain: elongation over free length [1], any shape.
        initial_pitch: pitch of the unloaded spring [m].
        coil_diameter: mean coil diameter [m].
        wire_diameter: wire diameter [m].
        poisson_ratio: of the wire [1].
        helix: see `coil_slope`.
    """
    initial = coil_slope(initial_pitch, coil_diameter, helix)
    slope = coil_slope(initial_pitch * (1.0 + spring_strain), coil_diameter, helix)
    # sin a = s / sqrt(1 + s^2) and cos^2 a = 1 / (1 + s^2): sines and arc tangents take processors long
    closed, opened = 1.0 + initial**2, 1.0 + slope**2
    opening = (slope / jnp.sqrt(opened) - initial / jnp.sqrt(closed)) / closed
    index = spring_index(coil_diameter, wire_diameter)
    return opening * opened**2 / (index * (1.0 + slope**2 / (1.0 + poisson_ratio)))


def spring_force(shear_stress: Array, coil_diameter: Array, wire_diameter: Array) -> Array:
    """Pull of the spring from the wire's shear stress, Eq. 2.9 [N]."""
    index = spring_index(coil_diameter, wire_diameter)
    return jnp.pi * wire_diameter**2 * shear_stress / (8.0 * index * wahl_factor(index))


def shear_stress_of_force(force: Array, coil_diameter: Array, wire_diameter: Array) -> Array:
    """Shear stress of the wire from the spring's pull, Eq. 2.8 [Pa]."""
    index = spring_index(coil_diameter, wire_diameter)
    return 8.0 * index * wahl_factor(index) * force / (jnp.pi * wire_diameter**2)


def wire_length(active_coils: Array, coil_diameter: Array, initial_pitch: Array) -> Array:
    """Length of the wire that is measured electrically, Eqs. 2.1 and 2.2 [m]."""
    return active_coils * jnp.sqrt((jnp.pi * coil_diameter) ** 2 + initial_pitch**2)


class SpringGeometry(eqx.Module):
    """Dimensions of one spring, in metres and coils.

    Attributes:
        wire_diameter, mandrel_diameter, initial_pitch: as wound [m]; the mean coil diameter is mandrel +
            wire.
        active_coils: coils that stretch and carry current [1].
        free_length: length of the unloaded spring, the denominator of the spring strain [m].
        helix: static; see `coil_slope`.
    """

    wire_diameter: Array = eqx.field(converter=jnp.asarray)
    mandrel_diameter: Array = eqx.field(converter=jnp.asarray)
    initial_pitch: Array = eqx.field(converter=jnp.asarray)
    active_coils: Array = eqx.field(converter=jnp.asarray)
    free_length: Array = eqx.field(converter=jnp.asarray)
    helix: str = eqx.field(static=True, default="printed")

    def __check_init__(self) -> None:
        for name in ("wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length"):
            value = getattr(self, name)
            if is_concrete(value) and not np.all(np.asarray(value) > 0.0):
                raise ValueError(f"Argument `{name}` must be positive, but it is {value}.")

    @property
    def coil_diameter(self) -> Array:
        """Mean coil diameter D = D_mandrel + d [m]."""
        return self.mandrel_diameter + self.wire_diameter

    @property
    def wire_length(self) -> Array:
        """Length of active wire [m], Eq. 2.2."""
        return wire_length(self.active_coils, self.coil_diameter, self.initial_pitch)

    def shear_strain(self, elongation: Array, poisson_ratio: Array = POISSON_RATIO) -> Array:
        """Shear strain of the wire at an elongation from the free length [m], Eq. 2.17."""
        return shear_strain(
            elongation / self.free_length,
            self.initial_pitch,
            self.coil_diameter,
            self.wire_diameter,
            poisson_ratio,
            self.helix,
        )

    def force(self, stress: Array) -> Array:
        """Pull of the spring [N] from the shear stress [Pa], Eq. 2.9."""
        return spring_force(stress, self.coil_diameter, self.wire_diameter)
