"""Path-dependent simulation: spring memories carried along a history by one scan.

A row is solved from its neighbour's configuration with the memories of the row before. The memories are
committed with the converged values. Everything is differentiable end to end and can be vmapped over
specimens, designs and protocols.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem, start
from ..actuator.branches import follow
from ..actuator.result import Equilibrium, at_phases_told, equilibrium_of
from ..actuator.root_find import at_given_phases, attached, stiffness_signs
from ..nitinol import MartensiteFraction, Spring, SpringResponse, SpringState
from ..nitinol.spring import Activation, Resistance, check_fractions
from ..nitinol.thermal import Heating, next_temperature
from ..numerics.safe import begun_as, is_concrete
from ..pipeline import Chain, Effect, Known, as_recorded
from ..precision import require_doubles, require_float64
from .load_train import strain_in_train


class History(eqx.Module):
    """A simulated history of an actuator.

    Attributes:
        rows: equilibrium of every row; arrays have a leading axis of rows.
        states: each spring's memory after every row, arrays of shape (rows,).
        temperatures: temperature of each spring [degC], shape (rows, springs); NaN for a spring that no
            current drives.
        seen: instrument readings `curvature` [1/m], `bend_angle` [rad] and `length` [m], shape (rows,); those
            of `rows` unless an effect changes them.
    """

    rows: Equilibrium
    states: tuple[SpringState, ...]
    temperatures: Float[Array, "rows springs"]
    seen: dict[str, Array]

    @property
    def converged(self) -> Array:
        """Mask of the rows with an equilibrium, shape (rows,)."""
        return self.rows.converged


class SpringHistory(eqx.Module):
    """A simulated test of one spring on a stand.

    Attributes:
        rows: response of the spring in every row.
        states: memory of the spring after every row.
        seen: instrument readings `force` [N] and `resistance` [ohm], shape (rows,).
    """

    rows: SpringResponse
    states: SpringState
    seen: dict[str, Array]


class _Carry(eqx.Module):
    """State that one row passes to the next."""

    states: tuple[SpringState, ...]
    unknowns: Array
    temperatures: tuple[Array, ...]
    resistances: tuple[Array, ...]
    memories: tuple


def simulate_history(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation | Heating, ...] = (),
    states: tuple[SpringState, ...] | None = None,
    *,
    time: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
    currents: tuple[Array | None, ...] = (),
    ambient: Array | None = None,
    gravity: Float[Array, "3"] | None = None,
) -> History:
    """Actuator under histories of pressure and of phase, resistance or current.

    Args:
        actuator: loaded actuator.
        pressure: gauge pressure [Pa], shape (rows,).
        activations: activations, one per spring, with arrays of shape (rows,) or (): `MartensiteFraction`,
            `Resistance`, or `Heating` by a current. Cold where empty.
        states: memories before the first row; fresh with the actuator's pre-strain where None.
        time: time [s], shape (rows,), non-decreasing; needed by `Heating` and by effects that depend on rate
            or duration.
        effects: effects beyond the base model; their memories start at rest.
        currents: recorded current through each spring [A], shape (rows,), or None where not recorded; read by
            effects only.
        ambient: temperature of the air [degC], shape (rows,) or (); read by effects only.
        gravity: acceleration of gravity in the base frame [m/s2], see `actuator.loads.gravity_vector`; read
            by effects only.

    Returns:
        The history. A row without equilibrium is NaN with a status, commits nothing, and stops no later row.

    Raises:
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    require_float64()
    pressure = jnp.asarray(pressure, dtype=float)
    count = len(actuator.springs)
    activations = tuple(activations) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = states if states is not None else actuator.fresh_states()
    require_doubles(actuator)
    check_fractions(actuator.spring_numbers, activations)
    _check(actuator, pressure, activations, states, time)
    rows = pressure.shape[0]
    spread = jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *x.shape[1:])), activations)
    clock = jnp.zeros(rows) if time is None else jnp.asarray(time, float)
    known = {}
    if effects and any(x is not None for x in currents):
        named = zip(actuator.spring_numbers, currents, strict=True)
        known["currents"] = {n: jnp.asarray(x, dtype=float) for n, x in named if x is not None}
    if effects and ambient is not None:
        known["temperature"] = jnp.broadcast_to(jnp.asarray(ambient, dtype=float), (rows,))
    if effects and gravity is not None:
        known["gravity"] = jnp.broadcast_to(jnp.asarray(gravity, dtype=float), (rows, 3))
    return _simulate(actuator, pressure, spread, states, clock, tuple(effects), known)


