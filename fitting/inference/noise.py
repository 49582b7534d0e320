"""How noisy a measured curve is, and how many independent samples its misfit holds.

A smooth curve that a law cannot follow leaves residuals that drift slowly: hundreds of samples then say as
much as a few independent ones. Both numbers below are counted before any standard error is quoted.
"""

import math
from collections.abc import Sequence

import numpy as np

GAUSSIAN_MAD = 0.6744897501960817
"""Median absolute deviation of a Gaussian in standard deviations."""
CHANCE = 1.15
"""Factor on a variance that white noise may show by chance."""
WINDOW = 5.0
"""Sokal's window: lags are summed up to this many correlation times."""
ORDERS = (2, 3, 4, 5)
"""Of differences that noise is told by: of 21 points of an S-shaped curve the second shows the curve
itself."""
CLEARLY, LASTING = 0.5, 0.09
"""A higher order leaves clearly less from the first of these parts, over the root of the number of
differences: under white noise the ratio of two neighbouring orders spreads by a fifth to a quarter over that
root. And from the
second: of first-order noise with a correlation of 0.9 higher orders show 7 % less than the second."""
HALF = 0.5
"""Of a step, how wide rounding errors are drawn anew for differences: enough to fill it, and little that has
to be taken off again."""
FEWEST_OF_ORDER = 6
"""Differences of a higher order, and readings, from which they tell anything."""
HUBER, FAR, ROUNDS = 2.0, 4.0, 50
"""Standard deviations at which a difference counts no more, and beyond which it is no noise; most rounds."""
_INSIDE = math.erf(HUBER / math.sqrt(2.0))
"""Part of a Gaussian within `HUBER` standard deviations."""
_HUBER_MEAN = (
    _INSIDE - 2.0 * HUBER * math.exp(-0.5 * HUBER**2) / math.sqrt(2.0 * math.pi) + HUBER**2 * (1.0 - _INSIDE)
)
"""Mean square of a standard Gaussian whose size is held to `HUBER`. Written out: importing `scipy.stats`
is two fifths of all that `pneusma simulate` imports."""
DRAWS, DRAWN = 32, 10_000
"""Times that rounding errors are drawn anew, at most, so that the median of 21 rounded points spreads by 2 %
with the draw; and numbers that are drawn in all, of longer recordings."""
SAME = 1e-9
"""Of the largest reading, a difference that is the computer's arithmetic: it has sixteen digits, files up to
nine."""
EVEN, MOST = 0.02, 0.95
"""Part of a step that differences may miss whole multiples by, as printed digits do; the share that must
not."""
FEW_STEPS = 5
"""Steps between the nearest two of a few readings, at most."""
ONE_WAY = 0.3
"""Share of moves within ramps from which these tell whether a course is rounded."""
UNEVEN, STANDS, STOOD = 0.1, 4, 0.1
"""Share of moves that are not as many steps as the one before; or stretches of equal readings, and their
share: more than turns and changes of rate make of straight courses without noise."""
FEWEST_OF_SIZE = 10
"""Different readings of one order of magnitude from which these have a step of their own."""


def least_step(values: np.ndarray) -> np.ndarray:
    """Step in which readings were written, at each of them: of a converter, of printed decimals, of a dead
    band.

    The step is the smallest difference between distinct values, where all others are whole multiples of it:
    smooth readings differ by anything. So do straight courses without noise, which all moves are one step of.
    Readings that stand still until they move by more than a dead band have the smallest move as their step.
    Where values are written with a number of significant digits, large ones have larger steps than small
    ones.

    Args:
        values: readings in the order of sampling, shape (n,), finite.

    Returns:
        The step at every reading, shape (n,), in their unit; 0 where readings show none.
    """
    found = np.full(len(values), _step(values))
    digits = np.floor(np.log10(np.where(values == 0.0, np.inf, np.abs(values))) + SAME)
    for size in np.unique(digits) if found.any() else ():
        alike = digits == size
        if len(np.unique(values[alike])) >= FEWEST_OF_SIZE:
            found[alike] = np.maximum(found[alike], common_step(values[alike]))
    return found


def rounding_noise(values: np.ndarray) -> float:
    """Standard deviation of the rounding of readings, step / sqrt(12) (W. R. Bennett, Bell Syst. Tech. J. 27
    (1948) 446), root mean square over readings of shape (n,); 0 where they show no step."""
    return float(np.sqrt(np.mean(least_step(values) ** 2 / 12.0))) if len(values) else 0.0


