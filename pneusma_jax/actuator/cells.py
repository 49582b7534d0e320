"""Cells of a grid of equilibria in which a row by resistance may have an equilibrium.

At given phases there is one equilibrium (`phase_map`). So the equilibria of a row are zeros of a map from the
fractions of its springs to what their resistances miss. The grid shows in which of its cells this map may
vanish. Where there are several zeros, the map is turned over in the cell of one of them.

All functions take NumPy and JAX arrays alike; `CellRanges` and `all_cells` are of NumPy alone.
"""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array

from ..numerics.linear import determinant
from .phase_map import (
    FRACTIONS,
    PRESSURES,
    PhaseMap,
    contracted,
    cubic,
    cubic_slope,
    four_nearest,
    fraction_at,
    namespace_of,
    patch,
    place_of,
)

MARGIN = 0.1
"""Part of the largest slope determinant at a cell's corners that all of them exceed where the map cannot fold
within the cell [1]."""
WIDER = 0.25
"""Part of a cell's range by which all its corners may miss zero while the cell still counts [1]: a curved map
may cross zero between them. Of 10,000 random rows of PneuSMA2 one took another equilibrium without a word
where this was 0, none where it was 0.1 to 1."""
SPARE = 0.1
"""Further part of a cell's range by which its corners may miss zero before it is examined [1]. Between
pressures of the grid the range is then only an estimate, from `SAMPLES` of them."""
SAMPLES = 5
"""Number of pressures at which the range of a cell between two pressures of the grid is looked at."""
NO_STEP = 1e3
"""Step to a zero where the slopes over a cell are singular and promise none, in widths of the cell [1]."""


class Reading(NamedTuple):
    """Readings of one spring: its resistance [ohm] if measured, else its fraction [1].

    The shape of `value` is (rows,), or (n,) with an entry for every pair of a row and a cell.
    """

    value: Array
    measured: bool


class Cells(NamedTuple):
    """Properties of cells, arrays of shape (n,).

    Attributes:
        holds: true where the map has both signs at the corners, for every spring.
        may_fold: true where it has both signs, or misses that by at most `WIDER`, and may turn over within
            the cell, by `MARGIN`.
        away: distance of the predicted zero from the middle of the cell, in widths of the cell [1]. It is
            `NO_STEP` where the slopes are singular.
        step: step to that zero, limited to the cell, in widths of the cell [1], shape (springs, n).

    Of cells of NumPy that miss both signs by more than `WIDER`, `away` is infinite and `step` zero.
    """

    holds: Array
    may_fold: Array
    away: Array
    step: Array


def examined(grid: PhaseMap, pressure: Array, readings: tuple[Reading, ...], cells: Array) -> Cells:
    """Properties of cells, from the map at their corners.

    Args:
        grid: equilibria of the actuator.
        pressure: pressure of the row of each cell [Pa], shape (n,).
        readings: readings of every spring in the row of each cell, shape (n,) each.
        cells: index of each on every axis, shape (springs, n). A cell lies before the point of its index. The
            first and last cell lie beyond the ends, where a fraction stays while its resistance lies beyond.
    """
    xp, count = namespace_of((grid, pressure, readings, cells)), len(readings)
    ups = list(itertools.product((0, 1), repeat=count))
    first, x = grid.slabs(pressure)
    every = xp.stack([_misses(grid, (first, cubic(x)), readings, cells, up) for up in ups])
    lowest, highest = every.min(axis=0), every.max(axis=0)
    spare = WIDER * (highest - lowest)
    holds = xp.all((lowest <= 0.0) & (highest >= 0.0), axis=0)
    near = xp.all((lowest <= spare) & (highest >= -spare), axis=0)
    if xp is not np:
        return _about(every, holds, near)
    some, size = np.flatnonzero(near), near.shape  # the others are of no further interest
    whole = Cells(np.zeros(size, bool), np.zeros(size, bool), np.full(size, np.inf), np.zeros((count, *size)))
    for filled, one in zip(whole, _about(every[..., some], holds[some], near[some]), strict=True):
        filled[..., some] = one
    return whole


def _about(every: Array, holds: Array, near: Array) -> Cells:
    """Properties of cells.

    Args:
        every: misfits at their corners, in the order of `itertools.product`, shape (corners, springs, n).
        holds: see `Cells`.
        near: true where the map has both signs, or misses that by at most `WIDER`, for every spring.
    """
    xp, count = namespace_of(every), every.shape[1]
    ups = list(itertools.product((0, 1), repeat=count))
    corners = dict(zip(ups, every, strict=True))

    def slope_at(up: tuple[int, ...]) -> Array:
        """Slopes along the edges at a corner, shape (misses, axes, n)."""
        other = lambda axis, end: (*up[:axis], end, *up[axis + 1 :])  # noqa: E731
        return xp.stack([corners[other(k, 1)] - corners[other(k, 0)] for k in range(count)], axis=1)

    slopes = xp.stack([slope_at(up) for up in ups])
    dets = xp.stack([determinant(slope) for slope in slopes])
    may_fold = near & ~(dets.min(axis=0) > MARGIN * dets.max(axis=0))
    step = _newton_step(slopes.mean(axis=0), every.mean(axis=0))
    step = xp.where(xp.isfinite(step), step, NO_STEP)
    return Cells(holds, may_fold, abs(step).max(axis=0), xp.clip(step, -0.5, 0.5))