@eqx.filter_jit
def _simulate(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation | Heating, ...],
    states: tuple[SpringState, ...],
    time: Array,
    effects: tuple[Effect, ...],
    recorded: dict[str, Any],
) -> History:
    """`simulate_history` after its arguments are checked: one program per design and length."""

    fixed = dict(actuator=actuator, fibres=actuator.fibres()) if effects else {}

    def problem_of(carry: _Carry, row: tuple) -> tuple[Problem, tuple[Array, ...]]:
        """The problem of a row, and the springs' temperatures in it [degC]."""
        pressure, activations, time, interval, recorded = row
        before = carry.temperatures, carry.resistances
        phases, temperatures = phases_of(actuator.springs, activations, *before, interval)
        inputs = Known(dict(time=time, interval=interval, recorded_pressure=pressure) | fixed | recorded)
        chain = Chain(effects, carry.memories, inputs)
        pressure = chain.through("pressure", pressure)
        chain = chain.knowing(pressure=pressure)
        return Problem(actuator, pressure, phases, carry.states, chain), temperatures

    def after(
        carry: _Carry, problem: Problem, temperatures: tuple[Array, ...], found: Equilibrium
    ) -> tuple[_Carry, dict[str, Array]]:
        """State for the next row, and instrument readings."""
        good = found.converged
        # a failed row is NaN: what it would commit is replaced before the memory's laws see it
        calm = jax.tree.map(lambda x: jnp.where(good, x, 0.0) if eqx.is_inexact_array(x) else x, found)
        committed = tuple(
            spring.remember(state, response)
            for spring, state, response in zip(actuator.springs, carry.states, calm.springs, strict=True)
        )
        shown = lambda row: dict(  # noqa: E731
            curvature=row.curvature, bend_angle=row.bend_angle, length=row.length
        )
        seen = problem.chain.through("outputs", shown(found), solved=found)
        # memories of shown values start from finite ones too
        memories = problem.chain.remembered(solved=calm, seen=shown(calm)) if effects else ()
        keep = lambda new, old: jnp.where(good, new, old)  # noqa: E731
        next_carry = _Carry(
            states=jax.tree.map(keep, committed, carry.states),
            unknowns=keep(calm.unknowns, carry.unknowns),
            temperatures=temperatures,
            resistances=tuple(
                keep(r.resistance, old) for r, old in zip(calm.springs, carry.resistances, strict=True)
            ),
            memories=jax.tree.map(keep, memories, carry.memories),
        )
        return next_carry, seen

    def commit(carry: _Carry, problem: Problem, temperatures: tuple, root: Array, good: Array) -> _Carry:
        """State that a candidate path passes to its next row."""
        root = jnp.where(good, root, jnp.nan)
        return after(carry, problem, temperatures, equilibrium_of(problem, root, jnp.asarray(0)))[0]

    def step(carry: _Carry, row: tuple) -> tuple[_Carry, tuple]:
        row, way = row
        problem, temperatures = problem_of(carry, row)
        if way is None:
            ended = at_given_phases(problem, carry.unknowns)
            found = equilibrium_of(
                problem, attached(problem, ended.unknowns), ended.steps, *at_phases_told(problem, ended)
            )
        else:
            root = jnp.where(way.good, attached(problem, way.unknowns), jnp.nan)
            firm = stiffness_signs(problem, way.unknowns)[1] > 0.0
            # at fixed resistances an equilibrium that is not stable is never the only one
            several = jnp.where(firm, way.equilibria, jnp.maximum(way.equilibria, 2))
            several = jnp.where(way.good, several, 0)
            found = equilibrium_of(problem, root, way.steps, several, firm)
        after_row, seen = after(carry, problem, temperatures, found)
        degrees = jnp.stack(temperatures) if temperatures else jnp.zeros(0)
        return after_row, (found, after_row.states, degrees, seen)

    interval = jnp.diff(time, prepend=time[:1])
    begun = jax.tree.map(lambda x: x[0], recorded)
    at_rest = Chain.begin(effects, pressure=pressure[0], states=states, **fixed, **begun)
    first = _first_carry(actuator, activations, states, at_rest.memories)
    history = (pressure, activations, time, interval, recorded)
    first = begun_as(first, (actuator, effects, history))
    way = None
    if any(isinstance(a, Resistance) for a in activations):
        way = follow(first, history, problem_of, commit)
    _, (rows, memories, temperatures, seen) = jax.lax.scan(step, first, (history, way))
    return History(rows, memories, temperatures, as_recorded(effects, seen, time))


def phases_of(
    springs: tuple[Spring, ...],
    activations: tuple[Activation | Heating, ...],
    temperatures: tuple[Array, ...],
    resistances: tuple[Array, ...],
    interval: Array,
) -> tuple[tuple[Activation, ...], tuple[Array, ...]]:
    """Activations of a row, currents turned into phases, and the springs' temperatures [degC].

    Args:
        springs, activations: springs and activations of one actuator.
        temperatures, resistances: values of its springs after the row before [degC, ohm].
        interval: time since that row [s].
    """
    phases, after = [], []
    rows = zip(springs, activations, temperatures, resistances, strict=True)
    for spring, activation, temperature, resistance in rows:
        if isinstance(activation, Heating):
            temperature = next_temperature(
                spring.alloy, spring.geometry, temperature, interval,
                activation.current, resistance, activation.ambient,
            )  # fmt: skip
            activation = MartensiteFraction(spring.alloy.martensite_fraction_at(temperature))
        phases.append(activation)
        after.append(temperature)
    return tuple(phases), tuple(after)


