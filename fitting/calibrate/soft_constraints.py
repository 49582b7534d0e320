"""Soft constraints: parameters held near values by one more residual each.

The values are data, so that one compiled program serves all of them.
"""

import functools
from collections.abc import Callable, Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from fitting.inference.parameters import Parameters
from fitting.specimens import Model, residual_of, specimen_of


def constrained_residual_of(kind: str | Model) -> Callable[[Mapping[str, Array], PyTree], Float[Array, " m"]]:
    """Residual of a stack of recordings, then of a soft constraint for every free parameter.

    Its data are `{"rows": stack, "constraints": table}`, with a table of `constraint_table`. All residuals
    are in units of their standard deviation. Calls with one kind return one object.

    Args:
        kind: kind of the recordings, or a model of them.
    """
    return _constrained(specimen_of(kind) if isinstance(kind, str) else kind)


@functools.cache
def _constrained(model: Model) -> Callable[[Mapping[str, Array], PyTree], Array]:
    own = residual_of(model)

    def residual(values: Mapping[str, Array], data: PyTree) -> Array:
        rows = jnp.ravel(own(values, data["rows"]))
        table = data["constraints"].items()
        constraints = [weight * (values[name] - target) for name, (target, weight) in table]
        return jnp.concatenate([rows, jnp.stack(constraints)])

    return residual


def constraint_table(
    parameters: Parameters, held: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, tuple[Array, Array]]:
    """Target and weight of every free parameter's soft constraint, SI; without one the weight is 0.

    Args:
        parameters: free parameters of the fit.
        held: value and 1-sigma of those that are held, SI.
    """
    table = {}
    for name in parameters.layout().free:
        target, sd = (held or {}).get(name, (0.0, np.inf))
        table[name] = (jnp.asarray(float(target)), jnp.asarray(1.0 / sd))
    return table
