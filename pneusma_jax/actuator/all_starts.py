"""Rows of known numbers whose equilibria are searched from all starts, many rows at a time."""

import jax
import numpy as np

from .batches import Rows, is_resistance, solved_at_phases, solved_from, starts_at, taken
from .further_roots import with_cold_ends
from .likely_cells import readings_of
from .phase_map import PhaseMap
from .result import Equilibrium
from .root_count import Known, counted, joined
from .starts import in_between, trial_fractions

TOGETHER = 64
"""Number of rows that are searched at a time with all starts; it bounds the memory."""
STRETCHES = np.linspace(-0.2, 0.4, 3)
BENDS = np.linspace(-0.6, 0.6, 9)
"""Scaled unknowns from which equilibria under loads are searched [1]. They are a stretch of -20 to 40 %, and
bends up to a full turn of the source's actuators. Their length is nine radii."""


def every_root(rows: Rows, grid: PhaseMap | None = None) -> Known:
    """All equilibria of usable rows by resistance, as `root_search.all_roots` finds those of one.

    Args:
        rows: usable rows.
        grid: equilibria at phases, if there is a grid that is sound about the rows' pressures.
    """
    count, size = rows.actuator.freedoms, len(rows)
    trials = trial_fractions(sum(is_resistance(a) for a in rows.each[1]))
    owner = np.repeat(np.arange(size), len(trials))
    many, trials = rows.taken(owner), np.tile(trials, (size, 1))
    if grid is None:
        begin = np.concatenate([np.full((len(owner), count), np.nan), trials], axis=1)
        seen = solved_from(many, begin, held=True)
        begin = np.where(seen.good[:, None], seen.unknowns, begin)
    else:
        fractions, given = [], iter(trials.T)
        for reading in readings_of(many):
            fractions.append(next(given) if reading.measured else reading.value)
        begin = np.concatenate([starts_at(grid, many.each[0], np.stack(fractions)), trials], axis=1)
    every = solved_from(many, begin)
    known = counted(rows, owner, every)
    roots = every.unknowns[known.which]
    between = in_between(np.where(known.real[..., None], roots, np.nan_to_num(roots)), known.real, count)
    others = np.repeat(np.arange(size), between.shape[1])
    more = solved_from(rows.taken(others), between.reshape(len(others), -1))
    return with_cold_ends(rows, np.concatenate([owner, others]), joined([every, more]))


def every_root_at_phases(rows: Rows) -> Known:
    """Equilibria of rows without measured resistances: without loads one each, under loads all that
    searches from `STRETCHES` and `BENDS` find."""
    found = solved_at_phases(rows, taken(rows.each[2], 0))
    owner = np.arange(len(rows))
    if not rows.actuator.loads:
        return counted(rows, owner, found)
    directions = rows.actuator.freedoms
    stretched = directions > 1 and rows.actuator.freedoms != 2 - rows.actuator.planar
    axes = [STRETCHES] * stretched + [BENDS] * (directions - stretched)
    trials = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, directions)
    others = np.repeat(owner, len(trials))
    more = solved_from(rows.taken(others), np.tile(trials, (len(rows), 1)))
    return counted(rows, np.concatenate([owner, others]), joined([found, more]))


def by_all_starts(rows: Rows, grid: PhaseMap | None = None) -> tuple[Equilibrium, np.ndarray]:
    """The least heated equilibrium of rows, each searched with all starts; `grid` as for `every_root`."""
    parts = []
    for first in range(0, len(rows), TOGETHER):
        parts.append(every_root(rows.taken(slice(first, first + TOGETHER)), grid).result())
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)
