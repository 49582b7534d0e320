"""Residuals of springs on a stand at given parameters, and their derivatives; the trajectories follow."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.parameters import Parameters
from fitting.specimens import Rows, residual_of
from fitting.specimens.spring_trajectory import residual_and_freedom


def values_of(parameters: Parameters, values: Mapping[str, float] | None = None) -> dict[str, Array]:
    """Values of the free parameters as arrays: their own, or others."""
    own = parameters.valuesdict() if values is None else values
    return {name: jnp.asarray(float(own[name])) for name in parameters}


def residuals_and_freedom(values: Mapping[str, Array], rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of each recording of a stack, shape (recordings, m), and the degrees of freedom that its
    trajectory takes, shape (recordings,).

    Where the model has no answer, every row whose fraction is free and has a resistance takes one: the most.
    """
    found, taken = jax.device_get(_at_the_end(values, rows))
    free = np.asarray(rows.extra["level_sd"]) > 0.0
    most = free * np.sum(np.asarray(rows.weight["resistance"]) > 0.0, axis=1)
    return found, np.where(np.isfinite(taken), taken, most)


@jax.jit
def _at_the_end(values: Mapping[str, Array], rows: Rows) -> tuple[Array, Array]:
    return jax.vmap(lambda one: residual_and_freedom(values, one))(rows)


def jacobian(values: Mapping[str, Array], rows: Rows) -> dict[str, Array]:
    """Derivative of a stack's residuals by every parameter, by name, each of shape (recordings, m)."""
    ways = dict(zip(values, jnp.eye(len(values)), strict=True))
    still = {name: jnp.zeros((len(values), *x.shape)) for name, x in rows.measured.items()}
    return dict(zip(values, _along(dict(values), rows, ways, still), strict=True))


def with_readings(
    values: Mapping[str, Array], rows: Rows, moved: Mapping[str, Array]
) -> Float[np.ndarray, "ways recordings m"]:
    """Change of a stack's residuals with its readings, the trajectories following.

    It takes the program of `jacobian`, so many ways at once as there are parameters.

    Args:
        values: free parameters by name, SI.
        rows: the stack, with decisions.
        moved: changes of the readings by output, SI, each of shape (ways, recordings, rows).
    """
    size, count = len(values), len(next(iter(moved.values())))
    fixed, found = {name: jnp.zeros(size) for name in values}, []
    for first in range(0, count, size):
        chosen = np.minimum(np.arange(first, first + size), count - 1)
        some = {name: jnp.asarray(np.asarray(x)[chosen]) for name, x in moved.items()}
        found.append(np.asarray(_along(dict(values), rows, fixed, some)))
    return np.concatenate(found)[:count]


@jax.jit
def _along(
    values: Mapping[str, Array], rows: Rows, of_values: Mapping[str, Array], of_readings: Mapping[str, Array]
) -> Float[Array, "ways recordings m"]:
    """Derivative of the residuals along changes of the parameters and of the readings."""

    def left(values: Mapping[str, Array], readings: Mapping[str, Array]) -> Array:
        return residual_of("spring")(values, eqx.tree_at(lambda r: r.measured, rows, readings))

    def one(*way: Mapping[str, Array]) -> Array:
        return jax.jvp(left, (values, rows.measured), way)[1]

    return jax.vmap(one)(of_values, of_readings)
