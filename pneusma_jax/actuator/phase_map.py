"""Starts for many rows of one actuator: its equilibria on a grid of pressure and martensite fractions.

A grid of a few hundred equilibria costs little next to thousands of rows. Interpolated in it, a row whose
phases are given starts so near its equilibrium that three Newton steps suffice. What the springs' resistances
are on it says where rows by resistance start (`cells`).

All functions take NumPy and JAX arrays alike: outside of transformations nothing is compiled for them.
"""

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .starts import DENSER, denser_when_cold

PRESSURES = 9
"""Number of pressures of the grid. Rows of PneuSMA2 then take three Newton steps from it, some four."""
SPAN = 50e3
"""Maximum distance of the grid's ends from the median pressure [Pa]. Rows beyond, mostly outliers, would make
the grid coarse for all others; they are solved apart."""
FRACTIONS = {1: 17, 2: 12, 3: 7}
"""Number of fractions of each spring, by the number of springs."""


def namespace_of(tree: object) -> Any:
    """`numpy` if no array of a pytree is one of JAX."""
    return jnp if any(isinstance(x, jax.Array) for x in jax.tree.leaves(tree)) else np


class PhaseMap(eqx.Module):
    """Equilibria of one actuator over pressure and phases.

    Attributes:
        low, high: pressures of the grid [Pa].
        unknowns: scaled configurations, shape (freedoms, PRESSURES, FRACTIONS, ...), an axis per spring.
        good: pressures at which all points have an equilibrium, shape (PRESSURES,).
        ohms: resistance of each spring [ohm], shape (springs, PRESSURES, FRACTIONS, ...).
        contrasts: resistance of martensite less that of austenite at each point [ohm], same shape.
    """

    low: Array
    high: Array
    unknowns: Array
    good: Array
    ohms: Array
    contrasts: Array

    @property
    def size(self) -> int:
        """Number of fractions of each spring."""
        return FRACTIONS.get(len(self.ohms), 1)

    @property
    def units(self) -> Array:
        """Mean size of the contrast of each spring, shape (springs,) [ohm]."""
        return abs(self.contrasts).reshape(len(self.contrasts), -1).mean(axis=1)

    def holds(self, pressure: Array) -> Array:
        """True if the grid is sound about pressures, any shape."""
        first, _ = self.slabs(pressure)
        around = self.good[first] & self.good[first + 1] & self.good[first + 2] & self.good[first + 3]
        return around & (pressure >= self.low) & (pressure <= self.high)

    def slabs(self, pressure: Array) -> tuple[Array, Array]:
        """The first of the four nearest pressures, and the place from it in steps of the grid; any shape."""
        xp = namespace_of((self, pressure))
        span = xp.maximum(self.high - self.low, 1e-9)
        place = xp.clip(xp.nan_to_num((pressure - self.low) / span), 0.0, 1.0) * (PRESSURES - 1)
        return four_nearest(place, PRESSURES)

    def between(self, table: Array, pressure: Array) -> Array:
        """Values of a table at pressures between those of the grid, by cubics.

        Args:
            table: shape (values, PRESSURES, FRACTIONS, ...), such as `ohms`.
            pressure: [Pa], shape (n,).

        Returns:
            Shape (n, values, FRACTIONS, ...).
        """
        first, x = self.slabs(pressure)
        index = np.arange(PRESSURES)
        # one product of matrices: to gather four values of each entry takes twice as long
        shares = sum((first[:, None] + j == index) * w[:, None] for j, w in enumerate(cubic(x)))
        flat = table.swapaxes(0, 1).reshape(PRESSURES, -1)
        return (shares @ flat).reshape(-1, len(table), *table.shape[2:])

    def at(self, pressure: Array, fractions: Array) -> Array:
        """Scaled configurations between the points of the grid, by cubics.

        Args:
            pressure: [Pa], shape (n,).
            fractions: shape (springs, n).

        Returns:
            Shape (freedoms, n).
        """
        values = self.between(self.unknowns, pressure)
        if not len(fractions):
            return values.T
        places = place_of(fractions, self.size)
        firsts, parts = zip(*(four_nearest(x, self.size) for x in places), strict=True)
        values = patch(values, firsts)
        for left, part in zip(range(len(parts), 0, -1), parts, strict=True):
            values = contracted(values, cubic(part), left)
        return values


def four_nearest(place: Array, size: int) -> tuple[Array, Array]:
    """The first of four points about a place on an axis, and the place from it; any shape."""
    xp = namespace_of(place)
    first = xp.clip(xp.floor(place).astype(int) - 1, 0, size - 4)
    return first, place - first


