"""What the instruments add to a recording: size and serial correlation of every channel, and how to whiten
it."""

from collections.abc import Iterable, Mapping

import numpy as np

from fitting.models.channels import LEAST_NOISE, Channel, correlation_by_lags, serial_correlation
from fitting.models.rows import Rows
from fitting.noise import robust_noise
from fitting.recordings import Recording


def channels_of(
    recording: Recording,
    rows: Rows,
    outputs: tuple[str, ...],
    size: int,
    quiet: Mapping[str, float],
) -> list[Channel]:
    """Measured outputs of a recording, padded to `size` rows.

    Where nobody states the noise it is estimated from high frequencies.

    Args:
        recording: as it was read.
        rows: the same as arrays.
        outputs: quantities that the model predicts.
        size: rows of the stack.
        quiet: 1-sigma of a row of quantities that tell it themselves, SI, see `quiet`.
    """
    found = []
    for quantity in outputs:
        if not recording.has(quantity) or quantity not in rows.weight:
            continue
        values, there = np.asarray(rows.measured[quantity]), np.asarray(rows.weight[quantity]) > 0.0
        if not there.any():
            continue
        raw = recording.si(quantity)
        raw = raw[np.isfinite(raw)]
        block = max(1, round(len(raw) / max(there.sum(), 1)))
        stated = recording.noise_si(quantity)
        if stated is not None and stated > 0.0:
            correlation, sigma = serial_correlation(raw, stated), stated
        elif quantity in quiet:
            sigma, correlation = quiet[quantity], 0.0
        else:
            sigma = robust_noise(np.asarray(rows.time)[there], values[there])
            sigma, correlation = unstated_noise(values[there], sigma)
            sigma = max(sigma, LEAST_NOISE * float(np.ptp(values[there])), 1e-12)
        if block > 1 and stated:
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


def unstated_noise(values: np.ndarray, white: float) -> tuple[float, float]:
    """Standard deviation and correlation of neighbouring errors of a channel that states neither.

    Args:
        values: samples in their order, shape (n,).
        white: standard deviation that white noise would have.

    Returns:
        Both, see `correlation_by_lags`.
    """
    correlation = correlation_by_lags(values)
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
