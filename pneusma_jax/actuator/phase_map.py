"""Where many rows of one actuator start: its equilibria on a grid of pressure and martensite fractions.

A grid of a few hundred equilibria costs little next to thousands of rows. Interpolated in it, a row whose
phases are given starts so near its equilibrium that three Newton steps suffice. For a row with measured
resistances the grid also tells in which cell its fractions lie, and whether there may be several: at given
phases there is one equilibrium, so the roots are zeros of a map of the unit cube, and where there are several
that map is turned over in the cell of one of them.
"""

import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.ndimage import map_coordinates
from jaxtyping import Array, Bool, Float

from ..nitinol import SpringState
from ..nitinol.spring import MartensiteFraction, Resistance
from ..numerics.linear import determinant, solve_small
from ..numerics.safe import frozen
from . import Actuator
from .balance import Problem, freedoms, start
from .root_find import DENSER, denser_when_cold, newton

PRESSURES = 9
"""Number of pressures of the grid. Rows of PneuSMA2 then take three Newton steps from it, some four."""
SPAN = 50e3
"""Maximum distance of the grid's ends from the median pressure [Pa]. Rows beyond, mostly outliers, would make
the grid coarse for all others; they are solved apart."""
MARGIN = 0.1
"""Minimum ratio of the smallest to the largest slope determinant of a cell's corners. Below it a fold may lie
within the cell."""
WIDER = 0.5
"""Part of its range over a cell by which a curved map may miss zero at all corners, yet cross it between [1].
Of 10,000 random rows of PneuSMA2 one took another equilibrium without a word with 0, none with 0.1 to 1."""
MOST_CELLS = 16
"""Maximum of cells in which equilibria of a row are looked for; rows with more are solved alone. Where only
cells that hold a zero counted, 175 rows had 5 on average and 9 at most."""
FRACTIONS = {1: 17, 2: 12, 3: 7}
"""Number of fractions of each spring, by the number of springs."""


class PhaseMap(eqx.Module):
    """Equilibria of one actuator over pressure and phases.

    Attributes:
        low, high: pressures of the grid [Pa].
        unknowns: scaled configurations, shape (freedoms, PRESSURES, FRACTIONS, ...), an axis per spring.
        good: pressures at which all points have an equilibrium, shape (PRESSURES,).
    """

    low: Array
    high: Array
    unknowns: Array
    good: Array

    def holds(self, pressure: Array) -> Array:
        """Whether the grid is sound about a pressure."""
        first, _ = self._slabs(pressure)
        around = jnp.all(jnp.stack([self.good[first + k] for k in range(4)]))
        return around & (pressure >= self.low) & (pressure <= self.high)

    def _slabs(self, pressure: Array) -> tuple[Array, Array]:
        """The first of the four nearest pressures, and the place from it in steps of the grid."""
        span = jnp.maximum(self.high - self.low, 1e-9)
        place = jnp.clip((pressure - self.low) / span, 0.0, 1.0) * (PRESSURES - 1)
        first = jnp.clip(jnp.floor(place).astype(int) - 1, 0, PRESSURES - 4)
        return first, place - first

    def at_pressure(self, pressure: Array) -> Array:
        """Scaled configurations at all phases, by a cubic through the four nearest pressures.

        Neighbouring equilibria differ by little, which a linear interpolation over pressure would hide.
        """
        (first, x), found = self._slabs(pressure), jnp.zeros(())
        for k in range(4):
            others = [j for j in range(4) if j != k]
            weight = math.prod((x - j) for j in others) / math.prod(k - j for j in others)
            found = found + weight * self.unknowns[:, first + k]
        return found

    def at(self, pressure: Array, fractions: Array) -> Array:
        """Scaled configuration between the points of the grid, linear over the fractions."""
        nodes = self.at_pressure(pressure)
        sizes = nodes.shape[1:]
        places = [(1.0 - jnp.cbrt(1.0 - x)) * (size - 1) for x, size in zip(fractions, sizes, strict=True)]
        if not places:
            return nodes
        return jnp.stack([map_coordinates(one, places, order=1, mode="nearest") for one in nodes])


