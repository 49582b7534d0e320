"""Period of what a model leaves: of a pump or a switched heater in time, of a machine's screw in its travel.

A period is found in the first half of every recording and confirmed in the second. The power at its
frequency is compared with that at frequencies beside it, which hold whatever else is left (the F-test of
D. J. Thomson, Proc. IEEE 70 (1982) 1055). What goes with a drive repeats as often as the drive does: with
pressure, strain, heat. So only periods that fit several times between two turning points of all other drives
are looked for, once what goes with these and their direction is taken off.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

from ..evaluate.program import Program
from ..fit.refit import Fit
from ..settings import DEFAULT
from .locate import drivers_of

stats = Late("scipy.stats")
PLACE = DEFAULT.place
SCORE_TEST = DEFAULT.score_test


@dataclass(frozen=True)
class Repeats:
    """A part of a misfit that repeats.

    Attributes:
        quantity: measured output that has it.
        driver: quantity along which it repeats.
        period: its period, in the unit of the driver, SI.
        amplitude: its amplitude, in the unit of the output, SI.
        p_value: p-value of the confirmation.
    """

    quantity: str
    driver: str
    period: float
    amplitude: float
    p_value: float


@dataclass(frozen=True)
class _Part:
    """Half of a recording: the driver, and the misfit in standard deviations of the noise, shape (rows,)."""

    x: np.ndarray
    misfit: np.ndarray

    @property
    def span(self) -> float:
        """Range of the driver."""
        return float(np.ptp(self.x))


@dataclass(frozen=True)
class _Course:
    """The misfit of one output along one driver.

    Attributes:
        quantity, driver: as of `Repeats`.
        halves: first and second halves of recordings.
        sigma: usual standard deviation of the noise, SI.
        longest: longest period to look for, in the unit of the driver.
    """

    quantity: str
    driver: str
    halves: tuple[list[_Part], list[_Part]]
    sigma: float
    longest: float


def repeats_of(program: Program, fit: Fit) -> Repeats | None:
    """The clearest period of what a model leaves; None where none is confirmed.

    Args:
        program: program of the campaign.
        fit: model.
    """
    best: tuple[float, float, _Course] | None = None
    for course in _courses(program, fit):
        found = _clearest(course)
        if found is not None and (best is None or found[0] < best[0]):
            best = (*found, course)
    if best is None:
        return None
    _, frequency, course = best
    second = course.halves[1]
    p_value = float(_chances(second, np.array([frequency]), _apart(second))[0])
    if not p_value <= SCORE_TEST.level:
        return None
    whole = [
        _Part(np.concatenate([one.x, other.x]), np.concatenate([one.misfit, other.misfit]))
        for one, other in zip(*course.halves, strict=True)
    ]
    near = frequency + np.linspace(-0.5, 0.5, 101) * _apart(second)
    power = _power(whole, near)
    rows, k = sum(len(part.x) for part in whole), int(np.argmax(power))
    amplitude = 2.0 * np.sqrt(power[k] / rows) * course.sigma
    return Repeats(course.quantity, course.driver, float(1.0 / near[k]), float(amplitude), p_value)


def _clearest(course: _Course) -> tuple[float, float] | None:
    """P-value and frequency of the clearest period in first halves; None where none could be resolved."""
    parts = course.halves[0]
    step = 1.0 / (4.0 * max(part.span for part in parts))
    resolved = (max(PLACE.beside) + 1) * _apart(parts)  # below, the trend that was taken off leaves no power
    most = min(len(part.x) / (2.0 * part.span) for part in parts)
    # At one period a row even a trend seems to repeat; rows of several passes lie between those of one.
    most = min(most, *(1.0 / np.median(np.abs(np.diff(part.x))) - resolved for part in parts))
    frequencies = np.arange(max(1.0 / course.longest, resolved), most, step)
    if not len(frequencies):
        return None
    chances = _chances(parts, frequencies, _apart(parts))
    k = int(np.argmin(chances))
    return float(chances[k]), float(frequencies[k])


def _apart(parts: list[_Part]) -> float:
    """Distance of frequencies that every recording resolves."""
    return 1.0 / min(part.span for part in parts)


def _chances(parts: list[_Part], frequencies: np.ndarray, apart: float) -> np.ndarray:
    """P-values of the power at frequencies, beside the mean power on both sides, shape (frequencies,)."""
    beside = np.array([sign * j for j in PLACE.beside for sign in (-1, 1)]) * apart
    around = frequencies[:, None] + beside
    background = _power(parts, around.ravel()).reshape(around.shape).mean(1)
    ratio = _power(parts, frequencies) / np.maximum(background, np.finfo(float).tiny)
    return stats.f.sf(ratio, 2 * len(parts), 2 * len(parts) * len(beside))


def _power(parts: list[_Part], frequencies: np.ndarray) -> np.ndarray:
    """Power of the misfit, summed over recordings: 1 for each from white noise, shape (frequencies,)."""
    total = np.zeros(len(frequencies))
    for part in parts:
        phases = np.exp(-2j * np.pi * frequencies[:, None] * part.x)
        total += np.abs(phases @ part.misfit) ** 2 / len(part.x)
    return total


def _courses(program: Program, fit: Fit) -> Iterator[_Course]:
    """The misfit of every output along time and along every drive."""
    every = drivers_of(program, fit)
    outputs = {channel.quantity for channels in program.channels for channel in channels}
    drives = {
        name: np.nan_to_num(x)
        for name, x in every.items()
        if name not in {"time", *outputs} and not name.endswith("_rate") and not name.startswith("max_")
    }
    for quantity in sorted(outputs):
        misfit, sigma, there = _misfit(program, fit, quantity)
        if not there.any():
            continue
        usual = float(np.median(sigma[there]))
        moving = {name: x for name, x in drives.items() if np.ptp(x[there]) > 0.0}
        for driver, along in {**moving, "time": every["time"]}.items():
            rest, others = misfit, [x for name, x in moving.items() if name != driver]
            for x in others:
                rest = rest - _with_drive(x, rest, there)
            parts = []
            for k, rows in _enough(there):
                turns = max((_turns(x[k][rows]) for x in others), default=0)
                parts.append((along[k][rows], rest[k][rows], np.ptp(along[k][rows]) / (turns + 1)))
            yield from _course(quantity, driver, parts, usual)


def _enough(there: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Recordings with rows for several stretches in each half, and these rows."""
    rows = [(k, np.flatnonzero(own)) for k, own in enumerate(there)]
    return [(k, own) for k, own in rows if len(own) >= 4 * PLACE.stretch]