def _first_carry(
    actuator: Actuator,
    activations: tuple[Activation | Heating, ...],
    states: tuple[SpringState, ...],
    memories: tuple,
) -> _Carry:
    """State at rest: springs at ambient temperature and at their attached length."""
    temperatures = tuple(
        a.ambient[0] if isinstance(a, Heating) else jnp.asarray(jnp.nan) for a in activations
    )
    resistances = tuple(
        s.alloy.resistivity(jnp.asarray(1.0), s.shear_strain(jnp.asarray(0.0))) * s.geometry.wire_length
        for s in actuator.springs
    )
    states = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), states)
    return _Carry(states, start(actuator), temperatures, resistances, memories)


@eqx.filter_jit
def simulate_spring(
    spring: Spring,
    elongation: Float[Array, "rows"],
    activation: Activation,
    state: SpringState | None = None,
    *,
    time: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
    temperature: Float[Array, "rows"] | None = None,
) -> SpringHistory:
    """One spring on a test stand, stretched along a history of elongation.

    Args:
        spring: spring with `attached_length` equal to its free length, as on a stand.
        elongation: elongation from the attached length [m], shape (rows,).
        activation: activation with arrays of shape (rows,) or (): `MartensiteFraction` for an isothermal
            test, `Resistance` for an isoresistive one, `Temperature` for one that temperature drives.
        state: memory before the first row; fresh and never stretched where None.
        time: time [s], shape (rows,), for effects that depend on rate or duration.
        effects: effects beyond the base model; their memories start at rest.
        temperature: temperature of the spring [degC], shape (rows,), for effects that depend on it.
    """
    rows = jnp.shape(elongation)[0]
    state = SpringState.fresh(0.0) if state is None else state
    state = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state)
    spread = jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *x.shape[1:])), activation)
    clock = jnp.zeros(rows) if time is None else jnp.asarray(time, dtype=float)
    elongation = jnp.asarray(elongation, dtype=float)
    recorded = {} if temperature is None else {"temperature": jnp.broadcast_to(temperature, (rows,))}
    span = jnp.max(jnp.abs(elongation))

    def step(carry: tuple, row: tuple) -> tuple:
        state, memories = carry
        elongation, activation, time, interval, recorded = row
        known = Known(dict(time=time, interval=interval, number=1, span=span) | recorded)
        chain = Chain(effects, memories, known)
        if chain.acts_at("compliance"):
            train = chain.through("compliance", jnp.zeros(2))

            def pull(given: tuple, length: Array) -> Array:
                spring, activation, state, chain = given
                return spring.pull(length, activation, state, chain)

            given = spring, activation, state, chain
            in_train = lambda length: strain_in_train(pull, given, length, *train)  # noqa: E731
            elongation = chain.where_acting("compliance", in_train, lambda length: length, elongation)
        response = spring.respond(elongation, activation, state, chain)
        after = spring.remember(state, response)
        true = dict(force=response.force, resistance=response.resistance)
        more = dict(spring=spring, solved=response, elongation=elongation)
        seen = chain.through("outputs", true, **more)
        later = chain.remembered(**more, seen=true) if effects else ()
        return (after, later), (response, after, seen)

    begun = jax.tree.map(lambda x: x[0], recorded)
    at_rest = Chain.begin(effects, spring=spring, number=1, states=(state,), **begun)
    history = (elongation, spread, clock, jnp.diff(clock, prepend=clock[:1]), recorded)
    first = begun_as((state, at_rest.memories), (spring, effects, history))
    _, (responses, memories, seen) = jax.lax.scan(step, first, history)  # type: ignore[var-annotated]
    return SpringHistory(responses, memories, as_recorded(effects, seen, clock))


def _check(
    actuator: Actuator, pressure: Array, activations: tuple, states: tuple, time: Array | None
) -> None:
    """Refuse meaningless inputs, in one sentence."""
    if pressure.ndim != 1 or pressure.shape[0] == 0:
        raise ValueError(
            f"Argument `pressure` must be a history of at least one row, but its shape is {pressure.shape}."
        )
    rows, count = pressure.shape[0], len(actuator.springs)
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
    for leaf in jax.tree.leaves(activations):
        if leaf.ndim and leaf.shape[0] != rows:
            raise ValueError(
                f"Argument `activations` must have {rows} rows like the pressure,"
                f" but one has {leaf.shape[0]}."
            )
    if time is None:
        if any(isinstance(a, Heating) for a in activations):
            raise ValueError("Argument `time` must be given where a current heats a spring, but it is None.")
        return
    if jnp.shape(time) != (rows,):
        raise ValueError(
            f"Argument `time` must have {rows} rows like the pressure, but it has {jnp.shape(time)}."
        )
    if is_concrete(time):
        back = np.flatnonzero(np.diff(np.asarray(time)) < 0.0)
        if back.size:
            raise ValueError(f"Argument `time` must not go backwards, but it does after row {back[0] + 1}.")
