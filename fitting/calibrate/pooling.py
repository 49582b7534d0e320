"""Constants of several specimens of one alloy, partially pooled: a normal-normal model with random effects.

Specimen i's constant is `theta_i ~ N(mu, tau^2)`, its estimate `x_i ~ N(theta_i, s_i^2)`. `tau` is found by
restricted maximum likelihood (D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320), `mu` by weights `1 / (s_i^2
+ tau^2)`. Each specimen's own value is drawn towards `mu`, the further the wider its error bar.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

optimize, stats = Late("scipy.optimize"), Late("scipy.stats")

LEVEL = 0.9
"""Probability of the quoted intervals."""
SPENT = 0.95
"""Minimum ratio of an estimate's standard error to its prior's at which it only repeats the prior."""
LOOSE = 1e-4
"""Precision of directions that the data do not inform, as a share of the priors' precision. It keeps the
matrices regular."""
WIDEST = 10.0
"""Maximum spread between specimens in the search, in units of the estimates' own spread and errors."""


@dataclass(frozen=True)
class Pooled:
    """A constant across specimens; all in the unit of the estimates.

    Attributes:
        names: names of the specimens; values, sd: their estimates as measured, shape (n,).
        mean, mean_sd: mean of the population, and its standard error.
        spread: 1-sigma between specimens.
        shrunk, shrunk_sd: the specimens' own values, partially pooled, shape (n,).
        next_low, next_high: interval that holds a further specimen's constant with 90 % probability.
        differ: p-value of the estimates being this different if the specimens were alike (Cochran's Q).
        unit: unit of the estimates.
    """

    names: tuple[str, ...]
    values: np.ndarray
    sd: np.ndarray
    mean: float
    mean_sd: float
    spread: float
    shrunk: np.ndarray
    shrunk_sd: np.ndarray
    next_low: float
    next_high: float
    differ: float
    unit: str = "1"


def without_priors(
    values: np.ndarray, covariance: np.ndarray, means: np.ndarray, prior_sd: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of one specimen's constants from its data alone: its Gaussian posterior without the priors.

    All specimens were fitted under the same priors. If their posteriors were pooled, the priors would count
    once for each specimen. A constant that is known only together with another one depends on that one's
    prior, too. So all priors are removed in one step.

    Args:
        values, covariance: mean and covariance of the posterior, shapes (n,) and (n, n).
        means, prior_sd: means and 1-sigmas of the priors, infinite where there is none or it is to stay,
            (n,).

    Returns:
        Values and standard errors, (n,); the errors are infinite where the data alone say next to nothing.
    """
    unit = np.where(np.isfinite(prior_sd), prior_sd, np.sqrt(np.diag(covariance)))
    about = np.where(np.isfinite(prior_sd), means, values)
    whole = np.linalg.inv(covariance / np.outer(unit, unit))
    strength, directions = np.linalg.eigh(whole - np.diag((unit / prior_sd) ** 2))
    alone = 1.0 / (np.maximum(strength, 0.0) + LOOSE)
    spread = (directions * alone) @ directions.T
    found = about + unit * (spread @ whole @ ((values - about) / unit))
    sd = np.sqrt(np.diag(spread))
    determined = ~np.isfinite(prior_sd) | (sd**-2.0 > SPENT**-2.0 - 1.0)
    return found, np.where(determined, unit * sd, np.inf)


def pool(names: Sequence[str], values: Sequence[float], sd: Sequence[float], unit: str = "1") -> Pooled:
    """Random-effects summary of one constant.

    Args:
        names: names of the specimens, two or more.
        values, sd: their estimates and standard errors, positive, shape (n,).
        unit: unit of both.

    Raises:
        ValueError: if there are fewer than two, or an error is not a positive number.
    """
    x, s = np.asarray(values, float), np.asarray(sd, float)
    if len(x) < 2 or not np.all(np.isfinite(s) & (s > 0.0) & np.isfinite(x)):
        raise ValueError("Arguments `values` and `sd` must hold two or more numbers with positive errors.")
    scale = float(np.std(x, ddof=1)) + float(np.mean(s))
    tau = _spread(x / scale, s / scale) * scale
    weight = 1.0 / (s**2 + tau**2)
    mean, mean_sd = float(weight @ x / weight.sum()), float(weight.sum() ** -0.5)
    share = tau**2 / (s**2 + tau**2)  # of its own estimate that each specimen keeps
    shrunk = mean + share * (x - mean)
    shrunk_sd = np.sqrt(share * s**2 + ((1.0 - share) * mean_sd) ** 2)
    freedom = max(len(x) - 2, 1)  # of a further specimen; Higgins et al., J. R. Stat. Soc. A 172 (2009) 137
    reach = float(stats.t.ppf(0.5 + 0.5 * LEVEL, freedom) * np.hypot(tau, mean_sd))
    differ = _alike(x, s)
    return Pooled(
        tuple(names), x, s, mean, mean_sd, float(tau), shrunk, shrunk_sd, mean - reach, mean + reach, differ,
        unit,
    )  # fmt: skip


def _spread(x: np.ndarray, s: np.ndarray) -> float:
    """Between-specimen standard deviation by restricted maximum likelihood; zero where none is needed."""

    def minus_log(tau: float) -> float:
        weight = 1.0 / (s**2 + tau**2)
        mean = weight @ x / weight.sum()
        return 0.5 * (np.log(weight.sum()) - np.log(weight).sum() + weight @ (x - mean) ** 2)

    within = {"bounds": (0.0, WIDEST), "method": "bounded", "options": {"xatol": 1e-8}}
    found = optimize.minimize_scalar(minus_log, **within)
    return 0.0 if minus_log(0.0) <= found.fun else float(found.x)


def _alike(x: np.ndarray, s: np.ndarray) -> float:
    weight = s**-2.0
    mean = weight @ x / weight.sum()
    return float(stats.chi2.sf(weight @ (x - mean) ** 2, len(x) - 1))
