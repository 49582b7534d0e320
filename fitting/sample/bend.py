"""The bend of a valley, taken out: whitened coordinates in which a curved valley of the density is straight.

Constants that trade against each other do so along curves. A posterior is then a thin curved valley, in which
a chain can only make short steps. Second differences of the weighted residual tell how a valley bends.
Each whitened coordinate is moved by a quadratic form of later ones:

    bent_m = z_m + 1/2 sum_ij bend_mij s(z_i) s(z_j),  i, j > m,  s(z) = z (1 + (z / `LONGEST`)^8)^(-1/8)

Coordinates are in the order of how much they bend others. So this map can be undone for any bend, and it
keeps volumes. The sampled density needs no Jacobian for it. A wrong bend costs time, never a right answer.
It is the second-order reparametrisation of D. M. Bates and D. G. Watts (J. R. Stat. Soc. B 42 (1980) 1),
cut to what is triangular.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .chart import Chart
from .laplace import Laplace
from .plateaus import Plateaus

LONGEST = 5.0
"""Coordinate up to which a bend grows, in standard deviations. Up to half of it the growth is quadratic to
one part in 1,000, since a bend may be fifty standard deviations wide."""
SPANS = (0.3, 1.0, 1.0)
"""Distances over which differences are taken, in standard deviations. Later passes are about the bend of the
earlier ones; most of what is left is of higher order."""
PROBES = 64
"""Number of draws that judge a bend."""
WORTH = 0.9
"""Maximum ratio of the new to the old distance from a Gaussian for which a bend is taken."""

SLIGHT = 0.01
"""Sum of squared second differences that counts as none, in standard deviations."""

Rows = Callable[[Float[np.ndarray, "points n"], Float[np.ndarray, "n n n"]], Float[np.ndarray, "points rows"]]
"""Weighted residuals, priors included, at whitened points beside a bend."""


def bent(z: Float[Array, " n"], bend: Float[Array, "n n n"]) -> Float[Array, " n"]:
    """Coordinates of the straight whitened map from those that follow the valley."""
    short = _short(z)
    return z + 0.5 * (bend @ short) @ short


def _short(z: Array) -> Array:
    """The coordinates, none beyond `LONGEST`."""
    return z * (1.0 + (z / LONGEST) ** 8) ** (-0.125)


def unbent(points: Float[np.ndarray, "m n"], bend: Float[np.ndarray, "n n n"]) -> Float[np.ndarray, "m n"]:
    """The inverse of `bent`, of many points: the loosest coordinate first."""
    z = np.array(points, float)
    for k in range(len(bend) - 2, -1, -1):
        z[:, k] -= _shift(z[:, k + 1 :], bend[k, k + 1 :, k + 1 :])
    return z


def _shift(z: Float[np.ndarray, "m k"], form: Float[np.ndarray, "k k"]) -> Float[np.ndarray, " m"]:
    """Half a quadratic form of shortened coordinates."""
    short = _short(z)
    return 0.5 * np.sum((short @ form) * short, axis=1)


class BentChart(Chart):
    """Whitened coordinates in which a posterior's valley is straight, for walkers.

    Args:
        sign: as of `Chart`.
        centre: centre of the whitened coordinates in the chart, shape (n,).
        root: root of their covariance there, regular, shape (n, n).
        bend: the bend of the valley, shape (n, n, n).
        plateaus: as of `Chart`.
    """

    def __init__(
        self,
        sign: Int[np.ndarray, " n"],
        centre: Float[np.ndarray, " n"],
        root: Float[np.ndarray, "n n"],
        bend: Float[np.ndarray, "n n n"],
        plateaus: Plateaus | None = None,
    ):
        super().__init__(sign, plateaus)
        self.centre, self.root, self.bend = (np.asarray(part, float) for part in (centre, root, bend))

    def to_chart(self, vector: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Whitened coordinates from those of the target."""
        away = np.reshape(super().to_chart(vector) - self.centre, (-1, len(self.centre)))
        return unbent(np.linalg.solve(self.root, away.T).T, self.bend).reshape(np.shape(vector))

    def to_target(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... n"]:
        """Coordinates of the target from whitened ones."""
        return super().to_target(self._in_chart(point))

    def log_jacobian(self, point: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "..."]:
        """Logarithm of the Jacobian determinant of `to_target`, up to a constant."""
        return super().log_jacobian(self._in_chart(point))

    def scaled_root(self, found: Laplace, spread: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
        """Root of the covariance in whitened coordinates: the identity."""
        return np.eye(len(self.centre))

    def _in_chart(self, point: np.ndarray) -> np.ndarray:
        z = np.reshape(point, (-1, len(self.centre)))
        straight = z + np.stack([_shift(z, form) for form in self.bend], axis=1)
        return np.reshape(self.centre + straight @ self.root.T, np.shape(point))


def order_of(rows: Rows, determined: Bool[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Order of the whitened coordinates: those that bend others the most, and are bent the least, last.

    Args:
        rows: residuals at whitened points.
        determined: true for the coordinates that the residuals determine, shape (n,).
    """
    size = len(determined)
    slope, second = _differences(rows, np.zeros((size, size, size)), SPANS[0])
    along = np.linalg.pinv(slope.T) @ second[np.arange(size), np.arange(size)].T
    along = np.where(np.eye(size, dtype=bool) | ~np.logical_and.outer(determined, determined), 0.0, along)
    bends, is_bent = np.sum(along**2, axis=0), np.sum(along**2, axis=1)
    return np.argsort((bends + SLIGHT) / (is_bent + SLIGHT), kind="stable")


def bend_of(rows: Rows, determined: Bool[np.ndarray, " n"], seed: int) -> Float[np.ndarray, "n n n"]:
    """The bend of a valley about the origin; zero where it brings the density no closer to a Gaussian.

    Args:
        rows: residuals at whitened points, in the order of `order_of`.
        determined: true for the coordinates that the residuals determine, shape (n,).
        seed: seed of the draws that judge it.
    """
    size = len(determined)
    straight, place = np.zeros((size, size, size)), np.arange(size)
    later = place[:, None, None] < np.minimum(place[:, None], place)
    allowed = later & np.logical_and.outer(determined, np.logical_and.outer(determined, determined))
    probes = np.random.default_rng(seed).standard_normal((PROBES, size)) * determined
    found, inverse = straight, None
    for span in SPANS:
        slope, second = _differences(rows, found, span)
        inverse = np.linalg.pinv(slope.T) if inverse is None else inverse
        found = found - np.where(allowed, np.einsum("mr,ijr->mij", inverse, second), 0.0)
    better = _distance(rows, found, probes) <= WORTH * _distance(rows, straight, probes)
    return found if better else straight


def _differences(
    rows: Rows, bend: Float[np.ndarray, "n n n"], span: float
) -> tuple[Float[np.ndarray, "n rows"], Float[np.ndarray, "n n rows"]]:
    """First and second derivatives of the residuals at the origin, by central differences.

    A second derivative that is not finite counts as zero.
    """
    size = len(bend)
    first, other = np.triu_indices(size, 1)
    axes = np.eye(size)
    pairs = (axes[first] + axes[other]) / np.sqrt(2.0)
    ways = span * np.concatenate([axes, pairs])
    found = rows(np.concatenate([np.zeros((1, size)), ways, -ways]), bend)
    here, ahead, behind = found[0], found[1 : 1 + len(ways)], found[1 + len(ways) :]
    along = (ahead + behind - 2.0 * here) / span**2
    along = np.where(np.all(np.isfinite(along), axis=1, keepdims=True), along, 0.0)
    second = np.zeros((size, size, found.shape[1]))
    second[np.arange(size), np.arange(size)] = along[:size]
    mixed = along[size:] - 0.5 * (along[first] + along[other])
    second[first, other] = second[other, first] = mixed
    return np.nan_to_num(ahead[:size] - behind[:size]) / (2.0 * span), second


def _distance(rows: Rows, bend: Float[np.ndarray, "n n n"], probes: Float[np.ndarray, "m n"]) -> float:
    """Mean of `log(1 + |difference of log-densities|)` from the Gaussian, as a chart is judged."""
    found = rows(np.concatenate([np.zeros_like(probes[:1]), probes]), bend)
    square = np.sum(found**2, axis=1)
    off = 0.5 * (square[1:] - square[0] - np.sum(probes**2, axis=1))
    return float(np.mean(np.log1p(np.abs(np.nan_to_num(off, nan=1e6, posinf=1e6)))))
