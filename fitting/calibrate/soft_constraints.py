"""Parameters held at values within one compiled program: a pin is one more residual that is data."""

import functools
from collections.abc import Callable, Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from fitting.inference.parameters import Parameters
from fitting.specimens import Model, residual_of, specimen_of


def constrained_residual_of(kind: str | Model) -> Callable[[Mapping[str, Array], PyTree], Float[Array, " m"]]:
    """Residual of a stack of recordings with a pin for every free parameter, one object for each kind.

    Its data are `{"rows": stack, "pins": table}` with the table of `constraint_table`. The residuals of all
    recordings come first, in units of their noise.

    Args:
        kind: kind of the recordings, or a model of them.
    """
    return _constrained(specimen_of(kind) if isinstance(kind, str) else kind)


@functools.cache
def _constrained(model: Model) -> Callable[[Mapping[str, Array], PyTree], Array]:
    own = residual_of(model)

    def residual(values: Mapping[str, Array], data: PyTree) -> Array:
        rows = jnp.ravel(own(values, data["rows"]))
        pins = [weight * (values[name] - target) for name, (target, weight) in data["pins"].items()]
        return jnp.concatenate([rows, jnp.stack(pins)])

    return residual


def constraint_table(
    parameters: Parameters, held: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, tuple[Array, Array]]:
    """Target and weight of every free parameter's pin, SI; those that nothing holds weigh nothing.

    Args:
        parameters: free parameters of the fit.
        held: value and 1-sigma of those that are held, SI.
    """
    table = {}
    for name in parameters.layout().free:
        target, sd = (held or {}).get(name, (0.0, np.inf))
        table[name] = (jnp.asarray(float(target)), jnp.asarray(1.0 / sd))
    return table
