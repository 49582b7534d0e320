"""Choice of the rate of pulling: the fastest at which a controller still holds a spring's resistance."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

import pneusma_jax as pj
from fitting.synthesise.controller import (
    HOT_KELVIN,
    HOT_WIDTHS,
    TRICKLE,
    build_stand,
    rest_resistances,
    run_stand,
    steps_of,
    travel_profile,
)
from fitting.synthesise.spring import COLD_WIDTHS
from pneusma_jax.nitinol.thermal import time_constant
from pneusma_jax.program_cache import stored_jit

from .candidates import HEATED, HELD, Candidate
from .information import held_phase

SECONDS = (4.0, 8.0, 16.0, 32.0)  # Candidate durations of a pull to the first step
LOST = 0.02  # Maximum error of a held resistance, as part of the contrast at rest
MOST_LOST = 0.1  # Maximum share of the time with a larger error
REST_S = 20.0
READ_S = 0.5  # Interval between the judged readings
SETUP_MIN = 5.0  # Time to mount, cool and settle a spring before a test
HEATING_S = 120.0  # Minimum duration of heating and cooling at constant length
COOLED_WIDTHS = 5.0
"""Distance below the middle of the transformation at which a wire is wholly martensitic, in its widths."""


class Rates(NamedTuple):
    """Rates of tests.

    Attributes:
        values: spring strain per second for each test.
        lost: positions of held resistances that even the slowest candidate rate loses. True where still air
            does not cool the wire as fast as the pull asks for, false where the supply does not heat it so.
    """

    values: list[float]
    lost: dict[float, bool]


class _Held(NamedTuple):
    """Fastest rate at which a resistance is held, or None; whether the wire is too hot where the slowest one
    loses it."""

    rate: float | None
    too_hot: bool


def minutes(test: Candidate, rate: float, heating_s: float = HEATING_S) -> float:
    """Duration of a test with its set-up [min], at a rate in spring strain per second.

    Args:
        test: the test.
        rate: its rate.
        heating_s: duration of heating and cooling at constant length, see `heating_seconds`.
    """
    travel = 2.0 * sum(test.strains) / rate
    return SETUP_MIN + (travel + (heating_s if test.hold == HEATED else 0.0)) / 60.0


def cooling_seconds(spring: pj.Spring) -> float:
    """Time in which a fully heated wire cools in still air until it is wholly martensitic [s].

    Nobody can drive a wire colder than its surroundings let it cool: the excess temperature falls by its time
    constant.
    """
    width = float(spring.alloy.T_width)
    hot = (HOT_WIDTHS + COLD_WIDTHS) * width + HOT_KELVIN
    cold = max(COLD_WIDTHS - COOLED_WIDTHS, 1.0) * width
    return float(time_constant(spring.alloy, spring.geometry)) * float(np.log(hot / cold))


def heating_seconds(spring: pj.Spring) -> float:
    """Duration of heating and cooling at constant length, half of it for cooling [s]."""
    return max(HEATING_S, 2.0 * cooling_seconds(spring))


def choose_rates(spring: pj.Spring, tests: Sequence[Candidate], seed: int, read_noise: float) -> list[float]:
    """The values of `rates_of`."""
    return rates_of(spring, tests, seed, read_noise).values


def rates_of(spring: pj.Spring, tests: Sequence[Candidate], seed: int, read_noise: float) -> Rates:
    """Spring strain per second for each test, and the held resistances that no candidate rate holds.

    Tests that hold a resistance get the fastest rate at which it is held wherever heating can hold it. A
    simulation of controller and heat balance over the longest of them decides. The others get the median of
    these rates.

    Args:
        spring: spring with its presumed constants.
        tests: candidate tests.
        seed: seed of the controller's readings.
        read_noise: standard deviation of these readings [ohm].
    """
    held_tests = [test for test in tests if test.hold == HELD]
    shares = sorted({test.share for test in held_tests})
    longest = [max((t for t in held_tests if t.share == share), key=_travel) for share in shares]
    found = _held_rates(spring, longest, seed, read_noise)
    slowest = _rates(tests)[-1]
    rates = {share: held.rate or slowest for share, held in zip(shares, found, strict=True)}
    usual = float(np.median(list(rates.values()))) if rates else _rates(tests)[1]
    values = [rates[test.share] if test.hold == HELD else usual for test in tests]
    lost = {share: held.too_hot for share, held in zip(shares, found, strict=True) if held.rate is None}
    return Rates(values, lost)


def _rates(tests: Sequence[Candidate]) -> list[float]:
    """Candidate rates, the fastest first [1/s]."""
    first = min(strain for test in tests for strain in test.strains)
    return [first / seconds for seconds in SECONDS]


def _travel(test: Candidate) -> float:
    return sum(test.strains)


def _held_rates(
    spring: pj.Spring, tests: list[Candidate], seed: int, read_noise: float
) -> list[_Held]:
    """Fastest rate at which the resistance of each test is held."""
    if not tests:
        return []
    free = float(spring.geometry.free_length)
    ambient = float(spring.alloy.T_mid) - COLD_WIDTHS * float(spring.alloy.T_width)
    cold, hot = rest_resistances(spring)
    speeds = _rates(tests)
    cases = [(test, rate) for test in tests for rate in speeds]
    travels = [
        travel_profile(free * np.asarray(t.strains), REST_S, np.asarray(t.strains) / rate)
        for t, rate in cases
    ]
    longest = max(map(len, travels))
    elongation = np.stack([np.pad(travel, (0, longest - len(travel))) for travel in travels])
    setpoints = np.array([hot + test.share * (cold - hot) for test, _ in cases])
    limits = np.tile([TRICKLE, 1.0], (len(cases), 1))
    noise = np.random.default_rng(seed).standard_normal((len(tests), longest)).repeat(len(speeds), axis=0)
    stand = build_stand(spring, ambient, read_noise)
    resistance = run_stand(stand, elongation, setpoints, limits, noise).resistance
    rows = slice(steps_of(REST_S), None, steps_of(READ_S))
    share = np.array([test.share for test, _ in cases])
    ideal = np.asarray(_ideal_phase(spring, elongation[:, rows], share))
    in_test = np.arange(longest)[rows] < np.array([len(travel) for travel in travels])[:, None]
    possible = in_test & (ideal > 0.0) & (ideal < 1.0)
    error = (np.asarray(resistance)[:, rows] - setpoints[:, None]) / (cold - hot)
    lost = np.sum(possible & (np.abs(error) > LOST), axis=1) / np.maximum(possible.sum(axis=1), 1)
    good = (lost <= MOST_LOST).reshape(len(tests), len(speeds))
    too_hot = np.sum(possible & (error < -LOST), axis=1) > np.sum(possible & (error > LOST), axis=1)
    found = zip(good, too_hot.reshape(good.shape)[:, -1], strict=True)
    return [
        _Held(next((v for v, ok in zip(speeds, row, strict=True) if ok), None), bool(hot))
        for row, hot in found
    ]


@stored_jit()
def _ideal_phase(spring: pj.Spring, elongation: jax.Array, share: jax.Array) -> jax.Array:
    """Martensite fraction that would hold the resistance, 0 or 1 where none does, shape (cases, rows)."""
    return jax.vmap(lambda x, s: held_phase(spring.alloy, spring.shear_strain(x), s))(elongation, share)
