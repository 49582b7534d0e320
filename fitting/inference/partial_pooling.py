"""Noise of one channel in several recordings: one for all, or one each where they clearly differ.

Recordings of one instrument usually have one noise, and all of them tell it best. An instrument may have
another range, or another setting, in one of them. One noise for all would then be too large for the others:
their error bars would be too wide, and their misfit would be hidden.
"""

from collections.abc import Sequence

import numpy as np

from .chance import chi_square_tail

LEVEL = 0.01
"""Maximum probability that recordings of one noise are said to differ."""
SPREAD = 1.3
"""Standard deviation of the logarithm of a noise told by differences of neighbours, times the root of their
number. It was 1.0 to 1.3 for 25 to 300 errors of first order, with correlations of 0 to 0.8."""
SYSTEMATIC = 0.06
"""Standard deviation of that logarithm for any number of them. It was 0.05 to 0.06 for 1000 with correlations
of 0.5 and more, where the order of the differences varies."""


def pooled_by_difference(sizes: Sequence[float], counts: Sequence[float]) -> np.ndarray | None:
    """Noise of every recording, drawn towards that of all as far as chance explains how they differ.

    Logarithms of sizes have errors of known variance, and scatter about a common mean. The variance of that
    scatter follows from Cochran's statistic (R. DerSimonian and N. Laird, Control. Clin. Trials 7 (1986)
    177). Every logarithm is then its posterior mean. Where the statistic is within chance, one noise serves.

    Args:
        sizes: standard deviation of each recording by itself, in any one unit; 0 where none is found.
        counts: number of differences of readings that tell each; 0 or less where nothing does.

    Returns:
        A standard deviation for each recording, in the same unit; that of all where nothing tells it. None
        where one noise serves all of them.
    """
    found, numbers = np.array(sizes, float), np.asarray(counts, float)
    told = (found > 0.0) & (numbers > 0.0)
    if told.sum() < 2:
        return None
    logarithm, variance = np.log(found[told]), SPREAD**2 / numbers[told] + SYSTEMATIC**2
    weight = 1.0 / variance
    total, freedom = weight.sum(), len(weight) - 1
    statistic = float(weight @ (logarithm - weight @ logarithm / total) ** 2)
    if chi_square_tail(statistic, freedom) > LEVEL:
        return None
    scatter = (statistic - freedom) / (total - weight @ weight / total)
    each = 1.0 / (variance + scatter)
    mean = each @ logarithm / each.sum()
    found[~told] = np.exp(mean)
    found[told] = np.exp((scatter * logarithm + variance * mean) / (variance + scatter))
    return found
