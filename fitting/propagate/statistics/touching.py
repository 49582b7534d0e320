"""Rows in which the body may touch itself: how many, and by how much it bends there."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Touching:
    """Counts of rows in which the body may touch itself.

    Attributes:
        rows: number of these rows, shape ().
        least, most: least and largest of their angles [deg], shape (); infinite without such rows.
    """

    rows: np.ndarray
    least: np.ndarray
    most: np.ndarray

    @classmethod
    def of(cls, angles: np.ndarray = np.zeros(0)) -> "Touching":  # noqa: B008
        """Counts of rows.

        Args:
            angles: largest angle of each row in which it may touch itself [deg], and 0 of any other.
        """
        there = angles[angles > 0.0]
        ends = (np.min(there, initial=np.inf), np.max(there, initial=-np.inf))
        return cls(np.asarray(there.size), *map(np.asarray, ends))

    def merge(self, other: "Touching") -> "Touching":
        """Counts of both sets of rows."""
        return Touching(
            self.rows + other.rows, np.minimum(self.least, other.least), np.maximum(self.most, other.most)
        )
