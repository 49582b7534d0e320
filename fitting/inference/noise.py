"""Noise of a measured curve, of its instruments and of the rounding of its readings."""

import math
from collections.abc import Sequence

import numpy as np

ACCURACY = 0.01
"""Maximum root mean square error, over the range of a recording, of a law that is as accurate as usual
instruments (class 1 of ISO 7500-1). The noise of neighbouring readings does not tell their accuracy."""
GAUSSIAN_MAD = 0.6744897501960817
"""Median absolute deviation of a Gaussian in standard deviations."""
FEW = 40
"""Minimum number of samples for an estimate of serial correlation from themselves alone."""
MOST_GUESSED = 0.8
"""Maximum correlation that is estimated from the samples alone. A trend with corners looks like more."""
ORDERS = (2, 3, 4, 5)
"""Orders of the differences in the noise estimate. For 21 points of an S-shaped curve the second shows the
curve itself."""
CLEARLY, LASTING = 0.5, 0.09
"""Minimum relative decreases by a higher order of differences. The first is divided by the root of the number
of differences. Under white noise the ratio of two neighbouring orders spreads by a fifth to a quarter over
that root. The second is absolute. For first-order noise with a correlation of 0.9, higher orders show 7 %
less than the second."""
HALF = 0.5
"""Width of the redrawn rounding errors for differences, as part of a step. It fills the step and leaves
little to subtract."""
FEWEST_OF_ORDER = 6
"""Minimum number of differences of a higher order, and of readings, for an estimate."""
HUBER, FAR, ROUNDS = 2.0, 4.0, 50
"""Huber's limit for differences in standard deviations; the limit beyond which they are no noise; maximum
number of rounds."""
_INSIDE = math.erf(HUBER / math.sqrt(2.0))
"""Part of a Gaussian within `HUBER` standard deviations."""
_HUBER_MEAN = (
    _INSIDE - 2.0 * HUBER * math.exp(-0.5 * HUBER**2) / math.sqrt(2.0 * math.pi) + HUBER**2 * (1.0 - _INSIDE)
)
"""Mean square of a standard Gaussian clipped at `HUBER`. It is written out because the import of
`scipy.stats` takes two fifths of the import time of `pneusma simulate`."""
DRAWS, DRAWN = 32, 10_000
"""Maximum number of redraws of rounding errors; the median of 21 rounded points then spreads by 2 % with the
draw. Second, total number of draws for longer recordings."""
SAME = 1e-9
"""Maximum difference that is due to computer arithmetic, relative to the largest reading. Arithmetic has
sixteen digits, files up to nine."""
EVEN, MOST = 0.02, 0.95
"""Maximum deviation of differences from whole multiples of a step, as part of it, as in printed digits;
minimum share of differences within it."""
FEW_STEPS = 5
"""Maximum number of steps between the nearest two of a few readings."""
ONE_WAY = 0.3
"""Minimum share of moves within ramps for these to decide if a trend is rounded."""
UNEVEN, STANDS, STOOD = 0.1, 4, 0.1
"""Minimum share of moves with another number of steps than the one before; or minimum number of stretches of
equal readings, and their minimum share. Turns and changes of rate make fewer in straight trends without
noise."""
FEWEST_OF_SIZE = 10
"""Minimum number of different readings of one order of magnitude for a step of their own."""


def within_accuracy(error: float, stated: bool) -> bool:
    """True if a law misses no more than instruments of unstated noise may.

    Args:
        error: root mean square error, over the range of a recording [1].
        stated: somebody states the noise. Then that is what judges, and not a usual accuracy.
    """
    return not stated and error <= ACCURACY


def least_step(values: np.ndarray) -> np.ndarray:
    """Step of the written readings, at each of them: of a converter, of printed decimals, or of a dead band.

    The step is the smallest difference between distinct values, where all others are whole multiples of it.
    Smooth readings differ by arbitrary amounts. Straight trends without noise have no step either, since all
    their moves are equal. Readings that stand still until they move by more than a dead band have the
    smallest move as their step. Where values have a number of significant digits, large ones have larger
    steps than small ones.

    Args:
        values: readings in the order of sampling, shape (n,), finite.

    Returns:
        Step at every reading, shape (n,), in their unit; 0 where readings show none.
    """
    found = np.full(len(values), _step(values))
    digits = np.floor(np.log10(np.where(values == 0.0, np.inf, np.abs(values))) + SAME)
    for size in np.unique(digits) if found.any() else ():
        alike = digits == size
        if len(np.unique(values[alike])) >= FEWEST_OF_SIZE:
            found[alike] = np.maximum(found[alike], common_step(values[alike]))
    return found


