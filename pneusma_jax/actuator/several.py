"""Rows that may have several equilibria, many at a time.

All start in the few cells of the grid of equilibria that may hold one (`phase_map`). At given phases there is
one equilibrium, so the map of fractions to resistances has degree one: the signs of the stiffness at all
equilibria of a row add up to one. Rows where they do not have missed one, and get more starts. Two that were
missed together are not seen by that; `root_find.all_roots` found none such in 175 rows of 3,000.
"""

import itertools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from . import Actuator
from .balance import Problem, freedoms
from .phase_map import MOST_CELLS, PhaseMap, starts_of
from .result import Equilibrium, equilibrium_of
from .root_find import MOST_ROOTS, distinct, newton, stiffness_signs

GROUP = 64
"""Number of rows, or of starts, that go through a program side by side."""
FEW_STEPS = 12
"""Maximum of Newton steps from a start. Of those that end at a root at all, 2 % need more than 10."""


@eqx.filter_jit
def _starts(actuator: Actuator, rows: tuple, grid: PhaseMap, share: Array, shift: Array) -> tuple:
    return jax.vmap(lambda row: starts_of(Problem(actuator, *row), grid, share, shift))(rows)


@eqx.filter_jit
def _roots(actuator: Actuator, rows: tuple, starts: Array) -> tuple:
    """Roots with the sign of their stiffness in front, number of steps, and whether they are some."""

    def one(row: tuple, start: Array) -> tuple:
        problem = Problem(actuator, *row)
        root, steps, good = newton(problem, start, FEW_STEPS)
        sign = stiffness_signs(problem, root)[1]
        return jnp.concatenate([sign[None], root]), steps, good & (sign != 0.0)

    return jax.vmap(one)(rows, starts)


@eqx.filter_jit
def _least_heated(
    actuator: Actuator, rows: tuple, found: Array, good: Array, steps: Array
) -> tuple[Equilibrium, Array]:
    """Of all equilibria of a row the least heated, and whether the signs of all add up."""

    def one(row: tuple, found: Array, good: Array, steps: Array) -> tuple:
        problem = Problem(actuator, *row)
        roots, real = distinct(found, good, freedoms(problem) + 1)
        signs, root, count = roots[:, 0], roots[0, 1:], jnp.sum(real)
        whole = (jnp.sum(jnp.where(real, signs, 0.0)) == 1.0) & (count < MOST_ROOTS)
        return equilibrium_of(problem, root, steps, count, signs[0] > 0.0), whole

    return jax.vmap(one)(rows, found, good, steps)


def least_heated(actuator: Actuator, rows: tuple, grid: PhaseMap) -> tuple[Equilibrium, np.ndarray]:
    """The least heated equilibrium of rows with measured resistances, as `equilibrium.solve` chooses it.

    Args:
        actuator: the same for all rows.
        rows: pressures, activations and states, arrays of shape (rows,).
        grid: of the actuator and of what its springs remember, the same in all rows.

    Returns:
        Equilibria, and in which rows all were found. What the others have is not to be used.
    """
    count, number = len(rows[0]), len(actuator.springs)
    shifts = [(1.0, np.zeros(number))]
    shifts += [(0.0, np.asarray(shift)) for shift in itertools.product((-1.0, 1.0), repeat=number)]
    found: Any = None
    good: Any = None
    steps: Any = None
    result: Any = None
    sure, left = np.zeros(count, bool), np.arange(count)
    for stage in (shifts[:1], shifts[1:]):
        at = _taken(rows, left)
        for share, shift in stage:
            begin = grid, jnp.asarray(share), jnp.asarray(shift)
            starts, real, few = _in_groups(_starts, actuator, (at,), *begin)
            row, cell = np.nonzero(real & few[:, None])
            if found is None:
                width = MOST_CELLS * len(shifts)
                found = np.zeros((count, width, starts.shape[2] + 1))
                good, steps, filled = np.zeros((count, width), bool), np.zeros(count, int), 0
            if len(row):
                roots, more, there = _in_groups(_roots, actuator, (_taken(at, row), starts[row, cell]))
                found[left[row], filled + cell], good[left[row], filled + cell] = roots, there
                np.add.at(steps, left[row], more)
            filled += MOST_CELLS
        best, whole = _in_groups(_least_heated, actuator, (at, found[left], good[left], steps[left]))
        if result is None:
            result = best
        else:
            jax.tree.map(lambda all_rows, some: all_rows.__setitem__(left, some), result, best)  # noqa: B023
        sure[left] = whole
        left = left[~whole]
        if not len(left):
            break
    return result, sure


def _taken(tree: tuple, rows: np.ndarray) -> tuple:
    return jax.tree.map(lambda x: x[rows], tree)


def _in_groups(program: Callable, actuator: Actuator, given: tuple, *same: object) -> tuple:
    """What a program makes of rows, `GROUP` at a time; the last group is filled up with its last row."""
    size, parts = len(jax.tree.leaves(given)[0]), []
    for first in range(0, size, GROUP):
        rows = np.minimum(np.arange(first, first + GROUP), size - 1)
        parts.append(program(actuator, *_taken(given, rows), *same))
    return jax.tree.map(lambda *x: np.concatenate(x)[:size], *parts)
