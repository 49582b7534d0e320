"""Random effects of instruments: an offset and a drift of a zero, estimated from a fit's residuals, and their
effect on the intervals of its constants.

Besides white noise each recording may have a constant offset of its zero and a random walk from its start.
Its inputs have such zeros, too, of the same size in units of their own noise.
Their sizes follow from the marginal likelihood of the linearised fit (restricted maximum likelihood, D. A.
Harville, J. Am. Stat. Assoc. 72 (1977) 320). It accounts for the part that the fit has absorbed.

A fit that treats the noise as white ignores this. Zeros of known sizes make the noise correlated. The
constants then have the centre and the covariance of generalised least squares. The sizes are uncertain, so a
constant's distribution is a mixture of such Gaussians over a grid of sizes, weighted by their probability
given the data. Intervals leave out as much of that mixture below as above.

Two simpler ways make intervals of clean recordings too wide. One is the covariance that a white fit has
beside a drift, the sandwich A^-1 (J' V J + P) A^-1: it is the mean over all courses of that drift, also those
that the residuals at hand exclude. The other is a variance averaged over the grid. A drift that is as
probable as 3 % but six times as wide as the noise doubles it, and widens a 90 % interval by 7 %.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from pneusma_jax.late import Late

special = Late("scipy.special")

BINS = 32
"""Maximum number of blocks of rows that a recording is averaged to; drifts are slow."""
DRIFTS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Candidate standard deviations of a drift at the end of a recording, in units of the noise."""
OFFSETS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Candidate standard deviations of a constant offset, in units of the noise."""
SCALES = (0.5, 0.59, 0.71, 0.84, 1.0, 1.19, 1.41, 1.68, 2.0, 2.38, 2.83)
"""Candidate factors on the white noise, which may be stated wrongly."""
STEADY = 0.5
"""Prior probability of a zero without drift, and of one without offset."""
LEAST = 1e-4
"""Minimum weight of a grid point that is kept."""
LEVELS = {50: 0.5, 68: math.erf(math.sqrt(0.5)), 90: 0.9}
"""Parts of a distribution that intervals of so many per cent hold; the 68 is one standard deviation."""
BISECTIONS = 40
"""Halvings of the bracket of an interval's end; its error is then that of the arithmetic."""
FAR = 6.0
"""Standard deviations from its centre within which a member of a mixture lies."""
MEMBERS = 4000
"""Maximum number of members of a mixture over several instruments. More are drawn from those of each. The end
of a 90 % interval is then known to 3 % beside drifts of up to ten times the noise's width, and to 4 % at
twenty."""
REACH = 0.1
"""Least length of one side of an interval over that of the fit, so that it holds the value that is quoted."""
WHOLE = 1.0
"""The same where constants are held that the recordings would move. They do so by several errors at times,
for which the derivatives at the fit are only a hint: `ka_3` of a wire was moved to the wrong side."""
CLEAR = 3.0
"""Bayes factor from which zeros count as off or wandering. Where recordings cannot tell, it is 1."""
SURE = 1.0 / (1.0 + CLEAR)
"""Probability of zeros that neither are off nor wander, from which white noise serves a fit. Below, the fit
is made with correlated noise. Where that misses the recordings, intervals reach equally far to both sides."""
RIDGE = 1e-12
"""Least precision of a constant without a prior, and part of the scaled information that is added to it."""


Size = tuple[float, float, float]
"""Standard deviations of a zero's drift at the end of a recording, of its offset, and of the white noise, all
in units of the noise as it was stated."""


@dataclass(frozen=True)
class Series:
    """Residuals of a fit for one output of one recording, rows in the order of time.

    Attributes:
        time: time of each row that counts, ascending, shape (rows,).
        misfit: residual over the noise, shape (rows,).
        slopes: derivatives of the residual by every free parameter, shape (rows, parameters).
        output: name of the output; outputs of one name share an instrument.
        count: number of readings averaged in a row.
        share: part of the noise's standard deviation that the instrument itself makes, 0 to 1, shape (rows,);
            inputs make the rest.
    """

    time: np.ndarray
    misfit: np.ndarray
    slopes: np.ndarray
    output: str
    count: np.ndarray | float = 1.0
    share: np.ndarray | float = 1.0


