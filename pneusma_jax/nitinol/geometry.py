"""Geometry of a close-wound helical spring: Section 2.2 of the source, Eqs. 2.1 to 2.19.

All lengths are in metres, strains dimensionless, angles in radians, forces in newtons, stresses in pascals.
The spring strain `eps` is elongation over free length; the shear strain `gamma` is that of the wire's
surface.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..late import optimistix as optx
from ..numerics.implicit_root import OneUnknown
from ..numerics.newton import BoundedNewton
from ..numerics.safe import as_array, as_numpy, is_concrete, namespace_of

POISSON_RATIO = 0.33  # Poisson's ratio of nitinol, used throughout the source
MOST_STEPS = 60
"""Maximum number of Newton steps in `spring_strain`; shear strains from -0.1 to 10 take 4 to 12."""


OVERLAP = 0.05
"""Part of the wire's diameter by which a pitch may be smaller [1]. The source sets both equal in one place
and measures 8 % more in another; the prior of its pitch ends 1 % below."""


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
        helix: slope convention: `"printed"` for `p / 2D` (Eq. 2.10), in which every published constant was
            identified; `"true"` for the helix `p / pi D`, which Eq. 2.1 implies, for new alloys (correction
            6).

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
        poisson_ratio: Poisson's ratio of the wire [1].
        helix: slope convention, see `coil_slope`.
    """
    initial = coil_slope(initial_pitch, coil_diameter, helix)
    slope = coil_slope(initial_pitch * (1.0 + spring_strain), coil_diameter, helix)
    return _sheared(slope, initial, spring_index(coil_diameter, wire_diameter), poisson_ratio)


def _sheared(slope: Array, initial: Array, index: Array, poisson_ratio: Array) -> Array:
    """Eq. 2.17 over the slopes of the coils, stretched and unloaded [1]."""
    # sin a = s / sqrt(1 + s^2) and cos^2 a = 1 / (1 + s^2): sines and arc tangents take processors long
    closed, opened = 1.0 + initial**2, 1.0 + slope**2
    xp = namespace_of(slope, initial, index, poisson_ratio)
    opening = (slope / xp.sqrt(opened) - initial / xp.sqrt(closed)) / closed
    return opening * opened**2 / (index * (1.0 + slope**2 / (1.0 + poisson_ratio)))


def spring_strain(
    gamma: Array,
    initial_pitch: Array,
    coil_diameter: Array,
    wire_diameter: Array,
    poisson_ratio: Array = POISSON_RATIO,
    helix: str = "printed",
) -> Array:
    """Strain of the spring from the shear strain of the wire: the inverse of Eq. 2.17 [1].

    The source does not state it. Eq. 2.17 is of the fourth degree in the coils' slope and rises with it. Its
    root is found by Newton's method on the slope, to rounding, and has derivatives of every order.

    Args:
        gamma: shear strain of the wire's surface [1], any shape; negative for a spring pushed together.
        initial_pitch, coil_diameter, wire_diameter, poisson_ratio, helix: dimensions and convention as for
            `shear_strain`. They may have any shapes that broadcast with `gamma`.

    Returns:
        Elongation over free length [1]; NaN where Newton's method finds no root, or an argument is not
        finite.

    Raises:
        ValueError: if `helix` is unknown.
    """
    initial = coil_slope(initial_pitch, coil_diameter, helix)
    index = spring_index(coil_diameter, wire_diameter)
    return jnp.vectorize(_slope_at)(gamma, initial, index, poisson_ratio) / initial - 1.0


def _slope_at(gamma: Array, initial: Array, index: Array, poisson_ratio: Array) -> Array:
    """Slope of the coils at one shear strain; NaN where Newton's method finds none."""
    given = (gamma, initial, index, poisson_ratio)

    def excess(slope: Array, given: tuple[Array, Array, Array, Array]) -> Array:
        gamma, *wire = given
        return _sheared(slope, *wire) - gamma

    begin = (initial + index * gamma)[None]
    found = optx.root_find(
        excess, BoundedNewton(longest=jnp.inf), begin, given, max_steps=MOST_STEPS, adjoint=OneUnknown(),
        throw=False,
    )  # fmt: skip
    off = jnp.abs(excess(found.value[0], given))
    return jnp.where(off <= 1e-9 * (1.0 + jnp.abs(gamma)), found.value[0], jnp.nan)


def coil_angle(
    spring_strain: Array, initial_pitch: Array, coil_diameter: Array, helix: str = "printed"
) -> Array:
    """Inclination of the coils from the strain of the spring, Eqs. 2.13 and 2.15 [rad].

    Args:
        spring_strain: elongation over free length [1]; 0 gives the initial angle.
        initial_pitch, coil_diameter: pitch and mean coil diameter of the unloaded spring [m].
        helix: slope convention, see `coil_slope`.

    Raises:
        ValueError: if `helix` is unknown.
    """
    return jnp.arctan(coil_slope(initial_pitch * (1.0 + spring_strain), coil_diameter, helix))


def elongation_of_angle(
    angle: Array, initial_angle: Array, active_coils: Array, coil_diameter: Array
) -> Array:
    """Elongation of the spring from the inclination of its coils, Eq. 2.3 [m].

    The wire keeps its length, and the coils become narrower as they rise. Eqs. 2.10 to 2.12, which the model
    follows, keep the coils' diameter instead. For the source's spring, Eq. 2.3 with the printed angle of
    `coil_angle` gives more elongation than Eq. 2.12. It is 1.55 times as much at small strain and 1.18 times
    at 575 %. With `helix="true"` it is 0.99 and 0.88 times (correction 6).

    Args:
        angle, initial_angle: inclination of the coils, stretched and unloaded [rad].
        active_coils: number of coils [1].
        coil_diameter: mean diameter of the unloaded coils [m].
    """
    rise = jnp.sin(angle) - jnp.sin(initial_angle)
    return jnp.pi * active_coils * coil_diameter * rise / jnp.cos(initial_angle)


