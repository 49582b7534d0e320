"""A specimen in series with a compliant load train, which stiffens under load.

Its law is `recorded = true + compliance * F / (1 + stiffening * |F|)` with `F = force(true)`.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from ..numerics.safe import begun_as, frozen

STEPS = 7
"""Maximum number of Newton steps, the differentiated one included; the force is nearly linear over them."""
CLOSE = 1e-12  # Maximum relative step before the differentiated one; it bounds the error of a derivative
LEAST_SLOPE = 0.05
"""Minimum slope of the recorded over the true length; below, the train snaps and no root is stable."""

Force = Callable[[PyTree, Array], Array]
"""Force of a specimen as a function of other quantities and of its length."""


def strain_in_train(
    force: Force, given: PyTree, recorded: Array, compliance: Array, stiffening: Array
) -> Array:
    """True length of a specimen from the recorded one, by Newton's method.

    It is written for length and force. Strain and stress are possible, with the compliance in their units.

    Args:
        force: force of the specimen [N], as a function of `given` and a true length [m].
        given: all numbers that the force depends on and that may be differentiated. A number that `force`
            closes over prevents reverse mode.
        recorded: recorded length over specimen and train [m].
        compliance: compliance of the unloaded train [m/N]; 0 gives the recorded length exactly.
        stiffening: inverse of the force that halves the compliance [1/N]; 0 for a linear train.

    Returns:
        The true length [m]. Only the last step is differentiated, which gives the first derivatives of the
        implicit function without tangents in the loop. A rigid train takes no other step.
    """
    still, (shown, give, stiffer) = frozen(given), frozen((recorded, compliance, stiffening))

    def improved(
        true: Array, pull: Array, slope: Array, recorded: Array, compliance: Array, stiffening: Array
    ) -> Array:
        stretch = compliance * pull / (1.0 + stiffening * jnp.abs(pull))
        return true - (true + stretch - recorded) / slope

    def again(carry: tuple) -> Array:
        *_, change, count = carry
        return (change > CLOSE * jnp.abs(shown)) & (count < STEPS)

    def advance(carry: tuple) -> tuple:
        true, pull, slope, _, count = carry
        true = improved(true, pull, slope, shown, give, stiffer)
        pull, stiffness = jax.jvp(lambda x: force(still, x), (true,), (jnp.ones_like(true),))
        soft = give / (1.0 + stiffer * jnp.abs(pull)) ** 2 * stiffness
        slope = jnp.maximum(1.0 + soft, LEAST_SLOPE)
        change = improved(true, pull, slope, shown, give, stiffer) - true
        return true, pull, slope, jnp.abs(change), count + 1

    begun = jnp.where(give == 0.0, 0.0, jnp.inf).astype(shown.dtype)  # a rigid train has the recorded length
    first = shown, jnp.zeros_like(shown), jnp.ones_like(shown), begun, jnp.asarray(0)
    first = begun_as(first, (still, shown, give, stiffer))
    found, _, slope, _, _ = jax.lax.while_loop(again, advance, first)
    return improved(found, force(given, found), slope, recorded, compliance, stiffening)
