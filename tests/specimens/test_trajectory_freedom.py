"""Degrees of freedom of a spring's trajectory: a reduced chi-square of one where what is left is noise."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.diagnose.evaluate.latent_trajectories import remembered_rows as hottest
from fitting.specimens.rows import Rows
from fitting.specimens.spring import FACTOR
from fitting.specimens.spring_course import best_course

COUNT, WORLDS = 120, 200
SLOPES = jnp.asarray([40.0, 30.0])
"""Change of both readings with the fraction, in standard deviations of their noise."""
INFORMATION = float(jnp.sum(SLOPES**2))


def smoother(process_noise):
    """The smoother of the readings' own information, as a full matrix."""
    steps = np.diff(np.eye(COUNT), axis=0)
    return INFORMATION * np.linalg.inv(INFORMATION * np.eye(COUNT) + steps.T @ steps / process_noise)


def followed(process_noise, walks):
    """Chi-squares of many recordings, and the degrees of freedom that their trajectories took.

    Args:
        process_noise: variance of the walk per row, as the prior says.
        walks: the same of the true walk.
    """
    rng = np.random.default_rng(5)
    truth = 0.5 + np.cumsum(np.sqrt(walks) * rng.standard_normal((WORLDS, COUNT)), axis=1)
    read = np.asarray(SLOPES)[:, None] * truth[:, None] + rng.standard_normal((WORLDS, 2, COUNT))

    return [np.asarray(x) for x in of_worlds(read, truth, float(process_noise))]


@jax.jit
@functools.partial(jax.vmap, in_axes=(0, 0, None))
def of_worlds(readings, begin, process_noise):
    """Chi-square of a recording, and the degrees of freedom that its trajectory took; one program for any walk."""
    measured = dict(zip("ab", readings, strict=True))
    weight, extra = dict.fromkeys("ab", jnp.ones(COUNT)), {"process_noise": jnp.asarray(process_noise)}
    rows = Rows(jnp.ones(COUNT, bool), jnp.arange(COUNT) * 1.0, {}, measured, weight, {}, extra, jnp.asarray(1))
    law = lambda fraction, decided_by: (SLOPES[:, None] * fraction, hottest(fraction), None)  # noqa: E731
    found = best_course(lambda fraction, *_: law(fraction, None)[0], law, begin, "ab", rows)
    return jnp.sum((found.predicted - readings) ** 2), jnp.sum(found.taken_from_errors)


@pytest.mark.parametrize(("leverage", "process_noise"), [(0.0, 1e-12), (0.5, 4.0 / 3.0 / INFORMATION), (1.0, 1e3)])
@pytest.mark.parametrize("share", [0.0, 1.0 / FACTOR])
def test_what_a_trajectory_leaves_of_noise_is_what_is_counted(leverage, process_noise, share):
    """At a leverage of one half the trace of the smoother was 0.19 of a row too few: a reduced chi-square of 0.88."""
    S = smoother(process_noise)
    assert np.trace(S) / COUNT == pytest.approx(leverage, abs=0.01)
    squares, taken = followed(process_noise, share * min(process_noise, 1e-4))
    np.testing.assert_allclose(taken, np.trace(2.0 * S - S @ S), rtol=1e-4)
    freedom = 2 * COUNT - taken.mean()
    error = squares.std() / np.sqrt(WORLDS)
    assert abs(squares.mean() - freedom) < 3.0 * error + 0.25 * share * COUNT  # a walk leaves a part of itself
    assert abs(squares.mean() / freedom - 1.0) < 0.04


def test_a_fraction_that_walks_as_far_as_its_prior_says_leaves_more():
    """There the trace of the smoother alone is right. A spring's prior is wider than its readings imply."""
    process_noise = 4.0 / 3.0 / INFORMATION
    squares, _ = followed(process_noise / 30.0, process_noise / 30.0)
    expected = 2 * COUNT - np.trace(smoother(process_noise / 30.0))
    assert abs(squares.mean() - expected) < 3.0 * squares.std() / np.sqrt(WORLDS)
