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
from .zeros import Series, Size, square

special = Late("scipy.special")

LEVELS = {50: 0.5, 68: math.erf(math.sqrt(0.5)), 90: 0.9}
"""Parts of a distribution that intervals of so many per cent hold; the 68 is one standard deviation."""
BISECTIONS = 40
"""Halvings of the bracket of an interval's end; its error is then that of the arithmetic."""
FAR = 6.0
"""Standard deviations from its centre within which a member of a mixture lies."""
REACH = 0.1
"""Least length of one side of an interval over that of the fit, so that it holds the value that is quoted."""
WHOLE = 1.0
"""The same where constants are held that the recordings would move. They do so by several errors at times,
for which the derivatives at the fit are only a hint: `ka_3` of a wire was moved to the wrong side."""
SURE = 1.0 / (1.0 + CLEAR)
"""Probability of zeros that neither are off nor drift, from which white noise serves a fit. Below, the fit
is made with correlated noise. Where that misses the recordings, intervals reach equally far to both sides."""


@dataclass(frozen=True)
class Lasting:
    """Estimated offsets and drifts of zeros, and their effect on the intervals of a fit's constants.

    Attributes:
        variance: square of the longer side of every parameter's 90 % interval over that of the fit, shape
            (parameters,).
        drift, offset: posterior mean of the standard deviation by output, in units of the noise.
        levels: by per cent, squares of the lower and the upper side of an interval, shape (parameters, 2)
            each. They are relative to those of a Gaussian of that variance. They are below 1 where sizes are
            uncertain, as tails are then longer than a Gaussian's. So they are on the side that zeros have
            moved the fit to.
        scale: posterior mean of the white noise by output, in units of the noise.
        steady: probability that no zero is off or drifts; one half beforehand, for any number of outputs.
        taken: true if the fit was made with noise that zeros correlate.
    """

    variance: np.ndarray
    drift: dict[str, float]
    offset: dict[str, float]
    levels: Mapping[int, np.ndarray] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    steady: float = 1.0
    taken: bool = False

    @property
    def sizes(self) -> dict[str, Size]:
        """Mean sizes by output."""
        return {name: (self.drift[name], self.offset[name], self.scale[name]) for name in self.drift}


def levels_by_name(found: Lasting, names: Sequence[str]) -> dict[str, dict[int, tuple[float, float]]]:
    """Factors on the sides of each parameter's intervals by per cent, as `Lasting.levels`."""
    sides = {p: np.broadcast_to(x, (len(names), 2)) for p, x in found.levels.items()}
    return {
        name: {p: (float(x[k, 0]), float(x[k, 1])) for p, x in sides.items()} for k, name in enumerate(names)
    }


def lasting(
    series: Sequence[Series],
    precision: np.ndarray,
    pull: np.ndarray,
    inflation: float = 1.0,
    taken: Mapping[str, Size] | None = None,
    held: int = 0,
) -> Lasting:
    """Effect of offsets and drifts of zeros on the intervals of a fit's constants.

    Args:
        series: residuals of all fitted recordings.
        precision: precision of the priors, shape (parameters,).
        pull: distance of each parameter from its prior's mean, shape (parameters,).
        inflation: factor on the noise that the fit's standard errors contain already.
        taken: sizes of zeros that the fit was made with, by output; none for a fit with white noise.
        held: number of last parameters that the fit held at their priors' means. What recordings say of them
            moves the others, and their doubt counts.
    """
    counted = [one for one in series if len(one.misfit) > 2]
    outputs = list(dict.fromkeys(one.output for one in counted))
    each = [sizes_of([s for s in counted if s.output == output], precision, pull) for output in outputs]
    none = np.zeros((len(precision) + 1, len(precision) + 1))
    own, rest = (
        sum((square(s, (taken or {}).get(s.output, (0.0, 0.0, 1.0))) for s in some), none) / inflation**2
        for some in (series, [s for s in series if len(s.misfit) <= 2])
    )
    return _of_mixture(each, outputs, own, rest, precision, pull, taken, held)


