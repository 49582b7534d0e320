"""Martensite fraction of a spring on a stand from its noisy resistance, as `pneusma simulate RECORDING` finds it."""

import numpy as np
import pytest

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.simulate import predict
from fitting.specimens.saved_models import AugmentedModel, add_effect
from pneusma_jax.effects import find_effect

SIZES = (0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
NOISE, LEAD = 2e-4, 0.12
"""Noise of resistances, and the resistance of the leads [ohm]."""


def recorded(xi0: float, lead: float = 0.0, noise: float = NOISE, rows: int = 121) -> tuple[Recording, np.ndarray]:
    """Two pulls of a spring of this fraction with noisy resistances, and the true force [N]."""
    spring = pj.Spring(pj.SpringGeometry(*SIZES), pj.load_alloy("krl35"), SIZES[-1])
    time = np.linspace(0.0, 120.0, rows)
    x = 0.05 * np.interp(time, [0, 20, 40, 80, 120], [0, 0.5, 0, 1, 0])
    made = pj.simulate_spring(spring, x, pj.MartensiteFraction(np.broadcast_to(xi0, x.shape))).rows
    ohms = np.asarray(made.resistance) + lead + noise * np.random.default_rng(3).normal(size=x.size)
    force = np.asarray(made.force)
    columns = {"time_s": time, "elongation_mm": 1e3 * x, "force_N": force, "resistance_ohm": ohms}
    stated = {"resistance_ohm": noise, "force_N": 0.004}
    geometry = {"alloy": "krl35", "free_length_mm": 14.0}
    recording = Recording("s", None, "spring", specimen="S", geometry=geometry, columns=columns, noise=stated)
    return recording, force


@pytest.mark.parametrize("xi0", [0.0, 1.0])
def test_a_spring_at_an_end_stays_there_whatever_noise_its_resistance_has(xi0):
    """By single readings, or a walk that cannot cross full heat, the force of the hot one was 0.1 N off."""
    recording, force = recorded(xi0)
    found = predict(recording)
    assert np.all(found.states["xi0"] == xi0)
    np.testing.assert_allclose(found.outputs["force_N"], force, atol=1e-9)


    assert any("throughout (xi0 = " in notice for notice in found.notices)


def test_a_spring_that_is_partly_heated_is_not_taken_for_cold():
    recording, force = recorded(0.98)
    found = predict(recording)
    assert np.abs(found.states["xi0"] - 0.98).max() < 0.01
    assert np.sqrt(np.mean((found.outputs["force_N"] - force) ** 2)) < 0.01


@pytest.mark.parametrize(("xi0", "noise"), [(0.5, 0.05), (0.35, 0.01)])
def test_a_half_heated_spring_is_not_taken_for_hot_where_noise_hides_it_row_by_row(xi0, noise):
    """By chi-square alone full heat passes; another constant fraction is clearly better."""
    recording, _ = recorded(xi0, noise=noise, rows=1001)
    assert np.abs(np.median(predict(recording).states["xi0"]) - xi0) < 0.1


def test_resistances_are_not_made_up_over_a_long_gap():
    recording, _ = recorded(0.8)
    recording.columns["resistance_ohm"][50:60] = np.nan
    recording.columns["resistance_ohm"][80:83] = np.nan
    found = predict(recording)
    empty = np.flatnonzero(np.isnan(found.outputs["force_N"]))
    np.testing.assert_array_equal(empty, np.arange(50, 60))


@pytest.mark.parametrize(("xi0", "most"), [(0.0, 1e-9), (0.9, 0.05)])
def test_what_readings_imply_contains_the_effects_of_a_model(xi0, most):
    recording, force = recorded(xi0, LEAD)
    leads = find_effect("series_resistance")(ohms=LEAD)
    model = AugmentedModel(added=(add_effect(leads, "a test"),))
    found = predict(recording, model=model)
    assert np.sqrt(np.mean((found.outputs["force_N"] - force) ** 2)) < most
    assert np.abs(found.states["xi0"] - xi0).max() < 0.02
