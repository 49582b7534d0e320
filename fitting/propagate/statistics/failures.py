"""Rows without a result: how many, why, where in the inputs; and what they can have changed."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from scipy.special import ndtr

BINS = 20
"""Classes of equal probability of each input: a failure at one end of 5 % shows in a class of its own."""


@dataclass(frozen=True)
class Failures:
    """Counts of rows.

    Attributes:
        rows: number of rows in each class of each input, shape (inputs, BINS).
        failed: the same of rows without a result.
        reasons: rows by status code, shape (256,).
    """

    rows: Int[np.ndarray, "inputs bins"]
    failed: Int[np.ndarray, "inputs bins"]
    reasons: Int[np.ndarray, "256"]

    @classmethod
    def of(
        cls, z: Float[np.ndarray, "rows inputs"], status: UInt8[np.ndarray, " rows"], good: np.ndarray
    ) -> "Failures":
        """Counts of rows at their scores.

        Args:
            z: normal scores.
            status: codes.
            good: true for rows with a result.
        """
        place = np.minimum((ndtr(z) * BINS).astype(int), BINS - 1)
        counts = [
            np.stack([np.bincount(x, minlength=BINS) for x in part.T]) for part in (place, place[~good])
        ]
        return cls(*counts, np.bincount(status, minlength=256))

    def merge(self, other: "Failures") -> "Failures":
        """Counts of both sets of rows."""
        return Failures(self.rows + other.rows, self.failed + other.failed, self.reasons + other.reasons)

    @property
    def total(self) -> int:
        """Number of rows."""
        return int(self.reasons.sum())

    @property
    def count(self) -> int:
        """Number of rows without a result."""
        return int(self.failed[0].sum()) if len(self.failed) else 0

    @property
    def share(self) -> float:
        """Share of all rows."""
        return self.count / max(self.total, 1)

    @property
    def shares(self) -> Float[np.ndarray, "inputs bins"]:
        """Share of failed rows in each class of each input."""
        return self.failed / np.maximum(self.rows, 1)

    @property
    def uneven(self) -> Float[np.ndarray, " inputs"]:
        """Largest distance between the distributions of an input in failed rows and in others [1], for each
        input.

        The Kolmogorov-Smirnov distance between the classes of failed rows and of all rows; 0 where nothing
        failed.
        """
        if not self.count:
            return np.zeros(len(self.rows))
        parts = (
            np.cumsum(part, axis=1) / part.sum(axis=1, keepdims=True) for part in (self.failed, self.rows)
        )
        failed, every = parts
        return np.abs(failed - every).max(axis=1)


def mean_bounds(mean: np.ndarray, low: np.ndarray, high: np.ndarray, share: float) -> tuple:
    """Least and largest mean of all rows, if failed rows lie between the smallest and largest seen."""
    return (1.0 - share) * mean + share * low, (1.0 - share) * mean + share * high


def sd_bounds(
    mean: np.ndarray, sd: np.ndarray, low: np.ndarray, high: np.ndarray, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same of the standard deviation.

    It is least with all failed rows at the mean of the others. It is largest with them at the two ends, at a
    weight for which the variance is stationary.
    """
    p, held = share, 1.0 - share
    least = np.sqrt(held) * sd
    spread = np.maximum(high - low, 1e-300)
    # variance over the weight w of the upper end: a parabola, largest where its slope is zero
    slope = p * (high**2 - low**2) - 2.0 * (held * mean + p * low) * p * spread
    weight = np.clip(slope / (2.0 * p**2 * spread**2) if p else 0.0 * mean, 0.0, 1.0)
    first = held * mean + p * (low + weight * spread)
    second = held * (sd**2 + mean**2) + p * (low**2 + weight * (high**2 - low**2))
    return least, np.sqrt(np.maximum(second - first**2, least**2))


def level_bounds(level: float, share: float) -> tuple[float, float]:
    """Levels among rows with a result between which a quantile of all rows lies, whatever failed rows are."""
    held = max(1.0 - share, 1e-12)
    return max(0.0, (level - share) / held), min(1.0, level / held)


def share_bounds(probability: float, share: float) -> tuple[float, float]:
    """Least and largest probability of all rows, from that of rows with a result."""
    return (1.0 - share) * probability, (1.0 - share) * probability + share
