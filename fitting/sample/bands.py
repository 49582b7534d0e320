"""The band of new measurements about a predicted curve, from the draws of the model's own band."""

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

HALVINGS = 40
"""Number of halvings of the interval that holds a quantile; they leave 1e-12 of it."""
TAIL = 6.0
"""Reach of that interval beyond the outermost draws, in standard deviations of the noise."""


def measurement_band(
    predicted: Float[np.ndarray, "draws rows"], sigma: Float[np.ndarray, " rows"], levels: tuple[float, float]
) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
    """Lower and upper end of a band of new measurements.

    A new measurement is a draw's prediction plus Gaussian noise. So its distribution is a mixture of
    Gaussians, one about each draw, whose quantiles are found to rounding. Where draws gather in several
    places, such a quantile may lie within the draws' own. There the band ends at the draws', and holds more.

    Args:
        predicted: curves that the draws predict.
        sigma: standard deviation of the noise of a measurement; NaN where nothing is measured.
        levels: probabilities below the two ends.

    Returns:
        Both ends; NaN where sigma is.
    """
    low, high = np.quantile(predicted, levels, axis=0)
    below, above = (_mixture_quantile(predicted, sigma, level) for level in levels)
    return np.minimum(below, low), np.maximum(above, high)


def _mixture_quantile(predicted: np.ndarray, sigma: np.ndarray, level: float) -> np.ndarray:
    """Quantile of a mixture of Gaussians of one width about each draw, at every row."""
    low, high = predicted.min(axis=0) - TAIL * sigma, predicted.max(axis=0) + TAIL * sigma
    safe = np.where(sigma > 0.0, sigma, 1.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        under = ndtr((middle - predicted) / safe).mean(axis=0) < level
        low, high = np.where(under, middle, low), np.where(under, high, middle)
    return np.where(sigma == 0.0, np.quantile(predicted, level, axis=0), 0.5 * (low + high))
