"""Proposals by the spread of walkers, where the fit's approximation is not the posterior."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.parameters import Parameter, Parameters
from fitting.sample import sample
from fitting.sample.independent import SHARE, SPREAD_AFTER, SPREAD_FREEDOM, Proposals, proposals_by_spread
from fitting.sample.settings import Settings
from fitting.sample.target import Target

FIT = Proposals(np.zeros(3), np.eye(3), SHARE)


def wide(points):
    """Log-density of a Gaussian, four times as wide as the fit's."""
    return -0.5 * np.sum((points / 4.0) ** 2, axis=1)


def as_wide(scale):
    return scale * np.random.default_rng(0).standard_normal((400, 3))


def by_spread(old, points, density):
    return proposals_by_spread(old, points, points[:40], density(points[:40]), density, seed=1)


def test_walkers_that_have_spread_give_wider_proposals():
    found = by_spread(FIT, as_wide(4.0), wide)
    assert found.freedom == SPREAD_FREEDOM and found.share == SHARE
    np.testing.assert_allclose(np.diag(found.root @ found.root.T), 16.0, rtol=0.2)


def test_walkers_begin_draws_that_the_fit_did_not_allow():
    assert by_spread(dataclasses.replace(FIT, share=0.0), as_wide(4.0), wide).share == SHARE


def test_proposals_stay_where_others_would_be_accepted_less():
    narrow = as_wide(0.3)
    walkers = as_wide(1.0)[:40]
    density = lambda points: -0.5 * np.sum(points**2, axis=1)  # noqa: E731
    assert proposals_by_spread(FIT, narrow, walkers, density(walkers), density, seed=1) is FIT


@pytest.mark.parametrize("points", [np.zeros((400, 3)), as_wide(1.0) * [1.0, 0.0, 1.0], as_wide(1.0)[:, [0, 0, 2]]])
def test_walkers_in_a_plane_give_none(points):
    assert by_spread(FIT, points, wide) is FIT


def cored(values, data):
    """A Gaussian with a narrow core, which alone the fit's approximation sees."""
    square = sum(value**2 for value in values.values())
    return jnp.logaddexp(-0.5 * square / 0.2**2, -0.5 * square / 1.5**2 - 1.0)


def test_a_chain_goes_on_to_the_same_bytes_across_the_change(tmp_path):
    parameters = Parameters(*[Parameter(name, 0.1, min=-50.0, max=50.0) for name in "xyz"])
    target = Target.from_log_likelihood(cored, parameters)
    settings = Settings(sampler="emcee", seed=2, chunk=50, ensembles=2, max_steps=SPREAD_AFTER + 50)
    path, before = tmp_path / "chain.h5", dataclasses.replace(settings, max_steps=SPREAD_AFTER - 30)
    sample(target, parameters, before, file=path)
    resumed = sample(target, parameters, settings, file=path, resume=True)
    whole = sample(target, parameters, settings)
    np.testing.assert_array_equal(resumed.chains, whole.chains)
    assert resumed.evaluations == whole.evaluations
    assert whole.diagnostics["drawn_by_their_spread"]
