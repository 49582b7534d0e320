"""Numbers of a propagated study: intervals, shares of variance, and the influence of failed rows."""

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import ndtri

from fitting.propagate import Propagation
from fitting.propagate.inputs import POSTERIOR
from fitting.propagate.problem import Problem
from fitting.propagate.statistics.failures import level_bounds, mean_bounds, sd_bounds, share_bounds
from pneusma_jax.units import constant_from_si

LEVELS = (0.005, 0.025, 0.05, 0.16, 0.25, 0.5, 0.75, 0.84, 0.95, 0.975, 0.995)
"""Quantile levels of tables."""
SCORES = ndtri([0.05, 0.5, 0.95])
"""Normal scores of the quantiles of an input that are told."""
INPUT_HEADER = ("input", "unit", "distribution", "q5", "q50", "q95")

TELLING = 0.2
"""Minimum distance of two distributions for an input to be named as one that separates failed rows, where
they are many. Of few, chance alone gives more: see `by_chance`."""


@dataclass(frozen=True)
class Exceedance:
    """Probability that a limit fails.

    Attributes:
        limit: limit in words.
        probability: probability up to each point of the driver, shape (points,).
        low, high: 95 % interval of each, for independent rows.
        bounds: bounds of the last one for any result of the failed rows.
        count: number of rows with a result.
    """

    limit: str
    probability: np.ndarray
    low: np.ndarray
    high: np.ndarray
    bounds: tuple[float, float]
    count: int


def exceedances(result: Propagation) -> list[Exceedance]:
    """Exceedance of every limit of the study, by counting."""
    count = int(result.moments.count[0])
    found = []
    for limit, beyond in result.summary.beyond.items():
        with np.errstate(invalid="ignore"):
            low = np.where(beyond > 0, stats.beta.ppf(0.025, beyond, count - beyond + 1), 0.0)
            high = np.where(beyond < count, stats.beta.ppf(0.975, beyond + 1, count - beyond), 1.0)
        probability = beyond / max(count, 1)
        bounds = share_bounds(float(probability[-1]), lost(result))
        found.append(Exceedance(limit, probability, low, high, bounds, count))
    return found


def lost(result: Propagation) -> float:
    """Share of rows without a result."""
    return result.summary.failures.share


@dataclass(frozen=True)
class Bounds:
    """Bounds of statistics of all rows, if those without a result lay within what was seen; shape (columns,).

    Attributes:
        mean, sd: least and largest mean and standard deviation.
        q5_least: least 5 % quantile.
        q95_most: largest 95 % quantile.
    """

    mean: tuple[np.ndarray, np.ndarray]
    sd: tuple[np.ndarray, np.ndarray]
    q5_least: np.ndarray
    q95_most: np.ndarray


def bounds_of(result: Propagation) -> Bounds:
    """Bounds of the statistics of every column."""
    moments, share = result.moments, lost(result)
    # possible levels of a quantile of all rows among those with a result
    outer = np.array([level_bounds(level, share) for level in (0.05, 0.95)])
    edges = result.quantiles(np.array([outer[0, 0], outer[1, 1]]))
    return Bounds(
        mean=mean_bounds(moments.mean, moments.smallest, moments.largest, share),
        sd=sd_bounds(moments.mean, moments.sd, moments.smallest, moments.largest, share),
        q5_least=edges[0],
        q95_most=edges[1],
    )


def column_table(result: Propagation) -> tuple[list[str], list[list]]:
    """Table of all statistics of every column: header and rows."""
    moments, quantiles, bounds = result.moments, result.quantiles(LEVELS), bounds_of(result)
    (low, high), (least, most) = bounds.mean, bounds.sd
    header = [
        "column", "unit", "rows", "nominal", "mean", "mean_standard_error", "sd", "skewness", "kurtosis",
        "smallest", *(f"q{100 * level:g}" for level in LEVELS), "largest", "mean_least", "mean_most",
        "sd_least", "sd_most", "q5_least", "q95_most",
    ]  # fmt: skip
    rows = []
    for k, label in enumerate(result.problem.columns.labels):
        rows.append([
            label, result.problem.columns.units[k], int(moments.count[k]), result.nominal[k],
            moments.mean[k], moments.standard_error[k], moments.sd[k], moments.skewness[k],
            moments.kurtosis[k], moments.smallest[k], *quantiles[:, k], moments.largest[k], low[k], high[k],
            least[k], most[k], bounds.q5_least[k], bounds.q95_most[k],
        ])  # fmt: skip
    return header, rows


def index_table(result: Propagation) -> tuple[list[str], list[list]]:
    """Table of every index with its interval and bounds: header and rows."""
    header = ["group", "column", "index", "value", "low", "high", "least", "most"]
    sums = result.summary.indices
    if sums is None:
        return header, []
    columns = result.problem.index_columns
    moments = result.moments
    bounds = sums.bounds(moments.smallest[columns], moments.largest[columns])
    labels, rows = result.problem.columns.labels, []
    for name, (value, half) in sums.estimates().items():
        least, most = bounds[name]
        for i, group in enumerate(result.problem.groups):
            for j, column in enumerate(columns):
                v, h = value[i, j], half[i, j]
                rows.append([group, labels[column], name, v, v - h, v + h, least[i, j], most[i, j]])
    return header, rows


def input_rows(problem: Problem) -> list[list]:
    """Every input with its unit, distribution and quantiles, as `INPUT_HEADER` has them.

    Numbers of a recording that no table has are in SI. Draws of a posterior are picked together, and have no
    quantiles here.
    """
    rows: list[list] = []
    for name, marginal in problem.inputs.marginals.items():
        unit = problem.response.variables[name].unit
        values = np.asarray(marginal.at(SCORES), float)
        rows.append([name, unit or "SI", marginal.words, *constant_from_si(values, unit or "1")])
    if problem.inputs.draws is not None:
        draws = problem.inputs.draws
        words = f"{len(draws.table):,} joint draws of {', '.join(draws.names)}"
        rows.append([POSTERIOR, "", words, np.nan, np.nan, np.nan])
    return rows


def shown_column(result: Propagation, name: str) -> int:
    """Column of a quantity for sentences: the one with the largest spread."""
    part = result.problem.columns.of(name)
    spread = np.nan_to_num(result.moments.sd[part], nan=-1.0)
    return part.start + int(np.argmax(spread))


def by_chance(result: Propagation) -> float:
    """Kolmogorov-Smirnov distance that the most uneven input has by chance, at most in 95 % of cases.

    Rows of a block share inputs, so a block with failed rows counts once. Massart's bound, shared among all
    inputs: P. Massart, Annals of Probability 18 (1990) 1269, doi:10.1214/aop/1176990746.
    """
    sums, inputs = result.summary.indices, len(result.problem.inputs.names)
    count = result.summary.failures.count if sums is None else sums.left_out
    return float(np.sqrt(0.5 * np.log(2.0 * inputs / 0.05) / max(count, 1)))


def too_few(result: Propagation) -> bool:
    """True if so few rows have no result that the place of no single input tells them from other rows."""
    failures, chance = result.summary.failures, by_chance(result)
    return bool(chance > TELLING and np.max(failures.uneven) <= chance)
