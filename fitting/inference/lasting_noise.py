"""Random effects of instruments: an offset and a drift of a zero, estimated from a fit's residuals, and their
effect on its standard errors.

Besides white noise each recording may have a constant offset of its zero and a random walk from its start.
Their sizes follow from the marginal likelihood of the linearised fit (restricted maximum likelihood, D. A.
Harville, J. Am. Stat. Assoc. 72 (1977) 320). It accounts for the part that the fit has absorbed. The fit
itself treats the noise as white. So the covariance of its parameters is the sandwich A^-1 (J' V J + P) A^-1.

The sizes are uncertain, too. The covariance is averaged over a grid of them, weighted by their probability
given the data.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from pneusma_jax.late import Late

linalg = Late("scipy.linalg")

BINS = 32
"""Maximum number of blocks of rows that a recording is averaged to; drifts are slow."""
DRIFTS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Candidate standard deviations of a drift at the end of a recording, in units of the noise."""
OFFSETS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Candidate standard deviations of a constant offset, in units of the noise."""
SCALES = (0.5, 0.71, 1.0, 1.41, 2.0, 2.8)
"""Candidate factors on the white noise, which may be stated wrongly."""
STEADY = 0.5
"""Prior probability of a zero without drift, and of one without offset."""
LEAST = 1e-4
"""Minimum weight of a grid point that is kept."""


@dataclass(frozen=True)
class Series:
    """Residuals of a fit for one output of one recording, rows in the order of time.

    Attributes:
        time: time of each row that counts, ascending, shape (rows,).
        misfit: residual over the noise, shape (rows,).
        slopes: derivatives of the residual by every free parameter, shape (rows, parameters).
        output: name of the output; outputs of one name share an instrument.
        count: number of readings averaged in a row.
    """

    time: np.ndarray
    misfit: np.ndarray
    slopes: np.ndarray
    output: str
    count: np.ndarray | float = 1.0


@dataclass(frozen=True)
class Lasting:
    """Estimated offsets and drifts of zeros, and their effect on standard errors.

    Attributes:
        variance: ratio of every parameter's variance to that of the fit, 1 or more, shape (parameters,).
        drift, offset: posterior mean of the standard deviation by output, in units of the noise.
        held: contribution of uncertain held constants to `variance`, shape (parameters,).
    """

    variance: np.ndarray
    drift: dict[str, float]
    offset: dict[str, float]
    held: np.ndarray | float = 0.0


def lasting(
    series: Sequence[Series], precision: np.ndarray, pull: np.ndarray, inflation: float = 1.0
) -> Lasting:
    """Effect of offsets and drifts of zeros on the standard errors of a fit.

    Args:
        series: residuals of all fitted recordings.
        precision: precision of the priors, shape (parameters,).
        pull: distance of each parameter from its prior's mean, shape (parameters,).
        inflation: factor on the noise that the fit's standard errors contain already.
    """
    binned = [_binned(one) for one in series if len(one.misfit) > 2]
    information = sum((s.slopes.T @ s.slopes for s in series), np.zeros((len(precision),) * 2)) / inflation**2
    scale = np.sqrt(np.maximum(np.diag(information) + precision, np.finfo(float).tiny))
    total = (information + np.diag(precision)) / np.outer(scale, scale)
    inverse = np.linalg.pinv(total, 1e-12, hermitian=True) / np.outer(scale, scale)
    meat, drift, offset = np.diag(precision).astype(float), {}, {}
    for output in dict.fromkeys(one.output for one in binned):
        mine = [one for one in binned if one.output == output]
        weights = _probable(mine, precision, pull)
        drift[output] = float(sum(w * d for (d, _, _), w in weights.items()))
        offset[output] = float(sum(w * o for (_, o, _), w in weights.items()))
        for (d, o, s), w in weights.items():
            for one in mine:
                covariance = s**2 * np.eye(len(one.misfit)) + _slow(one, d, o)
                meat += w * one.slopes.T @ covariance @ one.slopes / inflation**4
    found = np.diag(inverse @ meat @ inverse) / np.maximum(np.diag(inverse), np.finfo(float).tiny)
    return Lasting(np.maximum(np.nan_to_num(found, nan=1.0), 1.0), drift, offset)


def _binned(one: Series) -> Series:
    """The series in at most `BINS` blocks, each with the noise of a single row."""
    edges = np.linspace(0, len(one.misfit), min(BINS, len(one.misfit)) + 1).astype(int)
    size = np.diff(edges)
    total = lambda x: np.add.reduceat(x, edges[:-1], axis=0)  # noqa: E731
    root = np.sqrt(size)
    slopes = total(one.slopes) / root[:, None]
    return Series(total(one.time) / size, total(one.misfit) / root, slopes, one.output, size)


def _slow(one: Series, drift: float, offset: float) -> np.ndarray:
    """Covariance of a zero with offset and drift, between blocks, shape (blocks, blocks)."""
    course = (one.time - one.time[0]) / max(float(np.ptp(one.time)), 1e-12)
    walk = drift**2 * np.minimum.outer(course, course) + offset**2
    return walk * np.sqrt(np.multiply.outer(one.count, one.count))


def _probable(
    series: Sequence[Series], precision: np.ndarray, pull: np.ndarray
) -> dict[tuple[float, float, float], float]:
    """Posterior probability of each grid point that is kept: drift, offset and scale of the noise."""
    places = list(product(DRIFTS, OFFSETS, SCALES))
    before = [_before(drift, DRIFTS) * _before(offset, OFFSETS) for drift, offset, _ in places]
    logs = np.array([_log_evidence(series, precision, pull, *place) for place in places]) + np.log(before)
    weight = np.exp(logs - logs.max())
    weight = np.where(weight < LEAST * weight.max(), 0.0, weight)
    weight /= weight.sum()
    return {place: float(w) for place, w in zip(places, weight, strict=True) if w > 0.0}


def _before(size: float, sizes: Sequence[float]) -> float:
    """Prior probability of a size: zero, or any order of magnitude alike."""
    return STEADY if size == 0.0 else (1.0 - STEADY) / (len(sizes) - 1)


def _log_evidence(
    series: Sequence[Series],
    precision: np.ndarray,
    pull: np.ndarray,
    drift: float,
    offset: float,
    scale: float,
) -> float:
    """Marginal log-likelihood of a fit's residuals, with its parameters integrated out with their priors."""
    known = precision > 0.0
    normal, target = np.diag(np.where(known, precision, 1e-12)), precision * pull
    square, logs = float(precision @ pull**2), 0.0
    for one in series:
        covariance = scale**2 * np.eye(len(one.misfit)) + _slow(one, drift, offset)
        factor = np.linalg.cholesky(covariance)
        whitened = linalg.solve_triangular(factor, np.column_stack([one.misfit, one.slopes]), lower=True)
        r, slopes = whitened[:, 0], whitened[:, 1:]
        normal, target = normal + slopes.T @ slopes, target + slopes.T @ r
        square, logs = square + float(r @ r), logs + 2.0 * float(np.log(np.diag(factor)).sum())
    size = np.sqrt(np.diag(normal))
    scaled = normal / np.outer(size, size) + 1e-12 * np.eye(len(size))
    least = float(target / size @ linalg.cho_solve(linalg.cho_factor(scaled), target / size))
    determinant = float(np.linalg.slogdet(scaled)[1] + 2.0 * np.log(size).sum())
    return -0.5 * (logs + determinant + square - least)
