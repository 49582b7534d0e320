"""The smoother behind a noisy resistance."""

import numpy as np
import pytest

import pneusma_jax as pj
from fitting.inference.latent_trajectory.denoise import denoised, martensite_fraction, smooth_walk

ROWS = 300
"""Number of readings, the same in most tests, since programs are compiled anew for every number."""


@pytest.fixture(scope="module")
def spring():
    return pj.Spring(pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3), pj.load_alloy("krl35"), 14e-3)


def _measured(spring, xi0, noise, seed=0):
    time = 0.5 * np.arange(len(xi0))
    gamma = 0.03 + 0.05 * np.abs(np.sin(time / 15.0))
    ohms = np.asarray(spring.alloy.resistivity(xi0, gamma) * spring.geometry.wire_length)
    return time, ohms + noise * np.random.default_rng(seed).standard_normal(len(xi0)), gamma


@pytest.mark.parametrize("level", [1.0, 0.7, 0.3])
def test_a_steady_fraction_is_found_far_below_the_noise_of_samples(spring, level):
    xi0 = np.full(ROWS, level)
    time, ohms, gamma = _measured(spring, xi0, 2e-4)
    single = np.asarray(pj.Resistance(ohms).read(spring.alloy, gamma, spring.geometry.wire_length).xi0)
    error = np.abs(martensite_fraction(spring, time, ohms, gamma) - xi0).max()
    assert error < 0.05 * np.abs(single - xi0).max() and error < 5e-3


def test_heating_and_cooling_are_followed(spring):
    time = 0.5 * np.arange(ROWS)
    xi0 = 1.0 - 0.6 * np.clip((time - 20.0) / 30.0, 0.0, 1.0) + 0.4 * np.clip((time - 90.0) / 20.0, 0.0, 1.0)
    time, ohms, gamma = _measured(spring, xi0, 2e-4)
    assert np.abs(martensite_fraction(spring, time, ohms, gamma) - xi0).max() < 0.02


def test_exact_resistance_gives_the_exact_fraction(spring):
    xi0 = np.linspace(0.9, 0.5, ROWS)
    time, ohms, gamma = _measured(spring, xi0, 0.0)
    assert martensite_fraction(spring, time, ohms, gamma) == pytest.approx(xi0, abs=5e-4)


def test_a_jump_that_no_wire_can_make_is_read_sample_by_sample(spring):
    time = 0.5 * np.arange(600)
    xi0 = np.where((time > 100.0) & (time < 200.0), 0.3, 1.0)
    gamma = np.full(600, 0.084)
    ohms = np.asarray(spring.alloy.resistivity(xi0, gamma) * spring.geometry.wire_length)
    ohms = ohms + 2e-4 * np.random.default_rng(0).standard_normal(600)
    assert np.abs(martensite_fraction(spring, time, ohms, gamma) - xi0).max() < 0.05


def test_missing_samples_are_bridged(spring):
    time, ohms, gamma = _measured(spring, np.full(ROWS + 3, 0.8), 1e-4)
    ohms[10:13] = np.nan  # as many are left as elsewhere
    found = martensite_fraction(spring, time, ohms, gamma)
    assert found == pytest.approx(np.full(ROWS + 3, 0.8), abs=1e-3)
    assert np.all(np.isnan(martensite_fraction(spring, time, np.full(ROWS + 3, np.nan), gamma)))


def test_equal_readings_of_a_constant_average():
    rng = np.random.default_rng(3)
    values = 15.0 + 0.05 * rng.standard_normal(400)
    smooth = denoised(np.arange(400.0), values)
    assert np.abs(smooth - values.mean()).max() < 0.02
    assert denoised(np.arange(5.0), np.full(5, 2.0)) == pytest.approx(np.full(5, 2.0))


def test_a_precise_reading_weighs_more():
    mean = smooth_walk(np.arange(3.0), np.array([0.0, 1.0, 0.0]), np.array([1.0, 1e6, 1.0]))
    assert mean[1] == pytest.approx(1.0, abs=1e-3)


def test_steps_are_no_noise_where_their_size_is_known_within_a_factor():
    """A walk with few large steps, which hot rows hardly show, had become one constant."""
    fraction = np.r_[0.976, 0.976, 0.975, 0.967, 0.55, 0.28, np.full(8, 0.24), 0.6, 0.91, 0.954, 0.966, np.full(12, 0.972)]
    slope = np.r_[np.full(4, 0.47), 0.32, np.full(9, 0.08), 0.44, np.full(15, 1.24)]  # ohm
    values = fraction + 1.5e-4 / slope * np.random.default_rng(0).standard_normal(30)
    time, precision = 3.0 * np.arange(30), (slope / 1.5e-4) ** 2
    for stated in (0.2, 1.0, 3.0):
        assert np.abs(smooth_walk(time, values, precision / stated**2, (0.2, 5.0)) - fraction).max() < 0.01
    assert np.abs(smooth_walk(time, values, precision) - fraction).max() > 0.5


def test_known_noise_about_a_constant_is_averaged():
    values = 0.5 + 0.01 * np.random.default_rng(0).standard_normal(100)
    for stated in (0.2, 1.0, 3.0):
        found = smooth_walk(np.arange(100.0), values, np.full(100, 1e4 / stated**2), (0.2, 5.0))
        assert np.abs(found - 0.5).max() < 0.003
