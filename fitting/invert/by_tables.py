"""Many targets of a chain without loads: searched in tables of its segments, corrected on the exact model."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.design.bodies import Body

from .atlas import Atlas, Span, goal_values
from .forward import fresh, in_parallel, made_once, states_of
from .goals import sizes
from .search import LAST_WEIGHT, MOST_STEPS, WEIGHT, Box, Found, replaced, search_tables
from .tables import Table, table_of

FEW, LOT = 16, 128
"""Numbers of searches that the compiled program takes at once. Up to `FEW` searches use the small one, more
the large one, so that two programs serve all."""
CORRECTIONS = 4
"""Maximum of corrections on the exact model. Each leaves about a hundredth of the miss before it."""
EXACT = 0.02
"""Largest change of an aim, by the error of the tables, that needs no further correction, in sizes of the
goals [1]. The size of a position is 1 mm, so this is 0.02 mm, a twenty-fifth of what is tolerated."""
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
    for table in made_once(body.segments, lambda segment: table_of(segment, pressure, *span)):
        if table is None:
            return None
        tables.append(table)
    return tuple(tables)


@dataclass(frozen=True)
class ByTables:
    """Searches of one chain in tables of its segments.

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
        """Searches in the tables from states of the atlas, arrays of shape (targets, starts, ...).

        Args:
            goals: names.
            wanted: values of the goals [SI], shape (targets, columns).
            near: indices of the states to start from, shape (targets, starts).
            most: maximum of steps.
        """
        targets, starts = near.shape
        places = self.box.places(self.atlas.drives[near.ravel()])
        found = self._search(goals, np.repeat(wanted, starts, axis=0), places, WEIGHT, most)
        return jax.tree.map(lambda x: x.reshape(targets, starts, *x.shape[1:]), found)

    def corrected(self, goals: tuple[str, ...], wanted: np.ndarray, found: Found) -> Found:
        """The same searches, ended on the exact model.

        Where the tables are wrong by an error, the search in them goes on with an aim that is off by that
        much the other way. An end is taken only if the exact model is closer to what is wanted there.

        Args:
            goals: names.
            wanted: values of the goals [SI], shape (searches, columns).
            found: ends of the searches in the tables, arrays with a leading axis of searches.
        """
        scale = np.asarray(sizes(goals))
        error = self._exact(goals, found.place) - found.values
        best = _with_exact_values(found, found.values + error, wanted, scale)
        going, aims = np.arange(len(wanted)), wanted  # indices of the searches that go on, and their aims
        for _ in range(CORRECTIONS):
            new_aims = wanted[going] - error
            moved = np.linalg.norm((new_aims - aims) / scale, axis=1) > EXACT
            going, error, aims = going[moved], error[moved], new_aims[moved]
            if not going.size:
                break
            ended = self._search(goals, aims, best.place[going], LAST_WEIGHT, CORRECTING)
            error = self._exact(goals, ended.place) - ended.values
            new = _with_exact_values(ended, ended.values + error, wanted[going], scale)
            closer = new.miss < best.miss[going]
            best = replaced(best, going[closer], jax.tree.map(lambda x, k=closer: x[k], new))
            going, error, aims = going[closer], error[closer], aims[closer]
        return best

    def _exact(self, goals: tuple[str, ...], places: np.ndarray) -> np.ndarray:
        """Values of the goals by the exact model [SI], shape (places, columns)."""
        drives = np.asarray(self.box.drives(places))
        solved = states_of(self.body, drives[:, 0], drives[:, 1:], fresh(self.body))
        return goal_values(solved, goals)

    def _search(
        self, goals: tuple[str, ...], wanted: np.ndarray, places: np.ndarray, weight: float, most: int
    ) -> Found:
        """Searches in the tables from places in the box; see `search_tables`."""

        def lot(part: tuple[np.ndarray, np.ndarray]) -> Found:
            aims, begin = part
            return search_tables(
                self.body, self.tables, goals, self.box, aims, begin, jnp.asarray(weight), jnp.asarray(most)
            )

        return in_parallel(lot, (wanted, places), FEW, LOT)


def _with_exact_values(found: Found, values: np.ndarray, wanted: np.ndarray, scale: np.ndarray) -> Found:
    """Ends of searches with the values of the exact model, and the miss that follows from them."""
    miss = np.linalg.norm((values - wanted) / scale, axis=1)
    miss = np.where(np.isfinite(miss) & np.isfinite(found.miss), miss, np.inf)
    return eqx.tree_at(lambda f: (f.miss, f.values), found, (miss, values))
