"""Correlations of the inputs' normal scores with every column; mergeable."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Correlation:
    """Sums about a fixed centre.

    Attributes:
        count: number of rows.
        first: sums of scores and columns, shape (inputs + columns,).
        square: sums of their squares.
        cross: sums of products, shape (inputs, columns).
    """

    count: float
    first: Float[np.ndarray, " all"]
    square: Float[np.ndarray, " all"]
    cross: Float[np.ndarray, "inputs columns"]

    @classmethod
    def of(
        cls, z: Float[np.ndarray, "rows inputs"], y: Float[np.ndarray, "rows columns"], centre: np.ndarray
    ) -> "Correlation":
        """Sums of rows with a result.

        Args:
            z: normal scores.
            y: columns.
            centre: taken off the columns, the same in all parts of a study.
        """
        off = y - centre
        both = np.concatenate([z, off], axis=1)
        return cls(float(len(y)), both.sum(0), (both**2).sum(0), z.T @ off)

    def merge(self, other: "Correlation") -> "Correlation":
        """Sums of both sets of rows."""
        return Correlation(
            self.count + other.count, self.first + other.first, self.square + other.square,
            self.cross + other.cross,
        )  # fmt: skip

    @property
    def coefficients(self) -> Float[np.ndarray, "inputs columns"]:
        """Pearson's, NaN where something does not vary."""
        inputs, n = len(self.cross), max(self.count, 1.0)
        spread = np.sqrt(np.maximum(self.square / n - (self.first / n) ** 2, 0.0))
        product = self.cross / n - np.outer(self.first[:inputs], self.first[inputs:]) / n**2
        with np.errstate(divide="ignore", invalid="ignore"):
            return product / np.outer(spread[:inputs], spread[inputs:])
