"""The noise of an instrument from all of its recordings: size, growth with the signal, correlation.

One recording of small signals cannot tell small errors from correlated ones. Second differences of residuals
of all recordings can, over several distances. Missing physics leaves slow residuals, which second differences
remove, and corners, which a heavy-tailed likelihood tolerates. Where rows are means of samples and the noise
is stated, the samples are used as well, because means hardly show correlation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.special import ndtri

from fitting.inference.channels import Channel, block_noise
from fitting.inference.partial_pooling import pooled_by_difference
from fitting.specimens.block_means import averaged
from pneusma_jax.late import Late

from ..settings import DEFAULT

optimize = Late("scipy.optimize")

EVIDENCE = DEFAULT.evidence
INSTRUMENTS = DEFAULT.instruments
NOISE = DEFAULT.noise
SHARE = DEFAULT.share
VALUES = DEFAULT.values


@dataclass(frozen=True)
class Instrument:
    """Size, growth and correlation of the errors of one quantity.

    Attributes:
        scale: root mean square of its 1-sigma, in units of the stated one; SI where nobody states it.
        growth: part of the variance that goes with the square of the signal.
        level: root mean square of the signal, SI.
        correlation: correlation of neighbouring samples [1].
    """

    scale: float
    growth: float
    level: float
    correlation: float

    def sigma(self, stated: float | None, signal: np.ndarray, block: int) -> tuple[np.ndarray, float]:
        """1-sigma of every row, SI, and the correlation of neighbouring rows.

        Args:
            stated: 1-sigma of a sample that somebody states, if anyone does.
            signal: SI, (rows,).
            block: samples in a row.
        """
        each, correlation = block_noise(1.0, self.correlation, block)
        return self.scale * (stated or 1.0) * each * _shape(signal, self.level, self.growth), correlation

    def applied_to(self, channel: Channel, one: "Series") -> Channel:
        """A channel with this noise. Unstated noise is at least that of rounding."""
        sigma, correlation = self.sigma(one.stated, one.signal, one.block)
        sigma = one.relative * sigma
        if one.stated is None:
            sigma = np.maximum(sigma, one.rounding)
        there = np.isfinite(channel.sigma)
        return replace(channel, sigma=np.where(there, sigma, np.inf), correlation=float(correlation))


@dataclass(frozen=True)
class Series:
    """Errors of an instrument in one recording.

    Attributes:
        errors: residuals of a model, SI, (rows,), NaN where there are none.
        signal: SI, (rows,).
        inputs: variance that the noise of inputs brings, SI, (rows,).
        stated: 1-sigma of a sample, or None.
        block: samples in a row.
        rounding: 1-sigma of the rounding of a row, SI; `errors` and `inputs` hold half as much again, see
            `dithered`.
        readings: number of each row among the readings that it was chosen from, (rows,); None where every
            reading is in a row.
        relative: 1-sigma over that of the instrument [1], where recordings clearly differ; see
            `each_of_its_size`.
    """

    errors: np.ndarray
    signal: np.ndarray
    inputs: np.ndarray
    stated: float | None
    block: int
    rounding: float = 0.0
    readings: np.ndarray | None = None
    relative: float = 1.0

    def dithered(self, rounding: float) -> "Series":
        """The same with random errors of half a rounding step: rounded rows have differences of 0.

        Args:
            rounding: 1-sigma, SI.
        """
        if not rounding > 0.0:
            return self
        step = NOISE.dither * np.sqrt(12.0) * rounding
        anew = np.random.default_rng(0).uniform(-0.5 * step, 0.5 * step, self.errors.shape)
        inputs = self.inputs + (NOISE.dither * rounding) ** 2
        return replace(self, errors=self.errors + anew, inputs=inputs, rounding=rounding)

    def less(self, leverage: np.ndarray) -> "Series":
        """Without rows that latent trajectories follow much; `leverage` is the share of each, (rows,)."""
        return replace(self, errors=np.where(leverage > SHARE.minor, np.nan, self.errors))

    def finer(self, samples: np.ndarray, rows: int) -> "Series":
        """The errors of the samples whose means the rows are, at most `FINEST` of them.

        Args:
            samples: all of the recording, SI, NaN where missing, (samples,).
            rows: number of rows of the recording.
        """
        each = -(-len(samples) // NOISE.maximum_samples)
        values = averaged({"": samples}, each)
        block = -(-len(samples) // rows)
        middle = np.minimum(np.arange(rows) * block + 0.5 * (block - 1.0), len(samples) - 1.0)
        at = each * np.arange(len(values[""])) + 0.5 * (each - 1.0)
        signal, inputs = (np.interp(at, middle, x[:rows]) for x in (self.signal, self.inputs))
        beside = np.interp(at, middle, np.isnan(self.errors[:rows]).astype(float)) > 0.0
        errors = np.where(beside, np.nan, values[""] - signal)
        return replace(self, errors=errors, signal=signal, inputs=inputs * block / each, block=each)

    def bends(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Second differences by distance, and the rows in their middle.

        Of chosen rows only neighbouring readings count. Over rows that lie further apart a model's own misfit
        is no straight line, and would pass for noise.
        """
        found = []
        for lag in NOISE.lags:
            bend = self.errors[2 * lag :] - 2.0 * self.errors[lag:-lag] + self.errors[: -2 * lag]
            if self.readings is not None:
                apart = np.full(len(bend), np.inf)
                whole = self.readings[2 * lag :] - self.readings[: -2 * lag]
                apart[: len(whole)] = whole
                bend = np.where(apart == 2 * lag, bend, np.nan)
            there = np.flatnonzero(np.isfinite(bend))
            found.append((bend[there], there + lag))
        return found


