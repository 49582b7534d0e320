"""Detection of slack and of the load cell's zero at the start of a pull."""

from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

optimize = Late("scipy.optimize")

LEAST_FLAT_ROWS = 3
"""Minimum number of flat rows; fewer are the first readings of any test."""
FLAT = 0.15
"""Maximum ratio of the slope before the rise to the one after it, for a specimen that hung slack."""
OUTLIERS = 4.0
"""Number of standard deviations of the noise beyond which a row belongs to the rise."""
EVIDENCE = 9.0
"""Minimum decrease of the squared misfit by a flat start, in variances of the noise.

With it, one of 1920 rubbers without slack was falsely flagged. They had noise up to 2 kPa and steps up to 8
kPa, in 100 to 600 rows.
"""
WINDOW = 2.0
"""Length of the fitted curve, in lengths of the slack.

It was tested on a rubber in 200 rows, with 2 to 20 % of slack and noise of 0.3 % of the largest stress. The
start then errs by 0.1 % of strain, against a standard deviation of 0.25 %.
"""
FIRST_ROWS = 8
"""Minimum number of rows that show a rest. The rise of a rubber is a parabola over as many."""
SHARE = 0.005
"""Minimum detectable slack, as part of the range of the drive."""


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
    finite = np.isfinite(drive) & np.isfinite(force)
    x, y = drive[finite], force[finite]
    if x.size < 3 * LEAST_FLAT_ROWS:
        return None
    sign = 1.0 if abs(np.max(x) - x[0]) >= abs(np.min(x) - x[0]) else -1.0
    x = sign * x
    top = int(np.argmax(x))
    x, y = x[: top + 1], y[: top + 1]
    if x.size < 3 * LEAST_FLAT_ROWS or not x[-1] > x[0]:
        return None
    side = 1.0 if np.median(y[-max(3, y.size // 10) :]) >= np.median(y[:LEAST_FLAT_ROWS]) else -1.0
    y = side * y
    flat = _flat_rows(y)
    if flat < LEAST_FLAT_ROWS or flat >= x.size - LEAST_FLAT_ROWS:
        return None
    last = x[min(flat + LEAST_FLAT_ROWS, x.size - 1)]
    if not last > x[0]:
        return None
    reach = x <= x[0] + WINDOW * (x[flat - 1] - x[0])
    reach[: flat + 2 * LEAST_FLAT_ROWS] = True
    x_near, y_near = x[reach], y[reach]
    found = optimize.minimize_scalar(
        lambda start: _misfit(start, x_near, y_near),
        bounds=(x[0], last),
        method="bounded",
    )
    start = float(found.x)
    zero, slope = _parabola_fit(start, x_near, y_near)[:2]
    before = x < start
    if before.sum() < LEAST_FLAT_ROWS or start - x[0] < SHARE * (x[-1] - x[0]) or not slope > 0.0:
        return None
    rest = _misfit(start, x_near, y_near)
    spread = max(rest / max(x_near.size - 4, 1), noise_of_steps(y) ** 2, (1e-6 * float(np.ptp(y))) ** 2)
    if _misfit(float(x[0]), x_near, y_near) - rest < EVIDENCE * spread:
        return None
    own = float(np.polyfit(x[before] - x[0], y[before], 1)[0]) if np.ptp(x[before]) > 0.0 else 0.0
    if abs(own) > FLAT * slope:
        return None
    return Slack(sign * start, side * float(zero), int(before.sum()))


def rest_at_zero(x: np.ndarray, y: np.ndarray) -> float:
    """Reading where the drive is zero, from a parabola through the first rows: a rise from there is no rest.

    Args:
        x: strain or elongation of a test that begins near its zero, finite, shape (rows,).
        y: stress or force, finite, shape (rows,).
    """
    near = slice(0, min(max(FIRST_ROWS, x.size // 20), int(np.argmax(np.abs(x - x[0]))) + 1))
    reach = float(np.ptp(x[near]))
    if not reach > 0.0 or np.unique(x[near]).size < 4:
        return float(np.median(y[: max(x[near].size, 1)]))
    scaled, told = x[near] / reach, y[near]
    off = np.abs(told - np.polyval(np.polyfit(scaled, told, 2), scaled))
    others = off < off.max()  # one spike among the first rows is no rest
    if others.sum() >= 5 and off.max() > OUTLIERS * float(np.sqrt(np.mean(off[others] ** 2))):
        scaled, told = scaled[others], told[others]
    return float(np.polyval(np.polyfit(scaled, told, 2), 0.0))


def noise_of_steps(y: np.ndarray) -> float:
    """Standard deviation of a curve's noise from its third differences, no less than the resolution
    allows."""
    third = np.diff(y, 3)
    step = np.diff(np.unique(y))
    least = float(step.min()) / np.sqrt(12.0) if step.size else 0.0
    spread = float(np.median(np.abs(third))) / 0.6745 / np.sqrt(20.0) if third.size else 0.0
    return max(spread, least if least < 0.05 * float(np.ptp(y)) else 0.0)


def _flat_rows(y: np.ndarray) -> int:
    """Rows before the first row from which on all lie beyond the noise of the first ones."""
    noise = noise_of_steps(y)
    flat = LEAST_FLAT_ROWS
    for _ in range(20):  # the mean of the flat rows and their number settle each other
        level = float(np.mean(y[:flat]))
        beyond = y > level + OUTLIERS * noise + 1e-12 * float(np.ptp(y))
        last_within = np.flatnonzero(~beyond)
        count = int(last_within[-1]) + 1 if last_within.size else 0
        if count == flat or count < LEAST_FLAT_ROWS:
            return count
        flat = count
    return flat


def _parabola_fit(start: float, x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Level, slope and curvature of a parabola that leaves a level at a start, by least squares."""
    beyond = np.maximum(x - start, 0.0)
    scale = float(beyond.max()) or 1.0
    columns = np.stack([np.ones_like(x), beyond / scale, (beyond / scale) ** 2], axis=1)
    level, slope, curvature = np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(level), float(slope) / scale, float(curvature) / scale**2


def _misfit(start: float, x: np.ndarray, y: np.ndarray) -> float:
    level, slope, curvature = _parabola_fit(start, x, y)
    beyond = np.maximum(x - start, 0.0)
    return float(np.sum((y - level - slope * beyond - curvature * beyond**2) ** 2))
