"""Correlated noise that the constants of a fit have taken up, which its residuals do not show.

Constants follow the slow part of noise: that is where their errors come from. So the residuals have less of
it, and standard errors made from them are too small. For first-order noise it follows from the fitted
directions how much a fit takes up. So that is computed, and put back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

from .serial_correlation import lag_one, windowed_correlation

optimize = Late("scipy.optimize")

MOST = 0.99
"""Maximum correlation of neighbours that is asked for: noise of 100 samples in a row."""


@dataclass(frozen=True)
class Absorbed:
    """What residuals say of noise, with what the fit has taken up.

    Attributes:
        mean_square: factor by which the fit made its mean square too small, 1 or more.
        correlation_time: samples of the noise that count as one independent one, 1 or more.
    """

    mean_square: float
    correlation_time: float


def with_absorbed(series: Sequence[np.ndarray], directions: Sequence[np.ndarray]) -> Absorbed:
    """Noise whose residuals a fit has left.

    The noise is of first order. Its residuals have the same correlation of neighbours as these. Residuals or
    directions that are not finite, of a fit that failed, tell nothing. Nor do residuals of a fit that follows
    every sample: then each direction has taken up one sample's share.

    Args:
        series: residuals of each recording in the order of sampling, each of shape (n_i,).
        directions: derivatives of these by all that was fitted, each of shape (n_i, k).
    """
    together, most = np.concatenate(directions), max(len(s) for s in series)
    if not (np.all(np.isfinite(together)) and np.all(np.isfinite(np.concatenate(series)))):
        return Absorbed(1.0, 1.0)
    left, sizes, _ = np.linalg.svd(together, full_matrices=False)
    rank = int(np.sum(sizes > sizes.max(initial=0.0) * len(left) * np.finfo(float).eps))
    if rank == len(left):
        return Absorbed(float(rank), 1.0)
    blocks = np.split(left[:, :rank], np.cumsum([len(s) for s in series])[:-1])
    observed, (time, window) = lag_one(series), windowed_correlation(series)
    sums = _Sums(blocks, (0, 1, window))

    def departure(memory: float) -> float:
        """Correlation of neighbours in residuals of such noise, less the one that is seen."""
        _, after = sums(memory)
        return float((after[1] - after[0]) / (2.0 * after[0])) - observed

    memory = 0.0
    if departure(0.0) < 0.0:
        memory = MOST if departure(MOST) < 0.0 else float(optimize.brentq(departure, 0.0, MOST, xtol=1e-3))
    before, after = sums(memory)
    square, whole = (before / np.maximum(after, before * np.finfo(float).eps))[[0, 2]]
    return Absorbed(max(float(square), 1.0), float(np.clip(time * whole / square, 1.0, most)))


class _Sums:
    """Expected sums of products of samples at most some lags apart: of noise, and of its residuals.

    Args:
        blocks: orthonormal directions of the fit in the rows of each recording, each of shape (n_i, k).
        lags: numbers of rows.
    """

    def __init__(self, blocks: Sequence[np.ndarray], lags: Sequence[int]):
        self._blocks, self._lags = blocks, lags
        self._near = [
            [_convolved(block, (np.arange(len(block)) <= lag).astype(float)) for block in blocks]
            for lag in lags
        ]
        self._both = [
            sum(block.T @ one for block, one in zip(blocks, near, strict=True)) for near in self._near
        ]

    def __call__(self, memory: float) -> tuple[np.ndarray, np.ndarray]:
        """One sum for each of the lags, of noise and of its residuals.

        Args:
            memory: correlation of neighbours in noise of unit variance.
        """
        noise = sum(_all_pairs(len(block), memory, self._lags) for block in self._blocks)
        spread = [_convolved(block, memory ** np.arange(len(block))) for block in self._blocks]
        own = sum(block.T @ slow for block, slow in zip(self._blocks, spread, strict=True))
        left = []
        for whole, near, both in zip(noise, self._near, self._both, strict=True):
            cross = sum(float(np.sum(a * b)) for a, b in zip(near, spread, strict=True))
            left.append(whole - 2.0 * cross + float(np.sum(both * own)))
        return noise, np.array(left)


def _all_pairs(count: int, memory: float, lags: Sequence[int]) -> np.ndarray:
    """Sums of the correlation over pairs of rows that are at most each of the lags apart."""
    apart = np.arange(1, count)
    pairs = np.concatenate([[float(count)], 2.0 * (count - apart) * memory**apart])
    return np.cumsum(pairs)[np.minimum(lags, count - 1)]


def _convolved(columns: np.ndarray, one_sided: np.ndarray) -> np.ndarray:
    """Columns times the symmetric Toeplitz matrix of a first column, (n, k)."""
    count = len(columns)
    kernel = np.concatenate([one_sided, np.zeros(1), one_sided[:0:-1]])
    spectrum = np.fft.rfft(kernel)[:, None] * np.fft.rfft(columns, 2 * count, axis=0)
    return np.fft.irfft(spectrum, 2 * count, axis=0)[:count]
