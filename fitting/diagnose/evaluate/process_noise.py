"""Process noise: how fast a latent trajectory changes, by the evidence of its resistance."""

import numpy as np

from fitting.inference.channels import Channel

from ..settings import DEFAULT
from .latent_trajectories import intervals

EVIDENCE = DEFAULT.evidence
INSTRUMENTS = DEFAULT.instruments


def process_noise_of(
    reading: Channel, slope: np.ndarray, misfit: np.ndarray, trajectory: np.ndarray, time: np.ndarray
) -> float:
    """Process-noise variance per second of a fraction, by the largest evidence of its resistance.

    NaN where no variance is much better than the others.

    Args:
        reading: the resistance.
        slope: its derivative by the fraction, (rows,).
        misfit: model minus data, SI, (rows,).
        trajectory: fraction at which the model was evaluated, (rows,).
        time: [s], (rows,).
    """
    there = np.isfinite(reading.sigma) & np.isfinite(misfit) & (slope != 0.0)
    if there.sum() < 3:
        return np.nan
    inflation = np.sqrt((1.0 + reading.correlation) / (1.0 - reading.correlation))
    gradient, noise = slope[there], (inflation * reading.sigma)[there]
    read = gradient * trajectory[there] - misfit[there]
    steps = intervals(time[there])
    candidates = np.asarray(INSTRUMENTS.process_noise_variances)
    mean, variance = np.full(len(candidates), trajectory[there][0]), np.ones(len(candidates))
    evidence = np.zeros(len(candidates))
    for s, sigma, y, dt in zip(gradient, noise, read, steps, strict=True):
        variance = variance + candidates * dt
        spread = s**2 * variance + sigma**2
        innovation = y - s * mean
        evidence -= 0.5 * (np.log(spread) + innovation**2 / spread)
        gain = variance * s / spread
        mean, variance = mean + gain * innovation, variance * sigma**2 / spread
    decisive = np.ptp(evidence) > EVIDENCE.minimum_difference
    return float(candidates[np.argmax(evidence)]) if decisive else np.nan


def estimated_process_noise(found: np.ndarray) -> np.ndarray:
    """Process-noise variances of all trajectories; the median of the others where one is NaN."""
    known = found[np.isfinite(found) & (found > 0.0)]
    usual = 10.0 ** np.median(np.log10(known)) if known.size else INSTRUMENTS.usual_process_noise_variance
    return np.where(np.isfinite(found), found, usual)
