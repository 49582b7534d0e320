"""Effect of zeros that are off or drift on the intervals of a fit's constants."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pneusma_jax.late import Late

from .evidence import inverse, with_prior
from .mixture import joint, steady_of
from .shared import Shared, shared_sizes_of, square_beside
from .sizes import CLEAR, Sizes, decided, sizes_of
from .zeros import WHITE, Series, Size, square

special = Late("scipy.special")

SHARES = {50: 0.5, 68: math.erf(math.sqrt(0.5)), 90: 0.9}
"""Share of a distribution that an interval holds, by per cent; the 68 is one standard deviation."""
BISECTIONS = 40
"""Halvings of the bracket of an interval's end; its error is then that of the arithmetic."""
FAR = 6.0
"""Standard deviations from its centre within which a member of a mixture lies."""
LEAST_SIDE = 0.1
"""Least length of one side of an interval over that of the fit [1], so that it holds the quoted value."""
LEAST_SIDE_WITH_HELD = 1.0
"""The same where constants are held that the recordings would move. They do so by several errors at times,
for which the derivatives at the fit are only a hint: `ka_3` of a wire was moved to the wrong side."""
SURE_OF_WHITE = 1.0 / (1.0 + CLEAR)
"""Probability of zeros that neither are off nor drift, from which white noise serves a fit. Below, the fit
is made with correlated noise. Where that misses the recordings, intervals reach equally far to both sides."""
FEWEST_ROWS = 3
"""Minimum number of rows of a series that tells of its zero."""


@dataclass(frozen=True)
class Lasting:
    """Estimated offsets and drifts of zeros, and their effect on the intervals of a fit's constants.

    Attributes:
        variance: square of the longer side of every parameter's 90 % interval over that of the fit, shape
            (parameters,).
        drift, offset: posterior mean of the standard deviation by output, in units of the noise.
        side_variances: by per cent, (side / longer side at 90 %)^2 of the lower and the upper side of an
            interval, shape (parameters, 2) each, where sides are in those of a Gaussian. Below 1 on the
            shorter side, and where sizes are uncertain, as tails are then longer than a Gaussian's.
        scale: posterior mean of the white noise by output, in units of the noise.
        steady: probability that no zero is off or drifts; one half beforehand, for any number of outputs.
        steady_by_output: the same of the zero of each output alone.
        fitted_beside_zeros: true if the fit was made with noise that zeros correlate.
        correlation: correlation of the constants' errors beside the zeros, shape (parameters, parameters);
            None where it is that of the fit.
    """

    variance: np.ndarray
    drift: dict[str, float]
    offset: dict[str, float]
    side_variances: Mapping[int, np.ndarray] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    steady: float = 1.0
    steady_by_output: Mapping[str, float] = field(default_factory=dict)
    fitted_beside_zeros: bool = False
    correlation: np.ndarray | None = None

    @property
    def told(self) -> list[str]:
        """Outputs whose zeros are off or drift by clear evidence (`CLEAR`), most first; none where it is not.

        The size of a zero that recordings do not tell is that of its prior, and is no finding.
        """
        if self.steady >= SURE_OF_WHITE:
            return []
        names = sorted(self.steady_by_output, key=lambda name: self.steady_by_output[name])
        return [name for name in names if self.steady_by_output[name] < SURE_OF_WHITE] or names[:1]

    @property
    def sizes(self) -> dict[str, Size]:
        """Mean sizes by output."""
        return {n: Size(self.drift[n], self.offset[n], self.scale[n]) for n in self.drift}


def variances_by_name(found: Lasting, names: Sequence[str]) -> dict[str, float]:
    """`Lasting.variance` of each parameter."""
    return dict(zip(names, np.broadcast_to(found.variance, len(names)).tolist(), strict=True))


def covariance_beside_zeros(
    found: Lasting, names: Sequence[str], covariance: np.ndarray, names_of_fit: Sequence[str]
) -> np.ndarray:
    """Covariance of a fit's constants that counts zeros which are off or drift, as `covariance` without them.

    Args:
        found: zeros.
        names: names of the parameters of `found`.
        covariance: covariance by the fit alone, shape (constants, constants).
        names_of_fit: names of its constants, all of them among `names`.
    """
    at = [list(names).index(name) for name in names_of_fit]
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    if found.correlation is not None:
        correlation = found.correlation[np.ix_(at, at)]
    wider = sd * np.sqrt(np.broadcast_to(found.variance, len(names))[at])
    return correlation * np.outer(wider, wider)


