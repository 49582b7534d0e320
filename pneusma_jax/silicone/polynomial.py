"""Polynomial fits of engineering stress over engineering strain: Table 3.1."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.safe import as_array, namespace_of


def polynomial_stress(strain: Array, coefficients: Array) -> Array:
    """`p_1 eps^n + ... + p_n eps + p_(n+1)` by Horner's rule [Pa].

    Args:
        strain: engineering strain [1], any shape.
        coefficients: coefficients, highest power first, as in Table 3.1 [Pa], shape (n + 1,).
    """
    return namespace_of(strain, coefficients).polyval(coefficients, strain)


def polynomial_slope(strain: Array, coefficients: Array) -> Array:
    """Derivative of `polynomial_stress` over strain [Pa]."""
    xp = namespace_of(strain, coefficients)
    return xp.polyval(xp.polyder(coefficients), strain)


class PolynomialFit(eqx.Module):
    """One row of Table 3.1: a mechanical test of the silicone, as fitted.

    Attributes:
        coefficients: coefficients, highest power first [Pa].
        strain_min, strain_max: range of strains of the test [1].
    """

    coefficients: Array = eqx.field(converter=as_array)
    strain_min: Array = eqx.field(converter=as_array)
    strain_max: Array = eqx.field(converter=as_array)

    def __call__(self, strain: Array) -> Array:
        """Engineering stress [Pa] at an engineering strain [1]; not continued past the test's range."""
        return polynomial_stress(strain, self.coefficients)

    @property
    def cuts(self) -> Array:
        """Strains where the law is not smooth: none."""
        return jnp.zeros(0)

    @property
    def tested(self) -> tuple[Array, Array]:
        """Ends of the test's strains."""
        return self.strain_min, self.strain_max
