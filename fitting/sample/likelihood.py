"""Likelihoods of data, given a weighted residual, for noise of known or of unknown size."""

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

Residual = Callable[[dict[str, Array], PyTree], Array]


class KnownNoise(eqx.Module):
    """Independent Gaussian errors of known size.

    Serial correlation enters through the residual. Divided by sigma times the root of the correlation time,
    correlated errors count as often as independent ones would.

    Attributes:
        residual: function `residual(values, data)` in units of sigma, any shape.
    """

    residual: Residual

    def __call__(self, values: dict[str, Array], data: PyTree) -> Float[Array, ""]:
        """Log-likelihood up to a constant."""
        return -0.5 * jnp.sum(jnp.ravel(self.residual(values, data)) ** 2)


class UnknownNoise(eqx.Module):
    """Independent Gaussian errors whose common size is integrated out under the scale-free prior 1 / sigma.

    The integral of `sigma^-(N + 1) exp(-S / 2 sigma^2)` is proportional to `S^(-N/2)`, S the sum of squared
    residuals. This is Student's t, with the tails of an estimated noise (A. Gelman and others, Bayesian Data
    Analysis, 3rd ed., section 3.2). The same expression is the likelihood profiled over sigma.

    Attributes:
        residual: function `residual(values, data)`, right up to one common factor.
        observations: number of residuals that count as independent, N.
    """

    residual: Residual
    observations: Float[Array, ""]

    def __call__(self, values: dict[str, Array], data: PyTree) -> Float[Array, ""]:
        """Log-likelihood up to a constant."""
        return -0.5 * self.observations * jnp.log(jnp.sum(jnp.ravel(self.residual(values, data)) ** 2))


class GivenLikelihood(eqx.Module):
    """A user's log-likelihood.

    Attributes:
        function: function `function(values, data)` to a scalar; -inf for the impossible.
        residual: weighted residual whose sum of squares is nearly minus twice the function. It serves the
            most probable point and the Gaussian approximation. None takes those from the function's own
            derivatives.
    """

    function: Callable[[dict[str, Array], PyTree], Array]
    residual: Residual | None = None

    def __call__(self, values: dict[str, Array], data: PyTree) -> Float[Array, ""]:
        """Log-likelihood up to a constant."""
        return jnp.reshape(jnp.asarray(self.function(values, data)), ())
