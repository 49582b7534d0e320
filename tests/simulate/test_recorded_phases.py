"""Fractions behind noisy resistances of an actuator, as `pneusma simulate RECORDING` finds them."""

import numpy as np

import pneusma_jax as pj
from fitting.simulate.phases import fractions_behind


def test_fractions_behind_noisy_resistances_stay_at_the_truth_where_cold_springs_have_several_branches():
    """At 44 kPa a search by full steps ended 8 1/m away, whether it began at the truth or not."""
    rows, random = 128, np.random.default_rng(9)
    body, time = pj.make_actuator("pneusma2"), np.linspace(0.0, 120.0, rows)
    pressure = 44e3 * np.interp(time, [0.0, 12.0, 120.0], [0.0, 1.0, 1.0])
    first = 1.0 - 0.9 * np.interp(time, [60.0, 72.0, 90.0, 100.0], [0.0, 1.0, 1.0, 0.0])
    second = 1.0 - 0.4 * np.interp(time, [15.0, 25.0, 40.0, 50.0], [0.0, 1.0, 1.0, 0.0])
    true = (pj.MartensiteFraction(first), pj.MartensiteFraction(second))
    history = pj.simulate_history(body, pressure, true)
    measured = {
        k: np.asarray(spring.resistance) + 4e-4 * random.normal(size=rows)
        for k, spring in enumerate(history.rows.springs)
    }
    found = fractions_behind(body, time, pressure, measured, true, body.fresh_states())
    again = pj.simulate_history(body, pressure, tuple(found))
    off = np.asarray(again.rows.curvature - history.rows.curvature)
    assert np.sqrt(np.mean(off**2)) < 0.3
