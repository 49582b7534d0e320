"""A study as compiled functions: places in the box to objectives and constraints, with exact derivatives.

All starts, states and draws go through one program. The derivatives are those of the implicit function
theorem at every equilibrium.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.program_cache import cached_program
from pneusma_jax.units import to_si

from .bodies import Body, Materials, Plan, Solved, build_body, solve_body, solve_states
from .functions import load_function
from .quantities import QUANTITIES, STILL
from .space import Space
from .study import Constraint, Objective, Study
from .uncertain import NOMINAL, Draws, reduced, soft_failure
from .workspace import edge_states, enclosed_area, tip_in_plane

ROWS = 1024
"""Number of equilibria that are solved side by side; more leave the processor's cache."""


@dataclass(frozen=True)
class Row:
    """Meaning of one number of a constraint.

    Attributes:
        constraint: its index in the study.
        state: name; segment: from 1, or 0 for the whole; part: number of a spring, or 0.
    """

    constraint: int
    state: str
    segment: int = 0
    part: int = 0


@dataclass(frozen=True)
class States:
    """All states of a study, those of sweeps included.

    Attributes:
        names: name of each state; those of a sweep are `OBJECTIVE/NUMBER`.
        pressure: [Pa], shape (states,); fractions: shape (states, springs).
        driven: free entries, each as (state, spring or -1 for the pressure, name of the parameter).
        sweeps: range of the states of each objective with a sweep, by its name.
    """

    names: tuple[str, ...]
    pressure: np.ndarray
    fractions: np.ndarray
    driven: tuple[tuple[int, int, str], ...]
    sweeps: Mapping[str, tuple[int, int]]

    def index(self, wanted: Sequence[str]) -> np.ndarray:
        """Indices of named states; of all where none is named."""
        return np.array(
            [self.names.index(n) for n in wanted] if wanted else range(len(self.names)), dtype=int
        )

    def at(self, parameters: Mapping[str, Array]) -> tuple[Array, Array]:
        """Pressures and fractions with the free ones filled in."""
        pressure, fractions = jnp.asarray(self.pressure), jnp.asarray(self.fractions)
        for state, spring, name in self.driven:
            if spring < 0:
                pressure = pressure.at[state].set(parameters[name])
            else:
                fractions = fractions.at[state, spring].set(parameters[name])
        return pressure, fractions


def states_of(study: Study, plan: Plan) -> States:
    """Every state that objectives and constraints look at."""
    springs = plan.springs
    names, pressure, rows, driven, sweeps = [], [], [], [], {}
    for state in study.states.values():
        row = np.ones(len(springs))
        for j, (segment, number) in enumerate(springs):
            for key in ((0, number), (segment, number)):
                if key not in state.fractions:
                    continue
                value = state.fractions[key]
                if value is None:
                    own = f"{segment}." if key[0] else ""
                    driven.append((len(names), j, f"{state.name}.xi0_{own}{number}"))
                else:
                    row[j] = value
        if state.pressure is None:
            driven.append((len(names), -1, f"{state.name}.pressure"))
        names.append(state.name)
        pressure.append(0.0 if state.pressure is None else state.pressure)
        rows.append(row)
    for objective in study.objectives:
        if objective.sweep is None:
            continue
        loads, fractions = edge_states(plan.tables[0], objective.sweep)
        sweeps[objective.name] = (len(names), len(names) + len(loads))
        names += [f"{objective.name}/{k}" for k in range(len(loads))]
        pressure += list(loads)
        rows += list(fractions)
    return States(
        tuple(names), np.array(pressure), np.array(rows).reshape(len(names), -1), tuple(driven), sweeps
    )


