"""Measured columns with their noise (stated or estimated), its serial correlation, and the weight of each
sample."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import Recording

from .noise import FEW, GAUSSIAN_MAD, ORDERS, correlation_of, dithered, lagged_squares, rounding_noise
from .partial_pooling import pooled_by_difference
from .readings import noise_found, read_values, stated_noise

CORRELATED = 0.25
"""Minimum serial correlation that counts; short recordings resolve no less."""
MOST_CORRELATED = 0.98
LEAST_NOISE = 1e-5
"""Minimum estimated noise, as part of a column's span: the rounding of printed numbers."""


@dataclass(frozen=True)
class Channel:
    """One measured output of one recording.

    Attributes:
        quantity: name of the quantity: `curvature`, `force`, ...
        measured: measured values, SI, shape (rows,), zero where missing.
        sigma: marginal standard deviation of each sample, shape (rows,); infinite where it does not count.
        correlation: correlation of every error with the one before, one number or shape (rows,).
    """

    quantity: str
    measured: np.ndarray
    sigma: np.ndarray
    correlation: float | np.ndarray

    def whitened(self, difference: np.ndarray) -> np.ndarray:
        """Differences of shape (..., rows) as independent errors of unit size; zero where nothing counts.

        For first-order noise, the part of each error that the one before predicts is subtracted.
        """
        own, before = self.coefficients
        found = own * difference
        found[..., 1:] -= before[1:] * difference[..., :-1]
        return found

    @functools.cached_property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Factors of `whitened` on each difference and on the one before it, shape (rows,) each."""
        counted = np.isfinite(self.sigma)
        follows = np.zeros_like(counted)
        follows[1:] = counted[1:] & counted[:-1]
        weight = np.where(counted, 1.0 / self.sigma, 0.0)
        free = np.sqrt(1.0 - self.correlation**2)
        before = np.where(follows, self.correlation / free * np.roll(weight, 1), 0.0)
        return np.where(follows, weight / free, weight), before

    @property
    def count(self) -> int:
        """Number of samples that count."""
        return int(np.isfinite(self.sigma).sum())


def channel_weight(
    recording: Recording, quantity: str, columns: Mapping[str, np.ndarray], block: int
) -> np.ndarray:
    """Inverse standard deviation of every sample; zero where it is missing.

    Serially correlated noise is replaced by larger independent noise. For a slowly varying quantity, a sample
    counts as `(1 - r) / (1 + r)` independent ones. A scatter below the stated noise is no evidence of
    correlation by itself: the samples must show it, too.

    Args:
        recording: recording that may state the noise.
        quantity: name of the column's quantity.
        columns: `time` and the quantity, in SI, NaN where missing.
        block: number of readings averaged in a row.
    """
    values = columns[quantity]
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros(len(values))
    stated = stated_noise(recording, quantity)
    raw = read_values(recording, quantity)
    if stated is not None and stated > 0.0:
        correlation = min(serial_correlation(raw, stated), correlation_by_lags(raw))
        sigma = stated * np.sqrt((1.0 + correlation) / (1.0 - correlation) / block)
    else:
        sigma = noise_found(recording, quantity)
        if block > 1:
            sigma = block_noise(*unstated_noise(raw, sigma), block)[0]
        sigma = max(sigma, LEAST_NOISE * float(np.ptp(values[finite])), 1e-12)
    return np.where(finite, 1.0 / sigma, 0.0)


def correlation_by_lags(values: np.ndarray) -> float:
    """Correlation of neighbouring errors from second differences alone, independent of their size.

    For first-order noise on a smooth trend their variance at lag k is `sigma^2 (6 - 8 r^k + 2 r^2k)`. The
    ratio of lag two to lag one grows with r, from 1 to 2.

    Args:
        values: samples in their order, shape (n,).

    Returns:
        The correlation, at most `MOST_GUESSED`; 0 where the samples are few or it is small.
    """
    if len(values) < FEW:
        return 0.0
    correlation = correlation_of(lagged_squares(values))
    return correlation if correlation > CORRELATED else 0.0


def serial_correlation(values: np.ndarray, sigma: float) -> float:
    """Correlation of neighbouring errors, from second differences and the instrument's own standard
    deviation.

    For first-order noise on a smooth trend their variance is `sigma^2 (6 - 8 r + 2 r^2)`. Residuals of a
    model would mistake misfit for correlation. Rounding errors hide it: those of the samples and those by
    which they are `dithered` are subtracted, as independent ones.

    Args:
        values: samples in their order, shape (n,).
        sigma: marginal standard deviation, rounding included.

    Returns:
        The correlation; 0 where it is small or negative.
    """
    if len(values) < 12:
        return 0.0
    bend = np.diff(dithered(values), 2)
    rounding = rounding_noise(values) ** 2
    own = sigma**2 - rounding
    if not own > 0.0:
        return 0.0
    share = max((np.median(np.abs(bend)) / GAUSSIAN_MAD) ** 2 - 12.0 * rounding, 0.0) / own
    correlation = (2.0 - np.sqrt(1.0 + 0.5 * share)) * own / sigma**2
    return float(np.clip(correlation, 0.0, MOST_CORRELATED)) if correlation > CORRELATED else 0.0


def unstated_noise(values: np.ndarray, white: float) -> tuple[float, float]:
    """Standard deviation and correlation of neighbouring errors of a channel that states neither.

    Args:
        values: samples in their order, shape (n,).
        white: standard deviation under the assumption of white noise.

    Returns:
        Standard deviation and correlation, see `correlation_by_lags`.
    """
    correlation = correlation_by_lags(values)
    return first_order_noise(white, correlation), correlation


def unstated_noise_of_several(
    pieces: Sequence[np.ndarray], white: Sequence[float], inputs: Sequence[float]
) -> np.ndarray:
    """Standard deviation of one channel in each of several recordings that state no noise.

    Few samples tell a correlation badly, so all pieces tell one together; see `unstated_noise`. They tell one
    size, too, unless they clearly differ (`pooled_by_difference`). The noise of inputs is known and counts
    elsewhere. So it is subtracted, on average where they tell one size.

    Args:
        pieces: samples of each recording in their order, five or more each.
        white: standard deviation of each under the assumption of white noise.
        inputs: variance of each by the noise of inputs.

    Returns:
        Standard deviation of each piece without the noise of inputs, shape (pieces,).
    """
    weights, added = np.array([len(piece) for piece in pieces]), np.asarray(inputs, float)
    whole = np.square(white)
    own = np.maximum(whole - added, 0.0)
    counts = (weights - ORDERS[-1]) * (own / np.where(whole > 0.0, whole, 1.0)) ** 2
    sizes = pooled_by_difference(np.sqrt(own), counts)
    if sizes is None:
        one = max(float(np.average(whole - added, weights=weights)), 0.0)
        sizes, mean = np.full(len(pieces), np.sqrt(one)), np.average(added, weights=weights)
    else:
        mean = added
    units = sizes**2 + added
    each = np.array([lagged_squares(piece) for piece in pieces]) / np.where(units > 0.0, units, 1.0)[:, None]
    correlation = correlation_of(np.average(each, axis=0, weights=weights)) if weights.sum() >= FEW else 0.0
    factor = first_order_noise(1.0, correlation if correlation > CORRELATED else 0.0)
    return np.sqrt(factor**2 * (sizes**2 + mean) - mean)


def first_order_noise(white: float, correlation: float) -> float:
    """Standard deviation of first-order noise whose second differences are those of white noise.

    Args:
        white: standard deviation of the white noise.
        correlation: correlation of neighbouring errors.
    """
    return white * float(np.sqrt(6.0 / (6.0 - 8.0 * correlation + 2.0 * correlation**2)))


def block_noise(sigma: float, correlation: float, block: int) -> tuple[float, float]:
    """Standard deviation of the means of blocks of samples with first-order noise, and their correlation."""
    lags = np.arange(1, block)
    variance = (block + 2.0 * np.sum((block - lags) * correlation**lags)) / block**2
    ladder = np.sum(correlation ** np.arange(block))
    return sigma * float(np.sqrt(variance)), float(correlation * ladder**2 / block**2 / variance)
