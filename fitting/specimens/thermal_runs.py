"""Heating and cooling runs of a wire under a steady load: its transformation temperatures, and an
unrepresentative first heating.

A new wire has not been drawn by its load yet. Its first heating says nothing of the cycles that follow, and
no constant or effect of the cycles explains it.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.noise import robust_noise
from fitting.inference.parameters import Parameter, Prior

TURN = 0.1
"""Minimum part of the whole temperature range that must be reversed for a run to end."""
WHOLE = 0.5
"""Minimum part of the output's range in a run that shows the middle of the transformation."""
APART = 10.0
"""Minimum ratio of the first heating's deviation to the later heatings' scatter and to the noise.

An effect that fades over cycles changes the second from the third by at least a tenth of the first change.
Only an effect that is nearly over after half a cycle changes it by less. A state that the first heating ends
is gone at once.
"""
SEEN = 0.05
"""Minimum deviation of the first heating to be reported, as part of the output's range."""
GRID = 40
"""Number of temperatures at which heatings are compared."""


@dataclass(frozen=True)
class Run:
    """Rows between two turns of the temperature: `first` to `last`, both included. `heating` is true if it
    rises."""

    first: int
    last: int
    heating: bool

    @property
    def rows(self) -> slice:
        """The rows as a slice."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class FirstHeating:
    """A first heating that deviates from the later ones.

    Attributes:
        rows: number of rows of the first heating.
        off: root mean square deviation from the later ones, in units of the output's range [1].
        later: root mean square deviation of the later ones from each other, in the same unit [1].
    """

    rows: int
    off: float
    later: float

    def text(self, name: str) -> str:
        """Sentence for a report about the recording of that name."""
        return (
            f"{name}: the first heating (rows 1 to {self.rows}) is unlike the later ones. It is off by "
            f"{100.0 * self.off:.2g} % of the whole range, while those agree to {100.0 * self.later:.2g} %. "
            "The specimen had not been through a cycle under this load. These rows were set apart: they are "
            "not fitted"
        )


def runs_of(temperature: np.ndarray) -> list[Run]:
    """Runs between the turns of a finite temperature, shape (rows,). A reversal below `TURN` of the whole
    range starts no run."""
    least = TURN * float(np.ptp(temperature)) if len(temperature) else 0.0
    if not least > 0.0:
        return []
    turns, low, high, rising = [0], 0, 0, None
    for k, value in enumerate(temperature):
        low = k if value < temperature[low] else low
        high = k if value > temperature[high] else high
        if rising is not False and temperature[high] - value > least:
            turns += [high] if rising is not None or high > 0 else []
            rising, low = False, k
        elif rising is not True and value - temperature[low] > least:
            turns += [low] if rising is not None or low > 0 else []
            rising, high = True, k
    turns = [*dict.fromkeys([*turns, len(temperature) - 1])]
    pairs = zip(turns[:-1], turns[1:], strict=True)
    return [Run(a, b, bool(temperature[b] > temperature[a])) for a, b in pairs]


def half_way(recording: Recording, driver: str, output: str) -> tuple[float, ...]:
    """Temperatures [degC] at which an output passes the middle of its range on heating and cooling runs.

    Args:
        recording: recording with a temperature.
        driver: prescribed quantity, stress or strain; it must be steady.
        output: the other quantity.

    Returns:
        One temperature for every run that passes through half of the range or more; none where temperature
        has no influence.
    """
    columns = _columns(recording, driver, output)
    if columns is None:
        return ()
    temperature, values = columns
    runs = _without_first(recording, driver, output, runs_of(temperature))
    counted = values[runs[0].first :] if runs else values
    middle, span = 0.5 * (counted.max() + counted.min()), float(np.ptp(counted))
    found = []
    for run in runs:
        T, y = temperature[run.rows], values[run.rows]
        if np.ptp(y) < WHOLE * span or not (y.min() < middle < y.max()):
            continue
        above = y > middle
        # noise may pass the middle several times: the mean of those crossings is where it is half-way
        at = np.flatnonzero(above[1:] != above[:-1])
        share = (middle - y[at]) / (y[at + 1] - y[at])
        found.append(float(np.mean(T[at] + share * (T[at + 1] - T[at]))))
    return tuple(found)


def first_heating(recording: Recording, driver: str, output: str) -> FirstHeating | None:
    """First heating of a recording, if it deviates from two or more later ones that agree with each other.

    A recording that states its pre-strain is left alone, since its initial state is known. Arguments as for
    `half_way`.
    """
    if "prestrain" in recording.geometry:
        return None
    columns = _columns(recording, driver, output)
    if columns is None:
        return None
    temperature, values = columns
    runs = runs_of(temperature)
    heatings = [run for run in runs if run.heating]
    if len(heatings) < 3 or runs[0] is not heatings[0]:
        return None
    reached = [(temperature[r.first], temperature[r.last]) for r in heatings]
    low, high = max(a for a, _ in reached), min(b for _, b in reached)
    if high - low < WHOLE * float(np.ptp(temperature)):
        return None
    grid = np.linspace(low, high, GRID)
    first, *later = (_interpolated(temperature[r.rows], values[r.rows], grid) for r in heatings)
    span = float(np.ptp(values))
    off = _rms_difference(first, np.mean(later, axis=0)) / span
    agree = max(_rms_difference(a, b) for a, b in combinations(later, 2)) / span
    noise = robust_noise(np.arange(len(values)), values) / span
    if off < max(SEEN, APART * agree, APART * noise):
        return None
    rows = np.flatnonzero(_complete(recording, driver, output))
    return FirstHeating(int(rows[heatings[0].last]) + 1, off, agree)


def centre_prior(entry: Parameter, value: float) -> None:
    """Centre the prior of a parameter at another value, with the same width, and start there."""
    shift, prior = value - entry.prior.mean, entry.prior
    shifted = Prior(value, prior.sd, prior.min + shift, prior.max + shift)
    entry.set(value=value, min=shifted.min, max=shifted.max, prior=shifted, scale="linear")


def _without_first(recording: Recording, driver: str, output: str, runs: list[Run]) -> list[Run]:
    return runs[1:] if first_heating(recording, driver, output) else runs


def _complete(recording: Recording, driver: str, output: str) -> np.ndarray:
    return np.all([np.isfinite(recording.si(n)) for n in ("temperature", driver, output)], axis=0)


def _columns(recording: Recording, driver: str, output: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Temperature and output of the complete rows, where the driver is steady and the output is not."""
    if not all(recording.has(name) for name in ("temperature", driver, output)):
        return None
    complete = _complete(recording, driver, output)
    if complete.sum() < GRID // 2:
        return None
    drive = recording.si(driver)[complete]
    if np.ptp(drive) > TURN * np.max(np.abs(drive), initial=0.0):
        return None
    temperature, values = recording.si("temperature")[complete], recording.si(output)[complete]
    return (temperature, values) if np.ptp(values) > 0.0 and np.ptp(temperature) > 0.0 else None


def _interpolated(temperature: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Values of a rising run, interpolated at temperatures of a grid."""
    order = np.argsort(temperature, kind="stable")
    return np.interp(grid, temperature[order], values[order])


def _rms_difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))