@dataclass(frozen=True)
class Lasting:
    """Estimated offsets and drifts of zeros, and their effect on the intervals of a fit's constants.

    Attributes:
        variance: square of the longer side of every parameter's 90 % interval over that of the fit, shape
            (parameters,).
        drift, offset: posterior mean of the standard deviation by output, in units of the noise.
        levels: by per cent, square of the lower and the upper side of an interval over those of a Gaussian of
            that variance, shape (parameters, 2) each. They are below 1 where sizes are uncertain, as tails
            are then longer than a Gaussian's, and on the side that zeros have moved the fit to.
        scale: posterior mean of the white noise by output, in units of the noise.
        steady: probability that no zero is off or wanders; one half beforehand, for any number of outputs.
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
    free = len(precision) - held
    counted = [one for one in series if len(one.misfit) > 2]
    outputs = list(dict.fromkeys(one.output for one in counted))
    each = [_sizes([s for s in counted if s.output == output], precision, pull) for output in outputs]
    none = np.zeros((len(precision) + 1, len(precision) + 1))
    own, rest = (
        sum((_square(s, (taken or {}).get(s.output, (0.0, 0.0, 1.0))) for s in some), none) / inflation**2
        for some in (series, [s for s in series if len(s.misfit) <= 2])
    )
    covariance = _inverse(_with_prior(own[:free, :free], precision[:free]))
    unit = np.sqrt(np.diag(covariance))
    if not each:  # no series tells of zeros; held constants leave their doubt
        sd = np.sqrt(np.diag(_inverse(_with_prior(own[:-1, :-1], precision))))[:free] / unit
        return _of_sides({percent: np.stack([sd, sd], axis=1) for percent in LEVELS}, taken)
    steady = _steady(each, precision, pull, rest)
    members, weight = _joint([_decided(one) for one in each], precision, pull, rest)
    even, least = steady < SURE and not taken, WHOLE if held else REACH
    # a fit that stopped early is off its optimum by so much, which no zero has made
    early = covariance @ (own[:-1, -1] + precision * pull)[:free]

    # held constants are free here: the mixture has their doubt, as far as the recordings leave it
    spread = _inverse(members.normal)
    centre = early - np.einsum("mij,mj->mi", spread, members.slope)[:, :free]
    sd = np.sqrt(np.einsum("mii->mi", spread))[:, :free]
    sides = _sides(centre / unit, sd / unit, weight, even, least)
    sizes = np.einsum("m,mok->ko", weight, members.size)
    drift, offset, scale = (dict(zip(outputs, map(float, row), strict=True)) for row in sizes)
    return replace(_of_sides(sides, taken), drift=drift, offset=offset, scale=scale, steady=steady)


def _of_sides(sides: dict[int, np.ndarray], taken: Mapping[str, Size] | None) -> Lasting:
    """What intervals of these sides tell."""
    longer = sides[90].max(axis=1)
    levels = {percent: (side / longer[:, None]) ** 2 for percent, side in sides.items()}
    return Lasting(longer**2, {}, {}, levels=levels, taken=bool(taken))


@dataclass(frozen=True)
class _Sizes:
    """What the recordings of one output tell for each probable size of its zeros.

    Attributes:
        size: drift, offset and scale of the noise, shape (sizes, 3).
        before: logarithm of the prior probability, shape (sizes,).
        evidence: marginal log-likelihood from this output alone, shape (sizes,).
        information: information about the parameters, shape (sizes, parameters, parameters).
        slope: derivative of half the loss by the parameters, shape (sizes, parameters).
        loss: square of the whitened residuals plus the logarithm of the noise's determinant, shape (sizes,).
    """

    size: np.ndarray
    before: np.ndarray
    evidence: np.ndarray
    information: np.ndarray
    slope: np.ndarray
    loss: np.ndarray

    @property
    def weight(self) -> np.ndarray:
        """Probability of each size from this output alone, shape (sizes,)."""
        return _normal(self.before + self.evidence)


@dataclass(frozen=True)
class _Members:
    """Members of the mixture over all outputs.

    Attributes:
        size: drift, offset and scale of each output, shape (members, outputs, 3).
        normal: information about the parameters, priors included, shape (members, parameters, parameters).
        slope: derivative of half the loss, priors included, at the fit, shape (members, parameters).
    """

    size: np.ndarray
    normal: np.ndarray
    slope: np.ndarray


def _sizes(series: Sequence[Series], precision: np.ndarray, pull: np.ndarray) -> _Sizes:
    """Probable sizes of one output's zeros, and what its recordings tell beside each."""
    grid = list(product(DRIFTS, OFFSETS))
    count, shape = len(precision), (len(grid), len(SCALES))
    information, slope = np.zeros((*shape, count, count)), np.zeros((*shape, count))
    loss = np.zeros(shape)
    for one in series:
        for k, (drift, offset) in enumerate(grid):
            square, determinant = _squares(one, drift, offset, np.array(SCALES))
            information[k] += square[:, :count, :count]
            slope[k] += square[:, :count, count]
            loss[k] += square[:, count, count] + determinant
    size = np.array([[(d, o, s) for s in SCALES] for d, o in grid]).reshape(-1, 3)
    information, slope, loss = (x.reshape(-1, *x.shape[2:]) for x in (information, slope, loss))
    evidence = _log_evidence(information, slope, loss, precision, pull)
    before = np.log([_before(d, DRIFTS) * _before(o, OFFSETS) for d, o, _ in size])
    return _Sizes(size, before, evidence, information, slope, loss)


