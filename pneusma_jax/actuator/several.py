"""Rows by resistance, which may have several equilibria; many at a time, in NumPy about one compiled program.

A row starts in the cells of the grid of equilibria that may hold one (`likely_cells`). If only one cell may,
it holds the only equilibrium. Otherwise the equilibria of a row are counted (`root_count`). Rows that have
missed one, or may have, get more starts (`further_roots`), at last all of them (`all_starts`).
"""

import itertools
from typing import Any

import jax
import numpy as np

from .all_starts import by_all_starts
from .batches import Rows, Solved, is_resistance, map_of, put, solved_from, starts_at, taken
from .cells import CellRanges, Reading, fractions_beside, starts_in
from .further_roots import FLAT, beyond_cold, with_cold_ends, with_third
from .likely_cells import Looked, is_repeated, looked, readings_of
from .phase_map import PhaseMap, place_of
from .result import Equilibrium
from .root_count import Known, counted, counted_at_ends, joined

WORTHWHILE = 20
"""Number of rows from which on a grid of some 1,300 equilibria is made for them; fewer get all starts, some
150 each."""
PIECE = 16_384
"""Maximum of rows whose cells are looked at together; about ten cells each, it bounds the memory."""


def solved_by_resistance(rows: Rows, shared: bool) -> tuple[Equilibrium, np.ndarray]:
    """The least heated equilibrium of every row, and its joint unknowns.

    Args:
        rows: rows with a measured resistance, at least one.
        shared: true if the springs' memories are the same in all rows.
    """
    usable = rows.usable
    found = None
    for group, alike in [*_groups(rows, usable, shared), (np.flatnonzero(~usable), False)]:
        if not group.size:
            continue
        one = rows if group.size == len(rows) else rows.taken(group)
        if not usable[group[0]]:
            part = unusable(one).result()
        else:
            part = _by_cells(one) if alike else by_all_starts(one)
        if group.size == len(rows):
            return part  # a copy of many rows takes much memory
        if found is None:
            found = jax.tree.map(lambda x: np.empty((len(rows), *x.shape[1:]), x.dtype), part)
        jax.tree.map(lambda whole, some: put(whole, group, some), found, part)  # noqa: B023
    return found


def _groups(rows: Rows, usable: np.ndarray, shared: bool) -> list[tuple[np.ndarray, bool]]:
    """Rows whose springs remember the same, each with whether a grid is worth its while; and all others."""
    left = np.flatnonzero(usable)
    if shared:
        return [(left, len(left) >= WORTHWHILE)]
    memories = np.stack([np.asarray(x)[left] for x in jax.tree.leaves(rows.each[2])], axis=1)
    _, kind, count = np.unique(memories, axis=0, return_inverse=True, return_counts=True)
    kind = kind.ravel()
    groups = [(left[kind == k], True) for k in np.flatnonzero(count >= WORTHWHILE)]
    return [*groups, (left[count[kind] < WORTHWHILE], False)]


def unusable(rows: Rows) -> Known:
    """Rows that cannot be solved, with the status that says why."""
    unknowns = rows.actuator.freedoms + sum(is_resistance(a) for a in rows.each[1])
    found = solved_from(rows, np.full((len(rows), unknowns), np.nan))
    which = np.arange(len(rows))[:, None]
    return Known(found, which, np.zeros_like(which, bool), np.zeros(len(rows), bool), np.arange(len(rows)))


def _by_cells(rows: Rows) -> tuple[Equilibrium, np.ndarray]:
    """Rows of springs that remember the same; see the module."""
    grid = map_of(rows, taken(rows.each[2], 0))
    ranges = CellRanges(grid, tuple(is_resistance(a) for a in rows.each[1]))
    found = None
    for first in range(0, len(rows), PIECE):
        part = _piece(rows.taken(slice(first, first + PIECE)), grid, ranges)
        if found is None:
            found = jax.tree.map(lambda x: np.empty((len(rows), *x.shape[1:]), x.dtype), part)
        jax.tree.map(lambda whole, some: put(whole, slice(first, first + PIECE), some), found, part)  # noqa: B023
    return found


class _Answers:
    """Answers of rows so far.

    Attributes:
        best: the least heated equilibrium of every row, and its joint unknowns; None at first.
        sure: true for rows of which no equilibrium was missed, as far as their signs tell, shape (rows,).
        flat: true for those whose only equilibrium may hide two others nearby, shape (rows,).
    """

    def __init__(self, size: int) -> None:
        """No answers yet for `size` rows."""
        self.best: Any = None
        self.sure, self.flat = np.zeros(size, bool), np.zeros(size, bool)

    def keep(self, which: np.ndarray, part: tuple, sure: np.ndarray) -> None:
        """Answers of some rows."""
        if self.best is None:
            size = len(self.sure)
            self.best = jax.tree.map(lambda x: np.empty((size, *x.shape[1:]), x.dtype), part)
        jax.tree.map(lambda whole, one: put(whole, which, one), self.best, part)
        self.sure[which] = sure


