"""Coordinates for gradient-based samplers: without bounds, and whitened by the Gaussian approximation.

A coordinate u of a target that lies between two bounds becomes `u = lower + width * logistic(y)`; with one
bound, `u = lower + exp(y)` or `u = upper - exp(y)`; without bounds, `u = y`. Then `y = centre + root z`, with
the root of the approximation's covariance, so that z has about unit variance in every direction. The density
of z carries the Jacobian of the first map; the second is linear and changes the density by a constant only.
"""

from collections.abc import Callable
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from .laplace import Laplace, start_spread
from .target import Target

EDGE = 1e-3
"""Minimum distance of the centre from a bound, as a fraction of the distance of two bounds, or of the local
standard deviation beside one bound. It keeps the centre finite where the most probable point is on a bound."""
WIDEST = 1.0
"""Maximum standard deviation of a start along an unbounded coordinate. The logistic map has a standard
deviation of 1.8 for a flat density between its bounds; starts wider than this would fall onto its flat ends."""


class Unbounded(eqx.Module):
    """The maps between z, y and u.

    Attributes:
        lower, upper: (n,) bounds of the target's coordinates, infinite for none.
        centre: (n,) of y.
        root: (n, n) of y's covariance.
    """

    lower: Float[Array, " n"]
    upper: Float[Array, " n"]
    centre: Float[Array, " n"]
    root: Float[Array, "n n"]

    @classmethod
    def around(cls, target: Target, found: Laplace) -> "Unbounded":
        """The maps that whiten a target's Gaussian approximation."""
        lower, upper = np.asarray(target.lower), np.asarray(target.upper)
        spread = start_spread(target, found)
        sd = np.sqrt(np.sum(spread**2, axis=1))
        width = upper - lower
        gap = EDGE * np.where(np.isfinite(width), width, sd)
        mode = np.clip(found.mode, lower + gap, upper - gap)
        plain = cls(jnp.asarray(lower), jnp.asarray(upper), jnp.zeros(len(mode)), jnp.eye(len(mode)))
        centre = plain._from_bounded(jnp.asarray(mode))
        slope = np.asarray(jax.jvp(plain._to_bounded, (centre,), (jnp.ones(len(mode)),))[1])
        root = spread / slope[:, None]
        bounded = np.isfinite(lower) | np.isfinite(upper)
        long = np.sqrt(np.sum(root**2, axis=1))
        shrink = np.where(bounded & (long > WIDEST), WIDEST / np.where(long > 0.0, long, 1.0), 1.0)
        return cls(plain.lower, plain.upper, centre, jnp.asarray(root * shrink[:, None]))

    def coordinates(self, z: Float[Array, " n"]) -> Float[Array, " n"]:
        """Coordinates u of the target."""
        return self._to_bounded(self.centre + self.root @ z)

    def log_density(self, target: Target, z: Float[Array, " n"]) -> Float[Array, ""]:
        """Log-density of z up to a constant; -inf where the model has no answer."""
        found = target.log_probability(self.coordinates(z)) + self.log_slope(z)
        return jnp.where(jnp.isfinite(found), found, -jnp.inf)

    def log_slope(self, z: Float[Array, " n"]) -> Float[Array, ""]:
        """Logarithm of the Jacobian from y to u."""
        y = self.centre + self.root @ z
        slope = jnp.abs(jax.jvp(self._to_bounded, (y,), (jnp.ones_like(y),))[1])
        return jnp.sum(jnp.log(jnp.maximum(slope, jnp.finfo(slope.dtype).tiny)))

    def _to_bounded(self, y: Array) -> Array:
        low, high = jnp.isfinite(self.lower), jnp.isfinite(self.upper)
        start, end = jnp.where(low, self.lower, 0.0), jnp.where(high, self.upper, 0.0)
        both, growing = low & high, jnp.exp(jnp.where(low ^ high, y, 0.0))
        between = start + (end - start) * jax.nn.sigmoid(jnp.where(both, y, 0.0))
        return jnp.where(both, between, jnp.where(low, start + growing, jnp.where(high, end - growing, y)))

    def _from_bounded(self, u: Array) -> Array:
        low, high = jnp.isfinite(self.lower), jnp.isfinite(self.upper)
        start, end = jnp.where(low, self.lower, 0.0), jnp.where(high, self.upper, 0.0)
        both = low & high
        share = jnp.where(both, (u - start) / jnp.where(both, end - start, 1.0), 0.5)
        above = jnp.log(jnp.where(low & ~high, u - start, 1.0))
        below = jnp.log(jnp.where(high & ~low, end - u, 1.0))
        between = jnp.log(share) - jnp.log1p(-share)
        return jnp.where(both, between, jnp.where(low, above, jnp.where(high, below, u)))


def differentiation(density: Callable[..., Array], *arguments: Array) -> Literal["reverse", "forward"]:
    """How a density can be differentiated.

    Reverse differentiation costs a few evaluations in any number of dimensions, but a program that iterates
    until it has converged has none. Then the derivative is taken forwards, one direction beside the other.

    Args:
        density: `density(z, *arguments)` to a scalar.
        *arguments: examples of z and of what follows it.
    """
    try:
        jax.eval_shape(jax.grad(density), *arguments)
    except ValueError:  # "Reverse-mode differentiation does not work for lax.while_loop"
        return "forward"
    return "reverse"


def with_gradient(density: Callable[..., Array], how: Literal["reverse", "forward"]) -> Callable[..., Array]:
    """A density whose reverse derivative exists whatever its own program allows.

    A derivative that is not finite becomes zero: the step is judged by the density alone, and refused.

    Args:
        density: `density(z, *arguments)` to a scalar.
        how: see `differentiation`.
    """

    @jax.custom_vjp
    def safe(z: Array, *rest: PyTree) -> Array:
        return density(z, *rest)

    def forth(z: Array, *rest: PyTree) -> tuple[Array, tuple]:
        if how == "reverse":
            value, slope = jax.value_and_grad(density)(z, *rest)
        else:
            value, forward = jax.linearize(lambda p: density(p, *rest), z)
            slope = jax.vmap(forward)(jnp.eye(z.size, dtype=z.dtype))
        return value, (jnp.where(jnp.isfinite(slope), slope, 0.0), rest)

    def back(kept: tuple, cotangent: Array) -> tuple:
        slope, rest = kept
        return (cotangent * slope, *jax.tree.map(_no_tangent, rest))

    safe.defvjp(forth, back)
    return safe


def _no_tangent(leaf: Array) -> Array | np.ndarray:
    """The cotangent of what is not differentiated."""
    if jnp.issubdtype(leaf.dtype, jnp.inexact):
        return jnp.zeros_like(leaf)
    return np.zeros(leaf.shape, jax.dtypes.float0)
