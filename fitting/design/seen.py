"""The solved states of one design, as its objectives and constraints look at them."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.units import to_si

from .bodies import Body, Solved
from .every_state import States
from .quantities import QUANTITIES
from .study import Constraint, Objective
from .workspace import enclosed_area, tip_in_plane

TINY = 1e-6
"""Rounding of a distance [m] where it has no derivative; or share [1] of a target, of one unit for 0."""
LEVER = 1e-3 / np.radians(2.0)
"""Distance that counts as much as a turn of the tip by one radian [m]: 1 mm for 2 deg, as in inverse
problems."""


class Seen:
    """The solved states of one design.

    Args:
        states: all states of the study.
        functions: functions of the user's, by file and name.
        body: body of the design.
        parts: parts of its solved states, with a leading axis of states.
        parameters: free parameters [SI].
    """

    def __init__(
        self,
        states: States,
        functions: Mapping[tuple, Any],
        body: Body,
        parts: tuple,
        parameters: Mapping[str, Array],
    ):
        self.states, self.functions = states, functions
        self.body, self.parts, self.parameters = body, parts, parameters

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
        quantity, states = QUANTITIES[one.quantity], self.states.looked_at(one)
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
        function = self.functions[file, name]
        named = {
            name: Solved(self.body, *jax.tree.map(lambda x, k=k: x[k], self.parts))
            for k, name in enumerate(self.states.names)
        }
        return jnp.asarray(function(named, self.parameters), dtype=float).reshape(())

    def objective(self, one: Objective) -> Array:
        """Value of an objective [SI]; that of a target is the distance from it."""
        value = self.reached(one)
        if one.goal != "target":
            return value
        size = abs(one.target[0]) or abs(float(to_si(1.0, one.unit, True)))
        return jnp.sqrt((value - one.target[0]) ** 2 + (TINY * size) ** 2)

    def reached(self, one: Objective) -> Array:
        """Value of an objective's quantity [SI], whatever its goal."""
        states = self.states
        if one.quantity == "failure_probability":
            return jnp.zeros(())
        if one.file is not None:
            return self.users(one.file, one.function)
        if one.sweep is not None:
            first, last = states.sweeps[one.name]
            some = jax.tree.map(lambda x: x[first:last], self.parts)
            return enclosed_area(jax.vmap(lambda part: tip_in_plane(Solved(self.body, *part)))(some))
        if one.quantity == "tip_miss":
            return self._miss(one)
        if one.quantity == "stiffness_range":
            pair = self.quantity("bending_stiffness", states.index(one.states), one.segment - 1)
            return pair[1] / pair[0]
        found = self.quantity(one.quantity, states.index(one.states), one.segment - 1)
        return jnp.max(jnp.abs(found)) if QUANTITIES[one.quantity].springs else jnp.mean(found)

    def _miss(self, one: Objective) -> Array:
        """Root mean square distance of the tip from poses [m], with directions on the lever `LEVER`."""
        frames = self.parts[2][self.states.index(one.states)]
        squares = jnp.zeros(())
        for frame, pose in zip(frames, one.poses, strict=True):
            squares += jnp.sum((frame[:3, 3] - jnp.asarray(pose.tip)) ** 2)
            if pose.direction is not None:
                squares += LEVER**2 * jnp.sum((frame[:3, 2] - jnp.asarray(pose.direction)) ** 2)
        return jnp.sqrt(squares / len(one.poses) + TINY**2)
