"""Every state that a study looks at, those of sweeps included, as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .bodies import Plan
from .quantities import SAME_IN_EVERY_STATE
from .study import Constraint, State, Study
from .workspace import edge_states


class FreeDrive(NamedTuple):
    """A drive of a state that is a free parameter.

    Attributes:
        state: index of the state.
        spring: index of the spring whose fraction is free; None for the pressure.
        parameter: name of the parameter.
    """

    state: int
    spring: int | None
    parameter: str


@dataclass(frozen=True)
class States:
    """All states of a study, those of sweeps included.

    Attributes:
        names: name of each state; those of a sweep are `OBJECTIVE/NUMBER`.
        pressure: [Pa], shape (states,); fractions: shape (states, springs).
        free: drives that are free parameters; above they have values that `at` replaces.
        sweeps: range of the states of each objective with a sweep, by its name.
    """

    names: tuple[str, ...]
    pressure: np.ndarray
    fractions: np.ndarray
    free: tuple[FreeDrive, ...]
    sweeps: Mapping[str, tuple[int, int]]

    def index(self, wanted: Sequence[str]) -> np.ndarray:
        """Indices of named states; of all where none is named."""
        if not wanted:
            return np.arange(len(self.names))
        return np.array([self.names.index(name) for name in wanted], dtype=int)

    def looked_at(self, constraint: Constraint) -> np.ndarray:
        """Indices of the states that a constraint looks at; the first for what no state changes."""
        if constraint.quantity in SAME_IN_EVERY_STATE:
            return np.zeros(1, int)
        return self.index(constraint.states)

    def at(self, parameters: Mapping[str, Array]) -> tuple[Array, Array]:
        """Pressures and fractions with the free ones filled in."""
        pressure, fractions = jnp.asarray(self.pressure), jnp.asarray(self.fractions)
        for state, spring, name in self.free:
            if spring is None:
                pressure = pressure.at[state].set(parameters[name])
            else:
                fractions = fractions.at[state, spring].set(parameters[name])
        return pressure, fractions


def states_of_study(study: Study, plan: Plan) -> States:
    """Every state that objectives and constraints look at."""
    names, pressure, rows, free, sweeps = [], [], [], [], {}
    for state in study.states.values():
        row, free_here = drives_of(state, len(names), plan.springs)
        names.append(state.name)
        pressure.append(0.0 if state.pressure is None else state.pressure)
        rows.append(row)
        free += free_here
    for objective in study.objectives:
        if objective.sweep is None:
            continue
        loads, fractions = edge_states(plan.tables[0], objective.sweep)
        sweeps[objective.name] = (len(names), len(names) + len(loads))
        names += [f"{objective.name}/{k}" for k in range(len(loads))]
        pressure += list(loads)
        rows += list(fractions)
    return States(
        tuple(names), np.array(pressure), np.array(rows).reshape(len(names), -1), tuple(free), sweeps
    )


def drives_of(
    state: State, index: int, springs: Sequence[tuple[int, int]]
) -> tuple[np.ndarray, list[FreeDrive]]:
    """Fractions of all springs in one state, and its drives that are free.

    What a state says of one segment replaces what it says of all. Springs that it does not name are cold.

    Args:
        state: the state.
        index: its index among all states.
        springs: segment and number of each spring.
    """
    fractions, free = np.ones(len(springs)), []
    for spring, (segment, number) in enumerate(springs):
        of_all_segments, of_this_one = (0, number), (segment, number)
        key = of_this_one if of_this_one in state.fractions else of_all_segments
        name = f"{segment}.{number}" if key == of_this_one else f"{number}"
        value = state.fractions.get(key, 1.0)
        if value is None:
            free.append(FreeDrive(index, spring, f"{state.name}.xi0_{name}"))
        else:
            fractions[spring] = value
    if state.pressure is None:
        free.append(FreeDrive(index, None, f"{state.name}.pressure"))
    return fractions, free
