"""Checks of the arguments of a history."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..nitinol.thermal import Heating
from ..numerics.safe import is_concrete
from ..precision import require_float64


def check_course(pressure: Array, activations: tuple, time: Array | None) -> None:
    """Refuse meaningless inputs, in one sentence.

    Raises:
        RuntimeError: if float64 is off.
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    require_float64()
    if jnp.ndim(pressure) != 1 or not jnp.shape(pressure)[0]:
        raise ValueError(
            f"Argument `pressure` must be a history of at least one row, but its shape is "
            f"{jnp.shape(pressure)}."
        )
    rows = jnp.shape(pressure)[0]
    named = [("activations", leaf) for leaf in jax.tree.leaves(activations) if jnp.ndim(leaf)]
    for what, array in [*named, *([] if time is None else [("time", time)])]:
        if jnp.shape(array) != (rows,):
            raise ValueError(
                f"Argument `{what}` must have {rows} rows like the pressure, but one has {jnp.shape(array)}."
            )
    drives = jax.tree.leaves(activations, is_leaf=lambda x: isinstance(x, Heating))
    if time is None:
        if any(isinstance(drive, Heating) for drive in drives):
            raise ValueError("Argument `time` must be given where a current heats a spring, but it is None.")
    elif is_concrete(time):
        back = np.flatnonzero(np.diff(np.asarray(time)) < 0.0)
        if back.size:
            raise ValueError(f"Argument `time` must not go backwards, but it does after row {back[0] + 1}.")
