"""Unconstrained coordinates of bounded parameters, for samplers and optimisers without bounds.

The fit itself does not use them: it handles bounds as a box (see `fitting.inference.least_squares.engine`).
Here any real vector must be valid, so each bounded coordinate passes through a smooth increasing map onto its
open interval. The map is the logistic function between two bounds, softplus above or below one.

Near a bound a unit step changes the distance to it by a factor e, so the slope never vanishes at a finite
coordinate. It does in MINUIT's and lmfit's sine and square root. Those fold the line at the bound and trap a
parameter that touches it.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

NUDGE = 1e-9
"""Distance inside its bound to which a point on a bound is moved, as a fraction of its interval (or scale).
The coordinate is finite there."""


def _kinds(lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    below, above = jnp.isfinite(lower), jnp.isfinite(upper)
    return below & above, below & ~above, above & ~below


def to_unconstrained(
    point: Float[Array, " n"], lower: Float[Array, " n"], upper: Float[Array, " n"], scale: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Inverse of `to_bounded`.

    Args:
        point: point within the bounds, shape (n,); on a bound it is moved inside by `NUDGE`.
        lower: lower bounds, -inf for none, shape (n,).
        upper: upper bounds, +inf for none, shape (n,).
        scale: distance from a single bound beyond which the map is nearly the identity, shape (n,).
    """
    both, only_lower, only_upper = _kinds(lower, upper)
    low, width = jnp.where(both, lower, 0.0), jnp.where(both, upper - jnp.where(both, lower, 0.0), 1.0)
    fraction = jnp.where(both, jnp.clip((point - low) / width, NUDGE, 1 - NUDGE), 0.5)
    edge = jnp.where(only_lower, lower, jnp.where(only_upper, upper, 0.0))
    distance = jnp.where(only_lower | only_upper, jnp.maximum(jnp.abs(point - edge) / scale, NUDGE), 1.0)
    inverse_softplus = distance + jnp.log(-jnp.expm1(-distance))
    single = jnp.where(only_lower, inverse_softplus, -inverse_softplus)
    return jnp.where(
        both, jax.scipy.special.logit(fraction), jnp.where(only_lower | only_upper, single, point)
    )


def to_bounded(
    coordinate: Float[Array, " n"],
    lower: Float[Array, " n"],
    upper: Float[Array, " n"],
    scale: Float[Array, " n"],
) -> Float[Array, " n"]:
    """Point within the bounds for unconstrained coordinates; arguments as for `to_unconstrained`."""
    both, only_lower, only_upper = _kinds(lower, upper)
    low, width = jnp.where(both, lower, 0.0), jnp.where(both, upper - jnp.where(both, lower, 0.0), 1.0)
    between = low + width * jax.nn.sigmoid(coordinate)
    edge = jnp.where(only_lower, lower, jnp.where(only_upper, upper, 0.0))
    single = (
        jnp.where(only_lower, 1.0, -1.0)
        * scale
        * jax.nn.softplus(jnp.where(only_lower, coordinate, -coordinate))
    )
    return jnp.where(both, between, jnp.where(only_lower | only_upper, edge + single, coordinate))