def _newton_step(slope: Array, level: Array) -> Array:
    """Minus the solution of `slope @ step = level` by Cramer's rule, over a trailing axis."""
    xp, count = namespace_of((slope, level)), len(level)
    whole = determinant(slope)
    whole = xp.where(whole == 0.0, xp.nan, whole)
    columns = [[slope[:, j] if j != k else level for j in range(count)] for k in range(count)]
    return xp.stack([-determinant(xp.stack(column, axis=1)) / whole for column in columns])


def _misses(
    grid: PhaseMap, at: tuple[Array, Array], readings: tuple[Reading, ...], cells: Array, up: tuple[int, ...]
) -> Array:
    """Misfit of every spring's resistance at one corner of cells, shape (springs, n).

    A fraction at its end stays there while its resistance lies beyond, so that beyond the ends its miss grows
    until it changes sign. `at` is the first of four pressures, and their weights.
    """
    xp, last = namespace_of((grid, at, readings, cells)), grid.size - 1
    nodes = tuple(xp.clip(cells[k] + end - 1, 0, last) for k, end in enumerate(up))
    place, stride, units, found = at[0], grid.size ** len(nodes), grid.units, []
    for node in nodes:  # one index costs NumPy less than one for each axis
        place = place * grid.size + node
    between = lambda table: sum(  # noqa: E731
        w * table.reshape(-1)[place + j * stride] for j, w in enumerate(at[1])
    )
    for k, reading in enumerate(readings):
        if reading.measured:
            miss = _signs(grid, k, between) * (between(grid.ohms[k]) - reading.value) / units[k]
        else:
            miss = fraction_at(nodes[k].astype(float), grid.size) - reading.value
        outer = cells[k] + up[k]
        miss = xp.where(outer == 0, xp.minimum(miss, 0.0) - 1.0, miss)
        found.append(xp.where(outer == last + 2, xp.maximum(miss, 0.0) + 1.0, miss))
    return xp.stack(found)


def _signs(grid: PhaseMap, k: int, between: Callable) -> Array:
    """Sign of the slope of resistance over the fraction, 1 or -1, shape (n,). On a known grid it is mostly
    the same everywhere, and then one number."""
    xp = namespace_of(grid)
    if xp is np:
        signs = np.where(grid.contrasts[k] < 0.0, -1.0, 1.0)
        if np.all(signs == signs.flat[0]):
            return signs.flat[0]
    return xp.where(between(grid.contrasts[k]) < 0.0, -1.0, 1.0)


REFINEMENTS = 3
"""Number of Newton steps within a cell, on cubics through the points of the grid. After them 56 % of the
joint root-finds of PneuSMA2 take three steps, and 30 % four."""


def starts_in(
    grid: PhaseMap, pressure: Array, readings: tuple[Reading, ...], cells: Array, step: Array
) -> Array:
    """Fractions at which cubics through the points of the grid promise a zero, shape (springs, n).

    Args:
        grid, pressure, readings, cells: the same as those of `examined`.
        step: step to the start of the search, see `Cells`. The result stays within half a cell of the cell.
    """
    xp, count, last = namespace_of((grid, pressure, readings, cells)), len(readings), grid.size - 1
    low, high = xp.clip(cells - 1.5, 0, last), xp.clip(cells + 0.5, 0, last)
    place = xp.clip(cells - 0.5 + step, low, high)
    firsts = [four_nearest(xp.clip(cells[k] - 0.5, 0, last), grid.size)[0] for k in range(count)]
    patches, units = patch(grid.between(grid.ohms, pressure), tuple(firsts)), grid.units
    outer = (cells == 0) | (cells == last + 1)
    for _ in range(REFINEMENTS):
        parts = [place[k] - firsts[k] for k in range(count)]
        plain, risen = [cubic(part) for part in parts], [cubic_slope(part) for part in parts]
        level, slope = [], []
        for k, reading in enumerate(readings):
            if reading.measured:
                miss = (_summed(patches[k], plain) - reading.value) / units[k]
                rise = [
                    _summed(patches[k], [risen[j] if j == axis else plain[j] for j in range(count)])
                    / units[k]
                    for axis in range(count)
                ]
            else:
                miss = place[k] - place_of(reading.value, grid.size)
                rise = [xp.full_like(miss, float(axis == k)) for axis in range(count)]
            # a fraction at its end stays there
            level.append(xp.where(outer[k], 0.0, miss))
            slope.append([xp.where(outer[k], float(j == k), one) for j, one in enumerate(rise)])
        move = _newton_step(xp.stack([xp.stack(one) for one in slope]), xp.stack(level))
        place = xp.clip(place + xp.where(xp.isfinite(move), move, 0.0), low, high)
    return fraction_at(place, grid.size)