def _course(
    quantity: str, driver: str, along: list[tuple[np.ndarray, np.ndarray, float]], sigma: float
) -> Iterator[_Course]:
    """Halves of recordings along a driver, without their trend; nothing where the driver hardly varies.

    Recordings that go less than half as far as the one that goes farthest resolve too little.
    """
    first, second, stretches = [], [], []
    spans = [min(np.ptp(own) for own in np.array_split(x, 2)) for x, _, _ in along]
    for (x, misfit, stretch), span in zip(along, spans, strict=True):
        if span <= 0.0 or span < 0.5 * max(spans):
            continue
        halves = zip(np.array_split(x, 2), np.array_split(misfit, 2), strict=True)
        one, other = (
            _Part(own, values - np.polynomial.Polynomial.fit(own, values, 2)(own)) for own, values in halves
        )
        first.append(one)
        second.append(other)
        stretches.append(stretch)
    if first:
        yield _Course(quantity, driver, (first, second), sigma, min(stretches) / PLACE.periods)


def _turns(drive: np.ndarray) -> int:
    """Number of turning points of a drive, of more than a tenth of its range."""
    least, turns, rising, extreme = 0.1 * np.ptp(drive), 0, 0, drive[0]
    for value in drive:
        if rising >= 0 and value > extreme or rising <= 0 and value < extreme:
            rising, extreme = (rising or int(np.sign(value - extreme))), value
        elif abs(value - extreme) > least:
            turns, rising, extreme = turns + 1, -rising, value
    return turns


def _with_drive(drive: np.ndarray, misfit: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Mean misfit at a value and direction of a drive, (recordings, rows)."""
    rising = np.gradient(drive, axis=1) > 0.0
    edges = np.unique(np.quantile(drive[there], np.linspace(0.0, 1.0, PLACE.bins + 1)))
    place = np.clip(np.searchsorted(edges, drive, side="right") - 1, 0, max(len(edges) - 2, 0)) * 2 + rising
    count = np.bincount(place[there], minlength=place.max() + 1)
    mean = np.bincount(place[there], misfit[there], minlength=len(count)) / np.maximum(count, 1)
    return np.where(there, mean[place], 0.0)


def _misfit(program: Program, fit: Fit, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Misfit of an output in standard deviations, these, and where both count, (recordings, rows) each."""
    shape = len(program.recordings), program.stacked.mask.shape[1]
    misfit, sigma, there = np.zeros(shape), np.ones(shape), np.zeros(shape, bool)
    for k, channels in enumerate(program.channels):
        for j, channel in enumerate(channels):
            if channel.quantity == quantity:
                rows = slice(0, len(channel.measured))
                error = channel.measured - fit.evaluation.predicted[k][j]
                counts = np.isfinite(channel.sigma) & np.isfinite(error)
                there[k, rows], sigma[k, rows] = counts, np.where(counts, channel.sigma, 1.0)
                misfit[k, rows] = np.where(counts, error, 0.0) / sigma[k, rows]
    return misfit, sigma, there
