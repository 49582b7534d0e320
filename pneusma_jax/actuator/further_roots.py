"""Further equilibria of rows of which some are known: a third beyond two, those with a nearly cold spring.

Two that were missed together lie beside the one that was found, with a spring nearly cold. So rows whose
resistances hardly change with the fractions (`FLAT`) are looked at once more. So are rows whose cold spring
has too small a resistance.
"""

import numpy as np

from .balance import END_DEVIATIONS, END_TOLERANCE
from .batches import Rows, Solved, contrasts_at_rest, is_resistance, solved_from
from .result import Equilibrium
from .root_count import Known, counted, joined
from .starts import beside_cold

FLAT = 0.01
"""Minimum slope of resistances over fractions [1], see `Ended`, at which one equilibrium is believed to be
alone. In 10,000 random rows of PneuSMA2 it was below 0.008 in 0.1 % of those with one. Of 9 rows that came
back as another one, each with a nearly cold spring, it was below 0.006 in 8."""
BEYOND = (0.5, 1.0, 2.0)
"""Distances of starts beyond an unstable equilibrium, over that to the stable one on its other side [1]."""


def with_third(rows: Rows, known: Known) -> Known:
    """Equilibria of rows, and the third one of rows where two were found, of which one is unstable.

    It is looked for on the line through both, beyond the unstable one.

    Args:
        rows, known: rows, and what was found in them.
    """
    two = np.flatnonzero(~known.whole & (known.real.sum(axis=1) == 2))
    if not two.size:
        return known
    at = known.which[two, :2]
    stable = known.every.sign[at] > 0.0
    two, at, stable = (x[stable.sum(axis=1) == 1] for x in (two, at, stable))
    if not two.size:
        return known
    roots, count = known.every.unknowns[at], rows.actuator.freedoms
    turned = roots[~stable]
    starts = turned + np.asarray(BEYOND)[:, None, None] * (turned - roots[stable])
    starts[..., count:] = np.clip(starts[..., count:], 0.0, 1.0)
    others = np.tile(two, len(BEYOND))
    more = solved_from(rows.taken(others), starts.reshape(len(others), -1))
    return counted(rows, np.concatenate([known.owner, others]), joined([known.every, more]))


def with_cold_ends(rows: Rows, owner: np.ndarray, every: Solved) -> Known:
    """Equilibria that attempts found and those beside them, see `starts.beside_cold`.

    Args:
        rows, owner, every: the same as those of `root_count.counted`.
    """
    known = counted(rows, owner, every)
    roots = every.unknowns[known.which[known.real]]
    if not len(roots):
        return known
    starts, held = beside_cold(roots[:, None], np.ones((len(roots), 1), bool), rows.actuator.freedoms)
    others = np.repeat(np.flatnonzero(known.real) // known.real.shape[1], len(held))
    many, starts, held = rows.taken(others), starts.reshape(len(others), -1), np.tile(held, (len(roots), 1))
    seen = solved_from(many, starts, held)
    more = solved_from(many, np.where(seen.good[:, None], seen.unknowns, starts))
    return counted(rows, np.concatenate([owner, others]), joined([every, more]))


def beyond_cold(rows: Rows, result: Equilibrium) -> np.ndarray:
    """Whether a spring was found cold with a smaller resistance than was measured."""
    found, at_rest = np.zeros(len(rows), bool), contrasts_at_rest(rows.actuator)
    for contrast, activation, seen in zip(at_rest, rows.each[1], result.springs, strict=True):
        if is_resistance(activation):
            least = END_TOLERANCE * contrast + END_DEVIATIONS * activation.noise
            found |= (seen.xi0 >= 1.0) & (np.abs(seen.resistance - activation.value) > least)
    return found
