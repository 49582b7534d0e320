"""Instruments of a simulated bench: noise, a drifting zero, and finitely many digits."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.data.recordings import Recording, schema
from pneusma_jax.errors import InputError, nearest

from .wishes import Wishes, stream

DIGITS = {"time_s": 3, "elongation_mm": 4, "stress_MPa": 3, "stress_kPa": 3, "setpoint_ohm": 5, "strain": 7}
"""Decimals of a column that is written without noise; 4 where not listed."""


@dataclass(frozen=True)
class Instruments:
    """The sensors of a bench.

    Attributes:
        kind: kind of its recordings.
        noise: marginal standard deviation by canonical column, in that column's unit.
        noise_time_s: correlation time of the noise [s]; 0 for white noise.
        drift: standard deviation of the zero at the end of a test, in units of the noise.
        seed: seed of the random numbers.
    """

    kind: str
    noise: Mapping[str, float]
    noise_time_s: float
    drift: float
    seed: int

    @classmethod
    def of(cls, kind: str, wishes: Wishes, defaults: Mapping[str, float]) -> "Instruments":
        """Sensors of a kind of recording: the given noise, overridden by the user's wishes.

        Raises:
            InputError: for a column that the kind does not have, or one that holds no reading.
        """
        for name in wishes.noise:
            if name not in schema.KINDS[kind].columns.known:
                raise InputError(
                    f"--noise {name}: a recording of kind {kind} has no such column,"
                    f" {nearest(name, schema.KINDS[kind].columns.known)}"
                )
            if name not in defaults:
                raise InputError(f"--noise {name}: here noise can be given to {', '.join(defaults)}")
            if wishes.noise[name] == 0.0 and name in schema.KINDS[kind].columns.outputs:
                raise InputError(f"--noise {name}=0: an output needs noise, if only a little")
        noise = {**defaults, **wishes.noise}
        return cls(kind, noise, wishes.noise_time_s, wishes.drift, wishes.seed)

    def recording(
        self, name: str, role: str, specimen: str, time: np.ndarray, columns: Mapping[str, np.ndarray],
        geometry: Mapping[str, Any], tolerance: Mapping[str, float] | None = None,
    ) -> Recording:  # fmt: skip
        """A simulated recording of the bench's readings.

        Args:
            name: name of the recording.
            role: `fit` or `validation`.
            specimen: name of the specimen.
            time, columns: true values, see `read`.
            geometry, tolerance: tables that the recording states; without a tolerance, the kind's own holds.
        """
        return Recording(
            name=name,
            path=None,
            kind=self.kind,
            role=role,
            specimen=specimen,
            real=False,
            noise=self.stated(columns),
            geometry=dict(geometry),
            tolerance=None if tolerance is None else dict(tolerance),
            columns=self.read(name, time, columns),
        )

    def read(self, test: str, time: np.ndarray, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Readings that the bench records.

        Args:
            test: name of the recording, for its own random numbers.
            time: time [s], ascending, shape (rows,).
            columns: true values by canonical column, in its unit, shape (rows,); the clock is added.
        """
        written = {"time_s": np.round(time, DIGITS["time_s"])}
        for name, values in columns.items():
            sigma = self.noise.get(name, 0.0)
            random = stream(self.seed, "noise", test, name)
            read = values + sigma * (
                correlated(random, time, self.noise_time_s) + self.drift * random_walk(random, time)
            )
            written[name] = np.round(read, _decimals(name, sigma)) + 0.0  # no -0
        return written

    def stated(self, columns: Mapping[str, np.ndarray]) -> dict[str, float]:
        """The [noise] table for the columns of a recording."""
        return {name: self.noise[name] for name in columns if self.noise.get(name, 0.0) > 0.0}


def correlated(random: np.random.Generator, time: np.ndarray, memory_s: float) -> np.ndarray:
    """Noise of unit variance, correlated as exp(-dt / memory); shape (rows,)."""
    white = random.standard_normal(len(time))
    if memory_s <= 0.0:
        return white
    keep = np.exp(-np.diff(time) / memory_s)
    series = white.copy()
    for k, factor in enumerate(keep, start=1):
        series[k] = factor * series[k - 1] + math.sqrt(1.0 - factor**2) * white[k]
    return series


def random_walk(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """A zero that starts true and follows a random walk, with unit variance at the end; shape (rows,)."""
    span = max(time[-1] - time[0], 1e-12)
    steps = np.sqrt(np.diff(time, prepend=time[0]) / span) * random.standard_normal(len(time))
    return np.cumsum(steps)


def _decimals(name: str, sigma: float) -> int:
    """Number of decimals that resolves a hundredth of the noise."""
    return DIGITS.get(name, 4) if sigma <= 0.0 else max(0, math.ceil(2.0 - math.log10(sigma)))