def lasting_beside_trajectories(
    recordings: Sequence[Shared],
    precision: np.ndarray,
    pull: np.ndarray,
    inflation: float = 1.0,
    taken: Mapping[str, Size] | None = None,
) -> Lasting:
    """The same of recordings with hidden trajectories, which all have the same outputs; see `lasting`.

    An output without a reading tells nothing of its zero, which is left out.
    """
    none = np.zeros((len(precision) + 1, len(precision) + 1))
    own = sum((square_beside(one, taken or {}) for one in recordings), none) / inflation**2
    names = recordings[0].moved if recordings else {}
    outputs = [name for name in names if any(len(one.time[name]) for one in recordings)]
    each = [shared_sizes_of(recordings, outputs, precision, pull)] if outputs else []
    return _of_mixture(each, outputs, own, none, precision, pull, taken)


def _of_mixture(
    each: Sequence[Sizes],
    outputs: Sequence[str],
    own: np.ndarray,
    rest: np.ndarray,
    precision: np.ndarray,
    pull: np.ndarray,
    taken: Mapping[str, Size] | None = None,
    held: int = 0,
) -> Lasting:
    """Intervals of the mixture over all probable sizes.

    Args:
        each: probable sizes of each output, or group of outputs.
        outputs: names of the outputs, in that order.
        own: squares of slopes and residuals in the noise of the fit, shape (parameters + 1, parameters + 1).
        rest: those of rows that tell nothing of zeros.
        precision, pull, taken, held: as of `lasting`.
    """
    free = len(precision) - held
    covariance = inverse(with_prior(own[:free, :free], precision[:free]))
    unit = np.sqrt(np.diag(covariance))
    if not each:  # no series tells of zeros; held constants leave their doubt
        sd = np.sqrt(np.diag(inverse(with_prior(own[:-1, :-1], precision))))[:free] / unit
        return _of_sides({percent: np.stack([sd, sd], axis=1) for percent in LEVELS}, taken)
    steady = steady_of(each, precision, pull, rest)
    members, weight = joint([decided(one) for one in each], precision, pull, rest)
    even, least = steady < SURE and not taken, WHOLE if held else REACH
    # a fit that stopped early is off its optimum by so much, which no zero has made
    early = covariance @ (own[:-1, -1] + precision * pull)[:free]

    # held constants are free here: the mixture has their doubt, as far as the recordings leave it
    spread = inverse(members.normal)
    centre = early - np.einsum("mij,mj->mi", spread, members.slope)[:, :free]
    sd = np.sqrt(np.einsum("mii->mi", spread))[:, :free]
    sides = sides_of(centre / unit, sd / unit, weight, even, least)
    sizes = np.einsum("m,mok->ko", weight, members.size)
    drift, offset, scale = (dict(zip(outputs, map(float, row), strict=True)) for row in sizes)
    return replace(_of_sides(sides, taken), drift=drift, offset=offset, scale=scale, steady=steady)


def _of_sides(sides: dict[int, np.ndarray], taken: Mapping[str, Size] | None) -> Lasting:
    """What intervals of these sides tell."""
    longer = sides[90].max(axis=1)
    levels = {percent: (side / longer[:, None]) ** 2 for percent, side in sides.items()}
    return Lasting(longer**2, {}, {}, levels=levels, taken=bool(taken))


def sides_of(
    centre: np.ndarray, sd: np.ndarray, weight: np.ndarray, even: bool = False, least: float = REACH
) -> dict[int, np.ndarray]:
    """Lower and upper side of a mixture's intervals over those of a unit Gaussian about zero, by per cent.

    Args:
        centre, sd: centre and standard deviation of each member, shape (members, parameters).
        weight: probability of each, shape (members,).
        even: true for intervals that reach equally far to both sides of zero.
        least: least length of one side.

    Returns:
        Shape (parameters, 2) each. Both sides together are never shorter than the Gaussian's.
    """
    found = {}
    for percent, share in LEVELS.items():
        gaussian = special.ndtri(0.5 + 0.5 * share)
        ends = [_quantile(centre, sd, weight, 0.5 + 0.5 * side * share) for side in (-1.0, 1.0)]
        if even:
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
