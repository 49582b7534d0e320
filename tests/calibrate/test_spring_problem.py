"""The problem of a spring campaign, whose arrays are padded to few numbers of recordings."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.spring.problem import Problem
from fitting.calibrate.spring.search import problem_of, readings_of
from fitting.data.recordings import read_campaign
from fitting.specimens.rows import Rows, stack
from pneusma_jax.nitinol import load_alloy


@pytest.mark.parametrize("count", [2, 5, 7])
def test_a_margin_is_that_of_every_recording_and_of_the_padding(count):
    ones = np.ones(32)
    one = Rows(
        mask=ones > 0.0, time=ones, inputs={}, measured={}, weight={}, base={},
        extra={"margin": np.asarray(0.0)}, specimen=np.asarray(1),
    )  # fmt: skip
    rows = [one] * count
    stacked = stack(rows)
    problem = Problem((None,) * count, tuple(rows), stacked, None).with_turning_margin(0.25)
    assert problem.stacked.extra["margin"].shape == stacked.mask.shape[:1]
    assert eqx.tree_equal(problem.stacked.extra["margin"], jnp.full(stacked.mask.shape[:1], 0.25))


def test_a_test_of_a_known_alloy_is_held_at_the_phase_that_is_stated_for_it():
    campaign = read_campaign("calibration_data/examples/spring")
    reading = readings_of(campaign.recordings, {"hot": "hot", "cold": "cold"}, load_alloy("krl35"), None)[0]
    rows = problem_of(campaign, reading.tests, None, False, {}).rows
    held = {t.name: (float(r.extra["level"]), float(r.extra["level_sd"])) for t, r in zip(reading.tests, rows, strict=True)}
    assert held.pop("hot") == (0.0, 0.0) and held.pop("cold") == (1.0, 0.0)
    assert held and all(sd > 0.0 for _, sd in held.values())
