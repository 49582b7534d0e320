"""A law between two plateaus is sampled by its values at two ends where these are told better than its constants."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample
from fitting.sample.chart import Chart, choose_chart
from fitting.sample.independent import SHARE, proposals_about
from fitting.sample.laplace import laplace, start_spread
from fitting.sample.plateaus import ENDS, plateaus_of
from fitting.sample.target import LogDensity
from fitting.sample.unbounded import WhitenedMaps
from fitting.specimens.specimen import SigmoidLaw
from pneusma_jax.nitinol.resistivity import martensite_resistivity

LAW = SigmoidLaw("mean", "span", "slope", "offset", "sharpness")
X = jnp.array([0.0, 1.0])
TRUTH = 17.0, 2.1, -2.0, 1.5, 3.0
"""The law falls from 17.9 to 16.5 over the data. Two measured values leave its shape open."""


def open_law(noise=0.002):
    """A law whose five constants are open, measured precisely at both ends."""
    mean, span, slope, offset, sharpness = TRUTH
    parameters = Parameters(
        Parameter("mean", mean, prior=Prior(mean, 2.0, 9.0, 30.0)),
        Parameter("span", span, prior=Prior(span, 1.5, 0.05, 9.0), scale="log"),
        Parameter("slope", slope, prior=Prior(slope, 1.0, -8.0, -0.2)),
        Parameter("offset", offset, prior=Prior(offset, 0.7, -1.0, 5.0)),
        Parameter("sharpness", sharpness, prior=Prior(sharpness, 1.5, 0.8, 25.0), scale="log"),
    )
    data = martensite_resistivity(X, *TRUTH) + noise * np.random.default_rng(3).standard_normal(len(X))

    def residual(values, data):
        return (martensite_resistivity(X, *(values[name] for name in LAW)) - data) / noise

    target = Target.from_residual(residual, parameters, data)
    return replace(target, sigmoid_law=LAW), parameters


def around_the_truth(target, parameters, count=6):
    return target.pack(parameters) + 0.1 * np.random.default_rng(0).standard_normal((count, target.dimension))


@pytest.mark.parametrize("held", [(), ("slope", "sharpness")])
def test_the_change_keeps_volumes_and_is_undone_in_both_forms(held):
    target, parameters = open_law()
    for name in held:
        parameters[name].vary = False
    layout, stored = parameters.layout(), parameters.stored()
    offered = plateaus_of(LAW, layout, stored)
    assert [one.end for one in offered] == list(ENDS)
    for u in parameters.pack() + 0.1 * np.random.default_rng(0).standard_normal((5, len(layout.free))):
        for one in offered:
            assert abs(np.linalg.det(jax.jacfwd(one.straight)(jnp.asarray(u)))) == pytest.approx(1.0, abs=1e-9)
            np.testing.assert_allclose(one.plain(one.straight(u)), u, atol=1e-9)
            np.testing.assert_allclose(one.plain(one.straight(jnp.asarray(u))), u, atol=1e-9)


def test_its_coordinates_are_the_laws_own_values():
    target, parameters = open_law()
    u = around_the_truth(target, parameters)
    values = target.all_values(u)
    at = lambda x: martensite_resistivity(x, *(values[name] for name in LAW))  # noqa: E731
    moved = plateaus_of(LAW, target.layout, np.asarray(target.stored))[0].straight(u)
    np.testing.assert_allclose(moved[:, 0], at(0.0), rtol=1e-12)
    np.testing.assert_allclose(np.exp(moved[:, 1]), np.abs(at(1.0) - at(0.0)), rtol=1e-9)
    np.testing.assert_array_equal(moved[:, 2:], u[:, 2:])


def test_nothing_is_offered_where_a_constant_is_held_or_another_coordinate():
    _, parameters = open_law()
    parameters["span"].vary = False
    assert plateaus_of(LAW, parameters.layout(), parameters.stored()) == []
    assert plateaus_of(LAW._replace(mean="span", span="mean"), open_law()[1].layout(), np.ones(5)) == []
    assert plateaus_of(LAW._replace(slope="absent"), open_law()[1].layout(), np.ones(5)) == []


def test_draws_about_the_fit_are_accepted_in_these_coordinates_alone():
    target, parameters = open_law()
    found = laplace(target, target.pack(parameters))
    density = LogDensity(target, 32)
    chart = choose_chart(target, found, start_spread(target, found), density, 0)
    assert chart.plateaus is not None and chart.plateaus.end in ENDS
    plain = Chart(np.zeros(target.dimension, int))
    assert proposals_about(target, found, chart, density, 0).share == SHARE
    assert proposals_about(target, found, plain, density, 0).share == 0.0


def test_walkers_and_chains_see_the_same_density():
    target, parameters = open_law()
    found = laplace(target, target.pack(parameters))
    chart = choose_chart(target, found, start_spread(target, found), LogDensity(target, 32), 0)
    maps = WhitenedMaps.around(target, found, chart)
    z = 0.3 * np.random.default_rng(1).standard_normal((8, target.dimension))
    u = np.array([maps.coordinates(jnp.asarray(row)) for row in z])
    np.testing.assert_allclose(maps.whitened(u[0]), z[0], atol=1e-7)
    plain = np.array([float(target.log_probability(jnp.asarray(row))) for row in u])
    found = np.array([float(maps.log_density(target, jnp.asarray(row))) for row in z])
    jacobian = np.array([float(maps.log_jacobian(jnp.asarray(row))) for row in z])
    np.testing.assert_allclose(found - jacobian, plain, atol=1e-6)
    beyond = maps.whitened(np.array([31.0, *u[0, 1:]]))
    assert float(maps.log_density(target, jnp.asarray(beyond))) == -np.inf


@pytest.mark.parametrize("sampler", ["emcee", pytest.param("nuts", marks=pytest.mark.slow)])
def test_chains_go_on_to_the_same_bytes(sampler, tmp_path):
    target, parameters = open_law()
    settings = Settings(sampler=sampler, seed=2, chunk=10, ensembles=2, max_steps=20, warm_up=100)
    path = tmp_path / "chain.h5"
    sample(target, parameters, replace(settings, max_steps=10), file=path)
    resumed = sample(target, parameters, settings, file=path, resume=True)
    whole = sample(target, parameters, settings)
    np.testing.assert_array_equal(resumed.chains, whole.chains)
    if sampler == "emcee":
        assert whole.diagnostics["law_by_its_ends"] is not None


def test_draws_tell_the_law_as_well_as_the_fit_does():
    """The law at rest has the mean and the error of the Gaussian approximation; its mean has another shape."""
    target, parameters = open_law()
    posterior = sample(target, parameters, Settings(sampler="emcee", seed=2, max_steps=4000))
    assert posterior.converged, posterior.verdict
    draws = posterior.draws
    at_rest = martensite_resistivity(0.0, *(draws[name] for name in LAW)).ravel()
    slope = jax.grad(lambda u: martensite_resistivity(0.0, *(target.values(u)[name] for name in LAW)))
    told = np.asarray(slope(jnp.asarray(posterior.laplace.mode)))
    sd = float(np.sqrt(told @ posterior.laplace.covariance @ told))
    assert np.std(at_rest) == pytest.approx(sd, rel=0.15)
    assert np.std(draws["mean"]) > 50.0 * sd
