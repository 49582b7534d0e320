"""Every state that a study looks at, those of sweeps included, as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .bodies import Plan
from .quantities import STILL
from .study import Constraint, Study
from .workspace import edge_states


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

    def looked_at(self, one: Constraint) -> np.ndarray:
        """Indices of the states that a constraint looks at."""
        return np.zeros(1, int) if one.quantity in STILL else self.index(one.states)

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
