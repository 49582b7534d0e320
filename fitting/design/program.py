"""A study as compiled functions: places in the box to objectives and constraints, with exact derivatives.

All starts, states and draws go through one program. The derivatives are those of the implicit function
theorem at every equilibrium.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.numerics.rows import filled, first_rows
from pneusma_jax.program_cache import cached_program, of_package

from .bodies import Body, Materials, Plan, Solved, build_body, solve_body, solve_states
from .every_state import states_of_study
from .functions import load_function
from .quantities import QUANTITIES
from .seen import Seen
from .space import Space
from .study import Constraint, Study
from .uncertain import NOMINAL, Draws, reduced, soft_failure

ROWS = 1024
"""Number of equilibria that are solved side by side; more leave the processor's cache."""
TOGETHER = 72
"""Number of equilibria with derivatives that are solved side by side. Where a design has half as many states,
its lot is computed design by design, and places that only fill up a lot cost nothing."""


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
        self.space, self.states = Space(study.free), states_of_study(study, plan)
        self.materials = plan.materials()
        self.rows: tuple[Row, ...] = tuple(
            row for k, one in enumerate(study.constraints) for row in self._rows_of(k, one)
        )
        self.functions = {
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
        names = [self.states.names[i] for i in self.states.looked_at(one)]
        if quantity.whole:
            return [Row(k, name) for name in names]
        segments = [one.segment] if one.segment else range(1, len(self.plan.tables) + 1)
        springs = self.plan.springs
        parts = lambda s: [n for at, n in springs if at == s] if quantity.springs else [0]  # noqa: E731
        return [Row(k, name, s, part) for s in segments for name in names for part in parts(s)]

    @property
    def aims(self) -> dict[int, int]:
        """Place of a quantity that has a target among the numbers of an evaluation, by its objective.

        It is the quantity itself, while the objective is its distance from the target. Nothing is sought by
        it; reports tell it, and its derivatives.
        """
        count = len(self.study.objectives) + len(self.groups)
        aims = [k for k, one in enumerate(self.study.objectives) if one.aims]
        return {k: count + i for i, k in enumerate(aims)}

    def outputs(
        self, place: Array, draw: Mapping, materials: tuple[Materials, ...]
    ) -> tuple[Array, Array, Array]:
        """Objectives, signed to be minimised [SI]; scaled constraint rows, positive where violated [1]; and
        quantities that have a target [SI]."""
        parameters = self.space.parameters(place)
        own = tuple(m.with_draw(draw["alloy"], draw.get("stiffness")) for m in materials)
        body = build_body(self.plan, parameters, own, draw["added"])
        solve = lambda p, x: solve_body(body, p, x).parts  # noqa: E731
        parts = jax.vmap(solve)(*self.states.at(parameters))
        seen = Seen(self.states, self.functions, body, parts, parameters)
        rows = [jnp.ravel(seen.violation(one)) for one in self.study.constraints]
        margins = jnp.concatenate(rows) if rows else jnp.zeros(0)
        values = jnp.stack([one.sign * seen.objective(one) for one in self.study.objectives])
        reached = [seen.reached(one) for one in self.study.objectives if one.aims]
        return values, margins, jnp.stack(reached) if reached else jnp.zeros(0)

    def worst(self, margins: Array) -> Array:
        """Largest violation of each constraint [1], shape (constraints,)."""
        index = np.array([row.constraint for row in self.rows])
        return jnp.stack(
            [jnp.max(margins[np.flatnonzero(index == k)]) for k in range(len(self.study.constraints))]
        )

    def _reduced(self, place: Array, draws: Mapping, materials: tuple[Materials, ...]) -> Array:
        """Objectives and constraints as the optimiser gets them."""
        values, margins, reached = jax.vmap(lambda draw: self.outputs(place, draw, materials))(draws)
        reached = jnp.mean(reached, axis=0)
        if not self.uncertain:
            return jnp.concatenate([values[0], margins[0], reached])
        given = self.study.uncertainty
        spread = reduced(values, given.objective, given.k, given.level)
        groups = jax.vmap(self.worst)(margins) if self.rows else jnp.zeros((values.shape[0], 0))
        for k, one in enumerate(self.study.objectives):
            if one.quantity == "failure_probability":
                spread = spread.at[k].set(soft_failure(jnp.max(groups, axis=1)))
        if given.constraints == "counted":
            return jnp.concatenate([spread, reached])
        limits = reduced(groups, given.constraints, given.k, given.level)
        return jnp.concatenate([spread, limits, reached])

    def _stored(self, function: Callable, name: str) -> Callable:
        """A program of this study, traced once and not in every process; of a user's functions it is not."""
        if self.functions:
            return eqx.filter_jit(function)
        keep = all(of_package(type(effect)) for effect in self.plan.effects)  # one's own may change
        return cached_program(function, f"{name} {self.study!r} {self.plan!r}", keep=keep)

    @property
    def _width(self) -> int:
        """Number of designs that are computed side by side."""
        return max(1, TOGETHER // (len(self.states.names) * self.draws.count))

    def _over_places(self, one: Callable[[Array, dict, tuple], Any]) -> Callable:
        """A program that computes the first places of a lot, from what it computes at one."""

        def program(places: Array, count: Array, draws: dict, materials: tuple) -> Any:
            return first_of(lambda place: one(place, draws, materials), places, count, self._width)

        return self._stored(program, f"{one.__qualname__} {self._width}")

    @cached_property
    def _compiled(self) -> Callable:
        def derived(place: Array, draws: dict, materials: tuple) -> tuple[Array, Array]:
            values, push = jax.linearize(lambda u: self._reduced(u, draws, materials), place)
            return values, jax.vmap(push)(jnp.eye(place.size)).T

        return self._over_places(derived)

    @cached_property
    def _values(self) -> Callable:
        return self._over_places(self._reduced)

    def _at(self, program: Callable, places: np.ndarray, size: int | None) -> Any:
        count = len(places)
        full = jnp.asarray(filled(places, size or count))
        return first_rows(program(full, jnp.asarray(count), self.draws.tree(), self.materials), count)

    def evaluate(self, places: np.ndarray, size: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Values and their Jacobians at places in the box.

        Args:
            places: shape (places, parameters).
            size: number of places that the program is compiled for, at least as many; only those given cost
                time.

        Returns:
            Objectives, constraints and quantities that have a target (`aims`), shape (places, numbers). Then
            derivatives by the place, shape (places, numbers, parameters). NaN where a state has no
            equilibrium.
        """
        return self._at(self._compiled, places, size)

    def values(self, places: np.ndarray, size: int | None = None) -> np.ndarray:
        """Objectives and constraints as those of `evaluate`, without derivatives."""
        return self._at(self._values, places, size)

    @property
    def _draws_together(self) -> int:
        """Number of draws that are computed side by side."""
        return max(1, ROWS // len(self.states.names))

    @cached_property
    def _spread(self) -> object:
        size = self._draws_together

        def spread(place: Array, draws: dict, materials: tuple) -> tuple[Array, Array]:
            one = lambda draw: self.outputs(place, draw, materials)[:2]  # noqa: E731
            return jax.lax.map(one, draws, batch_size=size)

        return self._stored(spread, f"{spread.__qualname__} {size}")

    def spread(self, place: np.ndarray, draws: Draws) -> tuple[np.ndarray, np.ndarray]:
        """Objectives and constraint rows of every draw at one place, see `outputs`."""
        side_by_side = self._draws_together
        whole = -(-draws.count // side_by_side) * side_by_side if draws.count > side_by_side else draws.count
        lot = filled(draws.tree(), whole)  # a last lot of another size would be compiled by itself
        found = self._spread(jnp.asarray(place), jax.tree.map(jnp.asarray, lot), self.materials)
        return first_rows(tuple(found), draws.count)

    def solve_states(self, place: np.ndarray) -> tuple[Body, list[Solved]]:
        """The body at a place and all its states, for figures."""
        parameters = {n: float(x) for n, x in self.space.parameters(place).items()}
        body = build_body(self.plan, parameters, self.materials)
        pressure, fractions = self.states.at(parameters)
        found = jax.tree.map(np.asarray, solve_states(body, pressure, fractions))  # NumPy compiles nothing
        rows = [jax.tree.map(lambda x, k=k: x[k], found) for k in range(len(self.states.names))]
        return body, [Solved(body, *row) for row in rows]


def first_of(one: Callable[[Array], Any], places: Array, count: Array, width: int) -> Any:
    """Results of the first places, `width` at a time; those of the others are not computed, and are zero."""
    width = min(width, len(places))
    blocks = -(-len(places) // width)
    at = np.minimum(np.arange(blocks * width), len(places) - 1)
    side_by_side = jax.jit(jax.vmap(one))  # traced once for its shapes and for the loop
    lot = jax.ShapeDtypeStruct((width, *places.shape[1:]), places.dtype)
    zeros = lambda x: jnp.zeros((len(at), *x.shape[1:]), x.dtype)  # noqa: E731
    blank = jax.tree.map(zeros, jax.eval_shape(side_by_side, lot))

    def block(k: Array, found: Any) -> Any:
        some = side_by_side(jax.lax.dynamic_slice_in_dim(places[at], k * width, width))
        put = lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, k * width, 0)  # noqa: E731
        return jax.tree.map(put, found, some)

    return jax.tree.map(lambda x: x[: len(places)], jax.lax.fori_loop(0, -(-count // width), block, blank))
