"""Period of what a model leaves: of a pump or a switched heater in time, of a machine's screw in its travel.

Periods are looked for along time and along the load. One is found in the first half of every recording and
confirmed in the second, at its frequency alone. The power there is compared with that at frequencies
beside it, which hold
whatever else is left (the F-test of D. J. Thomson, Proc. IEEE 70 (1982) 1055). What goes with pressure,
strain or heat repeats as often as these do. So what goes with them and their direction is taken off before a
period in time is looked for. Such a period fits several times between two of their turning points. An error
that repeats along the load has the same phase in all recordings. It repeats in time, too, while the load has
one rate; so the load comes first.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from pneusma_jax.late import Late

from ..evaluate.program import Program
from ..fit.refit import Fit
from ..settings import DEFAULT
from .locate import drivers_of, hats_at, misfit_of

stats = Late("scipy.stats")
CHANCE = DEFAULT.chance
PLACE = DEFAULT.place
SHARE = DEFAULT.share


@dataclass(frozen=True)
class Repeats:
    """A part of a misfit that repeats.

    Attributes:
        quantity: measured output that has it.
        driver: quantity along which it repeats.
        period: its period, in the unit of the driver, SI.
        amplitude: its amplitude, in the unit of the output, SI.
        p_value: probability that chance alone confirms a period as clearly in any of the courses [1]: the
            p-value of the confirmation times `tries`.
        tries: number of courses, each an output along one driver, in which a period was looked for.
        seconds: period in time, where it repeats along the load and in time; None where in one of them alone.
    """

    quantity: str
    driver: str
    period: float
    amplitude: float
    p_value: float
    tries: int = 1
    seconds: float | None = None


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

    @property
    def in_phase(self) -> bool:
        """True if a period has the same phase in all recordings; in time it begins anew in each."""
        return self.driver != "time"


def repeats_of(program: Program, fit: Fit) -> Repeats | None:
    """The clearest period of what a model leaves; None where none is confirmed.

    Args:
        program: program of the campaign.
        fit: model.
    """
    found = [(course, *_found(course)) for course in _courses(program, fit) if course is not None]
    tries = len(found)
    told = [
        Repeats(course.quantity, course.driver, *_refined(course, frequency), p_value * tries, tries)
        for course, frequency, p_value in found
        if p_value * tries <= CHANCE.period_level
    ]
    if not told:
        return None
    alike = 1.0 + SHARE.alike
    clearest = max(told, key=lambda one: one.amplitude * (1.0 if one.driver == "time" else alike))
    in_time = [one for one in told if one.driver == "time" and one.quantity == clearest.quantity]
    if clearest.driver != "time" and in_time and in_time[0].amplitude * alike > clearest.amplitude:
        return replace(clearest, seconds=in_time[0].period)
    return clearest


def _refined(course: _Course, frequency: float) -> tuple[float, float]:
    """Period near a frequency, and amplitude [SI], from whole recordings."""
    whole = [
        _Part(np.concatenate([one.x, other.x]), np.concatenate([one.misfit, other.misfit]))
        for one, other in zip(*course.halves, strict=True)
    ]
    near = frequency + np.linspace(-0.5, 0.5, 101) * _apart(course.halves[1], course.in_phase)
    power = _power(whole, near, course.in_phase)
    rows, k = sum(len(part.x) for part in whole), int(np.argmax(power))
    return float(1.0 / near[k]), float(2.0 * np.sqrt(power[k] / rows) * course.sigma)


def _found(course: _Course) -> tuple[float, float]:
    """Frequency of the clearest period in first halves, and its p-value in second ones; 1 where none could be
    resolved."""
    first, second = course.halves
    step = 1.0 / (4.0 * max(part.span for part in first))
    # Below, the trend that was taken off leaves no power.
    resolved = (max(PLACE.beside) + 2) * _apart(first, course.in_phase)
    most = min(_most(part, not course.in_phase, resolved) for part in first)
    frequencies = np.arange(max(1.0 / course.longest, resolved), most, step)
    if not len(frequencies):
        return 0.0, 1.0
    frequency = frequencies[[int(np.argmin(_chances(first, frequencies, course.in_phase)))]]
    return float(frequency[0]), float(_chances(second, frequency, course.in_phase)[0])


def _most(part: _Part, clock: bool, resolved: float) -> float:
    """Highest frequency that the values of a driver resolve; a clock may pause.

    Half of the range has values at least as close as the gap that counts. At one period a row even a trend
    seems to repeat.
    """
    if clock:
        return len(part.x) / (2.0 * part.span)
    gaps = np.sort(np.diff(np.sort(part.x)))
    gap = gaps[np.searchsorted(np.cumsum(gaps), 0.5 * part.span)]
    row = float(np.median(np.abs(np.diff(part.x))))
    return min(0.5 / gap, 1.0 / row - resolved if row > 0.0 else np.inf)


def _apart(parts: list[_Part], in_phase: bool) -> float:
    """Distance of frequencies that are resolved: by all recordings together, or by every one."""
    return 1.0 / (max if in_phase else min)(part.span for part in parts)


def _chances(parts: list[_Part], frequencies: np.ndarray, in_phase: bool) -> np.ndarray:
    """P-values of the power at frequencies, beside the mean power on both sides, shape (frequencies,).

    Recordings count alike, whatever the size of their misfit.
    """
    alike = [_Part(p.x, p.misfit / max(float(np.std(p.misfit)), np.finfo(float).tiny)) for p in parts]
    beside = np.array([sign * j for j in PLACE.beside for sign in (-1, 1)]) * _apart(parts, in_phase)
    around = frequencies[:, None] + beside
    background = _power(alike, around.ravel(), in_phase).reshape(around.shape).mean(1)
    ratio = _power(alike, frequencies, in_phase) / np.maximum(background, np.finfo(float).tiny)
    freedom = 2 if in_phase else 2 * len(parts)
    return stats.f.sf(ratio, freedom, freedom * len(beside))


def _power(parts: list[_Part], frequencies: np.ndarray, in_phase: bool) -> np.ndarray:
    """Power of the misfit, shape (frequencies,): of all recordings as one, or the sum of theirs."""
    found = np.empty(len(frequencies))
    for some in np.array_split(np.arange(len(frequencies)), len(frequencies) // 256 + 1):  # bounded memory
        sums = np.array([np.exp(-2j * np.pi * frequencies[some, None] * p.x) @ p.misfit for p in parts])
        rows = np.array([len(p.x) for p in parts])
        alone = np.sum(np.abs(sums) ** 2 / rows[:, None], axis=0)
        found[some] = np.abs(sums.sum(0)) ** 2 / rows.sum() if in_phase else alone
    return found


def _courses(program: Program, fit: Fit) -> Iterator[_Course | None]:
    """The misfit of every output along the load and along time; None where no period could be resolved."""
    every, loads = drivers_of(program, fit), program.specimen.loads
    outputs = {channel.quantity for channels in program.channels for channel in channels}
    drives = {
        name: np.nan_to_num(x)
        for name, x in every.items()
        if name not in {"time", *outputs} and not name.endswith("_rate") and not name.startswith("max_")
    }
    for quantity in sorted(outputs):
        misfit, there = misfit_of(program, fit, quantity)
        if not there.any():
            continue
        moving = {name: x for name, x in drives.items() if np.ptp(x[there]) > 0.0}
        usual = _usual_noise(program, quantity)
        if loads in moving:
            along = [(moving[loads][k][rows], misfit[k][rows]) for k, rows in _enough(there)]
            yield _course(quantity, loads, along, [np.ptp(x) for x, _ in along], usual)
        for x in moving.values():
            misfit = misfit - _with_drive(x, misfit, there)
        along = [(every["time"][k][rows], misfit[k][rows]) for k, rows in _enough(there)]
        stretches = []
        for k, rows in _enough(there):
            turns = [_turns(x[k][rows], 0.1 * float(np.ptp(x[there]))) for x in moving.values()]
            stretches.append(np.ptp(every["time"][k][rows]) / (max(turns, default=0) + 1))
        yield _course(quantity, "time", along, stretches, usual)


def _usual_noise(program: Program, quantity: str) -> float:
    """Median standard deviation of an output's noise, SI."""
    every = [c.sigma for channels in program.channels for c in channels if c.quantity == quantity]
    sigma = np.concatenate(every)
    return float(np.median(sigma[np.isfinite(sigma)]))


