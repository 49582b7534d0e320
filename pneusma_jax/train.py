"""A specimen in series with a load train that gives, and stiffens as it is loaded:
`recorded = true + compliance * F / (1 + stiffening * |F|)` with `F = force(true)`."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array

STEPS = 4  # of Newton, at most, before the differentiated one; the force is nearly linear over that length
CLOSE = 1e-9  # change of the true length at which they end, relative; the differentiated one squares it
LEAST_SLOPE = 0.05  # of the recorded over the true length: below, the train snaps and no root is stable


def strain_in_train(
    force: Callable[[Array], Array], recorded: Array, compliance: Array, stiffening: Array
) -> Array:
    """True length of a specimen from the recorded one, by Newton's method.

    Written for length and force; strain and stress will do, with the compliance in their units.

    Args:
        force: of the specimen at a true length [m] -> [N].
        recorded: length over specimen and train [m].
        compliance: of the unloaded train [m/N]; 0 gives the recorded length exactly.
        stiffening: one over the force at which the train gives half as much [1/N]; 0 for one that is linear.

    Returns:
        The true length [m]. Only the last step is differentiated, which gives the implicit function's
        derivative; so tangents stay out of the loop. A rigid train takes no other step.
    """
    train = compliance, stiffening, recorded
    fixed = jax.lax.stop_gradient(train)

    def improved(true: Array, compliance: Array, stiffening: Array, recorded: Array) -> Array:
        pull, stiffness = jax.jvp(force, (true,), (jnp.ones_like(true),))
        stiffer = 1.0 + stiffening * jnp.abs(pull)
        soft = jax.lax.stop_gradient(compliance / stiffer**2 * stiffness)
        slope = jnp.maximum(1.0 + soft, LEAST_SLOPE)
        return true - (true + compliance * pull / stiffer - recorded) / slope

    def again(carry: tuple) -> Array:
        _, change, count = carry
        return (change > CLOSE * jnp.abs(fixed[2])) & (count < STEPS)

    def advance(carry: tuple) -> tuple:
        true, _, count = carry
        better = jax.lax.stop_gradient(improved(true, *fixed))
        return better, jnp.abs(better - true), count + 1

    begun = jnp.where(fixed[0] == 0.0, 0.0, jnp.inf)  # a rigid train has the recorded length
    found, _, _ = jax.lax.while_loop(again, advance, (fixed[2], begun, 0))
    return improved(jax.lax.stop_gradient(found), *train)
