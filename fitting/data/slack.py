"""Detection of slack and of the load cell's zero at the start of a pull."""

from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

optimize = Late("scipy.optimize")

LEAST_FLAT_ROWS = 3
"""Minimum number of flat rows; fewer are the first readings of any test."""
LARGEST_SLOPE_RATIO = 0.15
"""Maximum ratio of the slope before the rise to the one after it, for a specimen that hung slack [1]."""
OUTLIERS = 4.0
"""Number of standard deviations of the noise beyond which a reading is no noise.

Among the first rows of a pull it then belongs to the rise. In a fit to the first rows it is a spike.
"""
LEAST_GAIN = 9.0
"""Minimum decrease of the squared misfit by a flat start, in variances of the noise.

With it, one of 1920 rubbers without slack was falsely flagged. They had noise up to 2 kPa and steps up to 8
kPa, in 100 to 600 rows.
"""
FITTED_LENGTHS = 2.0
"""Length of the fitted curve, in lengths of the slack [1].

It was tested on a rubber in 200 rows, with 2 to 20 % of slack and noise of 0.3 % of the largest stress. The
start then errs by 0.1 % of strain, against a standard deviation of 0.25 %.
"""
FIRST_ROWS = 8
"""Minimum number of first rows for `reading_at_rest`. The curve of a rubber is a parabola over as many."""
BENDS = 2.0
"""Minimum misfit of a parabola through the first rows, in standard deviations of the noise, with which fewer
rows are taken.

Of 32 measured pulls and presses 15 bent so. Over all first rows their rest was up to 5 % of the largest
stress away from the first reading, over fewer rows 0.5 %.
"""
REACHES = 4.0
"""Minimum range of the rows that tell a rest, in distances of their first row from zero. A parabola is not
trusted much farther than it was fitted."""
AT_ZERO = 1e-3
"""Maximum distance from zero of a row that reads the rest, as part of the range of the drive [1].

Of 85 measured pulls and presses, 72 have such rows. In 36 of them a parabola through the first rows missed
the first such reading by more than four standard deviations of the noise, and by up to 6 % of the largest
stress.
"""
AT_START = 3
"""Number of first rows that tell a rest by their median, where none is near zero."""
SMALLEST_SHARE = 0.005
"""Minimum detectable slack, as part of the range of the drive [1]."""
LEAST_NOISE = 1e-6
"""Minimum noise of a reading, as part of the range of readings [1]: a simulated curve has none."""


@dataclass(frozen=True)
class Rest:
    """Reading of a specimen at rest, before it is strained.

    Attributes:
        reading: reading, in the unit of the force or stress.
        at: drive at which it was read; 0 where the first rows tell the reading at zero.
    """

    reading: float
    at: float = 0.0


@dataclass(frozen=True)
class Slack:
    """A flat start of a test.

    Attributes:
        start: drive at the start of the rise, in its own unit.
        zero: flat reading before the rise, in the unit of the force or stress.
        rows: number of flat rows.
    """

    start: float
    zero: float
    rows: int


def find_slack(drive: np.ndarray, force: np.ndarray) -> Slack | None:
    """Start of the rise in a pull (or a press) that begins flat.

    The flat reading is the mean of the first rows that differ by no more than their noise. The start of the
    rise is that of a parabola that leaves this level. It is fitted to the flat rows and to as many rows
    beyond.

    Args:
        drive: strain or elongation of the first stroke; shape (rows,), NaN where missing.
        force: stress or force; shape (rows,).

    Returns:
        The slack, with the sign of the input, or None where there is none.
    """
    stroke = _first_stroke(drive, force)
    if stroke is None:
        return None
    x, y, x_sign, y_sign = stroke
    flat = _flat_rows(y)
    if flat < LEAST_FLAT_ROWS or flat >= x.size - LEAST_FLAT_ROWS:
        return None
    latest = x[min(flat + LEAST_FLAT_ROWS, x.size - 1)]
    if not latest > x[0]:
        return None
    near = x <= x[0] + FITTED_LENGTHS * (x[flat - 1] - x[0])
    near[: flat + 2 * LEAST_FLAT_ROWS] = True
    x_near, y_near = x[near], y[near]
    found = optimize.minimize_scalar(
        lambda start: _misfit(start, x_near, y_near),
        bounds=(x[0], latest),
        method="bounded",
    )
    start = float(found.x)
    level, slope = _parabola_fit(start, x_near, y_near)[:2]
    before = x < start
    if before.sum() < LEAST_FLAT_ROWS or start - x[0] < SMALLEST_SHARE * (x[-1] - x[0]) or not slope > 0.0:
        return None
    misfit = _misfit(start, x_near, y_near)
    variance = max(
        misfit / max(x_near.size - 4, 1), noise_of_steps(y) ** 2, (LEAST_NOISE * float(np.ptp(y))) ** 2
    )
    if _misfit(float(x[0]), x_near, y_near) - misfit < LEAST_GAIN * variance:
        return None
    slope_before = float(np.polyfit(x[before] - x[0], y[before], 1)[0]) if np.ptp(x[before]) > 0.0 else 0.0
    if abs(slope_before) > LARGEST_SLOPE_RATIO * slope:
        return None
    return Slack(x_sign * start, y_sign * float(level), int(before.sum()))