def side_variances_by_name(
    found: Lasting, names: Sequence[str]
) -> dict[str, dict[int, tuple[float, float]]]:
    """`Lasting.side_variances` of each parameter, by per cent."""
    sides = {p: np.broadcast_to(x, (len(names), 2)) for p, x in found.side_variances.items()}
    return {
        name: {p: (float(x[k, 0]), float(x[k, 1])) for p, x in sides.items()} for k, name in enumerate(names)
    }


def lasting(
    series: Sequence[Series],
    precision: np.ndarray,
    pull: np.ndarray,
    inflation: float = 1.0,
    noise_sizes: Mapping[str, Size] | None = None,
    held: int = 0,
) -> Lasting:
    """Effect of offsets and drifts of zeros on the intervals of a fit's constants.

    Args:
        series: residuals of all fitted recordings.
        precision: precision of the priors, in the units of the slopes of `series`, shape (parameters,). For
            constants that were fitted these are SI, for those that were held the priors' standard deviations.
        pull: distance of each parameter from its prior's mean, in the same units, shape (parameters,).
        inflation: factor on the noise that the fit's standard errors contain already [1].
        noise_sizes: sizes of zeros that the fit was made with, by output; none for a fit with white noise.
        held: number of parameters that the fit held at their priors' means; they are the last ones. What
            recordings say of them moves the others, and their doubt counts.
    """
    counted = [one for one in series if len(one.misfit) >= FEWEST_ROWS]
    outputs = list(dict.fromkeys(one.output for one in counted))
    sizes_by_output = [
        sizes_of([s for s in counted if s.output == output], precision, pull) for output in outputs
    ]
    none, beside = np.zeros((len(precision) + 1, len(precision) + 1)), noise_sizes or {}
    fit_square, square_without_zeros = (
        sum((square(s, beside.get(s.output, WHITE)) for s in some), none) / inflation**2
        for some in (series, [s for s in series if len(s.misfit) < FEWEST_ROWS])
    )
    return _of_mixture(
        sizes_by_output, outputs, fit_square, square_without_zeros, precision, pull, noise_sizes, held
    )


def lasting_beside_trajectories(
    recordings: Sequence[Shared],
    precision: np.ndarray,
    pull: np.ndarray,
    inflation: float = 1.0,
    noise_sizes: Mapping[str, Size] | None = None,
) -> Lasting:
    """The same of recordings with hidden trajectories, which all have the same outputs; see `lasting`.

    An output without a reading tells nothing of its zero, which is left out.
    """
    none = np.zeros((len(precision) + 1, len(precision) + 1))
    fit_square = sum((square_beside(one, noise_sizes or {}) for one in recordings), none) / inflation**2
    names = recordings[0].moved if recordings else {}
    outputs = [name for name in names if any(len(one.time[name]) for one in recordings)]
    sizes_by_output = [shared_sizes_of(recordings, outputs, precision, pull)] if outputs else []
    return _of_mixture(sizes_by_output, outputs, fit_square, none, precision, pull, noise_sizes)