def _enough(there: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Recordings with rows for several stretches in each half, and these rows."""
    rows = [(k, np.flatnonzero(own)) for k, own in enumerate(there)]
    return [(k, own) for k, own in rows if len(own) >= 4 * PLACE.stretch]


def _course(
    quantity: str,
    driver: str,
    along: list[tuple[np.ndarray, np.ndarray]],
    stretches: list[float],
    sigma: float,
) -> _Course | None:
    """Halves of recordings along a driver, without their trend; None where the driver hardly varies.

    Recordings that go less than half as far as the one that goes farthest resolve too little. So do those
    with fewer values of the driver than a stretch has rows.
    """
    halves, kept, spans = [], [], []
    for (x, misfit), stretch in zip(along, stretches, strict=True):
        parts = list(zip(np.array_split(x, 2), np.array_split(misfit, 2), strict=True))
        if all(len(np.unique(own)) > PLACE.stretch for own, _ in parts):
            trends = [np.polynomial.Polynomial.fit(own, values, 2)(own) for own, values in parts]
            halves.append([_Part(own, y - trend) for (own, y), trend in zip(parts, trends, strict=True)])
            kept.append(stretch)
            spans.append(min(part.span for part in halves[-1]))
    used = [k for k in range(len(kept)) if kept[k] >= 0.5 * max(kept) and spans[k] >= 0.5 * max(spans)]
    if not used:
        return None
    first, second = ([halves[k][half] for k in used] for half in (0, 1))
    return _Course(quantity, driver, (first, second), sigma, min(kept[k] for k in used) / PLACE.periods)


def _turns(drive: np.ndarray, least: float) -> int:
    """Number of turning points of a drive, larger than `least`. Of one that moves in steps every row counts:
    what answers regular steps has all multiples of their frequency."""
    moves = np.abs(np.diff(drive))
    largest = np.sort(moves)[::-1][: len(moves) // 5]
    if np.ptp(drive) > least and largest.sum() > 0.8 * moves.sum():  # held most of the time
        moving = moves > 0.2 * largest[0]
        steps = int(np.sum(moving[1:] & ~moving[:-1]))
        return len(drive) if steps >= PLACE.periods else steps
    turns, rising, extreme = 0, 0, drive[0]
    for value in drive:
        if rising >= 0 and value > extreme or rising <= 0 and value < extreme:
            rising, extreme = (rising or int(np.sign(value - extreme))), value
        elif abs(value - extreme) > least:
            turns, rising, extreme = turns + 1, -rising, value
    return turns


def _with_drive(drive: np.ndarray, misfit: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Misfit that goes with a drive and its direction, piecewise linear, (recordings, rows)."""
    x, rising = drive[there], (np.gradient(drive, axis=1) > 0.0)[there]
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, PLACE.bins + 1)))
    hats = hats_at(x, knots).T
    basis = np.concatenate([hats * rising[:, None], hats * ~rising[:, None]], axis=1)
    found = np.zeros_like(misfit)
    found[there] = basis @ np.linalg.lstsq(basis, misfit[there], rcond=None)[0]
    return found
