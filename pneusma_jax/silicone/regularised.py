"""The silicone law of the actuator: Table 3.1's tension and buckling fits, joined smoothly at zero strain.

Eqs. 3.22 to 3.25 switch from one polynomial to the other at zero strain, where the stress jumps from -0.37 to
+5.76 kPa. The source also uses the polynomials beyond the tested strains. Here each polynomial loses its
constant term and is continued linearly outside the tested strains. The two are blended over a narrow band
(correction 10).
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.safe import as_array, namespace_of, smoothstep
from .laws import SiliconeLaw
from .polynomial import polynomial_slope, polynomial_stress


def continued_polynomial(
    strain: Array, coefficients: Array, lower: Array, upper: Array, least_slope: Array
) -> Array:
    """Polynomial inside [lower, upper], a straight line of at least `least_slope` outside [Pa]."""
    xp = namespace_of(strain, coefficients, lower, upper, least_slope)
    inside = xp.clip(strain, lower, upper)
    end_slope = xp.where(
        strain > upper, polynomial_slope(upper, coefficients), polynomial_slope(lower, coefficients)
    )
    return polynomial_stress(inside, coefficients) + xp.maximum(end_slope, least_slope) * (strain - inside)


def regularised_stress(
    strain: Array,
    tension: Array,
    compression: Array,
    half_width: Array,
    lower: Array,
    upper: Array,
    least_slope: Array,
) -> Array:
    """Engineering stress, monotone and twice differentiable inside the tested strains [Pa].

    Args:
        strain: engineering strain [1], any shape.
        tension, compression: coefficients of Table 3.1, highest power first [Pa]. Their constant terms are
            dropped, so that there is no stress at zero strain.
        half_width: half-width of the blend around zero strain [1].
        lower, upper: strains beyond which the law is linear [1].
        least_slope: smallest slope of those lines [Pa].
    """
    def stress(coefficients: Array) -> Array:
        xp = namespace_of(coefficients)
        without_constant = xp.concatenate([coefficients[:-1], xp.zeros(1, coefficients.dtype)])
        return continued_polynomial(strain, without_constant, lower, upper, least_slope)

    weight = smoothstep((strain + half_width) / (2.0 * half_width))
    return weight * stress(tension) + (1.0 - weight) * stress(compression)


class RegularisedSilicone(SiliconeLaw):
    """Dragon Skin 10 FAST in a fibre-wrapped tube, as the source models it.

    Attributes: see `regularised_stress`; `stiffness` multiplies the stress [1] (batch, strain range).
    """

    tension: Array = eqx.field(converter=as_array)
    compression: Array = eqx.field(converter=as_array)
    half_width: Array = eqx.field(converter=as_array)
    lower: Array = eqx.field(converter=as_array)
    upper: Array = eqx.field(converter=as_array)
    least_slope: Array = eqx.field(converter=as_array)
    stiffness: Array = eqx.field(converter=as_array, default=1.0)

    def __call__(self, strain: Array) -> Array:
        """See `SiliconeLaw`."""
        return self.stiffness * regularised_stress(
            strain, self.tension, self.compression, self.half_width, self.lower, self.upper, self.least_slope
        )

    @property
    def cuts(self) -> Array:
        """See `SiliconeLaw`: ends of the blend and of the tested strains [1], shape (4,)."""
        return jnp.stack([self.lower, -self.half_width, self.half_width, self.upper])

    @property
    def tested(self) -> tuple[Array, Array]:
        """See `SiliconeLaw`."""
        return self.lower, self.upper
