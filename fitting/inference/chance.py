"""Tail of the chi-square distribution, without `scipy.stats`, which takes a quarter of a second to load."""

import numpy as np
from scipy.special import chdtrc


def chi_square_tail(value: float | np.ndarray, freedom: int) -> np.ndarray:
    """Probability of a chi-square at least as large as `value`, with `freedom` degrees of freedom.

    Args:
        value: chi-square [1], of any shape.
        freedom: degrees of freedom; NaN is returned where there are none.
    """
    return np.where(freedom > 0, chdtrc(freedom, value), np.nan)


def log_chi_square_tail(value: float | np.ndarray, freedom: int) -> np.ndarray:
    """Logarithm of `chi_square_tail`; minus infinity where the probability is below the smallest number."""
    with np.errstate(divide="ignore"):
        return np.log(chi_square_tail(value, freedom))
