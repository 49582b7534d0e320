"""What the instruments add to a recording: size and serial correlation of every channel, and how to whiten
it."""

from collections.abc import Iterable
from functools import cache

import numpy as np

from fitting.characterise.noise import robust_noise
from fitting.models.channels import CORRELATED, LEAST_NOISE, Channel, serial_correlation
from fitting.models.rows import Rows
from fitting.recordings import Recording

FEW = 40
"""Samples below which serial correlation is not estimated from themselves alone."""
STRETCH, QUIETER, SIMULATED = 16, 0.3, 200
"""Fourth differences of a stretch; the quantile of stretches that tells white noise; and the draws that say
what it is worth."""
MOST_GUESSED = 0.8
"""Largest correlation that is read off the samples alone: a course with corners looks like more."""


def channels_of(
    recording: Recording, rows: Rows, outputs: tuple[str, ...], size: int, hiding: bool = False
) -> list[Channel]:
    """Measured outputs of a recording, padded to `size` rows.

    Where nobody states the noise it is estimated from high frequencies; that of a resistance behind which
    a course hides, by itself, since a model that is free to follow it never tells its errors.

    Args:
        recording: as it was read.
        rows: the same as arrays.
        outputs: quantities that the model predicts.
        size: rows of the stack.
        hiding: whether courses hide behind resistances.
    """
    found = []
    for quantity in outputs:
        if not recording.has(quantity) or quantity not in rows.weight:
            continue
        values, there = np.asarray(rows.measured[quantity]), np.asarray(rows.weight[quantity]) > 0.0
        if not there.any():
            continue
        every = recording.si(quantity)
        raw = every[np.isfinite(every)]
        block = max(1, round(len(raw) / max(there.sum(), 1)))
        stated = recording.noise_si(quantity)
        if stated is not None and stated > 0.0:
            correlation, sigma = serial_correlation(raw, stated), stated
        elif hiding and quantity.startswith("resistance"):
            quiet = quiet_noise(every) or robust_noise(np.arange(float(len(raw))), raw)
            sigma, correlation = max(quiet, *_least(raw)), 0.0
        else:
            sigma = robust_noise(np.asarray(rows.time)[there], values[there])
            sigma, correlation = unstated_noise(values[there], sigma)
            sigma = max(sigma, *_least(values[there]))
            block = 1
        if block > 1:
            sigma, correlation = block_noise(sigma, correlation, block)
        total = np.full(size, np.inf)
        total[: len(there)] = np.where(there, sigma, np.inf)
        full = np.zeros(size)
        full[: len(values)] = values
        found.append(Channel(quantity, full, total, float(correlation)))
    return found


def noise_of(recording: Recording, quantity: str) -> float:
    """1-sigma of a column, stated or from its fast changes, SI; without a clock, rows count for time."""
    stated = recording.noise_si(quantity)
    if stated is not None:
        return stated
    values = recording.si(quantity)
    time = recording.si("time") if recording.has("time") else np.arange(float(len(values)))
    there = np.isfinite(values) & np.isfinite(time)
    return robust_noise(time[there], values[there]) if there.sum() > 2 else 0.0


def quiet_noise(values: np.ndarray) -> float:
    """Standard deviation of white noise on a course that is smooth in some of its stretches.

    Fourth differences of neighbouring samples, by stretches: ramps and the ripple of a controller leave
    little of themselves in them, and a switch of the current nothing in most stretches. What lasts from
    sample to sample counts as course.

    Args:
        values: samples in their order, NaN where missing, shape (n,).

    Returns:
        The standard deviation, from the quieter stretches, as white noise would show it there; 0 with too few
        samples.
    """
    found = _quiet(values)
    return found / _quiet_unit(len(values)) if found > 0.0 else 0.0


def _quiet(values: np.ndarray) -> float:
    """Root mean square of fourth differences in the quieter stretches; 0 where there are none."""
    bend = np.diff(values, 4)
    parts = [bend[first : first + STRETCH] for first in range(0, len(bend), STRETCH)]
    seen = [part[np.isfinite(part)] for part in parts]
    square = [np.mean(part**2) for part in seen if part.size >= STRETCH // 2]
    return float(np.sqrt(np.quantile(square, QUIETER))) if square else 0.0


@cache
def _quiet_unit(count: int) -> float:
    """What white noise of unit size shows in as many samples, by simulation."""
    draws = np.random.default_rng(0).standard_normal((SIMULATED, count))
    return float(np.mean([_quiet(draw) for draw in draws]))


def _least(values: np.ndarray) -> tuple[float, float, float]:
    """Least 1-sigma of samples, by their span and by the steps in which they were rounded."""
    steps = np.diff(np.unique(values))
    rounding = float(steps.min()) / np.sqrt(12.0) if steps.size else 0.0
    return LEAST_NOISE * float(np.ptp(values)), rounding, 1e-12


def unstated_noise(values: np.ndarray, white: float) -> tuple[float, float]:
    """Standard deviation and correlation of neighbouring errors of a channel that states neither.

    Second differences over one and two samples have variances `sigma^2 (6 - 8 r^k + 2 r^2k)` at lag k for
    first-order noise on a smooth course: their ratio grows with r, from 1 to 2.

    Args:
        values: samples in their order, shape (n,).
        white: standard deviation that white noise would have.

    Returns:
        Both; the correlation is 0 where the samples are few or the ratio is not above that of white noise.
    """
    if len(values) < FEW:
        return white, 0.0
    spread = [
        float(np.median(np.abs(values[2 * k :] - 2.0 * values[k:-k] + values[: -2 * k]))) for k in (1, 2)
    ]
    if not spread[0] > 0.0:
        return white, 0.0
    grid = np.linspace(0.0, MOST_GUESSED, 91)
    ratio = (1.0 + grid) * (3.0 - grid**2) / (3.0 - grid)
    correlation = float(np.interp((spread[1] / spread[0]) ** 2, ratio, grid))
    correlation = correlation if correlation > CORRELATED else 0.0
    return white * float(np.sqrt(6.0 / (6.0 - 8.0 * correlation + 2.0 * correlation**2))), correlation


def block_noise(sigma: float, correlation: float, block: int) -> tuple[float, float]:
    """Standard deviation of the means of blocks of samples with first-order noise, and their correlation."""
    lags = np.arange(1, block)
    variance = (block + 2.0 * np.sum((block - lags) * correlation**lags)) / block**2
    ladder = np.sum(correlation ** np.arange(block))
    return sigma * float(np.sqrt(variance)), float(correlation * ladder**2 / block**2 / variance)


def lasting(pieces: Iterable[np.ndarray]) -> float:
    """Factor on variances by the serial correlation that whitened misfits still have.

    Args:
        pieces: misfits of every recording in their order; those that are exactly 0 do not count.
    """
    above, below = 0.0, 1e-12
    for r in pieces:
        r = r[r != 0.0]
        above += float(np.sum(r[1:] * r[:-1]))
        below += float(np.sum(r * r))
    rho = np.clip(above / below, 0.0, 0.9)
    return float((1.0 + rho) / (1.0 - rho))