def dithered(values: np.ndarray) -> np.ndarray:
    """Readings with rounding errors added anew, (`DRAWS`, n), or (1, n) where they show no step.

    Rounded readings differ by nothing or by whole steps, of which no median tells a size. With a further
    uniform error of one step they are spread as readings of their own noise and two rounding errors.

    Args:
        values: readings in the order of sampling, shape (n,), finite.
    """
    step = least_step(values)
    if not step.any():
        return values[None]
    return values + step * _uniform(_draws(len(values)), len(values))


def robust_noise(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth curve, rounding included, by differences of neighbours.

    Each run of three to six samples is compared with the polynomial through its others: differences of second
    to fifth order, normalised (Gasser, Sroka and Jennen-Steinmetz, Biometrika 73 (1986) 625; Hall, Kay and
    Titterington, Biometrika 77 (1990) 521). A higher order counts where it leaves clearly less: of few
    samples the curve itself bends between neighbours. The scale is Huber's (proposal 2), without differences
    far beyond their median: jumps and turning points do not count. Rounded readings are `dithered` first, and
    the result is never less than their rounding alone. Serially correlated noise is smooth, too, so for it
    the result is a lower bound.

    Args:
        x: where the curve was sampled, in the order of sampling, shape (n,).
        y: what was measured there, shape (n,).

    Returns:
        The standard deviation in the unit of `y`; that of rounding, or 0, with fewer than three usable
        samples.
    """
    found, rounding = None, rounding_noise(y)
    step = least_step(y)
    for order in ORDERS:
        weight, difference, step_there = _differences(x, y, step, order)
        count = len(difference)
        if found is not None and count < FEWEST_OF_ORDER or count == 0:
            break
        if rounding > 0.0:
            errors = HALF * _uniform(order + 1, _draws(count))
            difference = difference[:, None] + (weight * step_there) @ errors
        scale = np.sqrt(max(_scale(difference) ** 2 - (HALF * rounding) ** 2, 0.0))
        if found is None or scale < found * (1.0 - max(CLEARLY / np.sqrt(count), LASTING)):
            found = scale
    return max(float(found or 0.0), rounding)


def common_step(values: np.ndarray) -> float:
    """The largest step of which all differences between readings are whole multiples; 0 where there is none.

    The smallest difference is the step, or a few steps where readings are few.

    Args:
        values: shape (n,), finite, in any order.
    """
    between = np.diff(np.sort(values))
    between = between[between > SAME * np.max(np.abs(values), initial=0.0)]
    for parts in range(1, FEW_STEPS + 1) if len(between) else ():
        part = parts * between / between.min()
        if np.mean(np.abs(part - np.round(part)) < EVEN) > MOST:
            return float(between.min()) / parts
    return 0.0


def standing(moves: np.ndarray) -> np.ndarray:
    """Lengths of the stretches of equal readings, by the moves from each to the next."""
    return np.diff(np.flatnonzero(np.concatenate([[True], np.abs(moves) > 0.0, [True]])))


def _uneven(steps: np.ndarray) -> bool:
    """Whether moves, in steps, change in size from one to the next: on the way, as turns change them anyhow,
    or everywhere where hardly any four go one way."""
    windows = np.lib.stride_tricks.sliding_window_view(steps, 4)
    changes = windows[:, 1] != windows[:, 2]
    one_way = np.all(windows >= 0.0, axis=1) | np.all(windows <= 0.0, axis=1)
    there = changes[one_way] if one_way.mean() > ONE_WAY else changes
    return bool(there.mean() > UNEVEN)


def _often(stands: np.ndarray) -> bool:
    """Whether readings stand still again and again, by the lengths of all stretches: not at turns only."""
    return bool(np.sum(stands > 1) >= STANDS and np.mean(stands > 1) > STOOD)


def _step(values: np.ndarray) -> float:
    """One step of readings in their order, see `least_step`."""
    if len(values) < FEWEST_OF_ORDER:
        return 0.0
    least, moves = common_step(values), np.abs(np.diff(values))
    moves[moves <= SAME * np.max(np.abs(values))] = 0.0
    stands = standing(moves)
    if least > 0.0:
        return least if _uneven(np.round(np.diff(values) / least)) or _often(stands) else 0.0
    slow = _often(stands) and np.median(stands) > 1.0
    return float(moves[moves > 0.0].min()) if slow else 0.0


def _uniform(*shape: int) -> np.ndarray:
    """The same uniform numbers within half a unit at every call."""
    return np.random.default_rng(0).uniform(-0.5, 0.5, shape)


def _draws(count: int) -> int:
    return int(np.clip(DRAWN // max(count, 1), 2, DRAWS))


def _differences(x: np.ndarray, y: np.ndarray, step: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
    """Differences over neighbours among which x goes one way: weights of unit length, (m, order + 1); the
    differences, (m,); and the steps of their readings, (m, order + 1)."""
    if len(x) <= order:
        return np.zeros((0, order + 1)), np.zeros(0), np.zeros((0, order + 1))
    at, values, steps = (np.lib.stride_tricks.sliding_window_view(z, order + 1) for z in (x, y, step))
    forward = np.diff(at, axis=1)
    usable = np.all(forward > 0.0, axis=1) | np.all(forward < 0.0, axis=1)
    at, values, steps = at[usable], values[usable], steps[usable]
    at = (at - at.mean(axis=1, keepdims=True)) / np.ptp(at, axis=1)[:, None]
    apart = at[:, :, None] - at[:, None, :] + np.eye(order + 1)
    weight = 1.0 / np.prod(apart, axis=2)
    weight /= np.linalg.norm(weight, axis=1, keepdims=True)
    return weight, np.sum(weight * (values - values.mean(axis=1, keepdims=True)), axis=1), steps


def _scale(differences: np.ndarray) -> float:
    """Huber's scale of numbers about zero, without those far beyond their median."""
    size = np.abs(differences).ravel()
    first = float(np.median(size)) / GAUSSIAN_MAD
    if first > 0.0:
        size = size[size < FAR * first]
    scale = first or float(np.sqrt(np.mean(size**2)))
    for _ in range(ROUNDS if scale > 0.0 else 0):
        before, counted = scale, np.minimum(size / scale, HUBER) ** 2
        scale *= float(np.sqrt(np.mean(counted) / _HUBER_MEAN))
        if abs(scale - before) < 1e-4 * before:
            break
    return scale


def autocorrelation(series: Sequence[np.ndarray]) -> np.ndarray:
    """Autocorrelation of residuals pooled over recordings, their means left in (a misfit's mean is misfit).

    Args:
        series: residuals of each recording in the order of sampling, each of shape (n_i,).

    Returns:
        Correlation at lags 0, 1, ..., at most half the longest recording.
    """
    longest = max(len(s) for s in series)
    power = sum(float(s @ s) for s in series)
    if power == 0.0:
        return np.ones(1)
    products = np.zeros(longest)
    for s in series:
        spectrum = np.fft.rfft(s, 2 * len(s))
        products[: len(s)] += np.fft.irfft(np.abs(spectrum) ** 2)[: len(s)]
    return (products / products[0])[: max(longest // 2, 1)]


def correlation_time(series: Sequence[np.ndarray]) -> float:
    """Integrated autocorrelation time: how many samples make one independent one.

    The window grows until it is five times the sum inside it (A. Sokal, Monte Carlo methods in statistical
    mechanics, 1997). For a first-order process it is `(1 + r) / (1 - r)` of the lag-1 correlation r. The
    variance of anything smooth that is fitted to the samples grows by about this factor.

    Returns:
        The factor, 1 or more; at most the length of the longest recording.
    """
    lags = autocorrelation(series)
    summed = 2.0 * np.cumsum(lags) - 1.0
    inside = np.flatnonzero(np.arange(len(lags)) >= WINDOW * summed)
    time = summed[inside[0]] if len(inside) else summed.max()
    return float(np.clip(time, 1.0, max(len(s) for s in series)))


def inflation_of(reduced: float, series: Sequence[np.ndarray]) -> float:
    """Factor on standard errors for misfit larger than the noise, and misfit that lasts.

    Noise that lasts, a zero that drifts and a law that is not followed all leave fewer independent samples
    than there are: the variance grows by the mean square of the misfit times its correlation time. Where
    noise was taken as larger because it lasts, the mean square is smaller by as much, and the two make one.
    What a drift does to the numbers themselves is not seen in what is left: beside drift it is too little.

    Args:
        reduced: chi-square per degree of freedom.
        series: misfits over their noise of each recording and output, in the order of sampling.
    """
    product = reduced * correlation_time(series)
    return float(np.sqrt(product)) if product > CHANCE else 1.0


def lag_one(series: Sequence[np.ndarray]) -> float:
    """Correlation of neighbouring residuals; 0 where there are none."""
    lags = autocorrelation(series)
    return float(lags[1]) if len(lags) > 1 else 0.0
