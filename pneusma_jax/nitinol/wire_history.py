"""A straight wire along a history of stress or strain and of temperature, its memory carried by one scan."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.safe import begun_as, safe_divide, zero_unless
from ..pipeline import Effect, Known, Pipeline, as_driven, as_recorded
from ..program_cache import stored_jit
from .residual_strain import SpringState
from .spring import check_fraction
from .wire import WireAlloy, WireResponse, WireStatus


class WireHistory(eqx.Module):
    """A simulated test of one wire.

    Attributes:
        rows: response of the wire in every row.
        states: memory after every row; `prestrain` is an axial strain here.
        seen: instrument reading of `strain` [1] where stress is prescribed, else of `stress` [Pa], shape
            (rows,).
    """

    rows: WireResponse
    states: SpringState
    seen: dict[str, Array]

    @property
    def converged(self) -> Array:
        """Mask of the rows with an answer, shape (rows,)."""
        return self.rows.status <= int(WireStatus.several_strains)


class WireResistance(eqx.Module):
    """A measured electrical resistance of a wire, with those of both its phases.

    Attributes:
        value: measured resistance [ohm], shape (rows,) or ().
        cold, hot: resistances of the fully martensitic and the fully austenitic wire [ohm].
    """

    value: Array = eqx.field(converter=jnp.asarray)
    cold: Array = eqx.field(converter=jnp.asarray)
    hot: Array = eqx.field(converter=jnp.asarray)


class _Drive(eqx.Module):
    """Source of a row's phase: one of these fields; temperature also beside another source."""

    temperature: Array | None
    xi0: Array | None
    resistance: Array | None
    ends: tuple[Array, Array] | None

    def phase(self, wire: WireAlloy, pipeline: Pipeline) -> Array:
        """Martensite fraction of the row [1]."""
        if self.resistance is not None:
            cold, hot = self.ends  # type: ignore[misc]
            xi0 = (pipeline.apply("wire_resistance", self.resistance) - hot) * safe_divide(
                1.0, cold - hot, 1e-9
            )
            xi0 = jnp.clip(xi0, 0.0, 1.0)
        elif self.xi0 is not None:
            xi0 = self.xi0
        else:
            xi0 = wire.martensite_fraction_at(pipeline.apply("temperature", self.temperature))
        return pipeline.apply("phase", xi0)


@stored_jit(WireHistory, WireResponse, SpringState)
def _simulate(
    wire: WireAlloy,
    load: Array,
    by_stress: bool,
    drive: _Drive,
    state: SpringState,
    clock: Array,
    effects: tuple[Effect, ...],
) -> WireHistory:
    prescribed, free = ("stress", "strain") if by_stress else ("strain", "stress")
    span = jnp.max(jnp.abs(load))
    if drive.temperature is not None:
        told = as_driven(effects, {"temperature": drive.temperature}, clock)
        drive = dataclasses.replace(drive, temperature=told["temperature"])

    def step(carry: tuple, row: tuple) -> tuple[tuple, tuple]:
        state, memories = carry
        load, drive, time, interval = row
        known = dict(time=time, interval=interval, number=1, wire=wire, span=span)
        known[prescribed] = load
        if drive.temperature is not None:
            known["temperature"] = drive.temperature
        pipeline = Pipeline(effects, memories, Known(known))
        response = (wire.strain_at if by_stress else wire.respond)(
            load, drive.phase(wire, pipeline), state, pipeline
        )
        after = wire.remember(state, response)
        seen = pipeline.apply("outputs", {free: getattr(response, free)}, solved=response)
        if effects:
            # a failed row is NaN: what it would commit is replaced before the memory's laws see it
            good = response.status <= int(WireStatus.several_strains)
            finite = zero_unless(good, response)
            later = pipeline.remembered(solved=finite, seen={free: getattr(finite, free)})
            memories = jax.tree.map(lambda new, old: jnp.where(good, new, old), later, memories)
        return (after, memories), (response, after, seen)

    first = jax.tree.map(lambda x: x[0], drive)
    at_rest = dict(wire=wire, number=1)
    if first.temperature is not None:
        at_rest["temperature"] = first.temperature
    memories = Pipeline.begin(effects, **at_rest).memories
    history = (load, drive, clock, jnp.diff(clock, prepend=clock[:1]))
    carried = begun_as((state, memories), (wire, effects, history))
    _, (rows, states, seen) = jax.lax.scan(step, carried, history)
    return WireHistory(rows, states, as_recorded(effects, seen, clock))


def simulate_wire(
    wire: WireAlloy,
    *,
    stress: Float[Array, "rows"] | None = None,
    strain: Float[Array, "rows"] | None = None,
    temperature: Float[Array, "rows"] | None = None,
    xi0: Float[Array, "rows"] | None = None,
    resistance: WireResistance | None = None,
    state: SpringState | None = None,
    time: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
) -> WireHistory:
    """One wire along a history of stress or strain, and of temperature, phase or resistance.

    Args:
        wire: constants of the wire.
        stress: engineering stress [Pa], shape (rows,) or (); strain is solved for.
        strain: engineering strain [1], shape (rows,) or (); the alternative to `stress`.
        temperature: temperature of the wire [degC], shape (rows,) or (); denoised, as noise accumulates in
            the memory.
        xi0: martensite fraction [1], shape (rows,) or (); an alternative to `temperature`.
        resistance: measured resistance, another alternative; `temperature` may be given beside it, for
            effects.
        state: memory before the first row; fresh and never stretched where None.
        time: time [s], shape (rows,), for effects that depend on rate or duration.
        effects: effects beyond the base model; their memories start at rest.

    Returns:
        The history. A row that fails is NaN with a status, commits nothing, and stops no later row.

    Raises:
        ValueError: unless one of each group is given, with equal numbers of rows, or if a known fraction is
            not between 0 and 1.
    """
    driven = (temperature, xi0) if resistance is None else (resistance, xi0)
    choices = {
        "`stress` or `strain`": (stress, strain),
        "`temperature`, `resistance` or `xi0`"
        if resistance is not None
        else "`temperature` or `xi0`": driven,
    }
    for names, pair in choices.items():
        if sum(x is not None for x in pair) != 1:
            raise ValueError(f"One of the arguments {names} must be given, and only one.")
    if xi0 is not None:
        check_fraction("the wire", xi0)
    load = jnp.asarray(stress if stress is not None else strain, dtype=float)
    number = lambda x: None if x is None else jnp.asarray(x, dtype=float)  # noqa: E731
    drive = _Drive(
        number(temperature),
        number(xi0),
        None if resistance is None else number(resistance.value),
        None if resistance is None else (number(resistance.cold), number(resistance.hot)),
    )
    clock = None if time is None else jnp.asarray(time, dtype=float)
    try:
        shape = jnp.broadcast_shapes(load.shape, *(jnp.shape(x) for x in jax.tree.leaves((drive, clock))))
    except ValueError:
        shapes = f"{load.shape} and {next(x.shape for x in jax.tree.leaves(drive))}"
        raise ValueError(
            f"Load and phase must have equally many rows, but have the shapes {shapes}."
        ) from None
    if len(shape) != 1 or shape[0] == 0:
        raise ValueError(f"A history must have at least one row, but the shape of the load is {shape}.")
    state = SpringState.fresh(0.0) if state is None else state
    state = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state)
    spread = lambda x: jnp.broadcast_to(x, shape)  # noqa: E731
    clock = jnp.zeros(shape) if clock is None else spread(clock)
    drive = jax.tree.map(spread, drive)
    return _simulate(wire, spread(load), stress is not None, drive, state, clock, tuple(effects))
