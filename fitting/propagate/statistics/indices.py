"""Sobol indices and Shapley effects as sums over blocks, with a bootstrap that is one pass, too.

Every block has a weight in each replicate, drawn from a Poisson distribution of mean one, seeded by the
block's chunk. Weighted sums merge like all others. The first replicate has weight one everywhere: the
estimate.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

REPLICATES = 200
"""Number of replicates of the bootstrap: a standard deviation from these is within 5 % (1-sigma)."""
COVERED = 1.959964
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True)
class Sums:
    """Weighted sums over whole blocks, one row for each replicate.

    Attributes:
        kind: `sobol` or `shapley`.
        blocks: number of blocks; left_out: of these, without a result in some row.
        weight: sum of weights, shape (replicates,).
        level: sums of a, b, a^2, b^2 and (a - b)^2 / 2, shape (5, replicates, columns). Here `a` and `b` are
            the block's first two rows less a fixed centre.
        terms: sums of each group's terms, shape (3 or 1, replicates, groups, columns). `sobol`: b (ab - a),
            ab - a and (a - ab)^2 / 2. `shapley`: the loss of variance as the group is fixed.
    """

    kind: str
    blocks: int
    left_out: int
    weight: Float[np.ndarray, " replicates"]
    level: Float[np.ndarray, "5 replicates columns"]
    terms: Float[np.ndarray, "n replicates groups columns"]

    @classmethod
    def of(
        cls,
        kind: str,
        y: Float[np.ndarray, "blocks rows columns"],
        centre: Float[np.ndarray, " columns"],
        orders: np.ndarray,
        random: np.random.Generator,
        replicates: int = REPLICATES,
    ) -> "Sums":
        """Sums of the blocks of a chunk.

        Args:
            kind: `sobol` or `shapley`.
            y: NaN in rows without a result.
            centre: taken off, the same in all chunks.
            orders: order of the groups in each block, for `shapley`.
            random: random numbers of the chunk.
            replicates: number of replicates of the bootstrap.
        """
        good = np.all(np.isfinite(y), axis=(1, 2))
        weights = np.concatenate([np.ones((1, len(y))), random.poisson(1.0, (replicates, len(y)))])[
            :, good
        ]  # drawn for all blocks, so that a block has its weight whatever fails beside it
        off = y[good] - centre
        a, b = off[:, 0], off[:, 1]
        level = np.stack([a, b, a**2, b**2, 0.5 * (a - b) ** 2])
        terms = _sobol(off) if kind == "sobol" else _shapley(off, orders[good])
        weighted = lambda x: np.tensordot(weights, x, axes=(1, 1))  # noqa: E731
        return cls(
            kind, len(y), int(np.sum(~good)), weights.sum(axis=1),
            np.moveaxis(weighted(level), 1, 0), np.moveaxis(weighted(terms), 1, 0),
        )  # fmt: skip

    def merge(self, other: "Sums") -> "Sums":
        """Sums of both sets of blocks."""
        return Sums(
            self.kind, self.blocks + other.blocks, self.left_out + other.left_out, self.weight + other.weight,
            self.level + other.level, self.terms + other.terms,
        )  # fmt: skip

    @property
    def share_left_out(self) -> float:
        """Share of all blocks that were left out."""
        return self.left_out / max(self.blocks, 1)

    def estimates(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Indices with the half-width of their 95 % interval, each of shape (groups, columns).

        `first` and `total` of Sobol, or `shapley`; NaN where the output does not vary.
        """
        replicated = self._replicated()
        found = {}
        for name, value in replicated.items():
            with np.errstate(invalid="ignore"):
                found[name] = value[0], COVERED * value[1:].std(axis=0, ddof=1)
        return found

    def _replicated(self) -> dict[str, np.ndarray]:
        """Indices in each replicate, shape (replicates, groups, columns)."""
        n = np.maximum(self.weight, 1.0)[:, None]
        a, b, a2, b2, half = self.level / n
        mean = 0.5 * (a + b)
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.kind == "shapley":
                return {"shapley": self.terms[0] / n[..., None] / half[:, None]}
            variance = (0.5 * (a2 + b2) - mean**2)[:, None]
            product, difference, jansen = self.terms / n[..., None]
            first = (product - mean[:, None] * difference) / variance
            return {"first": first, "total": jansen / variance}

    def bounds(self, low: np.ndarray, high: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Least and largest index of all blocks, if every failed row lay between `low` and `high`.

        Args:
            low, high: limits of each column, shape (columns,).
        """
        q, spread2 = self.share_left_out, (high - low) ** 2
        n = max(self.weight[0], 1.0)
        a, b, a2, b2, half = self.level[:, 0] / n
        variance = half if self.kind == "shapley" else 0.5 * (a2 + b2) - (0.5 * (a + b)) ** 2
        least = (1.0 - q) * variance
        most = np.minimum(0.25 * spread2, least + q * (1.25 - q) * spread2)
        found = {}
        for name, (value, _) in self.estimates().items():
            part = (1.0 - q) * value * variance
            reach = {"total": (0.0, 0.5), "first": (-1.0, 1.0), "shapley": (-0.5, 0.5)}[name]
            ends = [part + q * r * spread2 for r in reach]
            with np.errstate(divide="ignore", invalid="ignore"):
                lowest = np.where(ends[0] < 0.0, ends[0] / least, ends[0] / most)
                highest = ends[1] / least
            found[name] = np.clip(lowest, 0.0, 1.0), np.clip(highest, 0.0, 1.0)
        return found


def _sobol(y: np.ndarray) -> np.ndarray:
    """Terms of each block, shape (3, blocks, groups, columns)."""
    a, b, mixed = y[:, :1], y[:, 1:2], y[:, 2:]
    return np.stack([b * (mixed - a), mixed - a, 0.5 * (a - mixed) ** 2])


def _shapley(y: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """Terms of each block, shape (1, blocks, groups, columns).

    Row 1 keeps no group of A, row k the first k - 1 of the order, and A itself all.
    """
    a = y[:, :1]
    steps = np.concatenate([y[:, 1:], a], axis=1)  # none kept, one kept, ..., all kept
    unexplained = 0.5 * (a - steps) ** 2
    lost = unexplained[:, :-1] - unexplained[:, 1:]
    terms = np.empty_like(lost)
    np.put_along_axis(terms, orders[:, :, None], lost, axis=1)
    return terms[None]