def _of_mixture(
    sizes_by_output: Sequence[Sizes],
    outputs: Sequence[str],
    fit_square: np.ndarray,
    square_without_zeros: np.ndarray,
    precision: np.ndarray,
    pull: np.ndarray,
    noise_sizes: Mapping[str, Size] | None = None,
    held: int = 0,
) -> Lasting:
    """Intervals of the mixture over all probable sizes.

    Args:
        sizes_by_output: probable sizes of each output, or group of outputs.
        outputs: names of the outputs, in that order.
        fit_square: squares of slopes and residuals in the noise of the fit, shape (parameters + 1,
            parameters + 1).
        square_without_zeros: those of rows that tell nothing of zeros.
        precision, pull, noise_sizes, held: as of `lasting`.
    """
    free = len(precision) - held
    covariance = inverse(with_prior(fit_square[:free, :free], precision[:free]))
    unit = np.sqrt(np.diag(covariance))
    if not sizes_by_output:  # no series tells of zeros; held constants leave their doubt
        sd = np.sqrt(np.diag(inverse(with_prior(fit_square[:-1, :-1], precision))))[:free] / unit
        return _of_sides({percent: np.stack([sd, sd], axis=1) for percent in SHARES}, noise_sizes)
    steady, alone = steady_of(sizes_by_output, precision, pull, square_without_zeros)
    members, weight = joint([decided(one) for one in sizes_by_output], precision, pull, square_without_zeros)
    symmetric = steady < SURE_OF_WHITE and not noise_sizes
    least = LEAST_SIDE_WITH_HELD if held else LEAST_SIDE
    # a fit that stopped early is off its optimum by so much, which no zero has made
    early = covariance @ (fit_square[:-1, -1] + precision * pull)[:free]

    # held constants are free here: the mixture has their doubt, as far as the recordings leave it
    spread = inverse(members.normal)
    centre = early - np.einsum("mij,mj->mi", spread, members.slope)[:, :free]
    sd = np.sqrt(np.einsum("mii->mi", spread))[:, :free]
    sides = sides_of(centre / unit, sd / unit, weight, symmetric, least)
    square = np.einsum("m,mij->ij", weight, spread[:, :free, :free] + centre[:, :, None] * centre[:, None, :])
    size = np.sqrt(np.diag(square))
    sizes = np.einsum("m,mok->ko", weight, members.size)
    drift, offset, scale = (dict(zip(outputs, map(float, row), strict=True)) for row in sizes)
    told = _of_sides(sides, noise_sizes)
    correlation = square / np.outer(size, size)
    by_output = dict(zip(outputs, alone.tolist(), strict=True))
    return replace(
        told, drift=drift, offset=offset, scale=scale, steady=steady, steady_by_output=by_output,
        correlation=correlation,
    )  # fmt: skip


def _of_sides(sides: dict[int, np.ndarray], noise_sizes: Mapping[str, Size] | None) -> Lasting:
    """Variance and side variances of intervals with these sides, see `sides_of`; no sizes of zeros yet."""
    longer = sides[90].max(axis=1)
    variances = {percent: (side / longer[:, None]) ** 2 for percent, side in sides.items()}
    return Lasting(longer**2, {}, {}, side_variances=variances, fitted_beside_zeros=bool(noise_sizes))


def sides_of(
    centre: np.ndarray, sd: np.ndarray, weight: np.ndarray, symmetric: bool = False, least: float = LEAST_SIDE
) -> dict[int, np.ndarray]:
    """Lower and upper side of a mixture's intervals over those of a unit Gaussian about zero, by per cent.

    Args:
        centre, sd: centre and standard deviation of each member, shape (members, parameters).
        weight: probability of each, shape (members,).
        symmetric: true for intervals that reach equally far to both sides of zero.
        least: least length of one side.

    Returns:
        Shape (parameters, 2) each. Both sides together are never shorter than the Gaussian's.
    """
    found = {}
    for percent, share in SHARES.items():
        gaussian = special.ndtri(0.5 + 0.5 * share)
        ends = [_quantile(centre, sd, weight, 0.5 + 0.5 * side * share) for side in (-1.0, 1.0)]
        if symmetric:
            both = np.concatenate([centre, -centre]), np.concatenate([sd, sd]), 0.5 * np.tile(weight, 2)
            upper = _quantile(*both, 0.5 + 0.5 * share)
            ends = [-upper, upper]
        sides = np.maximum(np.stack([-ends[0], ends[1]], axis=1) / gaussian, least)
        found[percent] = sides * np.maximum(2.0 / sides.sum(axis=1), 1.0)[:, None]
    return found


def _quantile(centre: np.ndarray, sd: np.ndarray, weight: np.ndarray, share: float) -> np.ndarray:
    """Place below which a mixture of Gaussians has this share, shape (parameters,); see `sides_of`."""
    low, high = (centre - FAR * sd).min(axis=0), (centre + FAR * sd).max(axis=0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = weight @ special.ndtr((middle - centre) / sd)
        low, high = np.where(below < share, middle, low), np.where(below < share, high, middle)
    return 0.5 * (low + high)
