"""Rows followed from neighbour to neighbour: derivatives across corners, where friction turns from row to row."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.simulate.tracking import track_history

ROWS = 60
TIME = np.linspace(0.0, 60.0, ROWS)
NOISE = 60.0  # Pa, of the pressure: friction turns at many rows of a plateau
STEP = 1e-6


def _curvature(values, pressure):
    """Curvature [1/m] of an actuator whose spring 2 is heated, by friction's moment and the silicone's stiffness."""
    body = pj.make_actuator("pneusma2")
    strength, factor = values
    friction = CATALOGUE["wrap_friction"](constant=strength * 2e-4, slip=0.01, spread=1.0)
    phases = (pj.MartensiteFraction(jnp.ones(ROWS)), pj.MartensiteFraction(0.5 + 0.4 * jnp.cos(TIME / 9.0)))
    states = pj.fresh_states(body, pj.design_geometry("pneusma2"))
    track = track_history(body, factor * pressure, phases, states, jnp.asarray(TIME), (friction,))
    return jnp.where(track.good, track.seen["curvature"], jnp.nan)


@pytest.fixture(scope="module")
def programs():
    """The course and its derivatives by both values, compiled once."""
    return jax.jit(_curvature), jax.jit(jax.jacfwd(_curvature))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_derivatives_of_rows_with_friction_are_those_of_the_rows(seed, programs):
    rng = np.random.default_rng(seed)
    pressure = 18e3 + 6e3 * np.clip(np.sin(TIME / 5.0), -0.5, 0.5) + NOISE * rng.standard_normal(ROWS)
    course, derivatives = programs
    here = jnp.asarray([1.0, 1.0])
    slopes = derivatives(here, pressure)
    assert np.all(np.isfinite(slopes))
    for k in range(2):
        aside = STEP * jnp.eye(2)[k]
        told = np.asarray((course(here + aside, pressure) - course(here - aside, pressure)) / (2.0 * STEP))
        scale = np.max(np.abs(told))
        np.testing.assert_allclose(slopes[:, k], told, rtol=1e-4, atol=1e-6 * scale)
