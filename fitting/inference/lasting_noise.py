"""Random effects of instruments: an offset and a drift of a zero, estimated from a fit's residuals, and their
effect on its standard errors.

Besides white noise each recording may have a constant offset of its zero and a random walk from its start.
Their sizes follow from the marginal likelihood of the linearised fit (restricted maximum likelihood, D. A.
Harville, J. Am. Stat. Assoc. 72 (1977) 320). It accounts for the part that the fit has absorbed. The fit
itself treats the noise as white. So the covariance of its parameters is the sandwich A^-1 (J' V J + P) A^-1.

The sizes are uncertain, too. So a parameter's distribution is a mixture over a grid of them, weighted by
their probability given the data: of Gaussians of one centre and many widths. Its intervals are those of that
mixture. A variance averaged over the grid is not the same: a drift that is as probable as 3 % but six times
as wide as the noise doubles the variance, and widens a 90 % interval by 7 %.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from pneusma_jax.late import Late

linalg = Late("scipy.linalg")
special = Late("scipy.special")

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
LEVELS = {50: 0.5, 68: math.erf(math.sqrt(0.5)), 90: 0.9}
"""Parts of a distribution that intervals of so many per cent hold; the 68 is one standard deviation."""
BISECTIONS = 40
"""Halvings of the bracket of an interval's end; its error is then that of the arithmetic."""
MEMBERS = 4000
"""Number of members of a mixture over several instruments, drawn from those of each. The end of a 90 %
interval is then known to 3 % beside drifts of up to ten times the noise's width, and to 4 % at twenty."""


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
        variance: square of the ratio of every parameter's 90 % interval to that of the fit, 1 or more, shape
            (parameters,).
        drift, offset: posterior mean of the standard deviation by output, in units of the noise.
        held: contribution of uncertain held constants to `variance`, shape (parameters,).
        levels: the same ratio for intervals of so many per cent, over that of 90 %, shape (parameters,) each.
            It is below 1 where sizes are uncertain: the tails are then longer than a Gaussian's.
    """

    variance: np.ndarray
    drift: dict[str, float]
    offset: dict[str, float]
    held: np.ndarray | float = 0.0
    levels: Mapping[int, np.ndarray] = field(default_factory=dict)


def levels_by_name(found: Lasting, names: Sequence[str]) -> dict[str, dict[int, float]]:
    """Factor of each parameter's intervals by per cent, as `Lasting.levels`."""
    return {
        name: {p: float(np.broadcast_to(x, len(names))[k]) for p, x in found.levels.items()}
        for k, name in enumerate(names)
    }


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
    norm = np.maximum(np.diag(inverse), np.finfo(float).tiny)
    least = np.einsum("ij,j,ij->i", inverse, precision, inverse) / norm
    mixtures, drift, offset = [], {}, {}
    for output in dict.fromkeys(one.output for one in binned):
        mine = [one for one in binned if one.output == output]
        weights = _probable(mine, precision, pull)
        drift[output] = float(sum(w * d for (d, _, _), w in weights.items()))
        offset[output] = float(sum(w * o for (_, o, _), w in weights.items()))
        added = []
        for d, o, s in weights:
            covariances = [s**2 * np.eye(len(one.misfit)) + _slow(one, d, o) for one in mine]
            meat = sum(one.slopes.T @ c @ one.slopes for one, c in zip(mine, covariances, strict=True))
            added.append(np.einsum("ij,jk,ik->i", inverse, meat, inverse) / inflation**4 / norm)
        mixtures.append((np.array(added), np.array(list(weights.values()))))
    ratios = _ratios(*_mixed(least, mixtures))
    found = np.maximum(np.nan_to_num(ratios[90], nan=1.0), 1.0)
    levels = {p: np.maximum(np.nan_to_num(ratio, nan=1.0), 1.0) / found for p, ratio in ratios.items()}
    return Lasting(found, drift, offset, levels=levels)


def _mixed(
    least: np.ndarray, mixtures: Sequence[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Variances of the members of a mixture over all instruments, shape (members, parameters); weights.

    Args:
        least: variance of every parameter without any noise.
        mixtures: added variances and weights of each instrument's own mixture.
    """
    if not mixtures:
        return np.ones_like(least)[None, :], np.ones(1)
    if len(mixtures) == 1:
        return least + mixtures[0][0], mixtures[0][1]
    random, total = np.random.default_rng(0), np.tile(least, (MEMBERS, 1))
    for added, weight in mixtures:
        total += added[random.choice(len(weight), MEMBERS, p=weight / weight.sum())]
    return total, np.full(MEMBERS, 1.0 / MEMBERS)


def _ratios(variance: np.ndarray, weight: np.ndarray) -> dict[int, np.ndarray]:
    """Square of the half widths of a mixture's intervals over those of a unit Gaussian, by per cent."""
    sd = np.sqrt(np.maximum(variance, 0.0))
    found = {}
    for percent, share in LEVELS.items():
        gaussian = special.ndtri(0.5 + 0.5 * share)
        low, high = gaussian * sd.min(axis=0), gaussian * sd.max(axis=0)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            inside = weight @ special.erf(middle / np.maximum(sd, np.finfo(float).tiny) / math.sqrt(2.0))
            low, high = np.where(inside < share, middle, low), np.where(inside < share, high, middle)
        found[percent] = (0.5 * (low + high) / gaussian) ** 2
    return found


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