def series_of(
    channel: Channel, bare: Channel, predicted: np.ndarray, stated: float | None, block: int
) -> Series:
    """Errors of a channel: residuals of a model.

    Args:
        channel: channel of one recording.
        bare: the same without the noise of inputs.
        predicted: predictions of the model, SI, (rows,), NaN where it has no answer.
        stated: 1-sigma of a sample, or None.
        block: samples in a row.
    """
    there = np.isfinite(channel.sigma)
    errors = np.where(there, channel.measured, np.nan) - predicted
    signal = np.where(np.isfinite(predicted), predicted, channel.measured)
    inputs = np.where(there, channel.sigma, 0.0) ** 2 - np.where(there, bare.sigma, 0.0) ** 2
    return Series(errors, signal, np.maximum(inputs, 0.0), stated, block)


def instrument_of(series: Sequence[Series]) -> Instrument | None:
    """The noise of largest likelihood; None where there are too few differences.

    Args:
        series: errors of one quantity; all with a stated noise, or none.
    """
    bends = [one.bends() for one in series]
    if sum(len(parts[0][0]) for parts in bends) < VALUES.minimum * NOISE.dependent_differences:
        return None
    rows = np.concatenate([one.signal[np.isfinite(one.errors)] for one in series])
    level = float(np.sqrt(np.mean(rows**2))) or 1.0
    stated = series[0].stated is not None
    unit = 1.0 if stated else _usual(bends)
    if not unit > 0.0:
        return None

    def cost(scale: float, fall: float, correlation: float) -> float:
        found = Instrument(unit * np.exp(scale), -np.expm1(-2.0 * fall), level, correlation)
        total = 0.0
        for one, parts in zip(series, bends, strict=True):
            sigma, r = found.sigma(one.stated, one.signal, one.block)
            for lag, (bend, rows) in zip(NOISE.lags, parts, strict=True):
                own, inputs = _variances(one, sigma, r, lag, rows)
                total += _heavy_tailed(bend, one.relative**2 * own + inputs)
        return float(total / NOISE.dependent_differences)

    # a stated size is believed: fast physics would pass for noise
    scale, fall, correlation = _chosen(cost, () if stated else (0,))
    return Instrument(unit * float(np.exp(scale)), float(-np.expm1(-2.0 * fall)), level, float(correlation))


def each_of_its_size(series: Sequence[Series], found: Instrument) -> list[Series] | None:
    """The series with the size of each beside the others; None where one noise serves all of them.

    The scatter of neighbouring residuals tells the sizes. Misfit is hardly in it, for it lasts longer. What
    noise of inputs makes of it tells nothing of the instrument, so such differences count by less.

    Args:
        series: errors of one quantity, whose noise nobody states.
        found: noise of all of them as one.
    """
    sizes, counts = np.ones(len(series)), np.zeros(len(series))
    for k, one in enumerate(series):
        bend, rows = one.bends()[0]
        if len(bend):
            sigma, correlation = found.sigma(one.stated, one.signal, one.block)
            own, inputs = _variances(one, sigma, correlation, NOISE.lags[0], rows)
            sizes[k] = _size(bend, own, inputs)
            own = sizes[k] ** 2 * own
            counts[k] = len(bend) * np.mean(own / (own + inputs)) ** 2
    each = pooled_by_difference(sizes, counts)
    if each is None:
        return None
    return [replace(one, relative=float(size)) for one, size in zip(series, each, strict=True)]