def shear_strain_of_angle(
    angle: Array, initial_angle: Array, index: Array, poisson_ratio: Array = POISSON_RATIO
) -> Array:
    """Shear strain of the wire from the inclination of the coils, Eq. 2.6 [1].

    Args:
        angle, initial_angle: inclination of the coils, stretched and unloaded [rad].
        index: spring index C [1].
        poisson_ratio: Poisson's ratio of the wire [1].
    """
    cosine, sine = jnp.cos(angle), jnp.sin(angle)
    opening = jnp.cos(initial_angle) ** 2 * (sine - jnp.sin(initial_angle))
    return opening / (index * cosine**2 * (cosine**2 + sine**2 / (1.0 + poisson_ratio)))


def elastic_force(
    angle: Array,
    initial_angle: Array,
    shear_modulus: Array,
    coil_diameter: Array,
    wire_diameter: Array,
    poisson_ratio: Array = POISSON_RATIO,
) -> Array:
    """Pull of a spring whose wire stays elastic, from the inclination of its coils, Eq. 2.4 [N].

    Eq. 2.6 is this divided by the modulus and put through Eq. 2.5, so all three hold together. The model goes
    another way: Eq. 2.9 with Wahl's factor, and the stress of Eq. 2.33 in place of `G gamma`.

    Args:
        angle, initial_angle: inclination of the coils, stretched and unloaded [rad].
        shear_modulus: shear modulus of the wire [Pa].
        coil_diameter, wire_diameter: diameters of the unloaded spring [m].
        poisson_ratio: Poisson's ratio of the wire [1].
    """
    index = spring_index(coil_diameter, wire_diameter)
    gamma = shear_strain_of_angle(angle, initial_angle, index, poisson_ratio)
    return jnp.pi * wire_diameter**2 * shear_modulus * gamma / (8.0 * index)


def uncorrected_shear_stress(force: Array, coil_diameter: Array, wire_diameter: Array) -> Array:
    """Shear stress of the wire from the spring's pull by torsion alone, Eq. 2.5 [Pa].

    It neglects curvature of the wire and direct shear, for which `shear_stress_of_force` (Eq. 2.8) has Wahl's
    factor.

    Args:
        force: pull of the spring [N].
        coil_diameter, wire_diameter: diameters of the spring [m].
    """
    return 8.0 * spring_index(coil_diameter, wire_diameter) * force / (jnp.pi * wire_diameter**2)


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
    xp = namespace_of(active_coils, coil_diameter, initial_pitch)
    return active_coils * xp.sqrt((xp.pi * coil_diameter) ** 2 + initial_pitch**2)


class SpringGeometry(eqx.Module):
    """Dimensions of one spring, in metres and coils.

    Attributes:
        wire_diameter, mandrel_diameter, initial_pitch: dimensions as wound [m]; the mean coil diameter is
            mandrel + wire.
        active_coils: number of coils that stretch and carry current [1].
        free_length: length of the unloaded spring, the denominator of the spring strain [m].
        helix: static; slope convention, see `coil_slope`.
    """

    wire_diameter: Array = eqx.field(converter=as_array)
    mandrel_diameter: Array = eqx.field(converter=as_array)
    initial_pitch: Array = eqx.field(converter=as_array)
    active_coils: Array = eqx.field(converter=as_array)
    free_length: Array = eqx.field(converter=as_array)
    helix: str = eqx.field(static=True, default="printed")

    def __check_init__(self) -> None:
        for name in ("wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length"):
            value = getattr(self, name)
            if is_concrete(value) and not np.all(np.asarray(value) > 0.0):
                raise ValueError(f"Argument `{name}` must be positive, but it is {value}.")
        if is_concrete(self.initial_pitch, self.wire_diameter):
            pitch, wire = np.asarray(self.initial_pitch), np.asarray(self.wire_diameter)
            if np.any(pitch < wire * (1.0 - OVERLAP)):
                raise ValueError(
                    f"Argument `initial_pitch` must be at least the wire's diameter, "
                    f"{np.max(wire) * 1e3:.4g} mm, but it is {np.min(pitch) * 1e3:.4g} mm."
                )

    @property
    def coil_diameter(self) -> Array:
        """Mean coil diameter D = D_mandrel + d [m]."""
        own = as_numpy(self) if is_concrete(self) else self
        return own.mandrel_diameter + own.wire_diameter

    @property
    def wire_length(self) -> Array:
        """Length of active wire [m], Eq. 2.2."""
        own = as_numpy(self) if is_concrete(self) else self
        return wire_length(own.active_coils, own.coil_diameter, own.initial_pitch)

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

    def elongation(self, gamma: Array, poisson_ratio: Array = POISSON_RATIO) -> Array:
        """Elongation from the free length [m] at a shear strain of the wire; inverts `shear_strain`."""
        return self.free_length * spring_strain(
            gamma, self.initial_pitch, self.coil_diameter, self.wire_diameter, poisson_ratio, self.helix
        )

    def force(self, stress: Array) -> Array:
        """Pull of the spring [N] from the shear stress [Pa], Eq. 2.9."""
        return spring_force(stress, self.coil_diameter, self.wire_diameter)
