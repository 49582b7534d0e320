"""A state as at the start of a recording: at rest, with memories of effects that nothing has woken yet.

Whoever asks for one state under effects means this one. `problem_at_rest` says what is at rest, and
`solve_at_rest` solves it. A caller with a start of its own takes the problem.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem
from ..actuator.result import Equilibrium
from ..nitinol import SpringState
from ..nitinol.spring import Activation
from ..pipeline import Effect
from .history import simulate_history
from .row import Bench


class Rest(eqx.Module):
    """A state at rest.

    Attributes:
        found: its equilibrium; NaN where there is none.
        seen: instrument readings `curvature` [1/m], `bend_angle` [rad] and `length` [m]; those of `found`
            unless an effect changes them.
    """

    found: Equilibrium
    seen: dict[str, Array]


def solve_at_rest(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation, ...],
    states: tuple[SpringState, ...] | None = None,
    *,
    effects: tuple[Effect, ...],
    gravity: Float[Array, "3"],
) -> Rest:
    """A state whose effects are as at the start of a recording: its first row; may be traced.

    Args:
        actuator: loaded actuator.
        pressure: gauge pressure as recorded [Pa], shape ().
        activations: one per spring, with arrays of shape ().
        states: memories of the springs; fresh where None.
        effects: effects beyond the base model.
        gravity: acceleration of gravity in the base frame [m/s2], read by effects only; see
            `actuator.designs.design_gravity`.

    Raises:
        ValueError: if the activations are not one per spring.
    """
    history = simulate_history(
        actuator, jnp.reshape(pressure, 1), activations, states,
        time=jnp.zeros(1), effects=effects, gravity=gravity,
    )  # fmt: skip
    return Rest(*jax.tree.map(lambda leaf: leaf[0], (history.rows, history.seen)))


def problem_at_rest(
    actuator: Actuator,
    effects: tuple[Effect, ...],
    pressure: Array,
    phases: tuple[Activation, ...],
    states: tuple[SpringState, ...],
    gravity: Array | None,
) -> Problem:
    """The problem that `solve_at_rest` solves.

    Args:
        actuator: loaded actuator.
        effects: effects beyond the base model.
        pressure: gauge pressure as recorded [Pa].
        phases: activations of the springs.
        states: memories of the springs.
        gravity: acceleration of gravity in the base frame [m/s2], shape (3,); read by effects only.
    """
    recorded: dict[str, Any] = {"gravity": gravity} if effects else {}
    bench, now = Bench.of(actuator, effects), jnp.zeros(())
    memories = bench.at_rest(pressure, states, recorded)
    return bench.problem(states, memories, phases, (pressure, now, now, recorded))