def phase_map(
    actuator: Actuator, states: tuple[SpringState, ...], pressure: Float[Array, "rows"]
) -> PhaseMap:
    """Grid that spans pressures; points without equilibrium have the first trial configuration.

    Args:
        actuator: what is loaded.
        states: what each spring remembers, the same for all rows.
        pressure: of the rows [Pa].
    """
    actuator, states, pressure = frozen((actuator, states, pressure))
    count = len(actuator.springs)
    finite = jnp.where(jnp.isfinite(pressure), pressure, jnp.nan)
    middle = jnp.nan_to_num(jnp.nanmedian(finite))
    low = jnp.maximum(jnp.nan_to_num(jnp.nanmin(finite)), middle - SPAN)
    high = jnp.minimum(jnp.nan_to_num(jnp.nanmax(finite)), middle + SPAN)
    axes = [jnp.linspace(low, high, PRESSURES)] + [denser_when_cold(FRACTIONS[count]) for _ in range(count)]
    grid = jnp.stack(jnp.meshgrid(*axes, indexing="ij"), axis=-1)
    first = start(actuator)

    def one(point: Array) -> tuple[Array, Array]:
        activations = tuple(MartensiteFraction(x) for x in point[1:])
        root, _, good = newton(Problem(actuator, point[0], activations, states), first)
        return jnp.where(good, root, first), good

    found, good = jax.lax.map(one, grid.reshape(-1, count + 1), batch_size=64)
    return PhaseMap(
        low, high, found.T.reshape(-1, *grid.shape[:-1]), jnp.all(good.reshape(PRESSURES, -1), axis=1)
    )


def start_of(
    problem: Problem, grid: PhaseMap
) -> tuple[Float[Array, "unknowns"], Bool[Array, ""]]:
    """Joint unknowns to start from, and whether the row certainly has no second equilibrium.

    Args:
        problem: one row; its activations fractions or resistances.
        grid: of its actuator.
    """
    problem = frozen(problem)
    if not any(isinstance(a, Resistance) for a in problem.activations):
        known = [_fraction(problem, k) for k in range(len(problem.activations))]
        fractions = jnp.stack(known) if known else jnp.zeros(0)
        return grid.at(problem.pressure, jnp.clip(fractions, 0.0, 1.0)), jnp.asarray(True)
    cells = _cells(*_misses(problem, grid))
    best = jnp.argmin(jnp.where(cells.holds, cells.away, jnp.inf))
    alone = jnp.any(cells.holds) & ~jnp.any(cells.turned) & grid.holds(problem.pressure)
    return _unknowns_at(problem, grid, cells.fractions(best)), alone


def starts_of(
    problem: Problem, grid: PhaseMap, share: Array, shift: Array
) -> tuple[Float[Array, "starts unknowns"], Bool[Array, "starts"], Bool[Array, ""]]:
    """Joint unknowns for every cell of the grid that may hold an equilibrium of a row by resistance.

    Args:
        problem: one row with a measured resistance.
        grid: of its actuator and of what its springs remember.
        share: of the way from the middle of the cell to the zero that its slopes promise [1].
        shift: further than that, in widths of a cell [1], shape (springs,).

    Returns:
        `MOST_CELLS` starts, which of them belong to a cell, and whether these are all such cells and the grid
        is sound about the row's pressure.
    """
    problem = frozen(problem)
    cells = _cells(*_misses(problem, grid))
    nearest = jnp.argsort(cells.away)[:MOST_CELLS]
    fractions = cells.fractions(nearest, share, shift)
    starts = jax.vmap(lambda x: _unknowns_at(problem, grid, x))(fractions.T)
    possible = cells.holds | cells.turned
    whole = (jnp.sum(possible) <= MOST_CELLS) & grid.holds(problem.pressure)
    return starts, possible[nearest], whole


def _unknowns_at(problem: Problem, grid: PhaseMap, fractions: Array) -> Array:
    """Joint unknowns at fractions of all springs."""
    known = [k for k, a in enumerate(problem.activations) if isinstance(a, Resistance)]
    return jnp.concatenate([grid.at(problem.pressure, fractions), fractions[jnp.asarray(known)]])


def _fraction(problem: Problem, k: int) -> Array:
    """Fraction of a spring whose phase does not depend on its resistance."""
    spring = problem.actuator.springs[k]
    return problem.activations[k].read(spring.alloy, jnp.zeros(()), spring.geometry.wire_length).xi0


