"""Path-dependent simulation: spring memories carried along a history by one scan.

A row is solved from its neighbour's configuration with the memories of the row before. The memories are
committed with the converged values. Everything is differentiable end to end and can be vmapped over
specimens, designs and protocols.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem, first_trial
from ..actuator.branches import Branch, follow
from ..actuator.implicit import attached
from ..actuator.load_steps import at_given_phases
from ..actuator.result import Equilibrium, Validity, count_and_stability, equilibrium_of
from ..actuator.stability import stiffness_signs
from ..implausible import warn_of_pressure
from ..nitinol import MartensiteFraction, Spring, SpringResponse, SpringState
from ..nitinol.spring import Activation, Resistance, check_fractions, drives_of
from ..nitinol.thermal import Heating, next_temperature
from ..numerics.lengths import fixed_length, going_on, known, lengthened, shortened
from ..numerics.safe import as_array, begun_as, check_number
from ..pipeline import Effect, as_recorded
from ..precision import require_doubles, require_float64
from ..program_cache import stored_jit
from .course import check_course
from .row import Bench, passed, wire_resistances


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
        TypeError: if the activations are no drives, or the pressure is no number.
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    require_float64()
    check_number("pressure", pressure)
    warn_of_pressure(pressure)
    pressure = jnp.asarray(pressure, dtype=float)
    count = len(actuator.springs)
    activations = drives_of(activations, (Heating,)) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = states if states is not None else actuator.fresh_states()
    require_doubles(actuator)
    check_fractions(actuator.spring_numbers, activations)
    _check_counts(actuator, activations, states)
    time = None if time is None else as_array(time)  # a list is an array, too
    check_course(pressure, activations, time)
    rows = pressure.shape[0]
    spread = jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *x.shape[1:])), activations)
    clock = jnp.zeros(rows) if time is None else jnp.asarray(time, float)
    if not effects and known((actuator, pressure, spread, states, clock)) and not _by_resistance(spread):
        length = fixed_length(rows)  # a row says nothing of those before it
        longer = *lengthened((pressure, spread), length), states, going_on(clock, length)
        return shortened(_simulate(actuator, *longer, (), {}), rows)
    recorded = {}
    if effects and any(x is not None for x in currents):
        named = zip(actuator.spring_numbers, currents, strict=True)
        recorded["currents"] = {n: jnp.asarray(x, dtype=float) for n, x in named if x is not None}
    if effects and ambient is not None:
        recorded["temperature"] = jnp.broadcast_to(jnp.asarray(ambient, dtype=float), (rows,))
    if effects and gravity is not None:
        recorded["gravity"] = jnp.broadcast_to(jnp.asarray(gravity, dtype=float), (rows, 3))
    return _simulate(actuator, pressure, spread, states, clock, tuple(effects), recorded)


def _by_resistance(activations: tuple) -> bool:
    """True if a resistance drives a spring: branches of equilibria are then chosen by later rows as well."""
    return any(isinstance(a, Resistance) for a in activations)


@stored_jit(History, Equilibrium, Validity, SpringResponse, SpringState)
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

    bench = Bench.of(actuator, effects)

    def problem_of(carry: _Carry, row: tuple) -> tuple[Problem, tuple[Array, ...]]:
        """The problem of a row, and the springs' temperatures in it [degC]."""
        pressure, activations, time, interval, recorded = row
        before = carry.temperatures, carry.resistances
        phases, temperatures = phases_of(actuator.springs, activations, *before, interval)
        own = pressure, time, interval, recorded
        return bench.problem(carry.states, carry.memories, phases, own), temperatures

    def commit(carry: _Carry, problem: Problem, temperatures: tuple, root: Array, good: Array) -> _Carry:
        """State that a candidate path passes to its next row."""
        root = jnp.where(good, root, jnp.nan)
        return _after(carry, problem, temperatures, equilibrium_of(problem, root, jnp.asarray(0)))[0]

    def step(carry: _Carry, row: tuple) -> tuple[_Carry, tuple]:
        row, way = row
        problem, temperatures = problem_of(carry, row)
        found = _solved(problem, carry, way)
        after_row, seen = _after(carry, problem, temperatures, found)
        degrees = jnp.stack(temperatures) if temperatures else jnp.zeros(0)
        return after_row, (found, after_row.states, degrees, seen)

    memories = bench.at_rest(pressure[0], states, jax.tree.map(lambda x: x[0], recorded))
    first = _first_carry(actuator, activations, states, memories)
    history = (pressure, activations, time, jnp.diff(time, prepend=time[:1]), recorded)
    first = begun_as(first, (actuator, effects, history))
    way = None
    if _by_resistance(activations):
        way = follow(first, history, problem_of, commit)
    _, (rows, memories, temperatures, seen) = jax.lax.scan(step, first, (history, way))
    return History(rows, memories, temperatures, as_recorded(effects, seen, time))


def _solved(problem: Problem, carry: _Carry, way: Branch | None) -> Equilibrium:
    """Equilibrium of a row: near the row before at given phases, on the chosen path at given resistances."""
    if way is None:
        ended = at_given_phases(problem, carry.unknowns)
        told = count_and_stability(problem, ended)
        return equilibrium_of(problem, attached(problem, ended.unknowns), ended.steps, *told)
    root = jnp.where(way.good, attached(problem, way.unknowns), jnp.nan)
    firm = stiffness_signs(problem, way.unknowns)[1] > 0.0
    # at fixed resistances an equilibrium that is not stable is never the only one
    several = jnp.where(firm, way.equilibria, jnp.maximum(way.equilibria, 2))
    several = jnp.where(way.good, several, 0)
    return equilibrium_of(problem, root, way.steps, several, firm)


def _after(
    carry: _Carry, problem: Problem, temperatures: tuple[Array, ...], found: Equilibrium
) -> tuple[_Carry, dict[str, Array]]:
    """State for the next row, and instrument readings."""
    good = found.converged
    row = passed(problem, found, good)
    keep = lambda new, old: jnp.where(good, new, old)  # noqa: E731
    wires = zip(wire_resistances(problem, row.finite), carry.resistances, strict=True)
    return _Carry(
        states=row.states,
        unknowns=keep(row.finite.unknowns, carry.unknowns),
        temperatures=temperatures,
        resistances=tuple(keep(new, old) for new, old in wires),
        memories=row.memories,
    ), row.seen


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
        temperatures, resistances: values of its wires after the row before [degC, ohm].
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
    return _Carry(states, first_trial(actuator), temperatures, resistances, memories)


def _check_counts(actuator: Actuator, activations: tuple, states: tuple) -> None:
    """Refuse other numbers of activations or states than springs."""
    count = len(actuator.springs)
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