def rounding_noise(values: np.ndarray) -> float:
    """Standard deviation of the rounding of readings of shape (n,), step / sqrt(12), as root mean square; 0
    where they show no step. Source: W. R. Bennett, Bell Syst. Tech. J. 27 (1948) 446."""
    return float(np.sqrt(np.mean(least_step(values) ** 2 / 12.0))) if len(values) else 0.0


def dithered(values: np.ndarray) -> np.ndarray:
    """Readings with rounding errors added anew, (`DRAWS`, n), or (1, n) where they show no step.

    Rounded readings differ by nothing or by whole steps, whose median is uninformative. With a further
    uniform error of one step they spread as readings with their own noise and two rounding errors.

    Args:
        values: readings in the order of sampling, shape (n,), finite.
    """
    step = least_step(values)
    if not step.any():
        return values[None]
    return values + step * _uniform(_draws(len(values)), len(values))


def lagged_squares(values: np.ndarray) -> list[float]:
    """Mean squares of second differences over one and two rows, by their medians; `dithered` readings.

    For first-order noise of variance s^2 on a smooth trend they are `s^2 (6 - 8 r^k + 2 r^2k)` at lag k.

    Args:
        values: readings in the order of sampling, shape (n,), finite, n > 4.
    """
    values = dithered(values)
    bends = (values[:, 2 * k :] - 2.0 * values[:, k:-k] + values[:, : -2 * k] for k in (1, 2))
    return [(float(np.median(np.abs(bend))) / GAUSSIAN_MAD) ** 2 for bend in bends]


def correlation_of(squares: Sequence[float]) -> float:
    """Correlation of neighbouring errors from the ratio of two `lagged_squares`, at most `MOST_GUESSED`."""
    if not squares[0] > 0.0:
        return 0.0
    grid = np.linspace(0.0, MOST_GUESSED, 91)
    ratio = (1.0 + grid) * (3.0 - grid**2) / (3.0 - grid)
    return float(np.interp(squares[1] / squares[0], ratio, grid))


def variance_before_rounding(values: np.ndarray) -> float:
    """Variance of first-order noise on a smooth trend, without that of rounding.

    Errors by rounding, and those by which readings are `dithered`, count as independent ones.

    Args:
        values: readings in the order of sampling, shape (n,), finite.

    Returns:
        The variance in their unit, 0 or more; 0 for fewer than `FEW` readings.
    """
    if len(values) < FEW:
        return 0.0
    added = 12.0 * rounding_noise(values) ** 2
    squares = [max(square - added, 0.0) for square in lagged_squares(values)]
    correlation = correlation_of(squares)
    return squares[0] / (6.0 - 8.0 * correlation + 2.0 * correlation**2)


def clearly_smaller(scale: float, other: float, count: int) -> bool:
    """True if a scale is smaller than another one by more than chance makes it, from `count` differences."""
    return bool(scale < other * (1.0 - max(CLEARLY / np.sqrt(count), LASTING)))


