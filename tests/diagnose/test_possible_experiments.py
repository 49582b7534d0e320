"""No experiment is proposed that a laboratory cannot make: a specimen cools as fast as its surroundings let it."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.verdict import next_experiment
from fitting.diagnose.verdict.next_experiment import best_design, cooling_rates
from fitting.specimens.rows import Rows

TIME = np.linspace(0.0, 100.0, 51)
FAST, SLOW = np.interp(TIME, [0, 10, 100], [25, 95, 25]), np.interp(TIME, [0, 50, 100], [25, 95, 25])


def rows(time=TIME):
    return Rows(
        mask=np.ones((1, len(TIME)), bool), time=time[None], inputs={"pressure": 3e4 * np.sin(TIME / 50.0)[None]}, measured={},
        weight={}, base={}, extra={}, specimen=np.zeros(1),
    )  # fmt: skip


@pytest.mark.parametrize(("name", "values", "place"), [("temperature", SLOW, 0), ("xi0_2", 1.0 - (SLOW - 25.0) / 70.0, 1)])
def test_the_rate_of_cooling_follows_the_clock(name, values, place):
    rate = cooling_rates({name: values[None]}, rows())[0]
    assert rate[place] == pytest.approx(np.ptp(values) / 50.0, rel=0.05) and rate[1 - place] == 0.0
    faster = cooling_rates({name: values[None]}, rows(TIME / 10.0))[0]
    assert faster[place] == pytest.approx(10.0 * rate[place])


def test_noise_about_a_constant_temperature_and_heating_alone_are_no_cooling():
    noise = 22.0 + np.random.default_rng(1).normal(0.0, 0.3, len(TIME))
    for values in (noise, np.linspace(25.0, 95.0, len(TIME)) + noise - 22.0):
        assert np.all(cooling_rates({"temperature": values[None], "pressure": values[None]}, rows()) == 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_the_steepest_rise_is_that_of_all_pairs_of_rows(seed):
    """Rows may share a moment; the rise is then between rows of other moments."""
    rng = np.random.default_rng(seed)
    time = np.sort(rng.choice([rng.uniform(0.0, 9.0, 40), rng.integers(0, 9, 40).astype(float)]))
    values = np.cumsum(rng.normal(size=40)) if seed % 3 else np.round(rng.normal(size=40))
    half = 0.5 * np.max(values - np.minimum.accumulate(values))
    rise, apart = values[None, :] - values[:, None], time[None, :] - time[:, None]
    pairs = (rise >= half) & (apart > 0.0)
    expected = np.max(half / apart[pairs]) if pairs.any() else np.inf
    assert next_experiment._steepest_rise(time, values, 0.0) == expected
    assert next_experiment._steepest_rise(np.zeros(40), values, 0.0) == np.inf


@pytest.fixture
def proposed(monkeypatch):
    """The design for a recording whose temperature follows a course, where shorter repetitions tell more."""

    def found(temperature):
        def evaluate(u, columns, stacked):
            time = np.asarray(stacked.time)[0]
            turned = not np.array_equal(np.asarray(stacked.inputs["pressure"]), np.asarray(plain.inputs["pressure"]))
            course = temperature[::-1] if turned else temperature
            return SimpleNamespace(misfit=[0.0], drivers={"temperature": course[None]}, gain=10.0 / time[-1] + 0.05 * turned)

        plain = rows()
        fit = SimpleNamespace(
            u=0, free=np.zeros(0), evaluation=SimpleNamespace(drivers={"temperature": temperature[None]}, trajectories=None)
        )
        program = SimpleNamespace(
            stacked=plain, specimen=SimpleNamespace(loads="pressure"), recordings=[SimpleNamespace(name="a", kind="tube")],
            evaluate=evaluate,
        )  # fmt: skip
        return best_design(program, fit, fit)

    monkeypatch.setattr(next_experiment, "with_trajectories", lambda stacked, trajectories: stacked)
    monkeypatch.setattr(next_experiment, "_separation", lambda program, one, two, k, rival: one.gain)
    return found


def test_faster_cooling_than_any_recorded_is_not_proposed_and_that_is_said(proposed):
    """A reverse order is possible where heating was as slow as cooling; where it was fast, it is not."""
    design = proposed(SLOW)
    assert (design.change, design.impossible) == ("in the reverse order", "ten times faster")
    assert proposed(FAST).change not in ("ten times faster", "in the reverse order")


def test_a_faster_repetition_without_cooling_states_the_speed_that_it_needs(proposed):
    design = proposed(np.full(len(TIME), 22.0))
    assert design.change == "ten times faster" and not design.impossible
    assert design.demand == "if the stand reaches 6 kPa/s"
