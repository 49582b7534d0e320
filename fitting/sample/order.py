"""Order of terms that are the same law in any order: draws keep that of the fit.

A sum of terms of one form does not change where two terms change places. Without an order its posterior has
as many modes as the terms have orders, and chains that sit in different ones never agree.
"""

from collections.abc import Callable, Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from fitting.inference.parameters import Parameters

from .likelihood import KnownNoise

Check = Callable[[dict[str, Array]], Array]


def keeps_order(parameters: Parameters, names: Sequence[str]) -> Check:
    """Function of the values that is true where some of them rise in the order in which those of the fit do.

    Args:
        parameters: parameters at the values of the fit.
        names: names of the values, one of each term.
    """
    names = sorted(names, key=lambda name: parameters[name].value)

    def in_order(values: dict[str, Array]) -> Array:
        rising = [values[low] <= values[high] for low, high in zip(names, names[1:], strict=False)]
        return jnp.all(jnp.stack(rising)) if rising else jnp.asarray(True)

    return in_order


def exchangeable(parameters: Parameters, terms: Sequence[tuple[str, ...]]) -> bool:
    """True if terms may change places: each parameter is free, with the prior and bounds of its like."""
    if not all(name in parameters and parameters[name].free for term in terms for name in term):
        return False
    known = [
        [(p.prior, p.min, p.max, p.scale) for p in (parameters[name] for name in term)] for term in terms
    ]
    tied = any(p.tie is not None for p in parameters.values())
    return not tied and all(one == known[0] for one in known)


class KnownNoiseInOrder(KnownNoise):
    """Independent Gaussian errors of known size, and impossible outside of an order.

    Attributes:
        checks: functions of the values, each true inside its order.
    """

    checks: tuple[Check, ...] = ()

    def __call__(self, values: dict[str, Array], data: PyTree) -> Float[Array, ""]:
        """Log-likelihood up to a constant; -inf where an order is not kept."""
        kept = jnp.all(jnp.stack([check(values) for check in self.checks]))
        return jnp.where(kept, super().__call__(values, data), -jnp.inf)
