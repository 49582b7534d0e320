"""Elimination row by row solves the dense system of a trajectory whose rows remember earlier ones."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.latent_trajectory.elimination import Elimination

ROWS = 40
HELD = 1e-6


def renewing(rng, how):
    """Rows that are remembered from then on: hotter than all before them, the first alone, or every one."""
    if how == "all":
        return np.ones(ROWS, bool)
    course = rng.random(ROWS) if how == "hottest" else np.arange(ROWS)
    lowest = np.minimum.accumulate(course)
    return np.concatenate([[True], course[1:] < lowest[:-1]])


@pytest.mark.parametrize("how", ["hottest", "first", "all"])
@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_it_solves_the_whole_system(how, correlation):
    rng = np.random.default_rng(0)
    renews = renewing(rng, how)
    source = np.maximum.accumulate(np.where(renews, np.arange(ROWS), 0))
    own = rng.standard_normal((2, ROWS))
    remembered = np.where(renews, 0.0, rng.standard_normal((2, ROWS)))
    walk = np.concatenate([[0.0], rng.random(ROWS - 1)])
    increments = np.diff(np.eye(ROWS), axis=0)
    whole = HELD * np.eye(ROWS) + increments.T @ (walk[1:, None] * increments)
    errors = correlation ** np.abs(np.subtract.outer(np.arange(ROWS), np.arange(ROWS)))
    inverses = [w[:, None] * np.linalg.inv(errors) * w for w in rng.random((2, ROWS))]
    for slope, memory, inverse in zip(own, remembered, inverses, strict=True):
        design = np.diag(slope) + memory[:, None] * np.eye(ROWS)[source]
        whole += design.T @ inverse @ design
    information = np.stack([np.diag(inverse) for inverse in inverses])
    correlated = np.stack([np.concatenate([[0.0], np.diag(inverse, -1)]) for inverse in inverses])
    parts = (own, remembered, renews, information, correlated, walk)
    right = rng.standard_normal(ROWS)
    found = Elimination.of(*map(jnp.asarray, parts), HELD).solve(jnp.asarray(right))
    assert np.allclose(found, np.linalg.solve(whole, right), rtol=1e-9, atol=1e-12)
