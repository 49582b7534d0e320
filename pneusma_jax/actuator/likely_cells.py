"""Cells of the grid of equilibria from which rows by resistance start, and what springs read there.

A row whose only possible cell holds an equilibrium starts there once. Others start in each of their cells.
"""

from typing import NamedTuple

import equinox as eqx
import numpy as np

from .batches import Rows, fractions_of, is_resistance
from .cells import CellRanges, Cells, Reading, examined
from .phase_map import PhaseMap

MOST_CELLS = 16
"""Maximum of cells in which equilibria of a row are looked for; rows with more get all starts."""
SAME = 0.01
"""Distance of two starts of a row, in points of the grid, below which one is left out. This spares 12 % of
the attempts of rows with several cells, of 10,000 random ones of PneuSMA2. With 0.1, 2 rows lost one."""
LOOK = 20_000
"""Maximum of cells that are looked at together; arrays of more leave the processor's cache."""


def readings_of(rows: Rows) -> tuple[Reading, ...]:
    """Readings of every spring."""
    springs = rows.actuator.springs
    found = []
    for k, activation in enumerate(rows.each[1]):
        if is_resistance(activation):
            found.append(Reading(activation.value, True))
        else:
            part = eqx.tree_at(
                lambda a: (a.springs, a.spring_numbers), rows.actuator,
                (springs[k : k + 1], rows.actuator.spring_numbers[k : k + 1]),
            )  # fmt: skip
            alone = Rows(part, (rows.each[0], (activation,), rows.each[2][k : k + 1]))
            found.append(Reading(fractions_of(alone)[0], False))
    return tuple(found)


class Looked(NamedTuple):
    """Cells that rows looked at, arrays of shape (n,), rows ascending.

    Attributes:
        row, cells: row and cells of each look; `cells` has shape (springs, n).
        step: see `Cells`.
        possible: true where an equilibrium may lie.
        first: indices of the likeliest cell of every row that can have no other.
        some: indices of all possible cells of the other rows.
        sound: rows for which the grid is sound, shape (rows,).
    """

    row: np.ndarray
    cells: np.ndarray
    step: np.ndarray
    possible: np.ndarray
    first: np.ndarray
    some: np.ndarray
    sound: np.ndarray


def looked(
    grid: PhaseMap, ranges: CellRanges, pressure: np.ndarray, readings: tuple[Reading, ...]
) -> Looked:
    """Cells that rows start from."""
    row, cell = ranges.met(pressure, readings)
    order, parts, size = np.argsort(row, kind="stable"), [], len(pressure)
    row, cells = row[order], ranges.cells[:, cell[order]]
    for first in range(0, len(row), LOOK):
        own = slice(first, first + LOOK)
        whose = tuple(Reading(r.value[row[own]], r.measured) for r in readings)
        parts.append(examined(grid, pressure[row[own]], whose, cells[:, own]))
    seen = Cells(*(np.concatenate(x, axis=-1) for x in zip(*parts, strict=True)))
    possible = seen.holds | seen.may_fold
    count = np.bincount(row[possible], minlength=size)
    may_fold = np.bincount(row[seen.may_fold], minlength=size) > 0
    held = np.bincount(row[seen.holds], minlength=size) > 0
    sound = grid.holds(pressure) & (count > 0) & (count <= MOST_CELLS)
    alone = sound & held & ~may_fold
    # of a row that is alone the cell whose own slopes put the zero nearest to its middle
    near = np.flatnonzero(seen.holds & alone[row])
    near = near[np.lexsort((seen.away[near], row[near]))]
    first = near[np.unique(row[near], return_index=True)[1]]
    some = np.flatnonzero(possible & (sound & ~alone)[row])
    return Looked(row, cells, seen.step, possible, first, some, sound)


def is_repeated(row: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Whether a start is that of another attempt of the same row, within `SAME`.

    Args:
        row: row of each attempt; attempts of a row follow each other.
        place: place of each start on the axes of the grid [1], shape (springs, n).
    """
    repeated = np.zeros(len(row), bool)
    for apart in range(1, MOST_CELLS):
        alike = row[apart:] == row[:-apart]
        if not alike.any():
            break
        near = np.max(np.abs(place[:, apart:] - place[:, :-apart]), axis=0) < SAME
        repeated[apart:] |= alike & near & ~repeated[:-apart]
    return repeated