def _size(bends: np.ndarray, own: np.ndarray, inputs: np.ndarray) -> float:
    """Factor on the instrument's 1-sigma that makes second differences most likely; see `_variances`."""
    cost = lambda scale: _heavy_tailed(bends, np.exp(2.0 * scale) * own + inputs)  # noqa: E731
    return float(np.exp(optimize.minimize_scalar(cost, bounds=(-3.0, 3.0), method="bounded").x))


def _variances(
    one: Series, sigma: np.ndarray, correlation: float, lag: int, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Variances of second differences about some rows: by the instrument, and by the noise of inputs.

    Args:
        one: errors.
        sigma: 1-sigma of the instrument in every row, SI.
        correlation: of neighbouring rows [1].
        lag: rows between the values of a difference.
        rows: rows in their middle.
    """
    own = 6.0 - 8.0 * correlation**lag + 2.0 * correlation ** (2 * lag)
    return own * sigma[rows] ** 2, 6.0 * one.inputs[rows]


def _heavy_tailed(bends: np.ndarray, variance: np.ndarray) -> float:
    """Negative log-likelihood of Student's t, whose core is that of a Gaussian of this variance."""
    degrees = INSTRUMENTS.student_degrees
    spread = _core(degrees) * np.sqrt(variance)
    tail = np.log1p((bends / spread) ** 2 / degrees)
    return float(np.sum(np.log(spread) + 0.5 * (degrees + 1.0) * tail))


def _chosen(cost: Callable[..., float], always: tuple[int, ...]) -> np.ndarray:
    """Logarithm of the scale, logarithm of the 1-sigma without a signal over it, and the correlation.

    The last two differ from zero only where they make the differences much likelier.
    """
    price = {
        1: EVIDENCE.minimum_difference,
        2: EVIDENCE.minimum_unstated if always else EVIDENCE.minimum_difference,
    }
    tried = [
        (*_least(cost, (*always, *more)), sum(price[n] for n in more)) for more in ((), (2,), (1,), (1, 2))
    ]
    return min(tried, key=lambda one: one[1] + one[2])[0]


def _least(cost: Callable[..., float], free: tuple[int, ...]) -> tuple[np.ndarray, float]:
    """Place and value of the least cost if only some numbers may differ from zero, from two starts."""
    low, high = (
        np.array([-3.0, 0.0, 0.0]),
        np.array([3.0, -np.log(INSTRUMENTS.minimum_floor), INSTRUMENTS.maximum_correlation]),
    )
    chosen, found = list(free), []
    if not chosen:
        return np.zeros(3), cost(*np.zeros(3))

    def part(x: np.ndarray) -> float:
        at = np.zeros(3)
        at[chosen] = x
        return cost(*at)

    for start in (np.array([0.0, 0.3, 0.3]), np.array([0.0, 1.5, 0.7])):
        bounds = list(zip(low[chosen], high[chosen], strict=True))
        found.append(optimize.minimize(part, start[chosen], bounds=bounds, method="L-BFGS-B"))
    best = min(found, key=lambda f: f.fun)
    at = np.zeros(3)
    at[chosen] = best.x
    return at, float(best.fun)


def _shape(signal: np.ndarray, level: float, growth: float) -> np.ndarray:
    """1-sigma over its root mean square, (rows,)."""
    return np.sqrt(1.0 - growth + growth * (signal / level) ** 2)


def _usual(bends: Sequence[Sequence[tuple[np.ndarray, np.ndarray]]]) -> float:
    """1-sigma of white noise with these second differences."""
    first = np.abs(np.concatenate([parts[0][0] for parts in bends]))
    return float(np.median(first) / ndtri(0.75) / np.sqrt(6.0))


@cache
def _core(tails: float) -> float:
    """Scale of Student's t that is most likely for Gaussian numbers of unit size."""
    z = ndtri((np.arange(4000) + 0.5) / 4000)
    slope = lambda s: np.mean((tails + 1.0) * z**2 / (tails * s**2 + z**2)) - 1.0  # noqa: E731
    return float(optimize.brentq(slope, 0.3, 1.5))
