"""An actuator that is stepped in time: currents in, resistances and curvature out, with any effects.

The same step serves as the plant, as the controller's own model, and as its observer. It is that of
`pneusma_jax.simulate.history` for heating currents, one row at a time, because what comes in depends on what
came out.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

import pneusma_jax as pj
from pneusma_jax.actuator.balance import first_trial
from pneusma_jax.actuator.load_steps import at_given_phases
from pneusma_jax.actuator.result import equilibrium_of
from pneusma_jax.nitinol import MartensiteFraction, SpringState
from pneusma_jax.nitinol.thermal import next_temperature
from pneusma_jax.numerics.safe import begun_as
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.row import Bench, Passed, passed, wire_resistances

AMBIENT = 22.0
"""Temperature of the air [degC]."""


class Memory(eqx.Module):
    """Memory of a plant from row to row.

    Attributes:
        states: states of the springs; memories: memories of the effects.
        unknowns: unknowns of the last balance; temperatures: temperatures of the wires [degC], shape
            (springs,).
        resistances: resistances that an instrument would show [ohm], shape (springs,).
        wires: resistances of the wires alone, which currents heat [ohm], shape (springs,).
    """

    states: tuple[SpringState, ...]
    memories: tuple
    unknowns: Array
    temperatures: Float[Array, "springs"]
    resistances: Float[Array, "springs"]
    wires: Float[Array, "springs"]


class Seen(eqx.Module):
    """Outputs of a row.

    Attributes:
        curvature: [1/m]; bend: angle of the whole body [rad]; resistances: [ohm]; fractions: martensite [1];
            temperatures: [degC]; shapes (springs,) of what each spring has.
        slopes: derivatives of the resistances by temperature at the strain of the row [ohm/K], shape
            (springs,).
        good: true where force and moment balance; otherwise all values are those of the row before.
    """

    curvature: Array
    bend: Array
    resistances: Array
    fractions: Array
    temperatures: Array
    slopes: Array
    good: Array


class Plant(eqx.Module):
    """An actuator with effects.

    Attributes:
        body: bends in a plane.
        effects: beyond the base model.
        gravity: acceleration of gravity in the base frame [m/s2], which effects feel; see
            `actuator.designs.design_gravity`. None without effects that feel it.
    """

    body: pj.Actuator
    effects: tuple[Effect, ...] = ()
    gravity: Float[Array, "3"] | None = None

    @property
    def _recorded(self) -> dict[str, Array]:
        """What effects read of every row."""
        return {} if self.gravity is None else {"gravity": self.gravity}

    def begin(self, pressure: Array) -> Memory:
        """Memory at rest, cold, under a pressure [Pa]."""
        states = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), self.body.fresh_states())
        memories = Bench.of(self.body, self.effects).at_rest(pressure, states, self._recorded)
        cold = jnp.full(len(self.body.springs), AMBIENT)
        resistances = jnp.stack(
            [
                s.alloy.resistivity(jnp.asarray(1.0), s.shear_strain(jnp.zeros(()))) * s.geometry.wire_length
                for s in self.body.springs
            ]
        )
        first = Memory(states, memories, first_trial(self.body), cold, resistances, resistances)
        return begun_as(first, (self.body, self.effects, pressure))

    def step(
        self, memory: Memory, pressure: Array, currents: Float[Array, "springs"], time: Array, interval: Array
    ) -> tuple[Memory, Seen]:
        """The next row.

        Args:
            memory: memory of the row before.
            pressure: reading of the pressure sensor [Pa]; currents: root mean square currents [A], shape
                (springs,).
            time: time of the row [s]; interval: time since the row before [s].
        """
        body, springs = self.body, self.body.springs
        warmer = jnp.stack(
            [
                next_temperature(s.alloy, s.geometry, t, interval, i, r, jnp.asarray(AMBIENT))
                for s, t, i, r in zip(springs, memory.temperatures, currents, memory.wires, strict=True)
            ]
        )
        fractions = jnp.stack(
            [s.alloy.martensite_fraction_at(t) for s, t in zip(springs, warmer, strict=True)]
        )
        drives = tuple(MartensiteFraction(x) for x in fractions)
        row = pressure, time, interval, self._recorded
        problem = Bench.of(body, self.effects).problem(memory.states, memory.memories, drives, row)
        ended = at_given_phases(problem, memory.unknowns)
        found = equilibrium_of(problem, jnp.where(ended.good, ended.unknowns, memory.unknowns), ended.steps)
        row = passed(problem, found, found.converged)
        wires = jnp.where(found.converged, jnp.stack(wire_resistances(problem, row.finite)), memory.wires)
        return self._after(memory, row, warmer, wires, found.converged)

    def _after(
        self, memory: Memory, row: Passed, warmer: Array, wires: Array, good: Array
    ) -> tuple[Memory, Seen]:
        """Memory after a row, and the row's outputs."""
        found = row.finite
        resistances = jnp.where(good, jnp.stack([r.resistance for r in found.springs]), memory.resistances)
        unknowns = jnp.where(good, found.unknowns, memory.unknowns)
        after = Memory(row.states, row.memories, unknowns, warmer, resistances, wires)
        slopes = jnp.stack(
            [
                jax.grad(lambda t, s=s, r=r: s.alloy.resistivity(s.alloy.martensite_fraction_at(t), r.gamma))(
                    t
                )
                * s.geometry.wire_length
                for s, r, t in zip(self.body.springs, found.springs, warmer, strict=True)
            ]
        )
        fractions = jnp.stack([r.xi0 for r in found.springs])
        seen = Seen(
            found.curvature, found.bend_angle, after.resistances, fractions, warmer, slopes, good
        )
        return after, seen
