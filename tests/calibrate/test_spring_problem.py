"""The problem of a spring campaign, whose arrays are padded to few numbers of recordings."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.spring.problem import Problem
from fitting.specimens.rows import Rows, stack


@pytest.mark.parametrize("count", [2, 5, 7])
def test_a_margin_is_that_of_every_recording_and_of_the_padding(count):
    ones = np.ones(32)
    one = Rows(
        mask=ones > 0.0, time=ones, inputs={}, measured={}, weight={}, base={},
        extra={"margin": np.asarray(0.0)}, specimen=np.asarray(1),
    )  # fmt: skip
    rows = [one] * count
    stacked = stack(rows)
    problem = Problem((None,) * count, tuple(rows), stacked, None).loose(0.25)
    assert problem.stacked.extra["margin"].shape == stacked.mask.shape[:1]
    assert eqx.tree_equal(problem.stacked.extra["margin"], jnp.full(stacked.mask.shape[:1], 0.25))
