"""Serial correlation of a misfit, and the number of independent samples in it.

A smooth curve that a law cannot follow leaves residuals that drift slowly. Hundreds of samples then say as
much as a few independent ones. Every standard error takes this into account.
"""

from collections.abc import Sequence

import numpy as np

CHANCE = 1.15
"""Maximum factor on a variance that white noise shows by chance."""
OVERSTATED = 0.5
"""Reduced chi-square, times the correlation time, below which noise is larger than the scatter."""
WINDOW = 5.0
"""Number of correlation times up to which lags are summed (Sokal's window)."""


def autocorrelation(series: Sequence[np.ndarray]) -> np.ndarray:
    """Autocorrelation of residuals pooled over recordings. Their means are left in, since a misfit's mean is
    misfit.

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
    """Integrated autocorrelation time: number of samples that count as one independent one.

    The window grows until it is five times the sum inside it (A. Sokal, Monte Carlo methods in statistical
    mechanics, 1997). For a first-order process it is `(1 + r) / (1 - r)`, with the lag-1 correlation r. The
    variance of a smooth fit to the samples grows by about this factor.

    Returns:
        The factor, 1 or more; at most the length of the longest recording.
    """
    return _summed(autocorrelation(series), series)


def swing_time(series: Sequence[np.ndarray]) -> float:
    """Number of samples that count as one where a misfit meets a number that acts as slowly as it changes.

    That is the sum of the squared autocorrelation (M. S. Bartlett, J. R. Stat. Soc. 98 (1935) 536). A slow
    misfit that swings about zero has a short `correlation_time`, since a mean averages its swings out. What a
    number does to the outputs may swing with it.

    Returns:
        The factor, 1 or more; at most the length of the longest recording.
    """
    return _summed(autocorrelation(series) ** 2, series)


def _summed(lags: np.ndarray, series: Sequence[np.ndarray]) -> float:
    """Sum over both signs of the lags, in a window of `WINDOW` times the sum inside it."""
    return float(np.clip(_windowed(lags)[0], 1.0, max(len(s) for s in series)))


def _windowed(lags: np.ndarray) -> tuple[float, int]:
    """Sum over both signs of the lags, and the last lag of it."""
    summed = 2.0 * np.cumsum(lags) - 1.0
    inside = np.flatnonzero(np.arange(len(lags)) >= WINDOW * summed)
    last = int(inside[0] if len(inside) else np.argmax(summed))
    return float(summed[last]), last


def windowed_correlation(series: Sequence[np.ndarray]) -> tuple[float, int]:
    """Sum of the autocorrelation of `correlation_time`, without its limits, and the largest lag of it."""
    return _windowed(autocorrelation(series))


def inflation_of(reduced: float, series: Sequence[np.ndarray]) -> float:
    """Factor on standard errors for misfit beyond the noise and with serial correlation.

    Correlated noise, a drifting zero and a wrong law all leave fewer independent samples than there are. The
    variance grows by the mean square of the misfit times its correlation time. Where the noise was already
    enlarged for its correlation, the mean square is smaller by as much, and both factors cancel. The bias of
    the parameters by a drift does not show in the residuals, so beside a drift the factor is too small.

    Args:
        reduced: chi-square per degree of freedom.
        series: misfits in units of their noise, of each recording and output, in the order of sampling.
    """
    product = reduced * correlation_time(series)
    return float(np.sqrt(product)) if product > CHANCE else 1.0


def lag_one(series: Sequence[np.ndarray]) -> float:
    """Correlation of neighbouring residuals; 0 where there are none."""
    lags = autocorrelation(series)
    return float(lags[1]) if len(lags) > 1 else 0.0


def overstated_sentence(reduced: float) -> str:
    """Sentence on noise that is stated or estimated too large.

    Args:
        reduced: reduced chi-square.
    """
    return (
        f"The recordings scatter by only {reduced**0.5:.2g} of the noise stated or estimated. If that "
        "noise is too large, the standard errors are, too, and a misfit may be hidden."
    )