def _piece(rows: Rows, grid: PhaseMap, ranges: CellRanges) -> tuple[Equilibrium, np.ndarray]:
    """Rows of `_by_cells`."""
    readings, answers = readings_of(rows), _Answers(len(rows))
    seen = looked(grid, ranges, rows.each[0], readings)
    if seen.sound.any():  # otherwise no row has a cell to start from
        tried, every = _attempted(rows, grid, readings, seen)
        owner, lone = seen.row[tried], len(seen.first)
        _alone(answers, owner[:lone], taken(every, slice(lone)))
        _compared(answers, rows, owner[lone:], taken(every, slice(lone, None)))
        _beside_cold(answers, rows)
        _beside_cells(answers, rows, grid, seen, owner, every)
    on_grid = grid.holds(rows.each[0])
    for there, starts in ((on_grid, grid), (~on_grid, None)):
        left = np.flatnonzero(~answers.sure & there)
        if left.size:
            answers.keep(left, by_all_starts(rows.taken(left), starts), np.ones(len(left), bool))
    return answers.best


def _attempted(
    rows: Rows, grid: PhaseMap, readings: tuple[Reading, ...], seen: Looked
) -> tuple[np.ndarray, Solved]:
    """Attempts from cells, those of rows that are alone first; and the looks that they start from.

    At least one row must be sound.
    """
    tried = np.concatenate([seen.first, seen.some])
    row = seen.row[tried]
    own = tuple(Reading(r.value[row], r.measured) for r in readings)
    begin = starts_in(grid, rows.each[0][row], own, seen.cells[:, tried], seen.step[:, tried])
    new = ~is_repeated(row, place_of(begin, grid.size))
    return tried[new], _solved_at(rows.taken(row[new]), grid, begin[:, new])


def _solved_at(rows: Rows, grid: PhaseMap, fractions: np.ndarray) -> Solved:
    """Rows from what the grid promises at fractions of all springs, shape (springs, rows)."""
    measured = np.asarray([is_resistance(a) for a in rows.each[1]])
    return solved_from(
        rows, np.concatenate([starts_at(grid, rows.each[0], fractions), fractions[measured].T], axis=1)
    )


def _alone(answers: _Answers, row: np.ndarray, every: Solved) -> None:
    """Rows with one possible cell, as most are: one attempt each, and nothing to compare."""
    answers.keep(row, (every.result, every.unknowns), every.good)
    answers.flat[row] = every.good & (every.slope < FLAT)


def _compared(answers: _Answers, rows: Rows, owner: np.ndarray, every: Solved) -> None:
    """Rows with several possible cells: their equilibria are counted.

    Args:
        answers, rows: answers so far, and all rows.
        owner, every: attempts, and the row of each.
    """
    which = np.unique(owner)
    if not which.size:
        return
    some = rows.taken(which)
    known = with_third(some, counted(some, np.searchsorted(which, owner), every))
    known = counted_at_ends(some, known)
    answers.keep(which, known.result(), known.whole)
    lone = known.whole & (known.real.sum(axis=1) == 1)
    answers.flat[which] = lone & (known.every.slope[known.which[:, 0]] < FLAT)


def _beside_cold(answers: _Answers, rows: Rows) -> None:
    """Rows whose only equilibrium may hide two others, with a spring nearly cold: these are looked for."""
    result, unknowns = answers.best
    flat = answers.flat | answers.sure & (result.equilibria == 1) & beyond_cold(rows, result)
    if flat.any():
        which = np.flatnonzero(flat)
        some = rows.taken(which)
        known = with_cold_ends(some, np.arange(len(which)), solved_from(some, unknowns[which]))
        answers.keep(which, known.result(), np.ones(len(which), bool))


def _beside_cells(
    answers: _Answers, rows: Rows, grid: PhaseMap, seen: Looked, owner: np.ndarray, every: Solved
) -> None:
    """Rows that have missed an equilibrium: they start beside their cells as well.

    Args:
        answers, rows, grid: answers so far, all rows, and the grid.
        seen: cells of the rows.
        owner, every: attempts so far, and the row of each.
    """
    again = np.flatnonzero(seen.sound & ~answers.sure)
    if not again.size:
        return
    missed = np.flatnonzero(seen.possible & np.isin(seen.row, again))
    before = np.isin(owner, again)
    springs = len(seen.cells)
    ways = [np.asarray(way)[:, None] for way in itertools.product((-1.0, 1.0), repeat=springs)]
    begin = np.concatenate([fractions_beside(grid, seen.cells[:, missed], way) for way in ways], axis=1)
    others = np.tile(seen.row[missed], len(ways))
    more = joined([taken(every, before), _solved_at(rows.taken(others), grid, begin)])
    whose = np.searchsorted(again, np.concatenate([owner[before], others]))
    known = counted(rows.taken(again), whose, more)
    answers.keep(again, known.result(), known.whole)
