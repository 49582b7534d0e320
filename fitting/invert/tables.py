"""Tables of a segment's shape over its drives, interpolated: what a search in a chain needs at each step.

In a chain without loads every segment is in equilibrium by itself. Its shape is a smooth function of the
pressure and of its own springs' fractions. So equilibria on a grid tell it: 825 for one spring, 33,275 for
three. A cubic through the four nearest values on each axis costs a hundredth of an equilibrium. The tables
only find the way: drives are verified, and what they still miss is corrected, on the exact model.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from fitting.design.bodies import Body
from pneusma_jax import Actuator

from .electrical import highest
from .forward import denser, fresh, states_of

PRESSURES = 25
"""Number of pressures of a table."""
FRACTIONS = {0: 1, 1: 33, 2: 21, 3: 11}
"""Number of fractions of each spring, by the number of springs; with more, a table would be too large."""
NARROW = 1e3
"""Least range of pressures of a table [Pa]; one that is held needs a range as well."""
LEAST_SPAN = 1e-3
"""Least range of fractions of a table [1]; fractions that are held need a range as well."""


class Table(eqx.Module):
    """Shapes of one segment.

    Attributes:
        pressures: [Pa], ascending, shape (pressures,).
        fractions: [1], ascending, denser towards the largest, shape (fractions,).
        shapes: bend angle vector [rad] and length [m] of every state, shape (3, pressures, fractions, ...),
            with an axis of fractions for every spring.
    """

    pressures: Array
    fractions: Array
    shapes: Array

    @property
    def springs(self) -> int:
        """Number of springs."""
        return self.shapes.ndim - 2

    def at(self, pressure: Array, fractions: Array) -> Array:
        """Bend and length between the points, shape (3,).

        Args:
            pressure: [Pa].
            fractions: of the segment's springs [1], shape (springs,).
        """
        axes = [(self.pressures, pressure), *((self.fractions, fractions[k]) for k in range(self.springs))]
        firsts, weights = zip(*(_four_nodes(nodes, place) for nodes, place in axes), strict=True)
        size = (self.shapes.shape[0], *(4 for _ in axes))
        values = lax.dynamic_slice(self.shapes, (0, *firsts), size)
        for along_last_axis in reversed(weights):  # each product takes the last axis away
            values = values @ along_last_axis
        return values


def looked_up(tables: tuple[Table, ...], drives: Array) -> Array:
    """Bend and length of every segment of a chain, shape (segments, 3).

    Args:
        tables: table of each segment.
        drives: pressure [Pa] and fractions of all springs [1], shape (drives,).
    """
    rows, first = [], 1
    for table in tables:
        rows.append(table.at(drives[0], drives[first : first + table.springs]))
        first += table.springs
    return jnp.stack(rows)


def _four_nodes(nodes: Array, place: Array) -> tuple[Array, Array]:
    """Index of the first of the four nodes about a place on an axis, and the weights of their values.

    The weights, shape (4,), are those of the cubic through the four (Lagrange).
    """
    first = jnp.clip(jnp.sum(nodes <= lax.stop_gradient(place)) - 2, 0, nodes.size - 4)
    four = lax.dynamic_slice(nodes, (first,), (4,))
    away = place - four
    apart = four[:, None] - four[None, :] + jnp.eye(4)
    across = jnp.where(jnp.eye(4, dtype=bool), 1.0, away[None, :])
    return first, jnp.prod(across, axis=1) / jnp.prod(apart, axis=1)


def table_of(
    segment: Actuator, pressure: tuple[float, float], xi0_min: float, xi0_max: float | None = None
) -> Table | None:
    """Table of one segment; None if it has too many springs, or if any of the states has no equilibrium.

    Args:
        segment: the actuator.
        pressure: lowest and highest, gauge [Pa].
        xi0_min, xi0_max: least and largest fraction [1]; None for that of a spring without a current.
    """
    count = len(segment.springs)
    if count not in FRACTIONS:
        return None
    low, high = pressure
    levels = np.linspace(low, max(high, low + NARROW), PRESSURES)
    body = Body((segment,), None)
    top = float(highest(body, xi0_max).max()) if count else 1.0
    nodes = np.sort(top - max(top - xi0_min, LEAST_SPAN) * (1.0 - denser(FRACTIONS[count])))
    grid = np.meshgrid(levels, *[nodes] * count, indexing="ij")
    rows = np.stack([x.ravel() for x in grid], axis=1)
    found = states_of(body, jnp.asarray(rows[:, 0]), jnp.asarray(rows[:, 1:]), fresh(body)).only
    shapes = np.column_stack([found.bend, found.length])
    if not np.all(np.isfinite(shapes)):
        return None
    return Table(*(jnp.asarray(x) for x in (levels, nodes, shapes.T.reshape(-1, *grid[0].shape))))
