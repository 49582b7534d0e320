"""Weight and forces from outside, as potential energies of the bent shape.

Frame: that of `kinematics`. The base is clamped at the origin. The axis z points along the straight tube from
base to tip; x and y are the axes of the section. The tube tilts towards `-theta`, its shorter side, so that a
positive planar bend moves the tip towards side 2 (-y). Vectors of acceleration and force are given in this
frame.

Let l be the length of the centre line. The fibre through place c of the section is an arc of length
`l + theta . c` that starts at (c, 0). Let w be the square of the bend angle, and c_k Stumpff's functions,
`c_k(w) = sum_j (-w)^j / (k + 2 j)!`. For example c_1 = sin(phi) / phi. Then the fibre's end and its mean are

    end  = (c, 0) + (l + theta . c) (-theta c_2(w), c_1(w))
    mean = (c, 0) + (l + theta . c) (-theta c_3(w), c_2(w))

The c_k are analytic, so a load has exact derivatives of every order, at the straight tube too. The gradient
of the potential with respect to (l, theta) is the generalised force that `actuator.equilibrium.imbalance`
adds. This is virtual work on the constant-curvature shape. It is the best answer of that shape to a load
under which the true curvature varies.
"""

import abc
import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..calibration.keys import ORIENTATIONS
from ..errors import InputError, nearest

STANDARD_GRAVITY = 9.80665  # m/s2
_SERIES_TERMS = 9  # below 1 rad: the first one left out is 4e-23


def stumpff(w: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Stumpff's functions c_1 to c_5 of w >= 0, analytic at 0; by `c_k + w c_(k+2) = 1 / k!`."""
    small = w < 1.0
    near, far = jnp.where(small, w, 0.0), jnp.where(small, 1.0, w)
    n_4, n_5 = (_series(near, k) for k in (4, 5))
    n_3, n_2 = 1.0 / 6.0 - near * n_5, 0.5 - near * n_4
    angle = jnp.sqrt(far)
    f_1, f_2 = jnp.sin(angle) / angle, (1.0 - jnp.cos(angle)) / far
    f_3 = (1.0 - f_1) / far
    f_4, f_5 = (0.5 - f_2) / far, (1.0 / 6.0 - f_3) / far
    pairs = ((1.0 - near * n_3, f_1), (n_2, f_2), (n_3, f_3), (n_4, f_4), (n_5, f_5))
    return tuple(jnp.where(small, one, other) for one, other in pairs)  # type: ignore[return-value]


def _series(w: Array, k: int) -> Array:
    """c_k of w below 1 by its definition."""
    total = jnp.zeros_like(w)
    for j in reversed(range(_SERIES_TERMS)):
        total = total * -w + 1.0 / math.factorial(k + 2 * j)
    return total


class Load(eqx.Module):
    """Something that does work when the actuator moves."""

    @abc.abstractmethod
    def potential(self, length: Array, bend: Float[Array, "2"]) -> Array:
        """Potential energy [J] of a centre line of some length [m], bent by an angle vector [rad]."""

    @abc.abstractmethod
    def generalised_force(self, length: Array, bend: Float[Array, "2"]) -> tuple[Array, Array]:
        """Gradient of the potential: pull along the centre line [N] and moments [N m], shape (2,).

        Written out, because differentiating the potential twice takes long to compile.
        """

    def carried(self) -> tuple[Array, Array, Array, Array]:
        """Load of the segments before the loaded one.

        Returns:
            Force spread along the segment [N] and its place in the section [m], force at its end [N] and its
            place in that section [m]. Forces keep their direction.

        Raises:
            ValueError: if the load is of a kind that is known for one segment only.
        """
        raise ValueError(
            f"A segment of a chain must not carry a {type(self).__name__}: "
            "how it passes from segment to segment is not known. See `chain_loads` for loads that are "
            "passed on."
        )


class Gravity(Load):
    """Weight of the tube and of a body at its tip.

    Attributes:
        acceleration: acceleration of gravity in the base frame [m/s2], shape (3,); see `gravity_vector`.
        mass: spread evenly along the tube [kg].
        place: centre of that mass in the section [m], shape (2,).
        tip_mass: mass of the end cap and of its payload [kg].
        tip_place: centre of that mass in the section of the tip [m], shape (2,).
    """

    acceleration: Float[Array, "3"] = eqx.field(converter=jnp.asarray)
    mass: Array = eqx.field(converter=jnp.asarray)
    place: Float[Array, "2"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0))
    tip_mass: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tip_place: Float[Array, "2"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0))

    def potential(self, length: Array, bend: Float[Array, "2"]) -> Array:
        """See `Load.potential`."""
        centre, tip = fibre_mean(length, bend, self.place), fibre_end(length, bend, self.tip_place)
        return -self.acceleration @ (self.mass * centre + self.tip_mass * tip)

    def generalised_force(self, length: Array, bend: Float[Array, "2"]) -> tuple[Array, Array]:
        """See `Load.generalised_force`."""
        tube = generalised_along(self.mass * self.acceleration, length, bend, self.place)
        tip = generalised_at_end(self.tip_mass * self.acceleration, length, bend, self.tip_place)
        return tube[0] + tip[0], tube[1] + tip[1]

    def carried(self) -> tuple[Array, Array, Array, Array]:
        """See `Load.carried`."""
        return (
            self.mass * self.acceleration, self.place, self.tip_mass * self.acceleration, self.tip_place
        )  # fmt: skip


