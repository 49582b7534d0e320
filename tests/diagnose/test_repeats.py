"""A misfit that repeats: its period along time or load is found in one half of the rows, confirmed in the other."""

import numpy as np
import pytest
from linear_world import CONSTANT, World, fast

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict import repeats
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.repeats import repeats_of
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.report.diagnosis.payload import content

ROWS = 240


def judged(seed, extra=lambda drivers: 0.0, loads=None):
    """The base model of a campaign with something more, in standard deviations of the noise, by its drivers."""
    made = fast(recordings=3, rows=ROWS, effects=(CONSTANT,))
    if loads is not None:
        made = type("Loaded", (World,), {"drivers": {"pressure": np.tile(loads, (3, 1))}})(made.base, made.effects)
    y = made.truth(np.random.default_rng(seed))
    return base_fit(made.program(y + extra({**made.drivers, "time": clock(made)})))


def clock(made):
    return np.asarray(made.program(made.truth(np.random.default_rng(0))).stacked.time)[:3]


@pytest.mark.parametrize("period", [5.3, 11.0])
def test_a_ripple_in_time_is_found_with_its_period_and_amplitude(period):
    """Its phase is another in every recording."""
    phases = np.array([0.0, 1.1, 2.9])[:, None]
    found = repeats_of(*judged(1, lambda d: 2.0 * np.sin(2.0 * np.pi * d["time"] / period + phases)))
    assert found.driver == "time" and found.period == pytest.approx(period, rel=5e-3) and found.p_value < 1e-3
    assert found.amplitude == pytest.approx(2.0 * unit(), rel=0.15)


def unit():
    """Standard deviation of the noise of the world, SI."""
    program, _ = judged(1)
    return float(np.median(program.channels[0][0].sigma))


def test_an_error_of_a_screw_is_found_along_the_load():
    found = repeats_of(*judged(2, lambda d: 2.0 * np.sin(2.0 * np.pi * d["pressure"] / 130.0)))
    assert found.driver == "pressure" and found.period == pytest.approx(130.0, rel=0.02)


@pytest.mark.parametrize(
    "extra",
    [
        lambda d: 0.0,
        lambda d: 4.0 * (d["pressure"] > 700.0),
        lambda d: 4.0 * (np.gradient(d["pressure"], axis=1) > 0.0),
        lambda d: 6.0 * np.exp(-d["time"] / 40.0),
        lambda d: 8.0 * (d["time"] > 0.55 * d["time"].max()),
        lambda d: 5.0 * (d["time"] > 0.6 * d["time"].max()),
        lambda d: np.cumsum(np.random.default_rng(9).standard_normal(d["time"].shape), axis=1) * 0.4,
    ],
    ids=["noise", "threshold", "branch", "decay", "slip", "jump", "walk"],
)
def test_what_does_not_repeat_or_goes_with_the_load_has_no_period(extra):
    found = [repeats_of(*judged(seed, extra)) for seed in range(3, 7)]
    assert not any(one is not None for one in found)  # at a level of one in a thousand


def steps(count):
    """A load that moves in steps, up and down."""
    return np.repeat(np.r_[0 : count // 2, count // 2 : 0 : -1], ROWS // count + 1)[:ROWS] * 100.0


TRIANGLES = 1000.0 * (1.0 - np.abs((np.arange(ROWS) / 60.0 % 1.0) * 2.0 - 1.0))


@pytest.mark.parametrize(
    ("loads", "extra"),
    [
        (TRIANGLES, lambda d: 20.0 * (d["pressure"] / 1e3) ** 3),
        (TRIANGLES, lambda d: 10.0 * np.tanh(d["pressure"] / 200.0) * (np.gradient(d["pressure"], axis=1) > 0.0)),
        (steps(12), lambda d: 20.0 * (d["pressure"] / 600.0) ** 4),
        (steps(12), lambda d: 8.0 * np.exp(-(d["time"] % (d["time"][0, 1] * (ROWS // 12 + 1))) / 5.0)),
        (np.where(np.arange(ROWS) // 30 % 2 == 0, 100.0, 900.0), lambda d: 5.0 * (d["pressure"] > 500.0)),
        (np.full(ROWS, 300.0), lambda d: 0.0),
    ],
    ids=["cubic", "one branch", "staircase", "relaxing steps", "switched", "held"],
)
def test_what_goes_with_the_load_has_no_period_however_the_load_moves(loads, extra):
    found = [repeats_of(*judged(seed, extra, loads)) for seed in range(3, 6)]
    assert not any(one is not None for one in found)


def test_a_period_is_found_beside_a_recording_with_far_more_misfit():
    sizes = np.array([1.0, 1.0, 12.0])[:, None]
    noise = np.random.default_rng(5).standard_normal((3, ROWS)) * (sizes - 1.0)
    found = repeats_of(*judged(6, lambda d: 3.0 * sizes * np.sin(2.0 * np.pi * d["time"] / 11.0) + noise))
    assert found.driver == "time" and found.period == pytest.approx(11.0, rel=0.01)


@pytest.mark.parametrize(("driver", "period"), [("time", 11.0), ("pressure", 130.0)])
def test_a_verdict_tells_the_period_and_models_it_where_its_phase_is_known(driver, period):
    """A period of time begins anew in each recording. One of the load is a function of it, and predicts."""
    made = fast(recordings=3, rows=ROWS, effects=(CONSTANT,))
    x = {**made.drivers, "time": clock(made)}[driver]
    phases = np.array([0.0, 1.1, 2.9])[:, None] * (driver == "time")
    y = made.truth(np.random.default_rng(4)) + 4.0 * np.sin(2.0 * np.pi * x / period + phases)
    conclusion = conclude(explain(made.program(y), np.random.default_rng(1)))
    assert [f.slug for f in conclusion.found] == ["unmodelled"]
    [told] = [s for s in verdict_sentences(conclusion) if "repeats every" in s]
    assert ("of pressure" in told) == (driver == "pressure") and ("a pump" in told) == (driver == "time")
    assert content(conclusion)["repeats"]["driver"] == driver
    (chance,) = [s for s in verdict_sentences(conclusion) if s.startswith("Chance alone would confirm so clear")]
    assert chance.endswith("counted over 2 searches along time and the load.")
    assert content(conclusion)["repeats"]["p_value"] <= 1e-3
    left = conclusion.after.reduced_chi2 / conclusion.before.reduced_chi2
    assert left < 0.5 if driver == "pressure" else left > 0.8


def test_the_probability_of_a_period_counts_every_search():
    """Chance has as many tries as there are outputs and drivers."""
    judgement = judged(1, lambda d: 2.0 * np.sin(2.0 * np.pi * d["time"] / 11.0))
    courses = list(repeats._courses(*judgement))
    found = repeats_of(*judgement)
    assert found.tries == len([c for c in courses if c is not None]) > 1
    (alone,) = [repeats._found(c)[1] for c in courses if c is not None and c.driver == "time"]
    assert found.p_value == pytest.approx(found.tries * alone)


@pytest.mark.slow
def test_noise_has_a_period_no_more_often_than_the_level_of_the_test():
    found = [repeats_of(*judged(seed)) for seed in range(100, 300)]
    assert sum(one is not None for one in found) <= 1