def _misses(problem: Problem, grid: PhaseMap) -> tuple[Array, int]:
    """What every spring's reading misses at all points of the grid, see `_beyond_ends`; fractions an axis."""
    actuator, count = problem.actuator, len(problem.activations)
    size = FRACTIONS[count]
    nodes = grid.at_pressure(problem.pressure).reshape(freedoms(problem), -1)
    axis = denser_when_cold(size)
    fractions = np.stack(np.meshgrid(*[axis] * count, indexing="ij")).reshape(count, -1)
    scaled = actuator.basis @ nodes
    centre, bend = scaled[0] * actuator.length, scaled[1:] * actuator.length / actuator.section.radius
    misses = []
    for k, activation in enumerate(problem.activations):
        xi0, spring = fractions[k], actuator.springs[k]
        if isinstance(activation, Resistance):
            elongation = centre + actuator.spring_places[k] @ bend
            chain = problem.chain.knowing(number=actuator.spring_numbers[k])
            excess, contrast = activation.excess(spring, elongation, jnp.asarray(xi0), chain)
            misses.append(jnp.sign(contrast) * excess / spring.contrast_at_rest)
        else:
            misses.append(xi0 - _fraction(problem, k))
    misses = jnp.stack(misses).reshape(count, *[size] * count)
    return _beyond_ends(misses), size


def _beyond_ends(misses: Array) -> Array:
    """The map with one more point at either end of every axis.

    A fraction at its end stays there while its resistance lies beyond, so that beyond the ends its miss grows
    until it changes sign.
    """
    count = misses.shape[0]
    wider = jnp.stack([jnp.pad(one, 1, mode="edge") for one in misses])
    for k in range(count):
        own = jnp.moveaxis(wider[k], k, 0)
        own = own.at[0].set(jnp.minimum(own[0], 0.0) - 1.0).at[-1].set(jnp.maximum(own[-1], 0.0) + 1.0)
        wider = wider.at[k].set(jnp.moveaxis(own, 0, k))
    return wider


class _Cells(eqx.Module):
    """Cells between points of the grid, in one flat axis.

    Attributes:
        holds: whether a cell may hold a zero of the map.
        turned: whether a cell may hold a zero, or misses one by `WIDER`, and is turned over at a corner.
        away: of the zero that the cell's slopes promise, from the middle of the cell in its widths; infinite
            where the cell neither holds one nor is `turned`.
        step: to that zero, held to the cell, in its widths, shape (springs, cells).
        size: static; number of fractions of each spring.
    """

    holds: Array
    turned: Array
    away: Array
    step: Array
    size: int = eqx.field(static=True)

    def fractions(self, cells: Array, share: Array = 1.0, shift: Array | None = None) -> Array:
        """Fractions of all springs in cells of given indices, see `starts_of`."""
        shape = [self.size + 1] * len(self.step)
        steps = share * self.step[:, cells]
        if shift is not None:
            steps = steps + shift[:, None]
        place = jnp.stack(jnp.unravel_index(cells, shape)).astype(float) - 0.5 + steps
        return 1.0 - (1.0 - jnp.clip(place / (self.size - 1), 0.0, 1.0)) ** DENSER


def _cells(wider: Array, size: int) -> _Cells:
    """The map's cells, see `_beyond_ends`."""
    count = wider.shape[0]
    ups = list(itertools.product((0, 1), repeat=count))
    corners = {
        up: wider[(slice(None), *[slice(1, None) if k else slice(None, -1) for k in up])] for up in ups
    }
    lowest = jnp.min(jnp.stack(list(corners.values())), axis=0)
    highest = jnp.max(jnp.stack(list(corners.values())), axis=0)
    holds = jnp.all((lowest <= 0.0) & (highest >= 0.0), axis=0).reshape(-1)
    spare = WIDER * (highest - lowest)
    near = jnp.all((lowest <= spare) & (highest >= -spare), axis=0).reshape(-1)

    def slope_at(up: tuple[int, ...]) -> Array:
        """Slopes along the edges at a corner, shape (misses, axes, cells)."""
        other = lambda axis, end: (*up[:axis], end, *up[axis + 1 :])  # noqa: E731
        edges = [corners[other(axis, 1)] - corners[other(axis, 0)] for axis in range(count)]
        return jnp.stack(edges, axis=1).reshape(count, count, -1)

    slopes = [slope_at(up) for up in ups]
    dets = jnp.stack([determinant(slope) for slope in slopes])
    turned = ~(jnp.min(dets, axis=0) > MARGIN * jnp.max(dets, axis=0))
    level = jnp.asarray(sum(corners.values()) / len(ups)).reshape(count, -1)
    step = -jax.vmap(solve_small, (2, 1), 1)(sum(slopes) / len(ups), level)
    step = jnp.where(jnp.isfinite(step), step, 1e3)
    turned = near & turned
    away = jnp.where(holds | turned, jnp.max(jnp.abs(step), axis=0), jnp.inf)
    return _Cells(holds, turned, away, jnp.clip(step, -0.5, 0.5), size)
