"""Detection of saturation: an instrument at full scale gives only a bound on the quantity."""

from collections.abc import Sequence

import numpy as np

from .noise import least_step, robust_noise

LONG = 5
"""Minimum number of rows at the extreme value for a saturated channel."""
AFTER, SMOOTH = 4.0, 3.0
"""Minimum continuation of the trend beyond its stop, in steps or standard deviations. The second number
multiplies it for readings so coarse that they may stand still at a smooth top. A rounded parabola would
continue by 2 to 8 steps."""
UNLIKELY = 1e-3
"""Maximum expected number of such stretches by chance, from the frequency of equal readings."""
ABRUPT = 1.5
"""Maximum ratio of the last stretches of equal readings before a stop. In a trend that levels off they
double."""
LEVELS = 0.45
"""Minimum ratio of slopes, of the second half of the way to a stop over the first. A trend that levels off by
itself has less. It is 0.6 for any parabola that is cut off, and at most 0.33 for an exponential rounded to
its end."""
LAST_WAY = 40.0
"""Number of steps, or of standard deviations, of the last way to a stop, on which slopes are compared. The
way is at most as long as the stop."""
NEAR, AROUND = 3.0, 7
"""Number of standard deviations below full scale within which noise is clipped on one side; number of rows of
a running median."""


def saturated(
    values: np.ndarray, others: Sequence[np.ndarray], known: float | None = None
) -> tuple[np.ndarray, float]:
    """Rows in which a channel is saturated at its largest or smallest value, while other channels change.

    Rows close to such a stop are included, since noise is clipped there and no longer symmetric. A channel
    may also stop at a value nearer to zero, but not at the ends of a test, before loading.

    Args:
        values: values of the channel in their order, shape (n,), finite.
        others: further channels, shape (n,) each; those with missing rows are ignored.
        known: saturation value of the channel in another test.

    Returns:
        Mask of the saturated rows, and the saturation value; NaN where there is none.
    """
    found, level = np.zeros(len(values), bool), np.nan
    if len(values) < 4 * LONG or not np.ptp(values) > 0.0:
        return found, level
    rows = np.arange(float(len(values)))
    spread = robust_noise(rows, values)
    step = max(float(least_step(values).max()), spread)
    still = float(np.mean(np.diff(values) == 0.0))
    moving = [(x, AFTER * robust_noise(rows, x)) for x in others if np.isfinite(x).all() and np.ptp(x) > 0.0]
    for sign in (1.0, -1.0):
        top = float(np.max(sign * values))
        full = top == float(np.max(np.abs(values)))
        stops = [(a, b) for a, b in runs(sign * values == top) if b - a > 1]
        stops = [(a, b) for a, b in stops if full or (a > 0 and b < len(values))]
        count = sum(b - a for a, b in stops)
        chance = len(values) * still ** (count - len(stops))
        clear = step * (AFTER if chance < UNLIKELY else SMOOTH * AFTER)
        known_stop = known is not None and sign * top == known and count > 0
        if known_stop or count >= LONG and any(
            _is_stop(sign * values, moving, run, clear, step, spread) for run in stops
        ):
            level = sign * top
            found |= _with_neighbours(sign * values, top, top - NEAR * step)
    return found, level


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """First row, and row after the last, of every stretch of a mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _is_stop(
    values: np.ndarray,
    moving: Sequence[tuple[np.ndarray, float]],
    run: tuple[int, int],
    clear: float,
    step: float,
    spread: float,
) -> bool:
    """True if a trend that rose to its extreme would have continued by more than `clear`, as other channels
    did.

    Args:
        values: values of the channel, shape (n,).
        moving: other channels, shape (n,), each with the smallest move beyond its noise.
        run: first row at the extreme, and the one after the last.
        clear: minimum continuation, in the unit of `values`.
        step: noise of a reading or its resolution, the larger one, in the unit of `values`.
        spread: standard deviation of a reading, in the unit of `values`.
    """
    for flip in (1, -1):  # forwards before the stop, and backwards after it
        y = values[::flip]
        a, b = run if flip == 1 else (len(values) - run[1], len(values) - run[0])
        first = max(a - max(LONG, b - a), 0)
        if a - first < LONG // 2:
            continue
        slope = (y[a] - y[first]) / (a - first)
        further = max((_rows_after_stop(x[::flip], noise, first, a, b) for x, noise in moving), default=0.0)
        goes_on = slope * further > clear and _is_abrupt(y, first, a, b)
        if goes_on and not _levels_off(y[first:a], step, spread):
            return True
    return False


def _levels_off(y: np.ndarray, step: float, spread: float) -> bool:
    """True if a trend clearly flattens on its last way to its extreme, so that it ends there by itself.

    Args:
        y: readings before the stop, in their order, shape (n,).
        step: noise of one of them or its resolution, the larger one.
        spread: standard deviation of one of them.
    """
    far = np.flatnonzero(y < y[-1] - LAST_WAY * step)
    y = y[min(far[-1] if len(far) else 0, max(len(y) - LONG, 0)) :]
    half = (len(y) + 1) // 2
    if half < 2:
        return False
    slopes = [np.polyfit(np.arange(half), part, 1)[0] for part in (y[:half], y[-half:])]
    error = spread / np.sqrt(np.sum((np.arange(half) - (half - 1) / 2.0) ** 2))
    return bool(slopes[1] + 2.0 * error < LEVELS * (slopes[0] - 2.0 * error))


def _rows_after_stop(x: np.ndarray, noise: float, first: int, a: int, b: int) -> float:
    """Number of rows for which another channel continued after a stop, at its earlier rate."""
    before, after = x[a] - x[first], x[a : b + 1] - x[a]
    if abs(before) <= noise:
        return 0.0
    return float(np.max(after * np.sign(before), initial=0.0) / abs(before) * (a - first))


def _is_abrupt(y: np.ndarray, first: int, a: int, b: int) -> bool:
    """True if readings changed as usual until a stop. In a trend that levels off, steps get longer."""
    changes = np.flatnonzero(np.diff(y[first : a + 1]))
    if len(changes) < 3:
        return len(changes) > 0 and (a - first) / len(changes) < (b - a) / LONG
    stands = np.diff(changes)
    usual = float(np.median(stands))
    return bool(stands[-1] <= ABRUPT * usual + 1.0 and b - a >= LONG * max(usual, 1.0))


def _with_neighbours(values: np.ndarray, top: float, low: float) -> np.ndarray:
    """Rows at full scale, and those around them in which the trend stays above `low`."""
    padded = np.pad(values, AROUND // 2, mode="edge")
    course = np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    found = values == top
    for start, end in runs((course >= low) | found):
        found[start:end] |= found[start:end].any()
    return found