def _decided(sizes: _Sizes) -> _Sizes:
    """The sizes with another prior, once zeros clearly wander, or are off: they do, by any size.

    The prior that any order of magnitude is alike serves that decision. Beside few recordings it would then
    pull sizes to zero. A flat one does not (A. Gelman, Bayesian Anal. 1 (2006) 515).
    """
    change, weight = np.zeros(len(sizes.before)), sizes.weight
    for one in sizes.size.T[:2]:
        if _in_favour(float(weight[one == 0.0].sum()), STEADY) > CLEAR:
            change += np.log(one, where=one > 0.0, out=np.full(len(one), -np.inf))
    return replace(sizes, before=sizes.before + change)


def _in_favour(after: float, before: float) -> float:
    """Bayes factor against a hypothesis, from its probabilities after and before the recordings."""
    return (1.0 - after) / max(after, RIDGE) * before / (1.0 - before)


def _steady(each: Sequence[_Sizes], precision: np.ndarray, pull: np.ndarray, rest: np.ndarray) -> float:
    """Probability that no zero is off or wanders; beforehand it is one half, however many outputs there are.

    If every output had its own chance, a clean campaign of many outputs would have some zero beforehand.
    """
    members, weight = _joint(each, precision, pull, rest)
    none = float(weight @ np.all(members.size[:, :, :2] == 0.0, axis=(1, 2)))
    return 1.0 / (1.0 + _in_favour(none, STEADY ** (2 * len(each))))


