"""How what cycles leave behind comes to its end."""

import jax.numpy as jnp
from jaxtyping import Array

LEAST = 1e-4
"""Slowness times x below which a series stands for the logarithm; off by less than its square."""


def settled(x: Array, slowness: Array) -> Array:
    """Share of what many cycles leave that is there after `x` >= 0 times their scale, 0 to 1.

    `1 - (1 + slowness x)^(-1 / slowness)`: exponential (1 - exp(-x), Lagoudas and Entchev 2004) where
    `slowness` [1], 0 or more, is 0, hyperbolic (x / (1 + x)) at 1, towards a power law beyond. It is what a
    rate gives that falls as the power 1 + slowness of what is still to come. Any shape; differentiable, at 0
    too.
    """
    near = slowness * jnp.maximum(x, 1.0) < LEAST
    safe = jnp.where(near, 1.0, slowness)
    stretched = jnp.where(near, x - 0.5 * slowness * x**2, jnp.log1p(safe * x) / safe)
    return -jnp.expm1(-stretched)
