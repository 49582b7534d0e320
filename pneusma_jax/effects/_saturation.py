"""Saturation of the permanent changes by cycles."""

import jax.numpy as jnp
from jaxtyping import Array

LEAST = 1e-4
"""Maximum slowness times x for which a series replaces the logarithm; its error is less than their square."""


def saturation(x: Array, slowness: Array) -> Array:
    """Share of the final permanent change after `x` >= 0 times the scale of cycles, 0 to 1.

    It is `1 - (1 + slowness x)^(-1 / slowness)`. At `slowness` [1] 0 this is exponential (1 - exp(-x),
    Lagoudas and Entchev 2004), at 1 hyperbolic (x / (1 + x)). Beyond 1 it tends to a power law. The rate of
    change is proportional to the power 1 + slowness of the remaining change. Any shape; differentiable, at 0
    too.
    """
    near = slowness * jnp.maximum(x, 1.0) < LEAST
    safe = jnp.where(near, 1.0, slowness)
    stretched = jnp.where(near, x - 0.5 * slowness * x**2, jnp.log1p(safe * x) / safe)
    return -jnp.expm1(-stretched)
