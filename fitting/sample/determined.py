"""Which ends of a parameter's interval the data determine, and which are those of its prior or bounds.

Without a prior a parameter is flat between its bounds. Where the draws reach such a bound in numbers, the
quantile there follows the bound. It is no measurement, however well the chains agree.
"""

import math

import numpy as np
from jaxtyping import Float

from fitting.calibrate.profile_likelihood import RISES, WIDTH_90
from fitting.calibrate.result import Estimate

from .problem import Problem
from .result import Posterior

AT_A_BOUND = math.exp(-0.5 * RISES[90])
"""Minimum density at a bound over the largest, for the bound to make this end of the interval [1].

It is that of a Gaussian at the end of its 90 % interval: the same limit as of a profile likelihood."""
BINS = 20
"""Number of bins between the 5 % and the 95 % quantile. A thousand draws leave 13 in one at the limit."""


def estimates(problem: Problem, posterior: Posterior) -> dict[str, Estimate]:
    """Every sampled parameter, see `estimate_of`."""
    return {name: estimate_of(problem, posterior, name) for name in posterior.names}


def estimate_of(problem: Problem, posterior: Posterior, name: str) -> Estimate:
    """A sampled parameter as the median and the 90 % interval of its draws, in the unit of files.

    Its `determined` ends are those that no bound makes. Its `of_prior` compares the interval with a Gaussian
    prior's.
    """
    k, summary, prior = posterior.names.index(name), posterior.summary[name], problem.parameters[name].prior
    draws = posterior.chains[:, posterior.convergence.burn_in :, :, k].ravel()
    low, median, high = (float(problem.shown(name, x)) for x in (summary.low, summary.median, summary.high))
    return Estimate(
        value=median,
        sd=float(problem.shown(name, summary.sd, spread=True)),
        unit=problem.unit(name),
        at_bound=False,
        interval={90: (low, high)},
        determined=held(draws, float(posterior.target.lower[k]), float(posterior.target.upper[k])),
        of_prior=None if prior is None else float((summary.high - summary.low) / (2.0 * WIDTH_90 * prior.sd)),
    )


def flat(problem: Problem, found: dict[str, Estimate]) -> list[str]:
    """Names of parameters without a prior of which a bound makes an end of the interval."""
    unknown = [name for name in found if problem.parameters[name].prior is None]
    return [name for name in unknown if not all(found[name].determined)]


def held(draws: Float[np.ndarray, " draws"], lower: float, upper: float) -> tuple[bool, bool]:
    """True for each end of the 90 % interval (lower, upper) that the data determine.

    Args:
        draws: values of one coordinate.
        lower, upper: its bounds, infinite for none.
    """
    low, high = np.quantile(draws, (0.05, 0.95))
    width = float(high - low) / BINS
    if not width > 0.0:
        return True, True
    counts, _ = np.histogram(draws, np.arange(draws.min(), draws.max() + 2.0 * width, width))
    least = AT_A_BOUND * counts.max()
    return bool((draws <= lower + width).sum() < least), bool((draws >= upper - width).sum() < least)