def robust_noise(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth curve, rounding included, from differences of neighbours.

    Each run of three to six samples is compared with the polynomial through its others. These are normalised
    differences of second to fifth order (Gasser, Sroka and Jennen-Steinmetz, Biometrika 73 (1986) 625; Hall,
    Kay and Titterington, Biometrika 77 (1990) 521). A higher order counts where it is clearly smaller, since
    with few samples the curve itself bends between neighbours.

    The scale is Huber's (proposal 2), without differences far beyond their median: jumps and turning points
    do not count. Rounded readings are `dithered` first, and the result is never less than their rounding
    alone. Serially correlated noise is smooth, too, so for it the result is a lower bound.

    Args:
        x: positions of the samples, in the order of sampling, shape (n,).
        y: measured values, shape (n,).

    Returns:
        Standard deviation in the unit of `y`; that of rounding, or 0, with fewer than three usable samples.
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
        if found is None or clearly_smaller(scale, found, count):
            found = scale
    return max(float(found or 0.0), rounding)


def common_step(values: np.ndarray) -> float:
    """The largest step of which all differences between readings are whole multiples; 0 where there is none.

    The smallest difference is the step, or a few steps where readings are few.

    Args:
        values: readings, shape (n,), finite, in any order.
    """
    between = np.diff(np.sort(values))
    between = between[between > SAME * np.max(np.abs(values), initial=0.0)]
    for parts in range(1, FEW_STEPS + 1) if len(between) else ():
        part = parts * between / between.min()
        if np.mean(np.abs(part - np.round(part)) < EVEN) > MOST:
            return float(between.min()) / parts
    return 0.0


def standing(moves: np.ndarray) -> np.ndarray:
    """Lengths of the stretches of equal readings, from the moves between neighbours."""
    return np.diff(np.flatnonzero(np.concatenate([[True], np.abs(moves) > 0.0, [True]])))


def _moves_vary(steps: np.ndarray) -> bool:
    """True if moves, in steps, change in size from one to the next. Only moves within ramps count, since
    turns change them anyhow. All count where hardly any four go one way."""
    windows = np.lib.stride_tricks.sliding_window_view(steps, 4)
    changes = windows[:, 1] != windows[:, 2]
    one_way = np.all(windows >= 0.0, axis=1) | np.all(windows <= 0.0, axis=1)
    selected = changes[one_way] if one_way.mean() > ONE_WAY else changes
    return bool(selected.mean() > UNEVEN)


def _stands_often(moves: np.ndarray) -> bool:
    """True if readings stand still repeatedly, and not at turns or in the holds of a protocol only.

    Args:
        moves: signed moves from each reading to the next; exactly 0 where it stands still.
    """
    stood = (standing(moves) > 1) & ~_held(moves)
    return bool(np.sum(stood) >= STANDS and np.mean(stood) > STOOD)


def _held(moves: np.ndarray) -> np.ndarray:
    """True for each stretch of equal readings that a straight ramp ends or leaves.

    A ramp that moves equally in every row is faster than its rounding, so it is not rounding that holds the
    next three readings or more. Arguments as `_stands_often`.
    """
    stands, size = standing(moves), np.abs(moves)
    ends = np.cumsum(stands)  # number of the move that ends each stretch, counted from one
    goes_on = np.zeros(len(moves) + 1, bool)
    goes_on[1:-1] = (size[1:] > 0.0) & (np.abs(np.diff(moves)) <= EVEN * size[1:])
    before, after = np.zeros((2, len(stands)), bool)
    after[:-1] = goes_on[ends[:-1]]
    before[1:] = goes_on[ends[:-1] - 1]
    return (stands > 2) & (before | after)


def _step(values: np.ndarray) -> float:
    """One step of readings in their order, see `least_step`."""
    if len(values) < FEWEST_OF_ORDER:
        return 0.0
    least, moves = common_step(values), np.diff(values)
    moves[np.abs(moves) <= SAME * np.max(np.abs(values))] = 0.0
    if least > 0.0:
        return least if _moves_vary(np.round(np.diff(values) / least)) or _stands_often(moves) else 0.0
    slow = _stands_often(moves) and np.median(standing(moves)) > 1.0
    return float(np.abs(moves[moves != 0.0]).min()) if slow else 0.0


def _uniform(*shape: int) -> np.ndarray:
    """Uniform random numbers within half a unit, the same at every call."""
    return np.random.default_rng(0).uniform(-0.5, 0.5, shape)


def _draws(count: int) -> int:
    return int(np.clip(DRAWN // max(count, 1), 2, DRAWS))


def _differences(x: np.ndarray, y: np.ndarray, step: np.ndarray, order: int) -> tuple[np.ndarray, ...]:
    """Differences over neighbours among which x is monotonic.

    The results are weights of unit length, (m, order + 1); the differences, (m,); the steps of their
    readings, (m, order + 1).
    """
    if len(x) <= order:
        return np.zeros((0, order + 1)), np.zeros(0), np.zeros((0, order + 1))
    at, values, steps = (np.lib.stride_tricks.sliding_window_view(z, order + 1) for z in (x, y, step))
    forward = np.diff(at, axis=1)
    usable = np.all(forward > 0.0, axis=1) | np.all(forward < 0.0, axis=1)
    at, values, steps = at[usable], values[usable], steps[usable]
    at = (at - at.mean(axis=1, keepdims=True)) / np.ptp(at, axis=1)[:, None]
    distances = at[:, :, None] - at[:, None, :] + np.eye(order + 1)
    weight = 1.0 / np.prod(distances, axis=2)
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
