"""Points of a study by their index: any block of rows can be made anywhere, without those before it."""

from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from .inputs import Inputs, normal_scores

METHODS = ("monte_carlo", "sobol", "latin_hypercube")
MOST_POINTS = 2**30
"""Points of SciPy's Sobol sequence, whose coordinates have 30 bits."""
TOGETHER = 1000
"""Blocks for Shapley effects that are made at once: 8 MB of matrices where 30 inputs are correlated."""


@dataclass
class Sampler:
    """Points in the unit cube, by chunk.

    A Sobol sequence is wound forward to a chunk's first point. Monte Carlo draws and Latin hypercubes have a
    random stream for each chunk. So each chunk has a Latin hypercube of its own (a replicated design).

    Attributes:
        method: one of `METHODS`.
        dimension: dimension of the cube.
        seed: seed of all random numbers.
        chunk: points of a whole chunk.
    """

    method: str
    dimension: int
    seed: int
    chunk: int
    _sequence: qmc.Sobol | None = field(default=None, init=False, repr=False)

    def points(self, index: int, count: int) -> Float[np.ndarray, "count dimension"]:
        """The first `count` points of a chunk."""
        if self.method == "sobol":
            return self._sobol(index * self.chunk, count)
        random = stream(self.seed, index, 0)
        if self.method == "monte_carlo":
            return random.random((count, self.dimension))
        return qmc.LatinHypercube(self.dimension, seed=random).random(count)

    def _sobol(self, first: int, count: int) -> np.ndarray:
        sequence = self._sequence
        if sequence is None or sequence.num_generated > first:
            sequence = qmc.Sobol(self.dimension, scramble=True, seed=np.random.default_rng(self.seed))
        if first > sequence.num_generated:
            sequence.fast_forward(first - sequence.num_generated)
        self._sequence = sequence
        if first == 0:  # SciPy warns of a first call that is no power of two; chunks are parts of a sequence
            return (
                np.concatenate([sequence.random(1), sequence.random(count - 1)])
                if count > 1
                else (sequence.random(1))
            )
        return sequence.random(count)


def stream(seed: int, index: int, purpose: int) -> np.random.Generator:
    """Random numbers of one chunk for one purpose, independent of all others."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(index, purpose))))


class Design(Protocol):
    """Rule that makes rows of the model from base points.

    Attributes:
        block: rows that belong together.
        dimension: dimension of a base point.
    """

    block: int
    dimension: int

    def rows(self, points: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Correlated scores, shape (points * block, inputs), and what the statistics must know of blocks.

        Args:
            points: points in the unit cube, shape (points, dimension).
            random: random numbers of the chunk.
        """


@dataclass(frozen=True)
class Plain:
    """Independent rows."""

    inputs: Inputs
    block: int = 1

    @property
    def dimension(self) -> int:
        """See `Design`."""
        return len(self.inputs.names)

    def rows(self, points: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """See `Design`."""
        z = normal_scores(points)
        return (z @ self.inputs.lower.T if self.inputs.correlated else z), np.zeros((len(points), 0), int)


@dataclass(frozen=True)
class InBlocks:
    """Designs whose base points are pairs of independent rows, A and B, with groups of inputs.

    Attributes:
        members: numbers of the inputs of each group.
    """

    inputs: Inputs
    members: tuple[tuple[int, ...], ...]
    beside: ClassVar[int]
    """Rows of a block beside one for each group."""

    @property
    def block(self) -> int:
        """See `Design`."""
        return len(self.members) + self.beside

    @property
    def dimension(self) -> int:
        """See `Design`."""
        return 2 * len(self.inputs.names)

    def pairs(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Independent scores of A and of B, each of shape (points, inputs)."""
        z, count = normal_scores(points), len(self.inputs.names)
        return z[:, :count], z[:, count:]


@dataclass(frozen=True)
class Saltelli(InBlocks):
    """Blocks A, B, and A with the inputs of one group from B: for Sobol indices of groups.

    A. Saltelli et al., Computer Physics Communications 181 (2010) 259, doi:10.1016/j.cpc.2009.09.018. Inputs
    of different groups must be independent.
    """

    beside = 2

    def rows(self, points: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """See `Design`."""
        a, b = (part @ self.inputs.lower.T for part in self.pairs(points))
        rows = np.repeat(a[:, None], self.block, axis=1)
        rows[:, 1] = b
        for k, members in enumerate(self.members):
            rows[:, k + 2, list(members)] = b[:, list(members)]
        return rows.reshape(-1, a.shape[1]), np.zeros((len(points), 0), int)


@dataclass(frozen=True)
class Shapley(InBlocks):
    """Blocks that let go of one group after the other, in random order: for Shapley effects.

    The first row is A. In row k the first k - 1 groups of the order keep A's values. All others are drawn
    again given these, by the copula. The order is that of the block. In the last row but one all groups but
    one are kept; in the second row none is. Source: E. Song, B. L. Nelson, J. Staum, SIAM/ASA J. Uncertainty
    Quantification 4 (2016) 1060, doi:10.1137/15M1048070, with one inner draw.
    """

    beside = 1

    def rows(self, points: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """See `Design`; beside the rows the order of groups, shape (points, groups)."""
        groups, count = len(self.members), len(self.inputs.names)
        orders = random.permuted(np.tile(np.arange(groups), (len(points), 1)), axis=1)
        first, second = self.pairs(points)
        rows = np.empty((len(points), self.block, count))
        for begin in range(0, len(points), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            rows[part] = self._let_go(orders[part], first[part], second[part])
        return rows.reshape(-1, count), orders

    def _let_go(self, orders: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Rows of some blocks, shape (points, block, inputs); `a` and `b` are independent scores."""
        count = a.shape[1]
        places = np.stack([np.concatenate([self.members[group] for group in order]) for order in orders])
        sizes = np.array([len(members) for members in self.members])[orders]
        kept = np.concatenate([np.full((len(a), 1), count), np.cumsum(sizes, axis=1) - sizes], axis=1)
        new = np.where(np.arange(count) < kept[:, :, None], a[:, None], b[:, None])
        if self.inputs.correlated:
            matrices = self.inputs.correlation[places[:, :, None], places[:, None, :]]
            new = new @ np.linalg.cholesky(matrices).swapaxes(1, 2)
        rows = np.empty_like(new)
        np.put_along_axis(rows, np.broadcast_to(places[:, None], new.shape), new, axis=2)
        return rows
