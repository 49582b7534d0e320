"""A curved valley is straightened by a map that keeps volumes, and walkers and chains in it draw the right density."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from posterior_cases import constant, line, line_data, line_parameters, within

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample
from fitting.sample.bend import BentChart, bent, unbent
from fitting.sample.chart import Chart
from fitting.sample.independent import SHARE, Proposals, proposals_about
from fitting.sample.laplace import laplace
from fitting.sample.target import LogDensity
from fitting.sample.unbounded import WhitenedMaps

BEND = 2.0


def valley(values, data):
    """Residual whose draws are `x ~ N(0, 1)`, `y ~ BEND x^2 + N(0, 0.1^2)`."""
    return jnp.stack([values["x"], 10.0 * (values["y"] - BEND * values["x"] ** 2)])


def bent_target(residual=valley):
    parameters = Parameters(Parameter("x", 0.1), Parameter("y", 0.1))
    return Target.from_residual(residual, parameters), parameters


def approximated(target, parameters):
    return laplace(target, target.pack(parameters))


def test_the_map_keeps_volumes_and_is_undone():
    rng, place = np.random.default_rng(0), np.arange(4)
    later = place[:, None, None] < np.minimum(place[:, None], place)
    bend = np.where(later, rng.standard_normal((4, 4, 4)), 0.0)
    bend = bend + np.swapaxes(bend, 1, 2)
    for z in 2.0 * rng.standard_normal((5, 4)):
        jacobian = jax.jacfwd(lambda z: bent(z, jnp.asarray(bend)))(jnp.asarray(z))
        assert float(jnp.linalg.det(jacobian)) == pytest.approx(1.0, abs=1e-9)
        there = np.asarray(bent(jnp.asarray(z), jnp.asarray(bend)))
        np.testing.assert_allclose(unbent(there[None], bend)[0], z, atol=1e-9)


def test_a_valley_becomes_straight_and_its_coordinates_agree_in_both_forms():
    target, parameters = bent_target()
    maps = WhitenedMaps.around(target, approximated(target, parameters), Chart(np.zeros(2, int)))
    points = np.random.default_rng(1).standard_normal((20, 2)).clip(-1.5, 1.5)
    density = np.array([float(maps.log_density(target, jnp.asarray(z))) for z in points])
    top = float(maps.log_density(target, jnp.zeros(2)))
    straight = top - 0.5 * np.sum(points**2, axis=1)
    assert np.all(np.abs(density - straight) < 0.01)
    chart = maps.chart
    assert isinstance(chart, BentChart)
    there = np.array([np.asarray(maps.coordinates(jnp.asarray(z))) for z in points])
    np.testing.assert_allclose(chart.to_target(points), there, atol=1e-9)
    np.testing.assert_allclose(chart.to_chart(there), points, atol=1e-9)
    np.testing.assert_allclose(maps.whitened(there[0]), points[0], atol=1e-9)


def test_a_straight_valley_gets_no_bend():
    target, parameters = Target.from_residual(line, line_parameters(), line_data()), line_parameters()
    maps = WhitenedMaps.around(target, approximated(target, parameters), Chart(np.zeros(2, int)))
    assert not np.any(maps.bend) and type(maps.chart) is Chart


@pytest.mark.parametrize("sampler", ["emcee", "nuts"])
def test_draws_of_a_bent_valley_have_its_moments(sampler):
    target, parameters = bent_target()
    posterior = sample(target, parameters, Settings(sampler=sampler, seed=2, warm_up=200, max_steps=4000))
    assert posterior.converged, posterior.verdict
    within(posterior, "x", 0.0, 1.0)
    within(posterior, "y", BEND, np.sqrt(2.0 * BEND**2 + 0.01), sigmas=5.0)


def test_walkers_in_a_bent_valley_go_on_to_the_same_bytes(tmp_path):
    target, parameters = bent_target()
    settings = Settings(sampler="emcee", seed=2, chunk=10, ensembles=2, max_steps=20)
    path = tmp_path / "chain.h5"
    sample(target, parameters, Settings(**{**settings.__dict__, "max_steps": 10}), file=path)
    resumed = sample(target, parameters, settings, file=path, resume=True)
    np.testing.assert_array_equal(resumed.chains, sample(target, parameters, settings).chains)


def proposals(residual):
    target, parameters = bent_target(residual)
    found = approximated(target, parameters)
    return proposals_about(target, found, Chart(np.zeros(2, int)), LogDensity(target, 32), 0)


def test_draws_about_the_fit_are_made_where_they_are_accepted():
    assert proposals(lambda values, data: jnp.stack([values["x"], 3.0 * values["y"]])).share == SHARE

    def thin(values, data):
        return jnp.stack([values["x"], 1e4 * (values["y"] - BEND * values["x"] ** 2)])

    assert proposals(thin).share == 0.0


def test_draws_about_the_fit_keep_a_density_that_is_not_the_fits():
    """A Gaussian that is cut at its mode, from the proposals alone."""
    parameters = Parameters(
        Parameter("half", 2.1, prior=Prior(2.0, 0.5, 2.0, 10.0)), Parameter("flat", 0.4, min=0.0, max=1.0)
    )
    target = Target.from_log_likelihood(constant, parameters)
    own = Proposals(np.array([2.2, 0.5]), np.array([[0.5, 0.1], [0.0, 0.4]]), 1.0)
    move, random = own.move, np.random.RandomState(0)
    points = np.tile([2.2, 0.5], (4000, 1))
    density = LogDensity(target, 4000)
    now = density(points)
    for _ in range(40):
        new, factor = move.get_proposal(points, random)
        there = density(new)
        taken = np.log(random.rand(4000)) < there - now + factor
        points, now = np.where(taken[:, None], new, points), np.where(taken, there, now)
    half = 2.0 + 0.5 * np.sqrt(2.0 / np.pi)
    assert abs(points[:, 0].mean() - half) < 4.0 * 0.3 / np.sqrt(4000)
    assert abs(points[:, 1].mean() - 0.5) < 4.0 * 0.29 / np.sqrt(4000)
    assert points[:, 1].std() == pytest.approx(np.sqrt(1.0 / 12.0), rel=0.05)


def test_a_second_mode_is_found_beside_draws_about_the_first():
    """Half of the mass is in each. With nine in ten such draws walkers ended after 200 steps with none in the other."""

    def two(values, data):
        return jnp.stack([(values["x"] ** 2 - 4.0) / 1.2, values["y"] - 0.3 * values["x"]])

    parameters = Parameters(Parameter("x", 1.9, min=-10.0, max=10.0), Parameter("y", 0.5, min=-10.0, max=10.0))
    target = Target.from_residual(two, parameters, None)
    found = sample(target, parameters, Settings(sampler="emcee", seed=1, ensembles=2, max_steps=1500))
    share = float(np.mean(found.chains[..., 0] < 0.0))
    assert share > 0.2 or not found.converged
