"""One row of an actuator's history: its problem from the memories before it, and the memories after it."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..actuator import Actuator
from ..actuator.balance import Problem, spring_responses
from ..actuator.result import Equilibrium
from ..nitinol import MartensiteFraction, SpringState
from ..nitinol.spring import Activation
from ..numerics.safe import zero_unless
from ..pipeline import Effect, Known, Pipeline


class Bench(eqx.Module):
    """An actuator with effects, as all rows of a history share it.

    Attributes:
        actuator: loaded actuator.
        effects: effects beyond the base model.
        fixed: values that effects know in every row; empty without effects.
    """

    actuator: Actuator
    effects: tuple[Effect, ...]
    fixed: dict[str, Any]

    @classmethod
    def of(cls, actuator: Actuator, effects: tuple[Effect, ...]) -> "Bench":
        """The bench of an actuator."""
        fixed = dict(actuator=actuator, fibres=actuator.fibres()) if effects else {}
        return cls(actuator, effects, fixed)

    def problem(
        self, states: tuple[SpringState, ...], memories: tuple, phases: tuple[Activation, ...], row: tuple
    ) -> Problem:
        """The problem of a row.

        Args:
            states, memories: memories of springs and effects after the row before.
            phases: activations of the springs.
            row: pressure as recorded [Pa], time [s], time since the row before [s], and recorded inputs of
                effects by name.
        """
        pressure, time, interval, recorded = row
        inputs = Known(dict(time=time, interval=interval, recorded_pressure=pressure) | self.fixed | recorded)
        pipeline = Pipeline(self.effects, memories, inputs)
        pressure = pipeline.apply("pressure", pressure)
        return Problem(self.actuator, pressure, phases, states, pipeline.with_known(pressure=pressure))

    def at_rest(self, pressure: Array, states: tuple[SpringState, ...], recorded: dict[str, Any]) -> tuple:
        """Memories of the effects before the first row, from whose pressure [Pa] and inputs they start."""
        begun = Pipeline.begin(self.effects, pressure=pressure, states=states, **self.fixed, **recorded)
        return begun.memories


class Passed(eqx.Module):
    """Results of a row.

    Attributes:
        finite: the equilibrium, 0 in place of NaN where there is none.
        states, memories: memories of springs and effects after the row; those before it without equilibrium.
        seen: instrument readings `curvature` [1/m], `bend_angle` [rad] and `length` [m].
    """

    finite: Equilibrium
    states: tuple[SpringState, ...]
    memories: tuple
    seen: dict[str, Array]


def passed(problem: Problem, found: Equilibrium, good: Array) -> Passed:
    """Memories and readings after a row.

    Args:
        problem: problem of the row.
        found: its result, NaN without equilibrium.
        good: true if there is an equilibrium.
    """
    # a failed row is NaN: what it would commit is replaced before the memory's laws see it
    finite = zero_unless(good, found)
    pairs = zip(problem.actuator.springs, problem.states, finite.springs, strict=True)
    committed = tuple(spring.remember(state, response) for spring, state, response in pairs)
    seen = problem.pipeline.apply("outputs", _shown(found), solved=found)
    # memories of shown values start from finite ones too
    later = ()
    if problem.pipeline.effects:
        later = problem.pipeline.remembered(solved=finite, seen=_shown(finite))
    keep = lambda new, old: jnp.where(good, new, old)  # noqa: E731
    return Passed(
        finite,
        jax.tree.map(keep, committed, problem.states),
        jax.tree.map(keep, later, problem.pipeline.memories),
        seen,
    )


def wire_resistances(problem: Problem, found: Equilibrium) -> tuple[Array, ...]:
    """Resistance of every spring's wire alone [ohm]: the one that a current heats.

    A meter shows that of leads as well, where an effect has some. A spring whose phase is no given fraction
    keeps its reading.

    Args:
        problem: problem of a row.
        found: its result, without NaN.
    """
    shown = tuple(response.resistance for response in found.springs)
    wires = problem.pipeline.without_leads()
    if wires is problem.pipeline:
        return shown
    alone = spring_responses(dataclasses.replace(problem, pipeline=wires), found.delta_centre, found.bend)
    rows = zip(problem.activations, alone, shown, strict=True)
    return tuple(own.resistance if isinstance(a, MartensiteFraction) else read for a, own, read in rows)


def _shown(found: Equilibrium) -> dict[str, Array]:
    return dict(curvature=found.curvature, bend_angle=found.bend_angle, length=found.length)
