"""The hyperelastic laws as modules: numbers plus `__call__(strain) -> engineering stress`.

`cuts` lists the strains at which a law is not smooth; the quadrature of a section splits there.
The functions of `hyperelastic` hold the formulas and their sources.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.safe import as_array
from . import hyperelastic


class SiliconeLaw(eqx.Module):
    """Axial engineering stress [Pa] as a function of engineering strain [1]."""

    @abc.abstractmethod
    def __call__(self, strain: Array) -> Array:
        """Engineering stress [Pa] at an engineering strain [1], any shape."""

    @property
    def cuts(self) -> Array:
        """Strains where the law is not smooth, ascending, shape (n,); none unless overridden."""
        return jnp.zeros(0)

    @property
    def tested(self) -> tuple[Array, Array]:
        """Smallest and largest strain of the law's data [1], each of shape (); infinite unless overridden."""
        return -jnp.asarray(jnp.inf), jnp.asarray(jnp.inf)


class NeoHookean(SiliconeLaw):
    """`mu (lambda - 1/lambda^2)`; mu [Pa]."""

    mu: Array = eqx.field(converter=as_array)

    def __call__(self, strain: Array) -> Array:
        """See `SiliconeLaw`."""
        return hyperelastic.neo_hookean_stress(1.0 + strain, self.mu)


class Yeoh(SiliconeLaw):
    """Yeoh's third-order law; c_10, c_20, c_30 [Pa]."""

    c_10: Array = eqx.field(converter=as_array)
    c_20: Array = eqx.field(converter=as_array)
    c_30: Array = eqx.field(converter=as_array)

    def __call__(self, strain: Array) -> Array:
        """See `SiliconeLaw`."""
        return hyperelastic.yeoh_stress(1.0 + strain, self.c_10, self.c_20, self.c_30)


class Gent(SiliconeLaw):
    """Gent's law; mu [Pa], j_m [1]."""

    mu: Array = eqx.field(converter=as_array)
    j_m: Array = eqx.field(converter=as_array)

    def __call__(self, strain: Array) -> Array:
        """See `SiliconeLaw`."""
        return hyperelastic.gent_stress(1.0 + strain, self.mu, self.j_m)


class Ogden(SiliconeLaw):
    """Ogden's law; mu [Pa] and alpha [1] of each term, shape (terms,)."""

    mu: Array = eqx.field(converter=as_array)
    alpha: Array = eqx.field(converter=as_array)

    def __call__(self, strain: Array) -> Array:
        """See `SiliconeLaw`."""
        return hyperelastic.ogden_stress(1.0 + strain, self.mu, self.alpha)
