"""A specimen in series with a load train that gives, and stiffens as it is loaded:
`recorded = true + compliance * F / (1 + stiffening * |F|)` with `F = force(true)`."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from ._numerics import begun_as, frozen

STEPS = 4  # of Newton, at most, before the differentiated one; the force is nearly linear over that length
CLOSE = 1e-9  # change of the true length at which they end, relative; the differentiated one squares it
LEAST_SLOPE = 0.05  # of the recorded over the true length: below, the train snaps and no root is stable


Force = Callable[[PyTree, Array], Array]
"""Of a specimen at a true length, from what else it depends on."""


def strain_in_train(
    force: Force, given: PyTree, recorded: Array, compliance: Array, stiffening: Array
) -> Array:
    """True length of a specimen from the recorded one, by Newton's method.

    Written for length and force; strain and stress will do, with the compliance in their units.

    Args:
        force: of the specimen [N], from `given` and a true length [m].
        given: every number that the force depends on and that derivatives are wanted by.
        recorded: length over specimen and train [m].
        compliance: of the unloaded train [m/N]; 0 gives the recorded length exactly.
        stiffening: one over the force at which the train gives half as much [1/N]; 0 for one that is linear.

    Returns:
        The true length [m]. Only the last step is differentiated, which gives the implicit function's
        derivative; so tangents stay out of the loop. A rigid train takes no other step.
    """
    still, fixed = frozen(given), frozen((recorded, compliance, stiffening))

    def improved(
        true: Array, pull: Array, slope: Array, recorded: Array, compliance: Array, stiffening: Array
    ) -> Array:
        stretch = compliance * pull / (1.0 + stiffening * jnp.abs(pull))
        return true - (true + stretch - recorded) / slope

    def again(carry: tuple) -> Array:
        _, change, _, count = carry
        return (change > CLOSE * jnp.abs(fixed[0])) & (count < STEPS)

    def advance(carry: tuple) -> tuple:
        true, _, _, count = carry
        pull, stiffness = jax.jvp(lambda x: force(still, x), (true,), (jnp.ones_like(true),))
        soft = fixed[1] / (1.0 + fixed[2] * jnp.abs(pull)) ** 2 * stiffness
        slope = jnp.maximum(1.0 + soft, LEAST_SLOPE)
        better = improved(true, pull, slope, *fixed)
        return better, jnp.abs(better - true), slope, count + 1

    begun = jnp.where(fixed[1] == 0.0, 0.0, jnp.inf)  # a rigid train has the recorded length
    first = begun_as((fixed[0], begun, jnp.ones_like(begun), jnp.asarray(0)), (still, fixed))
    found, _, slope, _ = jax.lax.while_loop(again, advance, first)
    return improved(found, force(given, found), slope, recorded, compliance, stiffening)