def cubic(x: Array) -> Array:
    """Weights of four values, at 0 to 3, in a cubic through them; shape (4, n) for places of shape (n,)."""
    xp, weights = namespace_of(x), []
    for k in range(4):
        others = [j for j in range(4) if j != k]
        weights.append(math.prod((x - j) for j in others) / math.prod(k - j for j in others))
    return xp.stack(weights)


def cubic_slope(x: Array) -> Array:
    """Derivatives of `cubic` by the place."""
    xp, slopes = namespace_of(x), []
    for k in range(4):
        a, b, c = (j for j in range(4) if j != k)
        slope = (x - a) * (x - b) + (x - a) * (x - c) + (x - b) * (x - c)
        slopes.append(slope / ((k - a) * (k - b) * (k - c)))
    return xp.stack(slopes)


def patch(values: Array, firsts: tuple[Array, ...]) -> Array:
    """Four values on each axis of tables of rows.

    Args:
        values: shape (n, tables, size, ...), as `PhaseMap.between` returns them.
        firsts: index of the first of them on each of the last axes, shape (n,).

    Returns:
        Shape (tables, 4, ..., 4, n).
    """
    rows, tables, *sizes = values.shape
    index = np.arange(rows) * tables + np.arange(tables)[:, None]
    for first, size in zip(firsts, sizes, strict=True):
        index = (index * size)[..., None, :] + (np.arange(4)[:, None] + first)
    return values.reshape(-1)[index]  # one index costs NumPy less than one for each axis


def contracted(values: Array, weights: Array, axes: int) -> Array:
    """A patch summed with weights over the first of its axes of four.

    Args:
        values: shape (..., 4, ..., 4, n).
        weights: shape (4, n).
        axes: number of axes of four.
    """
    first = values.ndim - 1 - axes
    shape = [4 if k == first else 1 for k in range(values.ndim - 1)]
    return (values * weights.reshape(*shape, weights.shape[-1])).sum(axis=first)


def grid_points(pressure: Array, springs: int) -> tuple[Array, Array, Array]:
    """The lowest and highest pressure of a grid [Pa], and its points, shape (points, 1 + springs).

    Args:
        pressure: pressures of the rows [Pa], shape (rows,).
        springs: number of springs.
    """
    xp = namespace_of(pressure)
    finite = xp.isfinite(pressure)
    known = xp.where(finite, pressure, xp.nan)
    some = xp.where(xp.any(finite), known, 0.0)
    middle = xp.nanmedian(some)
    low, high = xp.maximum(xp.nanmin(some), middle - SPAN), xp.minimum(xp.nanmax(some), middle + SPAN)
    axes = [low + (high - low) * np.linspace(0.0, 1.0, PRESSURES)]
    axes += [denser_when_cold(FRACTIONS[springs]) for _ in range(springs)]
    return low, high, xp.stack(xp.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 1 + springs)


def as_map(
    low: Array, high: Array, unknowns: Array, good: Array, ohms: Array, contrasts: Array
) -> PhaseMap:
    """The grid from what was found at its points, in the order of `grid_points`.

    Args:
        low, high: pressures [Pa].
        unknowns: scaled configurations, shape (points, freedoms); a trial where there is no equilibrium.
        good: true where there is an equilibrium, shape (points,).
        ohms, contrasts: see `PhaseMap`, shape (points, springs).
    """
    springs = ohms.shape[1]
    shape = (PRESSURES, *[FRACTIONS[springs]] * springs) if springs else (PRESSURES,)
    apart = lambda x: x.T.reshape(-1, *shape)  # noqa: E731
    return PhaseMap(
        low, high, apart(unknowns), good.reshape(PRESSURES, -1).all(axis=1), apart(ohms), apart(contrasts)
    )


def place_of(fractions: Array, size: int) -> Array:
    """Place of fractions on the axis of a grid, counted in points; for NumPy and JAX."""
    xp = namespace_of(fractions)
    return (1.0 - xp.cbrt(1.0 - xp.clip(xp.nan_to_num(fractions), 0.0, 1.0))) * (size - 1)


def fraction_at(place: Array, size: int) -> Array:
    """Fraction at a place on the axis of a grid, counted in points; for NumPy and JAX."""
    xp = namespace_of(place)
    return 1.0 - (1.0 - xp.clip(place / (size - 1), 0.0, 1.0)) ** DENSER
