"""How noisy a measured curve is, and how many independent samples its misfit holds.

A smooth curve that a law cannot follow leaves residuals that drift slowly: hundreds of samples then say as
much as a few independent ones. Both numbers below are counted before any standard error is quoted.
"""

from collections.abc import Sequence

import numpy as np

GAUSSIAN_MAD = 0.6744897501960817
"""Median absolute deviation of a Gaussian in standard deviations."""
CHANCE = 1.15
"""Factor on a variance that white noise may show by chance."""
WINDOW = 5.0
"""Sokal's window: lags are summed up to this many correlation times."""


def robust_noise(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth curve, from each sample's distance to its neighbours'
    chord.

    The pseudo-residual of Gasser, Sroka and Jennen-Steinmetz (Biometrika 73 (1986) 625) with a median
    absolute deviation in place of the mean square, so that jumps and turning points do not count. Serially
    correlated noise is smooth too, so for it the result is a lower bound.

    Args:
        x: where the curve was sampled, in the order of sampling, shape (n,).
        y: what was measured there, shape (n,).

    Returns:
        The standard deviation in the unit of `y`; 0 with fewer than three usable samples.
    """
    before, middle, after = x[:-2], x[1:-1], x[2:]
    span = after - before
    usable = (np.abs(span) > 0.0) & ((middle - before) * (after - middle) >= 0.0)
    if not np.any(usable):
        return 0.0
    weight = (after - middle)[usable] / span[usable]
    distance = y[1:-1][usable] - weight * y[:-2][usable] - (1.0 - weight) * y[2:][usable]
    pseudo = distance / np.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2)
    return float(np.median(np.abs(pseudo)) / GAUSSIAN_MAD)


def autocorrelation(series: Sequence[np.ndarray]) -> np.ndarray:
    """Autocorrelation of residuals pooled over recordings, their means left in (a misfit's mean is misfit).

    Args:
        series: residuals of each recording in the order of sampling, each of shape (n_i,).

    Returns:
        Correlation at lags 0, 1, ..., at most half the longest recording.
    """
    longest = max(len(s) for s in series)
    power = sum(float(s @ s) for s in series)
    if power == 0.0:
        return np.ones(1)
    products = np.zeros(longest)
    for s in series:
        spectrum = np.fft.rfft(s, 2 * len(s))
        products[: len(s)] += np.fft.irfft(np.abs(spectrum) ** 2)[: len(s)]
    return (products / products[0])[: max(longest // 2, 1)]


def correlation_time(series: Sequence[np.ndarray]) -> float:
    """Integrated autocorrelation time: how many samples make one independent one.

    The window grows until it is five times the sum inside it (A. Sokal, Monte Carlo methods in statistical
    mechanics, 1997). For a first-order process it is `(1 + r) / (1 - r)` of the lag-1 correlation r. The
    variance of anything smooth that is fitted to the samples grows by about this factor.

    Returns:
        The factor, 1 or more; at most the length of the longest recording.
    """
    lags = autocorrelation(series)
    summed = 2.0 * np.cumsum(lags) - 1.0
    inside = np.flatnonzero(np.arange(len(lags)) >= WINDOW * summed)
    time = summed[inside[0]] if len(inside) else summed.max()
    return float(np.clip(time, 1.0, max(len(s) for s in series)))


def inflation_of(reduced: float, series: Sequence[np.ndarray]) -> float:
    """Factor on standard errors for misfit larger than the noise, and misfit that lasts.

    Noise that lasts, a zero that drifts and a law that is not followed all leave fewer independent samples
    than there are: the variance grows by the mean square of the misfit times its correlation time. Where
    noise was taken as larger because it lasts, the mean square is smaller by as much, and the two make one.
    What a drift does to the numbers themselves is not seen in what is left: beside drift it is too little.

    Args:
        reduced: chi-square per degree of freedom.
        series: misfits over their noise of each recording and output, in the order of sampling.
    """
    product = reduced * correlation_time(series)
    return float(np.sqrt(product)) if product > CHANCE else 1.0


def lag_one(series: Sequence[np.ndarray]) -> float:
    """Correlation of neighbouring residuals; 0 where there are none."""
    lags = autocorrelation(series)
    return float(lags[1]) if len(lags) > 1 else 0.0
