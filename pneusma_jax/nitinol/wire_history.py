"""A straight wire along a history of stress or strain and of temperature, its memory carried by one scan."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .residual_strain import SpringState
from .wire import WireAlloy, WireResponse, WireStatus


class WireHistory(eqx.Module):
    """A simulated test of one wire.

    Attributes:
        rows: the wire's response in every row.
        states: its memory after every row; `prestrain` is an axial strain here.
    """

    rows: WireResponse
    states: SpringState

    @property
    def converged(self) -> Array:
        """Which rows have an answer, shape (rows,)."""
        return self.rows.status <= int(WireStatus.several_strains)


@eqx.filter_jit
def _simulate(wire: WireAlloy, load: Array, by_stress: bool, xi0: Array, state: SpringState) -> WireHistory:
    def step(state: SpringState, row: tuple) -> tuple[SpringState, tuple]:
        response = (wire.strain_at if by_stress else wire.respond)(*row, state)
        after = wire.remember(state, response)
        return after, (response, after)

    return WireHistory(*jax.lax.scan(step, state, (load, xi0))[1])


def simulate_wire(
    wire: WireAlloy,
    *,
    stress: Float[Array, "rows"] | None = None,
    strain: Float[Array, "rows"] | None = None,
    temperature: Float[Array, "rows"] | None = None,
    xi0: Float[Array, "rows"] | None = None,
    state: SpringState | None = None,
) -> WireHistory:
    """One wire along a history of stress or strain, and of temperature or phase.

    Args:
        wire: its constants.
        stress: engineering [Pa], shape (rows,) or (); strain is solved for.
        strain: engineering [1], shape (rows,) or (); the alternative to `stress`.
        temperature: of the wire [degC], shape (rows,) or (); denoised, as noise accumulates in the memory.
        xi0: martensite fraction [1], shape (rows,) or (); the alternative to `temperature`.
        state: memory before the first row; fresh and never stretched where None.

    Returns:
        The history. A row that fails is NaN with a status, commits nothing, and stops no later row.

    Raises:
        ValueError: unless one of each pair is given, with equal numbers of rows.
    """
    choices = {"`stress` or `strain`": (stress, strain), "`temperature` or `xi0`": (temperature, xi0)}
    for names, pair in choices.items():
        if sum(x is not None for x in pair) != 1:
            raise ValueError(f"One of the arguments {names} must be given, and only one.")
    load = jnp.asarray(stress if stress is not None else strain, dtype=float)
    phase = wire.martensite_fraction_at(jnp.asarray(temperature)) if xi0 is None else xi0
    phase = jnp.asarray(phase, dtype=float)
    try:
        shape = jnp.broadcast_shapes(load.shape, phase.shape)
    except ValueError:
        raise ValueError(
            f"Load and phase must have equally many rows, but have the shapes {load.shape} and {phase.shape}."
        ) from None
    if len(shape) != 1 or shape[0] == 0:
        raise ValueError(f"A history must have at least one row, but the shape of the load is {shape}.")
    state = SpringState.fresh(0.0) if state is None else state
    state = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state)
    load, phase = (jnp.broadcast_to(x, shape) for x in (load, phase))
    return _simulate(wire, load, stress is not None, phase, state)
