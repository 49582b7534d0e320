"""Scores of sets of effects from one Gram matrix: every pair exactly to second order, triples greedily.

An effect may be hidden by another one: alone it looks bad, and both together explain everything. So sets are
scored, not effects. All sensitivities about a point, whitened and projected off the base, give one Gram
matrix. A few normal equations then give the gain of any set of effects, each at one shape. They are solved
for thousands of sets at a time. Strengths keep their signs and bounds.

A set is worth its log marginal likelihood. That counts the misfit that it leaves, and the prior of its
strengths over what the recordings tell of them. The price is the number of sets of its size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fitting.inference.chance import log_chi_square_tail

from ..evaluate.program import Program
from ..evaluate.unknowns import Unknowns
from .evidence import log_sets
from .score_test import simulated
from .sensitivities import Block, Sensitivities


@dataclass(frozen=True)
class SetScore:
    """Score of a set of effects, each at one shape.

    Attributes:
        slugs: effects.
        promised: objective that it leaves, to second order.
        cost: negative log marginal likelihood, less a constant of the point.
        start: scaled numbers from which to fit it.
    """

    slugs: tuple[str, ...]
    promised: float
    cost: float
    start: np.ndarray


class Gram:
    """Normal equations of every set of blocks about one point.

    Args:
        look: sensitivities about the point.
        unknowns: unknowns of the campaign.
    """

    def __init__(self, look: Sensitivities, unknowns: Unknowns):
        self.blocks, self._unknowns, square = look.blocks, unknowns, look.scale**2
        widths = [b.columns.shape[1] for b in self.blocks]
        self._left = 0.5 * square * float(look.left @ look.left)
        total = sum(widths)
        X = np.concatenate([*(b.columns for b in self.blocks), np.zeros((len(look.left), 1))], axis=1)
        self.X = X
        self._G, self._g = X.T @ X, -look.scale * (X.T @ look.left)
        self._place = np.full((len(self.blocks), max(widths, default=1)), total)  # the last column is nothing
        self._low, self._high = np.zeros(total + 1), np.zeros(total + 1)
        first = 0
        for k, (block, width) in enumerate(zip(self.blocks, widths, strict=True)):
            place = first + np.arange(width)
            self._place[k, :width] = place
            # a whole change is taken as it is or not at all
            self._low[place] = 0.0 if block.whole else unknowns.low[block.own]
            self._high[place] = 1.0 if block.whole else unknowns.high[block.own]
            first += width

    def solve(self, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Strengths of sets of blocks, what they leave, and their information.

        Args:
            sets: indices of blocks, (sets, size).

        Returns:
            Scaled strengths (sets, size, width), objective (sets,), information over that of the priors
            (sets, strengths, strengths). A set of which one effect would act the wrong way leaves all.
        """
        count, size = sets.shape
        place = self._place[sets].reshape(count, -1)
        H, g = self._G[place[:, :, None], place[:, None, :]], self._g[place]
        low, high = self._low[place], self._high[place]
        active, eye = place < len(self._g) - 1, np.eye(place.shape[1])
        c = np.zeros(place.shape)
        for _ in range(place.shape[1]):
            c = np.linalg.solve(_kept(H, active, eye), np.where(active, g, 0.0)[:, :, None])[:, :, 0]
            wrong = active & (((c < 0.0) & (low >= 0.0)) | ((c > 0.0) & (high <= 0.0)))
            if not wrong.any():
                break
            active &= ~wrong
        c = np.where(active, np.clip(c, low, high), 0.0)
        gain = np.einsum("si,si->s", g, c) - 0.5 * np.einsum("si,sij,sj->s", c, H, c)
        whole = np.all(np.any(active.reshape(count, size, -1), axis=2), axis=1)
        spread = np.where(active, (high - low) / np.sqrt(12.0), 0.0)
        told = spread[:, :, None] * H * spread[:, None, :]
        return c.reshape(count, size, -1), self._left - np.where(whole, gain, 0.0), told

    def start(self, chosen: np.ndarray, strengths: np.ndarray, neutral: np.ndarray) -> np.ndarray:
        """Scaled numbers of a set of blocks: base constants of the point, shapes and strengths of the set."""
        u = self.blocks[chosen[0]].u.copy()
        effects = np.array([bool(item.effect) for item in self._unknowns.items])
        u[effects] = neutral[effects]
        for k, c in zip(chosen, strengths, strict=True):
            block = self.blocks[k]
            whose = self._unknowns.of([block.slug])
            u[whose] = block.u[whose]
            if not block.whole:
                u[block.own] = c[: len(block.own)]
        return u

    def best_log_p(self, sets: np.ndarray, products: np.ndarray) -> np.ndarray:
        """Log p-value of the set that explains most of each draw of errors, (draws,).

        Args:
            sets: indices of blocks, (sets, size).
            products: of all sensitivities with errors in units of the noise, (sensitivities, draws).
        """
        g, eye = products, np.eye(self._place.shape[1] * sets.shape[1])
        place = self._place[sets].reshape(len(sets), -1)
        active = place < len(self._g) - 1
        freedom, most, together = active.sum(axis=1), {}, 200  # for memory's sake alone
        for part in np.array_split(np.arange(len(sets)), max(len(sets) // together, 1)):
            H = self._G[place[part][:, :, None], place[part][:, None, :]]
            seen = g[place[part]]
            gains = np.sum(seen * np.linalg.solve(_kept(H, active[part], eye), seen), axis=1)
            for df in np.unique(freedom[part]):
                found = gains[freedom[part] == df].max(axis=0)
                most[df] = np.maximum(most.get(df, 0.0), found)
        return np.min([log_chi_square_tail(gain, df) for df, gain in most.items()], axis=0)


def pairs_p_value(look: Sensitivities, unknowns: Unknowns, rng: np.random.Generator) -> float:
    """P-value of the pair that explains most, all pairs counted, by simulated nulls; 1 where there is none.

    Two effects may hide each other, so that neither has a score that stands out.
    """
    pairs = _different(combinations(range(len(look.blocks)), 2), look.blocks)
    if not len(pairs):
        return 1.0
    gram = Gram(look, unknowns)
    drawn, seen = simulated(gram.X, look.left, rng), (gram.X.T @ look.left)[:, None]
    null, here = (gram.best_log_p(pairs, products) for products in (drawn, seen))
    return float((np.sum(null <= here) + 1) / (len(null) + 1))


def _kept(H: np.ndarray, active: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Normal equations of the active strengths; the others are held at zero."""
    both = active[:, :, None] & active[:, None, :]
    kept = np.where(both, H, 0.0)
    ridge = 1e-9 * np.trace(kept, axis1=1, axis2=2)[:, None, None]
    return kept + eye * np.where(active[:, :, None], ridge + 1e-30, 1.0)


def best_sets(look: Sensitivities, program: Program, neutral: np.ndarray, most: int) -> list[SetScore]:
    """The best pairs of effects about a point, each at its best shapes, and triples that extend them.

    Args:
        look: sensitivities about the point.
        program: program of the campaign.
        neutral: scaled numbers of the model there; absent effects at their absence.
        most: number of sets of each size.

    Returns:
        The best first, by marginal likelihood, misfit deflated by what the best pair leaves.
    """
    if len(look.blocks) < 2:
        return []
    gram = Gram(look, program.unknowns)
    pairs = _different(combinations(range(len(gram.blocks)), 2), gram.blocks)
    if not len(pairs):
        return []
    found = _ranked(gram, program, neutral, pairs, most)
    triples = [(*pair, k) for pair, _ in found for k in range(len(gram.blocks))]
    triples = _different(triples, gram.blocks)
    return [score for _, score in found] + (
        [score for _, score in _ranked(gram, program, neutral, triples, most)] if len(triples) else []
    )


def _different(sets: Sequence[tuple[int, ...]], blocks: list[Block]) -> np.ndarray:
    """Sets of blocks of effects that differ."""
    sets = list(sets)
    kept = [one for one in sets if len({blocks[k].slug for k in one}) == len(one)]
    return np.array(kept, int).reshape(len(kept), len(sets[0]) if sets else 0)


def _ranked(
    gram: Gram, program: Program, neutral: np.ndarray, sets: np.ndarray, most: int
) -> list[tuple[tuple[int, ...], SetScore]]:
    """The best sets of blocks, each set of effects once, and their scores."""
    strengths, left, told = gram.solve(sets)
    values = max(program.observations(program.fitted), 1)
    inflation = max(1.0, 2.0 * float(left.min()) / values)
    occam = 0.5 * np.linalg.slogdet(told / inflation + np.eye(told.shape[1]))[1]
    cost = left / inflation + occam + log_sets(len(program.unknowns.slugs), sets.shape[1])
    found: dict[frozenset, tuple] = {}
    for j in np.argsort(cost):
        slugs = tuple(gram.blocks[k].slug for k in sets[j])
        if frozenset(slugs) not in found:
            start = gram.start(sets[j], strengths[j], neutral)
            score = SetScore(slugs, float(left[j]), float(cost[j]), start)
            found[frozenset(slugs)] = tuple(sets[j]), score
            if len(found) == most:
                break
    return list(found.values())
