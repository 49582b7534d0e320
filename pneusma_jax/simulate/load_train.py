"""A specimen in series with a compliant load train, which stiffens under load.

Its law is `recorded = true + compliance * F / (1 + stiffening * |F|)` with `F = force(true)`.
"""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, PyTree

from ..late import optimistix as optx
from ..numerics.implicit_root import OneUnknown
from ..numerics.newton import BoundedNewton

STEPS = 7
"""Maximum number of Newton steps; the force is nearly linear over them."""
METHOD = BoundedNewton(close=1e-12, longest=jnp.inf)

Force = Callable[[PyTree, Array], Array]
"""Force of a specimen as a function of other quantities and of its length."""


def strain_in_train(
    force: Force, given: PyTree, recorded: Array, compliance: Array, stiffening: Array
) -> Array:
    """True length of a specimen from the recorded one, by Newton's method.

    It is written for length and force. Strain and stress are possible, with the compliance in their units.

    Args:
        force: force of the specimen [N], as a function of `given` and a true length [m].
        given: all numbers that the force depends on and that may be differentiated.
        recorded: recorded length over specimen and train [m].
        compliance: compliance of the unloaded train [m/N]; 0 gives the recorded length exactly.
        stiffening: inverse of the force that halves the compliance [1/N]; 0 for a linear train.

    Returns:
        The true length [m], with derivatives by the implicit function theorem.
    """

    def missed(true: Array, numbers: tuple) -> Array:
        given, recorded, compliance, stiffening = numbers
        pull = force(given, true[0])
        return true + compliance * pull / (1.0 + stiffening * jnp.abs(pull)) - recorded

    recorded = jnp.asarray(recorded, float)
    numbers = given, recorded, compliance, stiffening
    found = optx.root_find(
        missed, METHOD, recorded[None], numbers, max_steps=STEPS, adjoint=OneUnknown(), throw=False
    )
    return found.value[0]