def centred_weight(
    acceleration: Float[Array, "3"], mass: Array, tip_mass: Array, length: Array, bend: Float[Array, "2"]
) -> tuple[Array, Array]:
    """`Gravity.generalised_force` of masses on the centre line, in one evaluation [N, N m].

    Args:
        acceleration: acceleration of gravity in the base frame [m/s2], shape (3,).
        mass: mass spread along the tube [kg]; tip_mass: mass at its tip [kg].
        length: length of the centre line [m].
        bend: bend angle vector [rad].
    """
    c_1, c_2, c_3, c_4, c_5 = stumpff(bend @ bend)
    middle = c_4 - 0.5 * c_3
    aside, ahead = mass * c_3 + tip_mass * c_2, mass * c_2 + tip_mass * c_1
    slopes = (
        mass * 0.5 * (3.0 * c_5 - c_4) + tip_mass * middle,
        mass * middle + tip_mass * 0.5 * (c_3 - c_2),
    )
    return _generalised_along_fibre(acceleration, length, bend, jnp.zeros(2), (aside, ahead), slopes)


class TipForce(Load):
    """A force on the tip that keeps its direction.

    Attributes:
        force: the force in the base frame [N], shape (3,).
        place: point of attack in the section of the tip [m], shape (2,).
    """

    force: Float[Array, "3"] = eqx.field(converter=jnp.asarray)
    place: Float[Array, "2"] = eqx.field(converter=jnp.asarray, default=(0.0, 0.0))

    def potential(self, length: Array, bend: Float[Array, "2"]) -> Array:
        """See `Load.potential`."""
        return -self.force @ fibre_end(length, bend, self.place)

    def generalised_force(self, length: Array, bend: Float[Array, "2"]) -> tuple[Array, Array]:
        """See `Load.generalised_force`."""
        return generalised_at_end(self.force, length, bend, self.place)

    def carried(self) -> tuple[Array, Array, Array, Array]:
        """See `Load.carried`."""
        return jnp.zeros(3), jnp.zeros(2), self.force, self.place


class HeldLoad(Load):
    """A generalised force that does not change with the shape, such as what a chain puts on one segment.

    Attributes:
        pull: along the centre line [N].
        turn: moments on the bend angle vector [N m], shape (2,).
    """

    pull: Array = eqx.field(converter=jnp.asarray)
    turn: Float[Array, "2"] = eqx.field(converter=jnp.asarray)

    def potential(self, length: Array, bend: Float[Array, "2"]) -> Array:
        """See `Load.potential`."""
        return self.pull * length + self.turn @ bend

    def generalised_force(self, length: Array, bend: Float[Array, "2"]) -> tuple[Array, Array]:
        """See `Load.generalised_force`."""
        return self.pull, self.turn


