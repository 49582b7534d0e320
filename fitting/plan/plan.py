"""The plan of the first campaign on a spring of a new alloy, from expected information."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import pneusma_jax as pj
from fitting.calibrate.identifiability import identifiability
from fitting.calibrate.spring.reach import steps_of
from fitting.data.recordings import Recording
from fitting.inference.results import Result
from fitting.specimens.model_objects import geometry_of
from fitting.synthesise.spring import NOISE
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.units import from_si

from .candidates import HELD, LEG_ROWS, Candidate, candidates, courses, published_campaign
from .choose import WANTED, Choice, choose, covariances, expected_sd
from .information import Accuracy, information
from .knowledge import CONSTANTS, NOT_SEEN, Knowledge, knowledge_of
from .rates import HEATING_S, Rates, cooling_seconds, heating_seconds, minutes, rates_of

DRAWS = 8
"""Number of alloys over which a test's information is averaged, unless told otherwise."""
MOST_REPEATS = 3
"""Maximum number of repeats of one test."""
MISFIT = 0.02
"""Factor on force and contrast in resistance that the law itself is wrong by, unless told otherwise [1]."""
MOST_TESTS = 9
"""Maximum number of tests of the fit, repeats included, unless told otherwise."""
KNOWN = 0.25  # Maximum relative standard deviation of an identified constant


@dataclass(frozen=True)
class PlannedTest:
    """One test of the protocol.

    Attributes:
        candidate: chosen test.
        repeats: number of repeats.
        gain: information about the wanted constants from all repeats [nats].
        rate: rate of pulling, in spring strain [1/s].
        role: `fit` or `validation`.
        heating_s: duration of heating and cooling at constant length, in a test that does so [s].
    """

    candidate: Candidate
    repeats: int
    gain: float
    rate: float
    role: str = "fit"
    heating_s: float = HEATING_S

    @property
    def minutes(self) -> float:
        """Time of one repeat with its set-up [min]."""
        return minutes(self.candidate, self.rate, self.heating_s)

    @property
    def sampling_s(self) -> float:
        """Longest sampling interval that leaves enough samples on the shortest pull [s]."""
        shortest = min(self.candidate.strains) / self.rate
        return min(0.5, round(shortest / LEG_ROWS, 2))


@dataclass(frozen=True)
class Teller:
    """A test that determines a constant.

    Attributes:
        candidate: test.
        left: standard deviation of the constant after this test alone, in units of the prior's, median over
            alloys.
    """

    candidate: Candidate
    left: float


@dataclass(frozen=True)
class Plan(Result):
    """A protocol and its expected result.

    Attributes:
        knowledge: prior knowledge of the alloy before the first test.
        spring: spring at nominal constants.
        geometry: stated geometry by canonical key.
        steps: spring strains of the usual steps of its wire [1].
        tests: tests in order, the one for validation last.
        order: names of the single tests of the fit, repeats included, in the order of `sd`.
        sd: expected standard deviation after 0, 1, 2, ... tests in units of the prior's, median over alloys,
            shape (1 + tests, unknowns).
        published_sd: the same after the source's seven tests, shape (unknowns,).
        published_minutes: duration of those, at rates that hold their resistances [min].
        loose: sentences about constants that stay unknown after all tests, at the nominal alloy.
        wanted: constants that the tests were chosen for.
        noise: standard deviations of force [N] and resistance [ohm].
        misfit: assumed relative error of the law [1].
        tellers: tests that determine each constant best on their own, best first, by constant.
        cooling_s: time in which the fully heated wire cools in still air [s].
        lost: positions of held resistances of the tests that even their slow rate loses, see `Rates`.
    """

    knowledge: Knowledge
    spring: pj.Spring
    geometry: dict[str, Any]
    steps: tuple[float, ...]
    tests: list[PlannedTest]
    order: list[str]
    sd: np.ndarray
    published_sd: np.ndarray
    published_minutes: float
    loose: list[str]
    wanted: tuple[str, ...]
    noise: tuple[float, float]
    misfit: float
    tellers: dict[str, tuple["Teller", ...]]
    cooling_s: float
    lost: dict[float, bool]

    @property
    def minutes(self) -> float:
        """Duration of all tests with set-up [min]."""
        return sum(test.minutes * test.repeats for test in self.tests)

    def relative_sd(self, step: int = -1) -> dict[str, float]:
        """Expected standard deviation of each constant over its nominal magnitude, after some tests."""
        size = np.abs(self.knowledge.mean)
        return dict(zip(self.knowledge.names, self.sd[step] * self.knowledge.sd / size, strict=True))


