"""Fractions behind noisy resistances of an actuator, as `pneusma simulate RECORDING` finds them."""

import numpy as np
import pytest

import pneusma_jax as pj
from benchmarks.core_answers import noisy_recording
from fitting.simulate import phases
from fitting.simulate.phases import fractions_behind

ROWS = 128
BODY = "pneusma2"


def _error(pressure_kPa: float, first: np.ndarray, second: np.ndarray, noise: float, heat: float) -> float:
    """Largest error of curvature where both fractions begin heated [1/m], of which noise is in resistances.

    Args:
        first, second: true fractions, shape (ROWS,).
        noise: of resistances [ohm].
        heat: heat of a cold spring where the search begins [1].
    """
    random, body, time = np.random.default_rng(9), pj.make_actuator(BODY), np.linspace(0.0, 120.0, ROWS)
    pressure = 1e3 * pressure_kPa * np.interp(time, [0.0, 12.0, 120.0], [0.0, 1.0, 1.0])
    history = pj.simulate_history(body, pressure, tuple(map(pj.MartensiteFraction, (first, second))))
    measured = {
        k: np.asarray(spring.resistance) + noise * random.normal(size=ROWS)
        for k, spring in enumerate(history.rows.springs)
    }
    begun = tuple(pj.MartensiteFraction(np.minimum(x, 1.0 - heat)) for x in (first, second))
    found = fractions_behind(body, time, pressure, measured, begun, body.fresh_states())
    again = pj.simulate_history(body, pressure, tuple(found))
    return float(np.sqrt(np.mean(np.asarray(again.rows.curvature - history.rows.curvature) ** 2)))


def _pulse(heat: float, *seconds: float) -> np.ndarray:
    """A fraction that falls by a heat and returns, between four times [s]; shape (ROWS,)."""
    return 1.0 - heat * np.interp(np.linspace(0.0, 120.0, ROWS), seconds, [0.0, 1.0, 1.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "number"),
    [
        pytest.param(35, 13, id="the row in which one spring has cooled and the other begins"),
        pytest.param(35, 19, id="a branch that is left where a whole spring is held cold"),
        pytest.param(39, 18, id="three rows at the begin of a slow heating"),
    ],
)
def test_no_row_ends_on_another_branch_than_the_truth(seed, number):
    """Searches that ended 4 to 12 1/m away, less likely than the truth by 5 to 600,000 nats."""
    body, time, pressure, true, read, _, _, camera = noisy_recording(seed, number)
    fresh = body.fresh_states()
    found = pj.simulate_history(body, pressure, tuple(read), fresh).rows
    measured = {k: np.asarray(given.value) for k, given in enumerate(read)}
    begun = tuple(pj.MartensiteFraction(np.nan_to_num(np.asarray(s.xi0), nan=1.0)) for s in found.springs)
    x = fractions_behind(body, time, pressure, measured, begun, fresh)
    again = pj.simulate_history(body, pressure, tuple(x), fresh).rows
    assert np.max(np.abs(np.asarray(again.curvature - true.curvature))) < 5.0 * camera


@pytest.mark.slow
def test_fractions_behind_noisy_resistances_stay_at_the_truth_where_cold_springs_have_several_branches():
    """At 44 kPa a search by full steps ended 8 1/m away, whether it began at the truth or not."""
    first, second = _pulse(0.9, 60.0, 72.0, 90.0, 100.0), _pulse(0.4, 15.0, 25.0, 40.0, 50.0)
    assert _error(44.0, first, second, 4e-4, heat=0.0) < 0.3


@pytest.mark.slow
def test_a_spring_that_is_cold_throughout_is_found_cold_from_the_branch_on_which_it_is_heated():
    """Beside the truth lies a branch on which the cold spring is heated by 0.05 and the other one hotter."""
    assert _error(44.0, np.ones(ROWS), _pulse(0.7, 15.0, 30.0, 105.0, 118.0), 3e-5, heat=0.05) < 0.1


def test_a_row_without_a_prediction_does_not_speak_for_its_fractions(monkeypatch):
    """A trial that fails in rows is less likely than one that explains them."""
    body, time = pj.make_actuator(BODY), np.linspace(0.0, 120.0, ROWS)
    pressure, fractions = np.full(ROWS, 1e4), np.stack([np.ones(ROWS), _pulse(0.7, 15.0, 30.0, 105.0, 118.0)], axis=1)
    given = tuple(pj.MartensiteFraction(x) for x in fractions.T)
    history = pj.simulate_history(body, pressure, given)
    read = np.stack([np.asarray(spring.resistance) for spring in history.rows.springs], axis=1)
    noise = np.full(2, 2e-4)
    readings = phases._Readings(body, time, pressure, given, body.fresh_states(), (0, 1), read, noise)
    cold = np.zeros((ROWS, 2), bool)
    explained = phases._smoothed(readings, fractions, cold).likelihood
    whole, failing = phases._predicted_resistances, 6

    def failed(*arguments):
        ohms, slope = map(np.array, whole(*arguments))
        ohms[40 : 40 + failing] = np.nan
        return ohms, slope

    monkeypatch.setattr(phases, "_predicted_resistances", failed)
    assert phases._smoothed(readings, fractions, cold).likelihood < explained - 0.4 * failing * phases.UNPREDICTED**2
