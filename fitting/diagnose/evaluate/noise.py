"""Noise of every measured channel of a recording: its size and its serial correlation."""

from collections.abc import Iterable, Mapping

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import LEAST_NOISE, Channel, block_noise, serial_correlation, unstated_noise
from fitting.inference.readings import noise_found, read_values, stated_noise
from fitting.specimens.rows import Rows

from ..settings import DEFAULT

INSTRUMENTS = DEFAULT.instruments


def channels_of(
    recording: Recording,
    rows: Rows,
    outputs: tuple[str, ...],
    size: int,
    high_frequency: Mapping[str, float],
) -> list[Channel]:
    """Measured outputs of a recording, padded to `size` rows.

    Where nobody states the noise it is estimated from high frequencies.

    Args:
        recording: recording as it was read, or reduced.
        rows: the same as arrays.
        outputs: quantities that the model predicts.
        size: rows of the stack.
        high_frequency: 1-sigma of a row by quantity, SI, where `high_frequency_noise` estimated it.
    """
    found = []
    for quantity in outputs:
        if not recording.has(quantity) or quantity not in rows.weight:
            continue
        values, there = np.asarray(rows.measured[quantity]), np.asarray(rows.weight[quantity]) > 0.0
        if not there.any():
            continue
        raw, block = read_values(recording, quantity), recording.block
        stated = stated_noise(recording, quantity)
        if stated is not None and stated > 0.0:
            correlation, sigma = serial_correlation(raw, stated), stated
        elif quantity in high_frequency:
            sigma, correlation = high_frequency[quantity], 0.0
        else:
            sigma, correlation = unstated_noise(raw, noise_found(recording, quantity))
        if block > 1 and quantity not in high_frequency:
            sigma, correlation = block_noise(sigma, correlation, block)
        elif block == 1:
            correlation **= max(len(raw) / max(there.sum(), 1), 1.0)  # rows that are kept lie further apart
        if not stated:
            sigma = max(sigma, LEAST_NOISE * float(np.ptp(values[there])), 1e-12)
        total = np.full(size, np.inf)
        total[: len(there)] = np.where(there, sigma, np.inf)
        full = np.zeros(size)
        full[: len(values)] = values
        found.append(Channel(quantity, full, total, float(correlation)))
    return found


def correlation_factor(pieces: Iterable[np.ndarray]) -> float:
    """Serial-correlation factor: variance of a mean of whitened residuals over that of independent ones.

    Args:
        pieces: misfits of every recording in their order; those that are exactly 0 do not count.
    """
    above, below = 0.0, 1e-12
    for r in pieces:
        r = r[r != 0.0]
        above += float(np.sum(r[1:] * r[:-1]))
        below += float(np.sum(r * r))
    rho = np.clip(above / below, 0.0, INSTRUMENTS.maximum_correlation)
    return float((1.0 + rho) / (1.0 - rho))