def _first_stroke(drive: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float] | None:
    """Finite rows up to the largest drive, both signed so that they rise.

    Args:
        drive, force: as in `find_slack`.

    Returns:
        Drive and force, shapes (rows,), and the signs by which they were multiplied; None for too few rows.
    """
    finite = np.isfinite(drive) & np.isfinite(force)
    x, y = drive[finite], force[finite]
    if x.size < 3 * LEAST_FLAT_ROWS:
        return None
    x_sign = 1.0 if abs(np.max(x) - x[0]) >= abs(np.min(x) - x[0]) else -1.0
    x = x_sign * x
    end = int(np.argmax(x)) + 1
    x, y = x[:end], y[:end]
    if x.size < 3 * LEAST_FLAT_ROWS or not x[-1] > x[0]:
        return None
    y_sign = 1.0 if np.median(y[-max(3, y.size // 10) :]) >= np.median(y[:LEAST_FLAT_ROWS]) else -1.0
    return x, y_sign * y, x_sign, y_sign


def reading_at_rest(x: np.ndarray, y: np.ndarray) -> Rest:
    """Reading where the drive is zero, by a parabola through the first rows without a spike among them.

    The first reading alone would be wrong: the curve may already rise there.

    Where these rows bend more than a parabola, as a metal does that first settles in its grips, fewer of them
    are taken. They still reach several times as far as zero is from the first row. The first row at zero is
    believed before a parabola that misses it. Where the first rows do not reach as far as zero is from them,
    nothing is known there, and the rest is that of the first rows themselves.

    Args:
        x: strain or elongation of a test that begins near its zero, finite, shape (rows,).
        y: stress or force, finite, shape (rows,).

    Returns:
        The reading, in the unit of `y`. It is their median where they are too few for a parabola.
    """
    stroke = int(np.argmax(np.abs(x - x[0]))) + 1
    rows = min(max(FIRST_ROWS, x.size // 20), stroke)
    noise = noise_of_steps(y)
    while rows >= 2 * FIRST_ROWS and _bends(x[:rows], y[:rows], noise):
        if not np.ptp(x[: rows // 2]) > REACHES * abs(x[0]):
            break
        rows //= 2
    first = slice(0, rows)
    scale = float(np.ptp(x[first]))
    if not scale > 0.0 or np.unique(x[first]).size < 4:
        return Rest(float(np.median(y[: max(x[first].size, 1)])))
    scaled, readings = x[first] / scale, y[first]
    misses = np.abs(readings - np.polyval(np.polyfit(scaled, readings, 2), scaled))
    others = misses < misses.max()  # one spike among the first rows is no rest
    enough = others.sum() >= 5 and np.unique(scaled[others]).size > 2  # a parabola has three constants
    if enough and misses.max() > OUTLIERS * float(np.sqrt(np.mean(misses[others] ** 2))):
        scaled, readings = scaled[others], readings[others]
    curve = np.polyfit(scaled, readings, 2)
    near = np.flatnonzero(np.abs(scaled) * scale <= AT_ZERO * float(np.ptp(x)))
    if near.size:  # later ones may be noise of a drive that has left
        same = near[scaled[near] == scaled[near[0]]]
        there = float(np.median(readings[same]))
        if abs(there - float(np.polyval(curve, scaled[near[0]]))) > OUTLIERS * noise:
            return Rest(there)
    elif scale < float(np.abs(x[first]).min()):
        return Rest(float(np.median(y[:AT_START])), float(np.median(x[:AT_START])))
    return Rest(float(np.polyval(curve, 0.0)))


def _bends(x: np.ndarray, y: np.ndarray, noise: float) -> bool:
    """True if a parabola misses readings by more than their noise in the root mean square."""
    if not np.ptp(x) > 0.0:
        return False
    scaled = (x - x[0]) / np.ptp(x)
    off = y - np.polyval(np.polyfit(scaled, y, 2), scaled)
    return float(np.sqrt(np.mean(off**2))) > BENDS * max(noise, 1e-9 * float(np.ptp(y)))


def noise_of_steps(y: np.ndarray) -> float:
    """Standard deviation of a curve's noise, in the unit of the curve.

    Third differences remove what is smooth. They have 20 times the variance of independent noise. Their
    median absolute value is 0.6745 standard deviations. The result is at least the error of rounding to the
    smallest step, unless this is so large that rows are merely few.

    Args:
        y: the curve, finite, shape (rows,).
    """
    third = np.diff(y, 3)
    step = np.diff(np.unique(y))
    rounding = float(step.min()) / np.sqrt(12.0) if step.size else 0.0
    spread = float(np.median(np.abs(third))) / 0.6745 / np.sqrt(20.0) if third.size else 0.0
    return max(spread, rounding if rounding < 0.05 * float(np.ptp(y)) else 0.0)


def _flat_rows(y: np.ndarray) -> int:
    """Number of rows before the rise: after them, every reading is above the noise of the flat level."""
    noise = noise_of_steps(y)
    flat = LEAST_FLAT_ROWS
    for _ in range(20):  # the level depends on the number of flat rows, and this on the level
        level = float(np.mean(y[:flat]))
        beyond = y > level + OUTLIERS * noise + 1e-12 * float(np.ptp(y))
        last_within = np.flatnonzero(~beyond)
        count = int(last_within[-1]) + 1 if last_within.size else 0
        if count == flat or count < LEAST_FLAT_ROWS:
            return count
        flat = count
    return flat


def _parabola_fit(start: float, x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Level before a start, and the parabola's slope and curvature beyond it, by least squares."""
    beyond = np.maximum(x - start, 0.0)
    scale = float(beyond.max()) or 1.0
    columns = np.stack([np.ones_like(x), beyond / scale, (beyond / scale) ** 2], axis=1)
    level, slope, curvature = np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(level), float(slope) / scale, float(curvature) / scale**2


def _misfit(start: float, x: np.ndarray, y: np.ndarray) -> float:
    """Sum of squared residuals of `_parabola_fit`."""
    level, slope, curvature = _parabola_fit(start, x, y)
    beyond = np.maximum(x - start, 0.0)
    return float(np.sum((y - level - slope * beyond - curvature * beyond**2) ** 2))
