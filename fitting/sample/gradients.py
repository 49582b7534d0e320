"""Gradients of log-densities, in the mode of differentiation that their programs allow."""

from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

IMPOSSIBLE = "Reverse-mode differentiation does not work"
"""First words of the error by which JAX refuses reverse differentiation of a loop of unknown length."""


def differentiation(density: Callable[..., Array], *arguments: Array) -> Literal["reverse", "forward"]:
    """Mode of differentiation that a density allows.

    Reverse differentiation costs a few evaluations in any number of dimensions, but is impossible for a
    program that iterates until convergence. There, forward derivatives are taken, one for each direction.

    Args:
        density: function `density(z, *arguments)` to a scalar.
        *arguments: examples of z and of the further arguments.

    Raises:
        ValueError: that of the density itself, such as an InputError.
    """
    try:
        jax.eval_shape(jax.grad(density), *arguments)
    except ValueError as error:
        if IMPOSSIBLE not in str(error):
            raise
        return "forward"
    return "reverse"


def with_gradient(density: Callable[..., Array], how: Literal["reverse", "forward"]) -> Callable[..., Array]:
    """A density with derivatives of both modes, whatever its own program allows.

    Its gradient by z is computed once, by `how`, for any number of directions. Derivatives by the further
    arguments are zero without a word: nothing may differentiate by them. A derivative that is not finite
    becomes zero. The step is then judged by the density alone, and refused.

    Args:
        density: function `density(z, *arguments)` to a scalar.
        how: mode of differentiation, see `differentiation`.
    """

    @jax.custom_jvp
    def safe(z: Array, *rest: PyTree) -> Array:
        return density(z, *rest)

    @safe.defjvp
    def along(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
        z, *rest = primals
        if how == "reverse":
            value, slope = jax.value_and_grad(density)(z, *rest)
        else:
            value, forward = jax.linearize(lambda p: density(p, *rest), z)
            slope = jax.vmap(forward)(jnp.eye(z.size, dtype=z.dtype))
        return value, jnp.sum(jnp.where(jnp.isfinite(slope), slope, 0.0) * tangents[0])

    return safe