def _squares(one: Series, drift: float, offset: float, scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares of slopes and residuals, the last column, in units of correlated noise; its log-determinant.

    Within a block a zero is constant. So the rows of a block, less their mean, have white noise only.

    Args:
        one: residuals of one output of one recording.
        drift, offset: size of its zero.
        scales: standard deviations of the white noise, shape (scales,).

    Returns:
        Shapes (scales, parameters + 1, parameters + 1) and (scales,).
    """
    blocks, variance = _binned(one), scales**2
    rows, block = np.column_stack([one.slopes, one.misfit]), np.column_stack([blocks.slopes, blocks.misfit])
    width, axes = np.linalg.eigh(_slow(blocks, drift, offset))
    turned, noise = axes.T @ block, variance[:, None] + np.maximum(width, 0.0)
    between = np.einsum("bi,sb,bj->sij", turned, 1.0 / noise, turned)
    within = (rows.T @ rows - block.T @ block) / variance[:, None, None]
    spare = len(one.misfit) - len(width)
    return within + between, np.log(noise).sum(axis=1) + spare * np.log(variance)


def _square(one: Series, size: Size) -> np.ndarray:
    """The squares beside a zero of one size."""
    return _squares(one, *size[:2], np.array([size[2]]))[0][0]


def modes_of(
    time: np.ndarray, share: np.ndarray, drift: float, offset: float
) -> tuple[np.ndarray, np.ndarray]:
    """Modes of a zero along a recording, and their variances in units of the noise.

    Args:
        time: time of each row that counts, ascending, shape (rows,).
        share: as of `Series`.
        drift, offset: size of the zero.

    Returns:
        Orthonormal modes, constant within a block, shape (rows, `BINS`), zero beyond the number of rows; and
        variances, shape (`BINS`,).
    """
    none = Series(time, np.zeros(len(time)), np.zeros((len(time), 0)), "", share=share)
    modes, variance = np.zeros((len(time), BINS)), np.zeros(BINS)
    if not len(time):
        return modes, variance
    blocks = _binned(none)
    width, axes = np.linalg.eigh(_slow(blocks, drift, offset))
    number = np.repeat(np.arange(len(width)), blocks.count)
    modes[:, : len(width)] = axes[number] / np.sqrt(blocks.count)[number, None]
    variance[: len(width)] = np.maximum(width, 0.0)
    return modes, variance


def _joint(
    each: Sequence[_Sizes], precision: np.ndarray, pull: np.ndarray, rest: np.ndarray
) -> tuple[_Members, np.ndarray]:
    """Members of the mixture over all outputs, and their probability given all recordings.

    Args:
        each: probable sizes of each output.
        precision, pull: as of `lasting`.
        rest: squares of rows that tell nothing of zeros, shape (parameters + 1, parameters + 1).
    """
    places = [np.flatnonzero(one.weight) for one in each]
    if math.prod(map(len, places)) <= MEMBERS:
        chosen = np.stack([x.ravel() for x in np.meshgrid(*places, indexing="ij")], axis=1)
        ahead = np.zeros(len(chosen))
    else:
        random = np.random.default_rng(0)
        chosen = np.stack([random.choice(len(one.weight), MEMBERS, p=one.weight) for one in each], axis=1)
        ahead = sum(np.log(one.weight[k]) for one, k in zip(each, chosen.T, strict=True))
    pairs = list(zip(each, chosen.T, strict=True))
    information, slope, loss, before = (
        sum(getattr(one, name)[k] for one, k in pairs) for name in ("information", "slope", "loss", "before")
    )
    information, slope = information + rest[:-1, :-1], slope + rest[:-1, -1]
    weight = _normal(before - ahead + _log_evidence(information, slope, loss, precision, pull))
    size = np.stack([one.size[k] for one, k in pairs], axis=1)
    kept = weight > 0.0
    normal = _with_prior(information[kept], precision)
    return _Members(size[kept], normal, slope[kept] + precision * pull), weight[kept]


def _normal(logs: np.ndarray) -> np.ndarray:
    """Probabilities from their logarithms; those below `LEAST` of the largest are zero."""
    weight = np.exp(logs - logs.max())
    weight = np.where(weight < LEAST, 0.0, weight)
    return weight / weight.sum()


def _log_evidence(
    information: np.ndarray, slope: np.ndarray, loss: np.ndarray, precision: np.ndarray, pull: np.ndarray
) -> np.ndarray:
    """Marginal log-likelihood of a fit's residuals, its parameters integrated out with their priors.

    Args:
        information, slope, loss: as of `_Sizes`, one for each place.
        precision, pull: as of `lasting`.
    """
    normal, target = _with_prior(information, precision), slope + precision * pull
    least = np.einsum("mi,mij,mj->m", target, _inverse(normal), target)
    size = np.sqrt(np.einsum("mii->mi", normal))
    scaled = normal / (size[:, :, None] * size[:, None, :]) + RIDGE * np.eye(len(precision))
    determinant = np.linalg.slogdet(scaled)[1] + 2.0 * np.log(size).sum(axis=1)
    return -0.5 * (loss + determinant - least)


def _with_prior(information: np.ndarray, precision: np.ndarray) -> np.ndarray:
    """Information with that of the priors."""
    return information + np.diag(np.where(precision > 0.0, precision, RIDGE))


def _inverse(normal: np.ndarray) -> np.ndarray:
    """Covariances of informations in any units, shape (..., parameters, parameters)."""
    size = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    units = size[..., :, None] * size[..., None, :]
    return np.linalg.inv(normal / units + RIDGE * np.eye(normal.shape[-1])) / units


def _sides(
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
    """Place below which a mixture of Gaussians has this share, shape (parameters,); see `_sides`."""
    low, high = (centre - FAR * sd).min(axis=0), (centre + FAR * sd).max(axis=0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = weight @ special.ndtr((middle - centre) / sd)
        low, high = np.where(below < share, middle, low), np.where(below < share, high, middle)
    return 0.5 * (low + high)


def _binned(one: Series) -> Series:
    """The series in at most `BINS` blocks, each with the noise of a single row."""
    edges = np.linspace(0, len(one.misfit), min(BINS, len(one.misfit)) + 1).astype(int)
    size = np.diff(edges)
    total = lambda x: np.add.reduceat(x, edges[:-1], axis=0)  # noqa: E731
    root = np.sqrt(size)
    slopes = total(one.slopes) / root[:, None]
    share = total(np.broadcast_to(one.share, one.misfit.shape)) / size
    return Series(total(one.time) / size, total(one.misfit) / root, slopes, one.output, size, share)


def _slow(one: Series, drift: float, offset: float) -> np.ndarray:
    """Covariance of zeros with offset and drift, between blocks, shape (blocks, blocks).

    The zeros of the instrument and of the inputs are independent, of one size in units of their noise.
    """
    course = (one.time - one.time[0]) / max(float(np.ptp(one.time)), 1e-12)
    walk = drift**2 * np.minimum.outer(course, course) + offset**2
    inputs = np.sqrt(1.0 - np.minimum(one.share, 1.0) ** 2)
    alike = np.multiply.outer(one.share, one.share) + np.multiply.outer(inputs, inputs)
    return walk * alike * np.sqrt(np.multiply.outer(one.count, one.count))


def _before(size: float, sizes: Sequence[float]) -> float:
    """Prior probability of a size: zero, or any order of magnitude alike."""
    return STEADY if size == 0.0 else (1.0 - STEADY) / (len(sizes) - 1)
