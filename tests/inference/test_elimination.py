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


@pytest.mark.parametrize("stiffness", [1e15, 1e18])
def test_a_walk_that_is_stiffer_by_any_factor_loses_no_digits(stiffness):
    """All rows then move as one, by the sum of what pulls over the sum of what the readings hold."""
    rng = np.random.default_rng(1)
    renews = renewing(rng, "first")
    own, none = rng.standard_normal((2, ROWS)), jnp.zeros((2, ROWS))
    remembered = np.where(renews, 0.0, rng.standard_normal((2, ROWS)))
    walk = np.where(np.arange(ROWS) > 0, stiffness, 0.0)
    right = rng.standard_normal(ROWS)
    parts = (own, remembered, renews, np.ones((2, ROWS)), none, walk)
    found = Elimination.of(*map(jnp.asarray, parts), HELD).solve(jnp.asarray(right))
    together = right.sum() / (np.sum((own + remembered) ** 2) + ROWS * HELD)
    assert np.allclose(found, together, rtol=1e7 / stiffness, atol=0.0)
