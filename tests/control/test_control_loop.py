"""The plant is the model's own history; a controller that knows its plant follows, one that does not goes astray."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.control.loop import Run
from fitting.control.plant import Plant
from fitting.control.sweep import all_effects, usual_loop


def run_of(curvature, wanted):
    time = np.arange(len(curvature)) * 1.0
    blank = np.zeros((len(curvature), 2))
    return Run(
        time,
        np.array(wanted),
        np.array(curvature),
        np.zeros(len(curvature)),
        np.array(wanted),
        blank,
        blank,
        blank,
        blank[:, 0] == 0,
    )


def test_errors_and_settling_times_are_counted_from_the_courses():
    run = run_of([0, 5, 12, 9, 10, 10, 10], [0, 10, 10, 10, 10, 10, 10])
    assert run.rmse() == pytest.approx(np.sqrt((25 + 4 + 1) / 7))
    assert run.rmse(since=3.0) == pytest.approx(0.5)
    assert run.settling(1.0, 7.0) == 3.0
    assert run_of([0, 5, 5, 5], [0, 10, 10, 10]).settling(1.0, 4.0) == float("inf")


@pytest.fixture(scope="module")
def body():
    body = pj.make_actuator("pneusma2")
    place = body.section.enclosed_centroid
    return body.with_loads(pj.TipForce(jnp.zeros(3), place))


@pytest.mark.slow
def test_the_plant_steps_as_a_history_goes(body):
    rows, bare = 12, body.with_loads()
    time, currents = np.arange(rows) * 0.5, np.linspace(0.0, 0.2, rows)
    effects = all_effects({"viscoelastic_relaxation": {"g_1": 0.3}, "wrap_friction": {"constant": 2e-4}})
    heat = (pj.Heating(np.zeros(rows)), pj.Heating(currents))
    history = pj.simulate_history(bare, np.full(rows, 20e3), heat, time=time, effects=effects)
    plant = Plant(bare, effects)
    memory, seen = plant.begin(jnp.asarray(20e3)), []
    for k in range(rows):
        interval = jnp.asarray(time[k] - time[max(k - 1, 0)])
        drive = jnp.asarray([0.0, currents[k]])
        memory, row = plant.step(memory, jnp.asarray(20e3), drive, jnp.asarray(time[k]), interval)
        seen.append(float(row.curvature))
    np.testing.assert_allclose(seen, np.asarray(history.rows.curvature), rtol=1e-7, atol=1e-9)


@pytest.mark.slow
def test_knowing_the_series_resistance_gives_control_back(body):
    whole = usual_loop()
    rows = whole.time < 40.0
    loop = dataclasses.replace(whole, time=whole.time[rows], wanted=whole.wanted[rows])
    nothing = Plant(body, all_effects({}))
    plant = Plant(body, all_effects({"series_resistance": {"ohms": 0.15}}))
    told = Plant(body, all_effects({"series_resistance": {"ohms": 0.15}}))
    good, bad, known = loop.run(nothing, nothing), loop.run(plant, nothing), loop.run(plant, told)
    assert good.rmse(10.0) < 1.0 and known.rmse(10.0) < 1.0
    assert bad.rmse(10.0) > 2.0 * known.rmse(10.0)
    assert np.max(good.currents) <= 0.4 and good.good.all()