def _summed(values: Array, weights: list[Array]) -> Array:
    for left, one in zip(range(len(weights), 0, -1), weights, strict=True):
        values = contracted(values, one, left)
    return values


def all_cells(springs: int) -> np.ndarray:
    """Indices of all cells of a grid, shape (springs, cells)."""
    axes = [np.arange(FRACTIONS[springs] + 1)] * springs
    return np.stack(np.meshgrid(*axes, indexing="ij")).reshape(springs, -1)


def fractions_beside(grid: PhaseMap, cells: Array, shift: Any) -> Array:
    """Fractions of all springs beside the middle of cells, shape (springs, n).

    Args:
        grid: equilibria of the actuator.
        cells: index of each on every axis, shape (springs, n).
        shift: distance from the middle, in widths of a cell [1].
    """
    return fraction_at(cells - 0.5 + shift, grid.size)


# --- which cells to look at, for many rows; NumPy only ----------------------------------------------------


class CellRanges:
    """Ranges of resistances over every cell and between neighbouring pressures of a grid.

    A row looks only at cells whose ranges its readings meet, of some 170 about five.
    """

    def __init__(self, grid: PhaseMap, measured: tuple[bool, ...]) -> None:
        """Look at the grid once for all rows.

        Args:
            grid: the grid, made of NumPy arrays.
            measured: true for each spring with a resistance.
        """
        self.grid, self.cells = grid, all_cells(len(measured))
        ranges = [self._range(k, by_resistance) for k, by_resistance in enumerate(measured)]
        self.low, self.high = (np.stack(ends) for ends in zip(*ranges, strict=True))

    def _range(self, k: int, by_resistance: bool) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest reading of a spring with which a cell may be near a zero.

        Shape (pressures of the grid less one, cells).
        """
        grid, last, intervals = self.grid, self.grid.size - 1, PRESSURES - 1
        if by_resistance:
            shares = np.arange(intervals)[:, None] + np.linspace(0.0, 1.0, SAMPLES)
            first, x = grid.slabs(grid.low + shares.ravel() / intervals * (grid.high - grid.low))
            weights = cubic(x).reshape(4, -1, *[1] * len(self.cells))
            table = sum(w * grid.ohms[k][first + j] for j, w in enumerate(weights))
            table = table.reshape(intervals, SAMPLES, *table.shape[1:])
            least, most, unit = table.min(axis=1), table.max(axis=1), grid.units[k]
        else:
            axis = fraction_at(np.arange(last + 1.0), grid.size)
            axis = axis.reshape([-1 if j == k else 1 for j in range(len(self.cells))])
            least = most = np.broadcast_to(axis, (intervals, *[last + 1] * len(self.cells)))
            unit = 1.0
        corners = [
            (slice(None), *(np.clip(c + end - 1, 0, last) for c, end in zip(self.cells, up, strict=True)))
            for up in itertools.product((0, 1), repeat=len(self.cells))
        ]
        low = np.min([least[at] for at in corners], axis=0)
        high = np.max([most[at] for at in corners], axis=0)
        outer = (self.cells[k] == 0) | (self.cells[k] == last + 1)
        # beyond the ends the map is continued by one unit
        spare = (WIDER + SPARE) * (high - low + np.where(outer, unit, 0.0))
        low, high = low - spare, high + spare
        signs = np.where(grid.contrasts[k] < 0.0, -1.0, 1.0)
        if by_resistance and not np.all(signs == signs.flat[0]):
            return np.full_like(low, -np.inf), np.full_like(high, np.inf)
        upwards = not by_resistance or signs.flat[0] > 0.0
        below, beyond = (0, last + 1) if upwards else (last + 1, 0)
        return np.where(self.cells[k] == below, -np.inf, low), np.where(self.cells[k] == beyond, np.inf, high)

    def met(self, pressure: np.ndarray, readings: tuple[Reading, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Rows and cells that may have an equilibrium, or a fold near one: pairs of indices.

        A row of finite readings meets at least one cell: ranges overlap, and those at the ends have no end.
        """
        intervals = self.low.shape[1]
        span = max(float(self.grid.high - self.grid.low), 1e-9)
        slab = np.clip((pressure - self.grid.low) / span * intervals, 0, intervals - 1).astype(int)
        order = np.argsort(slab, kind="stable")
        rows, cells = [], []
        for one in np.unique(slab):
            own = order[np.searchsorted(slab[order], one) : np.searchsorted(slab[order], one, side="right")]
            within = np.ones((len(own), self.cells.shape[1]), bool)
            for k, reading in enumerate(readings):
                value = reading.value[own, None]
                within &= (value >= self.low[k, one]) & (value <= self.high[k, one])
            row, cell = np.nonzero(within)
            rows.append(own[row])
            cells.append(cell)
        return np.concatenate(rows), np.concatenate(cells)
