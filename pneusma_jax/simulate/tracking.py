"""An actuator followed row by row near known configurations, as fits and diagnoses need it repeatedly.

`simulate.history.simulate_history` searches further where a row is hard. Here a row starts from its
neighbour, and plain Newton suffices. A program with many effects then compiles in a fraction of the time, and
its derivatives along many directions are cheap.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem, configuration, first_trial, residual, spring_responses
from ..actuator.result import SHORTEST, Equilibrium, Status
from ..actuator.root_find import BALANCED
from ..late import optimistix as optx
from ..nitinol import SpringState
from ..nitinol.spring import Activation
from ..numerics.linear import solve_small
from ..numerics.newton import BoundedNewton
from ..numerics.safe import begun_as
from ..pipeline import Effect, as_recorded
from ..section.many_directions import in_plane
from .row import Bench, passed

METHOD = BoundedNewton(close=1e-10, patience=6, corner=0.0, balanced=1e-3 * BALANCED)
"""One further step, differentiated, ends the iteration. Near corners (friction, contact) steps are small long
before a row balances, so that a larger tolerance would lose rows. Elsewhere a balance that is predicted saves
one step of four; starting where the rate of the rows before leads saves half a step more."""
MOST_STEPS = 40
LONGEST = 0.05
"""Maximum change of a scaled unknown that the rate of the rows before predicts for a row [1]. It is half of
the bend with which searches begin."""


class Track(eqx.Module):
    """A followed history.

    Attributes:
        rows: equilibrium of every row; arrays have a leading axis of rows. NaN where there is none.
        seen: instrument readings `curvature` [1/m], `bend_angle` [rad] and `length` [m], shape (rows,).
        good: mask of the rows with an equilibrium, shape (rows,).
    """

    rows: Equilibrium
    seen: dict[str, Array]
    good: Array


def track_history(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation, ...],
    states: tuple[SpringState, ...],
    time: Float[Array, "rows"],
    effects: tuple[Effect, ...] = (),
    recorded: dict[str, Any] | None = None,
    guess: tuple[Activation, ...] | None = None,
) -> Track:
    """`simulate_history` for rows that lie near each other, not compiled by itself.

    Args:
        actuator: loaded actuator.
        pressure: gauge pressure [Pa], shape (rows,).
        activations: activations, one per spring, with arrays of shape (rows,).
        states: memories before the first row.
        time: time [s], non-decreasing, shape (rows,).
        effects: effects beyond the base model; their memories start at rest.
        recorded: further inputs of effects by name, arrays of shape (rows, ...): `currents` [A] by the
            spring's number, `has_currents` 1 where that was recorded and 0 elsewhere, `temperature` of the
            air [degC], `gravity` [m/s2].
        guess: phases for the search of the first row's configuration. Two configurations may share a
            resistance, and from the wrong one no row returns to the right branch.
    """
    recorded = recorded or {}
    bench = Bench.of(actuator, effects)

    def step(carry: tuple, row: tuple) -> tuple[tuple, tuple]:
        unknowns, rate, states, memories = carry
        pressure, activations, *own = row
        interval = own[1]
        problem = bench.problem(states, memories, activations, (pressure, *own))
        found = _equilibrium_near(problem, unknowns + jnp.clip(interval * rate, -LONGEST, LONGEST))
        good = found.status == int(Status.converged)
        after = passed(problem, found, good)
        kept = jnp.where(good, after.finite.unknowns, unknowns)
        rate = jax.lax.stop_gradient((kept - unknowns) / jnp.where(interval > 0.0, interval, jnp.inf))
        return (kept, rate, after.states, after.memories), (found, after.seen, good)

    states = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), states)
    memories = bench.at_rest(pressure[0], states, jax.tree.map(lambda x: x[0], recorded))
    interval = jnp.diff(time, prepend=time[:1])
    rows = (pressure, activations, time, interval, recorded)
    at_start = Problem(actuator, pressure[0], guess or jax.tree.map(lambda x: x[0], activations), states)
    first = _equilibrium_near(jax.lax.stop_gradient(at_start), first_trial(actuator))
    unknowns = jnp.where(first.status == int(Status.converged), first.unknowns, first_trial(actuator))
    carried = (unknowns, jnp.zeros_like(unknowns), states, memories)
    carried = begun_as(carried, (actuator, effects, rows))
    _, (found, seen, good) = jax.lax.scan(step, carried, rows)
    return Track(found, as_recorded(effects, seen, time), good)


def _residual(unknowns: Array, problem: Problem) -> Array:
    """`residual`, with the wall integrated for derivatives along many directions where bending is in a
    plane."""
    body = problem.actuator
    if not body.planar:
        return residual(unknowns, problem)
    centre, bend = configuration(body, unknowns)
    towards = jnp.asarray(body.side_direction)
    strained = centre / body.length, bend @ towards / body.length
    return residual(unknowns, problem, wall=in_plane(body.section, body.silicone, *strained, towards))


def _equilibrium_near(problem: Problem, guess: Array) -> Equilibrium:
    """Equilibrium near a guess. Where there is none, the status says so and the rest is NaN.

    An activation with a method `held` ignores the strain in the iterations and follows it in the last step.

    Newton's iterations carry no derivatives. One further step does and gives those of the implicit function.
    So the row's laws are compiled three times and not once for every use.
    """
    frozen, body = jax.lax.stop_gradient(problem), problem.actuator

    fixed_phases = tuple(getattr(a, "held", lambda a=a: a)() for a in problem.activations)
    frozen = eqx.tree_at(lambda p: p.activations, frozen, jax.lax.stop_gradient(fixed_phases))
    guess = jax.lax.stop_gradient(guess)
    found = optx.root_find(_residual, METHOD, guess, frozen, max_steps=MOST_STEPS, throw=False)
    root, slope = jax.lax.stop_gradient((found.value, found.stats["slope"]))
    excess = _residual(root, problem)
    missed = jax.lax.stop_gradient(excess)
    if any(hasattr(a, "held") for a in problem.activations):
        missed = _residual(root, frozen)
        full = jax.lax.stop_gradient(problem)
        slope = jax.lax.stop_gradient(jax.jacfwd(lambda z: _residual(z, full))(root))
    size = jnp.max(jnp.abs(missed))
    unknowns = root - solve_small(slope, excess)
    centre, bend = configuration(body, unknowns)
    side_1, side_2 = body.section.sides(jnp.asarray(body.side_direction))
    shortest = (centre - jnp.abs(bend @ jnp.asarray(body.side_direction)) * side_1) / body.length
    status = jnp.select(
        [~(size < BALANCED), shortest < SHORTEST],
        [int(Status.no_equilibrium), int(Status.collapsed)],
        int(Status.converged),
    )
    result = Equilibrium(
        delta_centre=centre,
        bend=bend,
        length=body.length + centre,
        radius=0.5 * (side_1 - side_2),
        middle=0.5 * (side_1 + side_2),
        spring_elongations=centre + body.spring_places @ bend,
        springs=spring_responses(problem, centre, bend),
        unknowns=unknowns,
        residual=size,
        steps=found.stats["num_steps"],
        status=status,
        side_direction=tuple(float(x) for x in body.side_direction),
    )
    good = status == int(Status.converged)
    return jax.tree.map(lambda x: jnp.where(good, x, jnp.nan) if eqx.is_inexact_array(x) else x, result)
