"""Measured columns: how much each sample counts, its noise, stated or estimated, and its correlation."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import Recording

from .noise import GAUSSIAN_MAD, dithered
from .readings import noise_found, read_values

CORRELATED = 0.25
"""Serial correlation below which a column's noise is taken as independent: what short recordings tell
apart."""
MOST_CORRELATED = 0.98
FEW = 40
"""Samples below which serial correlation is not estimated from themselves alone."""
MOST_GUESSED = 0.8
"""Largest correlation that is read off the samples alone: a course with corners looks like more."""
LEAST_NOISE = 1e-5
"""Of a column's span: noise that is estimated is never less, a printed number has its rounding."""


@dataclass(frozen=True)
class Channel:
    """One measured output of one recording.

    Attributes:
        quantity: `curvature`, `force`, ...
        measured: SI, shape (rows,), zero where missing.
        sigma: marginal standard deviation of each sample, infinite where it does not count.
        correlation: of every error with the one before, one number or shape (rows,).
    """

    quantity: str
    measured: np.ndarray
    sigma: np.ndarray
    correlation: float | np.ndarray

    def whitened(self, difference: np.ndarray) -> np.ndarray:
        """Differences of shape (..., rows) as independent errors of unit size; zero where nothing counts.

        First-order noise: each error is freed of what the one before tells about it.
        """
        own, before = self.coefficients()
        found = own * difference
        found[..., 1:] -= before[1:] * difference[..., :-1]
        return found

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """What `whitened` multiplies each difference by, and what of the one before it takes off, (rows,)."""
        there = np.isfinite(self.sigma)
        follows = np.zeros_like(there)
        follows[1:] = there[1:] & there[:-1]
        weight = np.where(there, 1.0 / self.sigma, 0.0)
        free = np.sqrt(1.0 - self.correlation**2)
        before = np.where(follows, self.correlation / free * np.roll(weight, 1), 0.0)
        return np.where(follows, weight / free, weight), before

    @property
    def count(self) -> int:
        """Samples that count."""
        return int(np.isfinite(self.sigma).sum())


def channel_weight(
    recording: Recording, quantity: str, columns: Mapping[str, np.ndarray], block: int
) -> np.ndarray:
    """One over the 1-sigma of every sample; zero where it is missing.

    Serially correlated noise is taken as independent noise that is larger: a sample counts for as many
    independent ones as it is worth to anything that varies slowly, `(1 - r) / (1 + r)`. A scatter smaller
    than stated alone is no correlation: the samples must show it by themselves, too.

    Args:
        recording: states the noise, if anyone does.
        quantity: column, by quantity.
        columns: `time` and the quantity, in SI, NaN where missing.
        block: readings that a row is the mean of.
    """
    values = columns[quantity]
    held = np.isfinite(values)
    if not held.any():
        return np.zeros(len(values))
    stated = recording.noise_si(quantity)
    raw = read_values(recording, quantity)
    if stated is not None and stated > 0.0:
        correlation = min(serial_correlation(raw, stated), correlation_by_lags(raw))
        sigma = stated * np.sqrt((1.0 + correlation) / (1.0 - correlation) / block)
    else:
        sigma = noise_found(recording, quantity)
        if block > 1:
            sigma = block_noise(*unstated_noise(raw, sigma), block)[0]
        sigma = max(sigma, LEAST_NOISE * float(np.ptp(values[held])), 1e-12)
    return np.where(held, 1.0 / sigma, 0.0)


def correlation_by_lags(values: np.ndarray) -> float:
    """Correlation of neighbouring errors by second differences alone, whatever their size.

    Over one and two samples their variances are `sigma^2 (6 - 8 r^k + 2 r^2k)` at lag k for first-order noise
    on a smooth course: the ratio grows with r, from 1 to 2.

    Args:
        values: samples in their order, shape (n,).

    Returns:
        The correlation, at most `MOST_GUESSED`; 0 where the samples are few or it is small.
    """
    if len(values) < FEW:
        return 0.0
    values = dithered(values)
    spread = [
        float(np.median(np.abs(values[:, 2 * k :] - 2.0 * values[:, k:-k] + values[:, : -2 * k])))
        for k in (1, 2)
    ]
    if not spread[0] > 0.0:
        return 0.0
    grid = np.linspace(0.0, MOST_GUESSED, 91)
    ratio = (1.0 + grid) * (3.0 - grid**2) / (3.0 - grid)
    correlation = float(np.interp((spread[1] / spread[0]) ** 2, ratio, grid))
    return correlation if correlation > CORRELATED else 0.0


def serial_correlation(values: np.ndarray, sigma: float) -> float:
    """Correlation of neighbouring errors, from second differences and the instrument's own 1-sigma.

    For first-order noise on a smooth course their variance is `sigma^2 (6 - 8 r + 2 r^2)`. Residuals of a
    model would mistake misfit for correlation.

    Args:
        values: samples in their order, shape (n,).
        sigma: marginal 1-sigma.

    Returns:
        The correlation; 0 where it is small or negative.
    """
    if len(values) < 12:
        return 0.0
    bend = np.diff(dithered(values), 2)
    share = (np.median(np.abs(bend)) / (GAUSSIAN_MAD * sigma)) ** 2
    correlation = 2.0 - np.sqrt(max(1.0 + 0.5 * share, 0.0))
    return float(np.clip(correlation, 0.0, MOST_CORRELATED)) if correlation > CORRELATED else 0.0


def unstated_noise(values: np.ndarray, white: float) -> tuple[float, float]:
    """Standard deviation and correlation of neighbouring errors of a channel that states neither.

    Args:
        values: samples in their order, shape (n,).
        white: standard deviation that white noise would have.

    Returns:
        Both, see `correlation_by_lags`.
    """
    correlation = correlation_by_lags(values)
    return white * float(np.sqrt(6.0 / (6.0 - 8.0 * correlation + 2.0 * correlation**2))), correlation


def block_noise(sigma: float, correlation: float, block: int) -> tuple[float, float]:
    """Standard deviation of the means of blocks of samples with first-order noise, and their correlation."""
    lags = np.arange(1, block)
    variance = (block + 2.0 * np.sum((block - lags) * correlation**lags)) / block**2
    ladder = np.sum(correlation ** np.arange(block))
    return sigma * float(np.sqrt(variance)), float(correlation * ladder**2 / block**2 / variance)