def plan_campaign(
    alloy: str | Path | None = None,
    geometry: Mapping[str, Any] | None = None,
    *,
    tests: int = MOST_TESTS,
    wanted: Sequence[str] = WANTED,
    noise: Mapping[str, float] | None = None,
    misfit: float = MISFIT,
    draws: int = DRAWS,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Plan:
    """Plan the first campaign on a spring whose alloy is to be characterised.

    Args:
        alloy: table with priors; None for uncharacterised nitinol.
        geometry: geometry of the spring, keys of `[geometry]`; the source's where unstated.
        tests: maximum number of tests, without validation.
        wanted: constants that the tests are to determine.
        noise: standard deviations of `force_N` and `resistance_ohm`.
        misfit: error of the law itself, as a share of the force and of the contrast in resistance [1].
        draws: number of alloys in the expectation.
        seed: seed of their draw.
        progress: function that is called with a few words after each step.

    Raises:
        InputError: for tables, dimensions or names that cannot be used.
        RuntimeError: if float64 is off.
    """
    _check(tests, wanted, noise or {}, misfit, draws)
    stated = dict(geometry or {})
    dimensions = _dimensions(stated)
    prior = knowledge_of(alloy, float(dimensions.wire_diameter))
    spring = pj.Spring(dimensions, pj.Alloy(**prior.nominal, name=prior.table.name), dimensions.free_length)
    sigma = tuple({**NOISE, **(noise or {})}[key] for key in ("force_N", "resistance_ohm"))
    steps = steps_of(dimensions)
    pool, source = candidates(steps), published_campaign(steps)
    every = rates_of(spring, [*pool, *source], seed, sigma[1])
    rates, source_rates = every.values[: len(pool)], every.values[len(pool) :]
    heating = heating_seconds(spring)
    progress("rates")
    information_of = _informer(prior, prior.draws(draws, seed), dimensions, sigma, misfit)
    progress("alloys")
    table = np.stack([information_of(pool, r) for r in range(1, MOST_REPEATS + 1)], axis=2)
    progress("information")
    times = np.array([minutes(test, rate, heating) for test, rate in zip(pool, rates, strict=True)])
    chosen = choose(table, times, prior.names, wanted, tests)
    indices = [choice.index for choice in chosen]
    progress("choice")
    source_sd = expected_sd(information_of(source, 1)[:, :, None], range(len(source)))[-1]
    progress("comparison")
    protocol = _protocol(pool, rates, chosen, steps, heating)
    return Plan(
        knowledge=prior,
        spring=spring,
        geometry=stated,
        steps=steps,
        tests=protocol,
        order=[pool[index].name for index in indices],
        sd=np.median(expected_sd(table, indices), axis=1),
        published_sd=np.median(source_sd, axis=0),
        published_minutes=sum(minutes(t, rate) for t, rate in zip(source, source_rates, strict=True)),
        cooling_s=cooling_seconds(spring),
        lost=_lost(every, protocol),
        loose=_loose(prior, covariances(table, indices)[-1, 0]),
        wanted=tuple(wanted),
        noise=sigma,
        misfit=misfit,
        tellers=_tellers(table, pool, prior.names),
    )


def _informer(
    prior: Knowledge,
    alloys: Mapping[str, np.ndarray],
    dimensions: pj.SpringGeometry,
    sigma: tuple[float, ...],
    misfit: float,
) -> Callable[[Sequence[Candidate], int], np.ndarray]:
    """Function from tests and their number of repeats to their information, see `information`."""
    values = {name: as_array(np.asarray(column)) for name, column in alloys.items()}
    scale = as_array(np.asarray(prior.sd))

    def information_of(batch: Sequence[Candidate], repeats: int) -> np.ndarray:
        accuracy = Accuracy(*(np.asarray(x, float) for x in (sigma, misfit, repeats)))
        return np.asarray(information(values, prior.names, scale, dimensions, courses(batch), accuracy))

    return information_of


def _loose(prior: Knowledge, covariance: np.ndarray) -> list[str]:
    """Sentences about constants that the tests leave open.

    Args:
        prior: prior knowledge of the constants.
        covariance: expected covariance after the tests, in prior standard deviations.
    """
    units = [prior.table.quantities[name].unit for name in prior.names]
    factor = np.array([from_si(1.0, unit, difference=True) for unit in units])
    scale = factor * prior.sd
    entries = identifiability(prior.names, factor * prior.mean, covariance * np.outer(scale, scale))
    return [entry["text"] for entry in entries]


def _tellers(
    table: np.ndarray, pool: Sequence[Candidate], names: Sequence[str]
) -> dict[str, tuple[Teller, ...]]:
    """Best test of each kind of hold for every constant, by the remaining standard deviation after it alone.

    Args:
        table: information of each test, shape (alloys, tests, repeats, unknowns, unknowns).
        pool: candidate tests.
        names: names of the unknowns.
    """
    alone = np.stack([np.median(expected_sd(table, [k])[-1], axis=0) for k in range(len(pool))])
    found = {}
    for place, name in enumerate(names):
        best: dict[int, Teller] = {}
        for k in np.argsort(alone[:, place]):
            best.setdefault(pool[k].hold, Teller(pool[k], float(alone[k, place])))
        found[name] = tuple(best.values())
    return found


def _dimensions(stated: Mapping[str, Any]) -> pj.SpringGeometry:
    """Dimensions of a spring on a stand.

    Raises:
        InputError: if they are impossible.
    """
    geometry = geometry_of(Recording(name="spring", path=None, kind="spring", geometry=dict(stated)))
    names = ("wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length")
    try:
        return pj.SpringGeometry(*(getattr(geometry, name) for name in names))
    except ValueError as error:
        raise InputError(f"[geometry]: {error}") from None


def _protocol(
    pool: list[Candidate], rates: list[float], chosen: list[Choice], steps: tuple[float, ...], heating: float
) -> list[PlannedTest]:
    """Chosen tests with equal ones merged as repeats of the first, and last the one for validation."""
    indices = [choice.index for choice in chosen]
    tests = [
        PlannedTest(
            pool[index],
            indices.count(index),
            float(sum(choice.gain for choice in chosen if choice.index == index)),
            rates[index],
        )
        for index in dict.fromkeys(indices)
    ]
    return [replace(test, heating_s=heating) for test in (*tests, _validation(pool, rates, indices, steps))]


def _lost(rates: Rates, tests: list[PlannedTest]) -> dict[float, bool]:
    """Positions of held resistances of planned tests that even their slow rate loses."""
    held = {test.candidate.share for test in tests if test.candidate.hold == HELD}
    return {share: hot for share, hot in rates.lost.items() if share in held}


def _validation(
    pool: list[Candidate], rates: list[float], chosen: list[int], steps: tuple[float, ...]
) -> PlannedTest:
    """A stepwise test at a held resistance far from those of the fit."""
    used = [pool[index].share for index in chosen if pool[index].hold == HELD] or [0.0, 1.0]
    full = [k for k, test in enumerate(pool) if test.hold == HELD and test.strains == steps]
    best = max(full, key=lambda k: min(abs(pool[k].share - share) for share in used))
    return PlannedTest(pool[best], 1, 0.0, rates[best], "validation")


def _check(tests: int, wanted: Sequence[str], noise: Mapping[str, float], misfit: float, draws: int) -> None:
    if not 1 <= tests <= 50:
        raise InputError(f"--tests {tests}: must be 1 to 50")
    if not 1 <= draws <= 200:
        raise InputError(f"--draws {draws}: must be 1 to 200")
    if not 0.0 <= misfit < 1.0:
        raise InputError(f"--misfit {misfit:g}: is a share, such as 0.02")
    for name, value in noise.items():
        if name not in NOISE:
            raise InputError(f"--noise {name}: no such instrument, {nearest(name, NOISE)}")
        if not 0.0 < value < np.inf:
            raise InputError(f"--noise {name}={value:g}: must be more than 0")

    names = [name for name in CONSTANTS if name not in NOT_SEEN]
    for name in wanted:
        if name not in names:
            raise InputError(f"--for {name}: no constant that such tests show, {nearest(name, names)}")
