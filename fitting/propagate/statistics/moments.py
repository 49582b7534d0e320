"""Moments of columns, and quantiles by a sketch; both mergeable."""

from dataclasses import dataclass

import numpy as np
from fastdigest import TDigest
from jaxtyping import Float

CENTROIDS = 300
"""Number of centroids of a t-digest. Ranks are then within 0.0006 of the exact ones at 10^6 values in 1 to
100 parts. At 0.1 and 99.9 % they are within 0.00003 (measured on a normal distribution). A sketch takes 5
kB."""


@dataclass(frozen=True)
class Moments:
    """Moments of each column: number, mean, sums of the second to fourth power of deviations, smallest,
    largest.

    Merged as in P. Pebay, Sandia report SAND2008-6212.
    """

    count: np.ndarray
    mean: np.ndarray
    second: np.ndarray
    third: np.ndarray
    fourth: np.ndarray
    smallest: np.ndarray
    largest: np.ndarray

    @classmethod
    def of(cls, y: Float[np.ndarray, "rows columns"]) -> "Moments":
        """Moments of rows, all of which must be finite."""
        if not len(y):
            zero = np.zeros(y.shape[1])
            return cls(zero, zero, zero, zero, zero, zero + np.inf, zero - np.inf)
        mean = y.mean(axis=0)
        off = y - mean
        square = off * off
        return cls(
            np.full(y.shape[1], float(len(y))), mean, square.sum(0), (square * off).sum(0),
            (square * square).sum(0), y.min(0), y.max(0),
        )  # fmt: skip

    def merge(self, other: "Moments") -> "Moments":
        """Moments of both sets of rows together."""
        na, nb = self.count, other.count
        n = np.maximum(na + nb, 1.0)
        d = np.where((na > 0) & (nb > 0), other.mean - self.mean, 0.0)
        a2, b2, a3, b3 = self.second, other.second, self.third, other.third
        return Moments(
            count=na + nb,
            mean=np.where(na == 0, other.mean, self.mean + d * nb / n),
            second=a2 + b2 + d**2 * na * nb / n,
            third=a3 + b3 + d**3 * na * nb * (na - nb) / n**2 + 3.0 * d * (na * b2 - nb * a2) / n,
            fourth=(
                self.fourth + other.fourth + d**4 * na * nb * (na**2 - na * nb + nb**2) / n**3
                + 6.0 * d**2 * (na**2 * b2 + nb**2 * a2) / n**2 + 4.0 * d * (na * b3 - nb * a3) / n
            ),
            smallest=np.minimum(self.smallest, other.smallest),
            largest=np.maximum(self.largest, other.largest),
        )  # fmt: skip

    @property
    def nan_where_empty(self) -> "Moments":
        """The same with NaN instead of 0 where there are no rows."""
        none = self.count == 0
        known = lambda x: np.where(none, np.nan, x)  # noqa: E731
        return Moments(
            self.count, known(self.mean), known(self.second), known(self.third), known(self.fourth),
            known(self.smallest), known(self.largest),
        )  # fmt: skip

    @property
    def variance(self) -> np.ndarray:
        """Unbiased; NaN below two rows."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.count > 1, self.second / (self.count - 1.0), np.nan)

    @property
    def sd(self) -> np.ndarray:
        """Standard deviation."""
        return np.sqrt(self.variance)

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error of the mean, as if rows were independent: too large for Sobol sequences and Latin
        hypercubes."""
        return self.sd / np.sqrt(np.maximum(self.count, 1.0))

    @property
    def skewness(self) -> np.ndarray:
        """Third standardised moment."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.sqrt(self.count) * self.third / self.second**1.5

    @property
    def kurtosis(self) -> np.ndarray:
        """Fourth standardised moment, 3 for a normal distribution."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.count * self.fourth / self.second**2


@dataclass(frozen=True)
class Sketches:
    """A t-digest for each column, serialised."""

    digests: tuple[bytes, ...]

    @classmethod
    def of(cls, y: Float[np.ndarray, "rows columns"]) -> "Sketches":
        """Sketches of finite rows."""
        found = []
        for column in y.T:
            digest = TDigest(max_centroids=CENTROIDS)
            if len(column):
                digest.batch_update(np.ascontiguousarray(column))
            found.append(digest.to_bytes())
        return cls(tuple(found))

    def merge(self, other: "Sketches") -> "Sketches":
        """Sketches of both sets of rows."""
        pairs = zip(self.digests, other.digests, strict=True)
        merged = (TDigest.from_bytes(mine).merge(TDigest.from_bytes(theirs)) for mine, theirs in pairs)
        return Sketches(tuple(digest.to_bytes() for digest in merged))

    def quantiles(self, levels: Float[np.ndarray, " levels"]) -> Float[np.ndarray, "levels columns"]:
        """Quantiles of every column, NaN where there are no rows."""
        digests = [TDigest.from_bytes(digest) for digest in self.digests]
        asked = np.asarray(levels, float)
        columns = [np.full(len(asked), np.nan) if d.is_empty() else d.quantile_vec(asked) for d in digests]
        return np.asarray(columns, float).reshape(len(digests), len(asked)).T
