"""Equilibria of rows that attempts found, and whether these are all: the signs of their stiffness tell.

At given phases there is one equilibrium, so the map of fractions to resistances has degree one. Hence the
signs of the stiffness at all equilibria of a row add up to one. Rows whose signs do not have missed one. The
sum does not show two that were missed together, see `further_roots`.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np

from .balance import END_TOLERANCE
from .batches import Rows, Solved, contrasts_at_rest, is_resistance, solved_from, taken
from .result import Equilibrium, Status
from .root_search import MOST_ROOTS, distinct

INWARDS = 3.0
"""Number of `END_TOLERANCE` by which the reading of an exactly cold or hot spring is moved inside [1]."""
TWIN = 1e-5
"""Distance from the end at which an equilibrium beside an exactly cold or hot spring is looked for [1]."""
NEAR = 0.01
"""Maximum change of a scaled unknown with which an equilibrium is the same one after that [1]."""


class Known(NamedTuple):
    """Equilibria of rows that were found, those of a row the least heated first.

    Attributes:
        every: attempts, one after the other.
        which: indices of each row's attempts, shape (rows, roots).
        real: true for those that are equilibria.
        whole: true if the signs of all equilibria of a row add up to one.
        owner: row of each attempt.
    """

    every: Solved
    which: np.ndarray
    real: np.ndarray
    whole: np.ndarray
    owner: np.ndarray

    def result(self, root: np.ndarray | int = 0) -> tuple[Equilibrium, np.ndarray]:
        """One equilibrium of every row, and its joint unknowns."""
        at = self.which[np.arange(len(self.which)), root]
        found = taken(self.every.result, at)
        count = self.real.sum(axis=1)
        count = np.maximum(count, found.equilibria)
        several = (found.status == int(Status.converged)) & (count > 1)
        status = np.where(several, int(Status.several_equilibria), found.status)
        found = eqx.tree_at(lambda f: (f.status, f.equilibria), found, (status, count))
        return found, self.every.unknowns[at]


def joined(parts: list[Solved]) -> Solved:
    """Attempts, one part after the other."""
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def counted(rows: Rows, owner: np.ndarray, every: Solved) -> Known:
    """Equilibria of every row that attempts found.

    Args:
        rows: the rows, of which some may have no attempt.
        owner: row of each attempt, in any order.
        every: attempts.
    """
    size, total = len(rows), len(owner)
    order = np.argsort(owner, kind="stable")
    place = np.arange(total) - np.searchsorted(owner[order], owner[order])
    width = max(int(place.max()) + 1, 1)
    which = np.zeros((size, width), int)
    there = np.zeros((size, width), bool)
    which[owner[order], place], there[owner[order], place] = order, True
    good = there & (every.good & (every.sign != 0.0))[which]
    best, real = distinct(every.unknowns[which], good, rows.actuator.freedoms)
    which = np.take_along_axis(which, best, axis=1)
    signs = np.where(real, every.sign[which], 0.0).sum(axis=1)
    return Known(every, which, real, (signs == 1.0) & (real.sum(axis=1) < MOST_ROOTS), owner)


def counted_at_ends(rows: Rows, known: Known) -> Known:
    """Equilibria of rows, where those with an exactly cold or hot spring are counted rightly.

    At an end the map has another slope on either side, and a sign is that of one side. Another equilibrium
    may lie right beside, inside. It is looked for first. Then readings are moved to the inside, by a few of
    the tolerances within which a spring stays at its end. An equilibrium at the end that is gone then counts
    nothing: the two have met.

    Args:
        rows, known: rows, and what was found in them.
    """
    count = rows.actuator.freedoms
    here, _ = _at_ends(rows, known)
    row, root = np.nonzero(here.any(axis=0) & ~known.whole[:, None])
    if not row.size:
        return known
    starts = known.every.unknowns[known.which[row, root]]
    inner = np.where(here[:, row, root].T, np.abs(starts[:, count:] - TWIN), starts[:, count:])
    beside = solved_from(rows.taken(row), np.concatenate([starts[:, :count], inner], axis=1), patient=False)
    known = counted(rows, np.concatenate([known.owner, row]), joined([known.every, beside]))
    here, moved = _at_ends(rows, known)
    row, root = np.nonzero(here.any(axis=0) & ~known.whole[:, None])
    if not row.size:
        return known
    nearby = rows.taken(row)
    measured = [k for k, a in enumerate(rows.each[1]) if is_resistance(a)]
    for k, by in zip(measured, moved[:, row, root], strict=True):
        value = nearby.each[1][k].value + by
        nearby = Rows(nearby.actuator, eqx.tree_at(lambda e: e[1][k].value, nearby.each, value))  # noqa: B023
    starts = known.every.unknowns[known.which[row, root]]
    ended = solved_from(nearby, starts, patient=False)
    own, near = known.every.sign[known.which], np.max(np.abs(ended.unknowns - starts), axis=1) < NEAR
    signs = np.where(known.real, own, 0.0)
    kept = ended.good & near & (ended.sign == own[row, root])
    signs[row, root] = np.where(kept, own[row, root], 0.0)
    settled = (signs.sum(axis=1) == 1.0) & (known.real.sum(axis=1) < MOST_ROOTS)
    return known._replace(whole=known.whole | settled)


def _at_ends(rows: Rows, known: Known) -> tuple[np.ndarray, np.ndarray]:
    """Springs that are exactly cold or hot in equilibria, and by what their readings are moved inside [ohm].

    Readings with noise are left alone: their tolerance is wide. Both have the shape (measured, rows, roots).
    """
    count, here, moved = rows.actuator.freedoms, [], []
    measured = [k for k, a in enumerate(rows.each[1]) if is_resistance(a)]
    at_rest = contrasts_at_rest(rows.actuator)
    for place, k in enumerate(measured):
        activation, xi0 = rows.each[1][k], known.every.unknowns[known.which, count + place]
        least = END_TOLERANCE * at_rest[k]
        seen = known.every.result.springs[k].resistance[known.which]
        met = (np.abs(seen - activation.value[:, None]) <= least) & (activation.noise == 0.0)[:, None]
        here.append(known.real & met & ((xi0 >= 1.0) | (xi0 <= 0.0)))
        rises = np.where(known.every.contrasts[known.which, k] < 0.0, -1.0, 1.0)
        moved.append(np.where(here[-1], INWARDS * least * rises * np.where(xi0 >= 1.0, -1.0, 1.0), 0.0))
    return np.stack(here), np.stack(moved)