def fibre_end(length: Array, bend: Float[Array, "2"], place: Float[Array, "2"]) -> Float[Array, "3"]:
    """Tip of the fibre through a place of the section, in the base frame [m]."""
    c_1, c_2, *_ = stumpff(bend @ bend)
    return _along_fibre(length, bend, place, c_2, c_1)


def fibre_mean(
    length: Array, bend: Float[Array, "2"], place: Float[Array, "2"], shared: tuple[Array, ...] | None = None
) -> Float[Array, "3"]:
    """Mean place of the fibre through a place of the section, in the base frame [m].

    Args:
        length: length of the centre line [m].
        bend: bend angle vector [rad].
        place: place in the section [m], shape (2,).
        shared: `stumpff(bend @ bend)`, where it is known already.
    """
    _, c_2, c_3, *_ = stumpff(bend @ bend) if shared is None else shared
    return _along_fibre(length, bend, place, c_3, c_2)


def _along_fibre(length: Array, bend: Array, place: Array, aside: Array, ahead: Array) -> Array:
    own_length = length + bend @ place
    return jnp.concatenate([place - own_length * aside * bend, (own_length * ahead)[None]])


def generalised_at_end(
    force: Array, length: Array, bend: Array, place: Array, shared: tuple[Array, ...] | None = None
) -> tuple[Array, Array]:
    """Gradient of `-force @ fibre_end` over length [N] and bend [N m]; `shared` as of `fibre_mean`."""
    c_1, c_2, c_3, c_4, _ = stumpff(bend @ bend) if shared is None else shared
    slopes = (c_4 - 0.5 * c_3, 0.5 * (c_3 - c_2))  # of c_2 and c_1: c_k' = (k c_(k+2) - c_(k+1)) / 2
    return _generalised_along_fibre(force, length, bend, place, (c_2, c_1), slopes)


def generalised_along(
    force: Array, length: Array, bend: Array, place: Array, shared: tuple[Array, ...] | None = None
) -> tuple[Array, Array]:
    """Gradient of `-force @ fibre_mean` over length [N] and bend [N m]; `shared` as of `fibre_mean`."""
    _, c_2, c_3, c_4, c_5 = stumpff(bend @ bend) if shared is None else shared
    slopes = (0.5 * (3.0 * c_5 - c_4), c_4 - 0.5 * c_3)
    return _generalised_along_fibre(force, length, bend, place, (c_3, c_2), slopes)


def _generalised_along_fibre(
    force: Array, length: Array, bend: Array, place: Array, values: tuple, slopes: tuple
) -> tuple[Array, Array]:
    """Gradient over length [N] and bend [N m], from factors of the fibre's position and their slopes."""
    aside, ahead = force[:2], force[2]
    per_length = values[0] * (aside @ bend) - values[1] * ahead
    turned = values[0] * aside + 2.0 * bend * (slopes[0] * (aside @ bend) - slopes[1] * ahead)
    return per_length, place * per_length + (length + bend @ place) * turned


def gravity_vector(orientation: str, magnitude: Array = STANDARD_GRAVITY) -> Float[np.ndarray, "3"]:
    """Acceleration of gravity in the base frame [m/s2].

    Args:
        orientation: `"vertical_base_down"` (clamped below, tip up), `"vertical_base_up"` (hangs) or
            `"horizontal"` (side 1 uppermost).
        magnitude: [m/s2].

    Raises:
        InputError: for another word; names the nearest.
    """
    if orientation not in ORIENTATIONS:
        raise InputError(f"no orientation is called {orientation!r}, {nearest(orientation, ORIENTATIONS)}")
    return np.asarray(magnitude * np.asarray(ORIENTATIONS[orientation]))
