"""White noise along channels: as large as stated, new at every point, and picked by one input."""

import numpy as np
import pytest
from study_texts import tube_study

import pneusma_jax as pj
from fitting.propagate import build_problem, propagate, read_study
from fitting.propagate.responses import NOISE
from fitting.propagate.responses.noise import WhiteNoise, noise_of

TUBE = tube_study(9, "[noise]\npressure_kPa = 0.2\n[sampling]\nrows = 2000")


@pytest.fixture(scope="module")
def tube(tmp_path_factory):
    pj.enable_float64()
    folder = tmp_path_factory.mktemp("noise")
    path = folder / "study.toml"
    path.write_text(TUBE)
    return propagate(path, folder / "out")


def test_noise_of_an_input_moves_the_output_by_its_slope(tube):
    problem = tube.problem
    assert problem.inputs.names == (NOISE,)
    pressure, length = problem.columns.driver.values, problem.nominal
    rising = slice(1, int(np.argmax(pressure)))
    slope = np.gradient(length[: rising.stop + 1], pressure[: rising.stop + 1])[rising]
    np.testing.assert_allclose(tube.moments.sd[rising], 0.2 * slope, rtol=0.1)
    standard_error = tube.moments.sd[rising] / np.sqrt(2000)
    assert np.all(np.abs(tube.moments.mean[rising] - length[rising]) < 4.0 * standard_error + 2e-3)


def test_each_point_has_noise_of_its_own_and_a_number_always_the_same(tube):
    numbers = np.random.default_rng(0).random((1000, 1))
    rows, again = tube.problem.evaluator(numbers)[0], tube.problem.evaluator(numbers[::-1])[0][::-1]
    np.testing.assert_array_equal(rows, again)
    correlation = np.corrcoef(rows[:, 1:-1], rowvar=False)
    assert np.max(np.abs(correlation - np.eye(len(correlation)))) < 4.5 / np.sqrt(1000)
    without = tube.problem.evaluator(np.full((1, 1), -1.0))[0]
    np.testing.assert_array_equal(without[0], tube.nominal)


def test_fractions_stay_fractions_and_channels_differ():
    noise = noise_of({"xi0_2": 0.5, "pressure_kPa": 1.0}, {"pressure": "kPa", "xi0_2": "1"}, "study")
    assert noise == WhiteNoise({"xi0_2": 0.5, "pressure": 1000.0})
    given = {"pressure": np.zeros(4000), "xi0_2": np.full(4000, 0.5)}
    found = noise.on(given, {NOISE: np.float64(0.3)})
    assert 0.0 == found["xi0_2"].min() and found["xi0_2"].max() == 1.0
    assert np.std(found["pressure"]) == pytest.approx(1000.0, rel=0.05)
    inside = (found["xi0_2"] > 0.0) & (found["xi0_2"] < 1.0)
    assert abs(np.corrcoef(found["pressure"][inside], found["xi0_2"][inside])[0, 1]) < 0.1
    assert noise.on(given, {})["pressure"] is given["pressure"], "a model without noise is untouched"


@pytest.mark.slow
def test_noise_along_a_driver_has_an_index_of_its_own(write, tmp_path):
    text = """
schema = "pneusma-study/1"
[model]
through = "state"
design = "pneusma2"
pressure_kPa = {from = 10.0, to = 40.0, points = 4}
xi0_2 = 0.4
[noise]
pressure_kPa = 0.5
[input]
G_m = {mean = 3.0, sd = 0.1, unit = "GPa"}
[[output]]
name = "curvature_1pm"
[sampling]
rows = 8000
[indices]
"""
    problem = build_problem(read_study(write(text)))
    assert set(problem.inputs.names) == {"G_m", NOISE}
    result = propagate(problem, tmp_path / "out")
    first, half = result.summary.indices.estimates()["first"]
    total = result.summary.indices.estimates()["total"][0]
    assert np.all(first[:, 2:] > 0.01) and np.all(np.abs(first.sum(axis=0) - 1.0)[2:] < 0.15)
    assert np.all(total > -0.05) and np.all(half < 0.2)
