"""Numbers without rounding errors of arithmetic: `0.9`, and not `0.8999999999999999`."""

import numpy as np

ROUNDINGS = 8.0
"""Maximum rounding error of a number that an import makes, in units of the last place. A converted unit makes
up to 2.0 (a test over all pairs of units); a quotient of two converted numbers twice that, and its own."""
_MOST_DECIMALS = 22
"""Maximum number of decimals; 10 to a higher power is no exact number in double precision."""
_WHOLE = 2.0**53
"""Largest number up to which every whole number is one in double precision."""


def shortest(values: np.ndarray | float, beyond: float = 0.0) -> np.ndarray:
    """Numbers with the fewest decimals that the arithmetic behind them cannot tell from the given ones.

    Args:
        values: numbers, any shape; NaN stays.
        beyond: largest number that was added to them or taken off, in their unit. Its rounding errors are
            theirs.

    Returns:
        Numbers within `ROUNDINGS` units of the last place of the given ones, of the same shape.
    """
    given = np.ravel(np.asarray(values, dtype=float))
    bound = ROUNDINGS * np.finfo(float).eps * (np.abs(given) + abs(beyond))
    found = given.copy()
    left = np.isfinite(given)
    for decimals in range(_MOST_DECIMALS + 1):
        power = 10.0**decimals
        left &= np.abs(given) * power < _WHOLE  # beyond it, rounding leaves a number as it is
        if not left.any():
            break
        rounded = np.rint(given[left] * power) / power
        near = np.abs(rounded - given[left]) <= bound[left]
        places = np.flatnonzero(left)
        found[places[near]] = rounded[near]
        left[places[near]] = False
    return found.reshape(np.shape(values))
