"""High-frequency noise estimate of resistances that latent trajectories follow, where no noise is stated.

A model that may follow a resistance does not show its errors. The resistance itself does, by fourth
differences of neighbouring samples in the quieter stretches of all recordings. Ramps and slow ripple leave
little there, and a switched heater nothing in most stretches. Ripple of fewer than about ten samples a period
counts as noise. Samples that a logger interpolated look too quiet; state the noise then.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import LEAST_NOISE, block_noise
from fitting.inference.noise import robust_noise, rounding_noise
from fitting.inference.readings import read_values
from fitting.specimens.rows import Rows

from ..settings import DEFAULT

CHANCE = DEFAULT.chance
NOISE = DEFAULT.noise


def high_frequency_readings(recordings: Sequence[Recording], rows: Sequence[Rows]) -> list[dict[str, float]]:
    """1-sigma of a row of every resistance whose noise nobody states, SI, by recording and quantity.

    Where rows are means over blocks of samples, the noise of the means counts if it is much larger. Errors
    that last over a block do not average out. A little more is the trajectory, which bends faster from row to
    row.

    Args:
        recordings: recordings as they were read, or reduced.
        rows: the same as arrays.
    """
    found: list[dict[str, float]] = [{} for _ in recordings]
    for quantity in sorted({name for r in rows for name in r.measured if name.startswith("resistance")}):
        pieces = {}
        for k, (recording, row) in enumerate(zip(recordings, rows, strict=True)):
            if recording.has(quantity) and quantity in row.measured and not recording.noise_si(quantity):
                raw = read_values(recording, quantity)
                mean = np.asarray(row.measured[quantity])[np.asarray(row.weight[quantity]) > 0.0]
                pieces[k] = raw, mean
        blocks = {k: recordings[k].block for k in pieces}
        own = high_frequency_noise([raw for raw, _ in pieces.values()])
        if own is None:
            own = max((robust_noise(np.arange(len(raw)), raw) for raw, _ in pieces.values()), default=0.0)
        means = high_frequency_noise([mean for k, (_, mean) in pieces.items() if blocks[k] > 1]) or 0.0
        for k, (raw, _) in pieces.items():
            sigma = block_noise(own, 0.0, blocks[k])[0]
            span = float(np.ptp(raw)) if len(raw) else 0.0
            floor = max(LEAST_NOISE * span, rounding_noise(raw), 1e-12)
            if blocks[k] > 1 and means > CHANCE.scatter_ratio * sigma:
                sigma = means
            found[k][quantity] = max(sigma, floor)
    return found


def high_frequency_noise(pieces: Sequence[np.ndarray]) -> float | None:
    """Standard deviation of white noise on a signal that is smooth in some of its stretches.

    Args:
        pieces: finite samples of every recording in their order, (samples,).

    Returns:
        The standard deviation; 0 where they are as flat as rounding makes them, and None for too few samples.
    """
    pieces = [piece for piece in pieces if len(piece) > NOISE.difference_order + NOISE.stretch // 2]
    squares = [_stretches(piece[None])[0] for piece in pieces]
    if not squares:
        return None
    found = np.sqrt(np.quantile(np.concatenate(squares), NOISE.quiet_quantile))
    return float(found / _unit(tuple(sorted(min(len(piece), NOISE.simulated_samples) for piece in pieces))))


def _stretches(values: np.ndarray) -> np.ndarray:
    """Mean squares of the differences in every stretch, (..., stretches), from samples (..., samples)."""
    bend = np.diff(values, NOISE.difference_order, axis=-1) ** 2
    count = max(bend.shape[-1] // NOISE.stretch, 1)
    return np.stack([part.mean(axis=-1) for part in np.array_split(bend, count, axis=-1)], axis=-1)


@cache
def _unit(counts: tuple[int, ...]) -> float:
    """The same statistic of white noise of unit size in recordings of so many samples, by simulation."""
    rng = np.random.default_rng(0)
    squares = [_stretches(rng.standard_normal((NOISE.simulated_draws, count))) for count in counts]
    return float(
        np.mean(np.sqrt(np.quantile(np.concatenate(squares, axis=-1), NOISE.quiet_quantile, axis=-1)))
    )
