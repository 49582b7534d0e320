"""Search for a jump of a prediction between a fit and one error of a constant."""

from collections.abc import Callable

import numpy as np

MISSED = 0.5
"""Maximum deviation of the outputs from their slope, one error away, in standard deviations of all data [1].

At one error the slope changes them by 1. Where they deviate by more, the place is sought at which they begin
to. A smooth prediction may be so curved, too."""
SUDDEN = 0.5
"""Minimum share of `MISSED` that arises at a jump, within `NARROW` [1]. A deviation that grows by a power of
the distance would need an exponent of 32."""
NARROW = 1.0 / 64.0
"""Maximum width of the place of a jump, as a share of its distance from the fit [1]. It takes 11 predictions
to find it, and none where the slope holds."""


def jumps(deviation: Callable[[float], np.ndarray], near: float, far: float, holds: float = 0.0) -> bool:
    """True if a prediction leaves its slope at a jump, between two distances from the fit.

    Args:
        deviation: function from a distance to the deviation of all outputs from their slope, in standard
            deviations, shape (outputs,).
        near, far: shortest and longest distance, in the unit that `deviation` takes.
        holds: distance within which the slope must hold. A deviation that begins nearer counts as a jump.
    """
    if far <= near:
        return False
    low, high = np.zeros(1), deviation(far)
    if _size(high) <= MISSED:
        return False
    while far > (1.0 + NARROW) * near:
        middle = float(np.sqrt(near * far))
        found = deviation(middle)
        if _size(found) > MISSED:
            far, high = middle, found
        else:
            near, low = middle, found
    return far < holds or _size(high - low) > SUDDEN * MISSED


def _size(deviation: np.ndarray) -> float:
    """Root of the sum of squares."""
    return float(np.linalg.norm(deviation))