class Model:
    """A study with its choices made.

    Args:
        study: the study as read.
        plan: tables of this combination of choices.
        draws: common random numbers of the search.

    Attributes:
        space: the box of the free parameters.
        states: all of them.
        rows: meaning of each number of the constraints, without uncertainty.
    """

    def __init__(self, study: Study, plan: Plan, draws: Draws = NOMINAL):
        self.study, self.plan, self.draws = study, plan, draws
        self.space, self.states = Space(study.free), states_of(study, plan)
        self.materials = plan.materials()
        self.rows: tuple[Row, ...] = tuple(
            row for k, one in enumerate(study.constraints) for row in self._rows_of(k, one)
        )
        self._functions = {
            (one.file, one.function): load_function(one.file, one.function)
            for one in (*study.objectives, *study.constraints)
            if one.file is not None
        }

    @property
    def uncertain(self) -> bool:
        """True if results are spread."""
        return self.study.uncertainty is not None

    @property
    def groups(self) -> tuple[Row, ...]:
        """Meaning of each number that the optimiser gets as a constraint."""
        if not self.uncertain:
            return self.rows
        if self.study.uncertainty.constraints == "counted":
            return ()
        return tuple(Row(k, "all draws") for k in range(len(self.study.constraints)))

    def _rows_of(self, k: int, one: Constraint) -> list[Row]:
        if one.file is not None:
            return [Row(k, "all states")]
        quantity = QUANTITIES[one.quantity]
        names = [self.states.names[i] for i in self._looked_at(one)]
        if quantity.whole:
            return [Row(k, name) for name in names]
        segments = [one.segment] if one.segment else range(1, len(self.plan.tables) + 1)
        springs = self.plan.springs
        parts = lambda s: [n for at, n in springs if at == s] if quantity.springs else [0]  # noqa: E731
        return [Row(k, name, s, part) for s in segments for name in names for part in parts(s)]

    def _looked_at(self, one: Constraint) -> np.ndarray:
        return np.zeros(1, int) if one.quantity in STILL else self.states.index(one.states)

    def outputs(self, place: Array, draw: Mapping, materials: tuple[Materials, ...]) -> tuple[Array, Array]:
        """Objectives, signed to be minimised [SI], and scaled constraint rows, positive where violated
        [1]."""
        parameters = self.space.parameters(place)
        own = tuple(m.with_draw(draw["alloy"], draw.get("stiffness")) for m in materials)
        body = build_body(self.plan, parameters, own, draw["added"])
        solve = lambda p, x: solve_body(body, p, x).parts  # noqa: E731
        parts = jax.vmap(solve)(*self.states.at(parameters))
        seen = _Seen(self, body, parts, parameters)
        rows = [jnp.ravel(seen.violation(one)) for one in self.study.constraints]
        margins = jnp.concatenate(rows) if rows else jnp.zeros(0)
        values = jnp.stack([one.sign * seen.objective(one) for one in self.study.objectives])
        return values, margins

    def worst(self, margins: Array) -> Array:
        """Largest violation of each constraint [1], shape (constraints,)."""
        index = np.array([row.constraint for row in self.rows])
        return jnp.stack(
            [jnp.max(margins[np.flatnonzero(index == k)]) for k in range(len(self.study.constraints))]
        )

    def _reduced(self, place: Array, draws: Mapping, materials: tuple[Materials, ...]) -> Array:
        """Objectives and constraints as the optimiser gets them."""
        values, margins = jax.vmap(lambda draw: self.outputs(place, draw, materials))(draws)
        if not self.uncertain:
            return jnp.concatenate([values[0], margins[0]])
        given = self.study.uncertainty
        spread = reduced(values, given.objective, given.k, given.level)
        groups = jax.vmap(self.worst)(margins) if self.rows else jnp.zeros((values.shape[0], 0))
        for k, one in enumerate(self.study.objectives):
            if one.quantity == "failure_probability":
                spread = spread.at[k].set(soft_failure(jnp.max(groups, axis=1)))
        if given.constraints == "counted":
            return spread
        return jnp.concatenate([spread, reduced(groups, given.constraints, given.k, given.level)])

    def _stored(self, function: Callable, size: int) -> Callable:
        """A program of this study, traced once and not in every process; of a user's functions it is not."""
        if self._functions:
            return eqx.filter_jit(function)
        return cached_program(function, f"{function.__qualname__} {size} {self.study!r} {self.plan!r}")

    @cached_property
    def _compiled(self) -> object:
        size = max(1, ROWS // (len(self.states.names) * self.draws.count))

        def evaluate(places: Array, draws: dict, materials: tuple) -> tuple[Array, Array]:
            def one(place: Array) -> tuple[Array, Array]:
                values, push = jax.linearize(lambda u: self._reduced(u, draws, materials), place)
                return values, jax.vmap(push)(jnp.eye(place.size)).T

            return jax.lax.map(one, places, batch_size=min(size, places.shape[0]))

        return self._stored(evaluate, size)

    def evaluate(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and their Jacobians at places in the box.

        Args:
            places: shape (places, parameters).

        Returns:
            Objectives and constraints, shape (places, numbers), and derivatives by the place, shape (places,
            numbers, parameters); NaN where a state has no equilibrium.
        """
        found = self._compiled(jnp.asarray(places), self.draws.tree(), self.materials)
        return tuple(np.asarray(x) for x in found)

    @cached_property
    def _spread(self) -> object:
        size = max(1, ROWS // len(self.states.names))

        def spread(place: Array, draws: dict, materials: tuple) -> tuple[Array, Array]:
            one = lambda draw: self.outputs(place, draw, materials)  # noqa: E731
            return jax.lax.map(one, draws, batch_size=size)

        return self._stored(spread, size)

    def spread(self, place: np.ndarray, draws: Draws) -> tuple[np.ndarray, np.ndarray]:
        """Objectives and constraint rows of every draw at one place, see `outputs`."""
        found = self._spread(jnp.asarray(place), jax.tree.map(jnp.asarray, draws.tree()), self.materials)
        return tuple(np.asarray(x) for x in found)

    def solve_states(self, place: np.ndarray) -> tuple[Body, list[Solved]]:
        """The body at a place and all its states, for figures."""
        parameters = {n: float(x) for n, x in self.space.parameters(place).items()}
        body = build_body(self.plan, parameters, self.materials)
        pressure, fractions = self.states.at(parameters)
        found = jax.tree.map(np.asarray, solve_states(body, pressure, fractions))  # NumPy compiles nothing
        rows = [jax.tree.map(lambda x, k=k: x[k], found) for k in range(len(self.states.names))]
        return body, [Solved(body, *row) for row in rows]


class _Seen:
    """The solved states of one design, as objectives and constraints look at them."""

    def __init__(self, model: Model, body: Body, parts: tuple, parameters: Mapping[str, Array]):
        self.model, self.body, self.parts, self.parameters = model, body, parts, parameters

    def quantity(self, name: str, states: np.ndarray, segment: int) -> Array:
        """A quantity in some states, shape (states,) or (states, springs)."""
        function = QUANTITIES[name].function
        some = jax.tree.map(lambda x: x[states], self.parts)
        return jax.vmap(lambda part: function(Solved(self.body, *part), segment))(some)

    def violation(self, one: Constraint) -> Array:
        """Scaled excess over a limit, positive where it is violated [1], in the order of `Model.rows`."""
        if one.file is not None:
            value = self.users(one.file, one.function)
            return self._scaled(one, value, jnp.asarray(one.limit))
        quantity, states = QUANTITIES[one.quantity], self.model._looked_at(one)
        segments = [0] if quantity.whole else (
            [one.segment - 1] if one.segment else range(len(self.body.segments))
        )  # fmt: skip
        found = []
        for k in segments:
            if quantity.springs and not self.body.segments[k].springs:
                continue
            value = self.quantity(one.quantity, states, k)
            if one.limit is None:
                limit = quantity.tested(Solved(self.body, *jax.tree.map(lambda x: x[0], self.parts)), k)
            else:
                limit = jnp.asarray(one.limit)
            found.append(jnp.ravel(self._scaled(one, value, limit)))
        return jnp.concatenate(found)

    @staticmethod
    def _scaled(one: Constraint, value: Array, limit: Array) -> Array:
        least = abs(float(to_si(1.0, one.unit, True)))
        size = jax.lax.stop_gradient(jnp.where(jnp.abs(limit) > 0.0, jnp.abs(limit), least))
        return (value - limit) / size if one.most else (limit - value) / size

    def users(self, file: object, name: str) -> Array:
        """Value of a function of the user's."""
        function = self.model._functions[file, name]
        named = {
            name: Solved(self.body, *jax.tree.map(lambda x, k=k: x[k], self.parts))
            for k, name in enumerate(self.model.states.names)
        }
        return jnp.asarray(function(named, self.parameters), dtype=float).reshape(())

    def objective(self, one: Objective) -> Array:
        """Value of an objective [SI]; that of a target is the distance from it."""
        states = self.model.states
        if one.quantity == "failure_probability":
            return jnp.zeros(())
        if one.file is not None:
            value = self.users(one.file, one.function)
        elif one.sweep is not None:
            first, last = states.sweeps[one.name]
            some = jax.tree.map(lambda x: x[first:last], self.parts)
            value = enclosed_area(jax.vmap(lambda part: tip_in_plane(Solved(self.body, *part)))(some))
        elif one.quantity == "tip_miss":
            tip = self.parts[2][states.index(one.states)[0], :3, 3]
            return jnp.sqrt(jnp.sum((tip - jnp.asarray(one.target)) ** 2) + TINY**2)
        elif one.quantity == "stiffness_range":
            pair = self.quantity("bending_stiffness", states.index(one.states), one.segment - 1)
            value = pair[1] / pair[0]
        else:
            found = self.quantity(one.quantity, states.index(one.states), one.segment - 1)
            value = jnp.max(jnp.abs(found)) if QUANTITIES[one.quantity].springs else jnp.mean(found)
        return (
            jnp.sqrt((value - one.target[0]) ** 2 + (TINY * one.target[0]) ** 2)
            if one.goal == "target"
            else value
        )


TINY = 1e-6
"""Rounding of the tip of a distance [m], or share of a target [1], where a distance has no derivative."""
