"""Many targets of a chain without loads: searched in tables of its segments, corrected on the exact model."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.design.bodies import Body

from .atlas import Atlas, Span, goal_values
from .forward import fresh, in_parallel, made_once, states_of
from .goals import sizes
from .search import LAST_WEIGHT, MOST_STEPS, WEIGHT, Box, Found, search_tables
from .tables import Table, table_of

FEW, LOT = 16, 128
"""Number of searches that go through the program together: few or many, so that two programs serve all."""
CORRECTIONS = 4
"""Maximum of corrections on the exact model. Each leaves about a hundredth of the miss before it."""
EXACT = 0.02
"""Difference of the exact values from those wanted of the tables at which no correction is needed, in sizes
of the goals [1]: 0.02 mm, a twenty-fifth of what is tolerated."""
CORRECTING = 10
"""Maximum of steps of a correction; it starts where the tables meet the target."""


def tables_of(body: Body, pressure: tuple[float, float], span: Span) -> tuple[Table, ...] | None:
    """Tables of a chain's segments, equal ones made once; None for a body that has to be solved as a whole.

    Args:
        body: the body that is driven.
        pressure: lowest and highest, gauge [Pa].
        span: least and largest fraction.
    """
    if body.chain is None or body.chain.loaded:
        return None
    tables = []
    for own in made_once(body.segments, lambda segment: table_of(segment, pressure, *span)):
        if own is None:
            return None
        tables.append(own)
    return tuple(tables)


@dataclass(frozen=True)
class ByTables:
    """Searches of one chain.

    Attributes:
        body, atlas: the chain, and states to start from.
        tables, box: tables of its segments, and ranges of the drives.
    """

    body: Body
    atlas: Atlas
    tables: tuple[Table, ...]
    box: Box

    def searched(
        self, goals: tuple[str, ...], wanted: np.ndarray, near: np.ndarray, most: int = MOST_STEPS
    ) -> Found:
        """Searches in the tables from states of the atlas, arrays of shape (targets, starts, ...)."""
        targets, starts = near.shape
        places = self.box.places(self.atlas.drives[near.ravel()])
        found = self._lots(goals, np.repeat(wanted, starts, axis=0), places, WEIGHT, most)
        return jax.tree.map(lambda x: x.reshape(targets, starts, *x.shape[1:]), found)

    def corrected(self, goals: tuple[str, ...], wanted: np.ndarray, found: Found) -> Found:
        """The same ends on the exact model: what the tables are off there is added to their targets."""
        scale, aimed = np.asarray(sizes(goals)), wanted.copy()
        off = self._exact(goals, found.place) - found.values
        best = _exactly(found, found.values + off, wanted, scale)
        rows = np.arange(len(wanted))
        for _ in range(CORRECTIONS):
            # the aim of the search so far against the one that the tables' error asks for
            late = np.linalg.norm((wanted[rows] - off - aimed) / scale, axis=1)
            rows, off = rows[late > EXACT], off[late > EXACT]
            if not rows.size:
                break
            aimed = wanted[rows] - off
            again = self._lots(goals, aimed, best.place[rows], LAST_WEIGHT, CORRECTING)
            off = self._exact(goals, again.place) - again.values
            new = _exactly(again, again.values + off, wanted[rows], scale)
            better = new.miss < best.miss[rows]
            best = jax.tree.map(lambda a, b, k=rows[better], m=better: _put(a, k, b[m]), best, new)
            rows, off, aimed = rows[better], off[better], aimed[better]
        return best

    def _exact(self, goals: tuple[str, ...], places: np.ndarray) -> np.ndarray:
        drives = np.asarray(self.box.drives(places))
        solved = states_of(self.body, drives[:, 0], drives[:, 1:], fresh(self.body))
        return goal_values(solved, goals)

    def _lots(
        self, goals: tuple[str, ...], wanted: np.ndarray, places: np.ndarray, weight: float, most: int
    ) -> Found:
        last = jnp.asarray(weight), jnp.asarray(most)
        work = lambda row: search_tables(self.body, self.tables, goals, self.box, *row, *last)  # noqa: E731
        return in_parallel(work, (wanted, places), FEW, LOT)


def _exactly(found: Found, values: np.ndarray, wanted: np.ndarray, scale: np.ndarray) -> Found:
    """Ends with the values of the exact model, and the miss by these."""
    miss = np.linalg.norm((values - wanted) / scale, axis=1)
    miss = np.where(np.isfinite(miss) & np.isfinite(found.miss), miss, np.inf)
    return Found(found.place, miss, values, found.effort, found.slope, found.unknowns, found.steps)


def _put(old: np.ndarray, where: np.ndarray, new: np.ndarray) -> np.ndarray:
    old = np.array(old)
    old[where] = new
    return old
