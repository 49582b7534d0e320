"""Samplers are tested on distributions whose moments and quantiles are known."""

import numpy as np
import pytest
from posterior_cases import banana, constant, line, line_data, line_parameters, line_posterior, within
from scipy import stats

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample
from fitting.sample.likelihood import UnknownNoise


@pytest.fixture(scope="module")
def straight():
    data = line_data()
    return data, sample(Target.from_residual(line, line_parameters(), data), line_parameters())


def test_gaussian_has_its_exact_moments(straight):
    data, posterior = straight
    mean, covariance = line_posterior(data)
    assert posterior.converged and posterior.verdict[0].startswith("Converged")
    assert posterior.convergence.kept > 50 * posterior.convergence.tau.max()
    for k, name in enumerate(("offset", "slope")):
        within(posterior, name, mean[k], covariance[k, k] ** 0.5)
    draws = posterior.flat()
    assert np.corrcoef(draws.T)[0, 1] == pytest.approx(
        covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]), abs=0.06
    )


def test_laplace_is_exact_where_the_posterior_is_gaussian(straight):
    data, posterior = straight
    mean, covariance = line_posterior(data)
    np.testing.assert_allclose(posterior.laplace.mode, mean, rtol=1e-8)
    np.testing.assert_allclose(posterior.laplace.covariance, covariance, rtol=1e-8)
    assert not any(d.notable for d in posterior.disagreements.values())


def test_draws_are_as_normal_as_they_should_be(straight):
    data, posterior = straight
    mean, covariance = line_posterior(data)
    found = posterior.summary["slope"]
    exact = stats.norm(mean[1], covariance[1, 1] ** 0.5)
    for level, quantile in ((0.05, found.low), (0.5, found.median), (0.95, found.high)):
        error = np.sqrt(level * (1 - level) / found.effective)
        assert abs(exact.cdf(quantile) - level) < 4.0 * error


@pytest.mark.slow
def test_banana_has_its_exact_moments_and_laplace_is_caught():
    bend = 1.0
    parameters = Parameters(Parameter("x", 0.3), Parameter("y", -0.3))
    target = Target.from_log_likelihood(banana, parameters, {"bend": bend})
    posterior = sample(target, parameters, Settings(max_steps=8000, seed=3))
    assert posterior.converged
    within(posterior, "x", 0.0, 1.0)
    found = posterior.summary["y"]
    assert abs(found.mean) < 4.0 * found.mcse
    assert found.sd == pytest.approx(np.sqrt(1.0 + 2.0 * bend**2), rel=0.12)
    disagreement = posterior.disagreements["y"]
    assert disagreement.notable and disagreement.ratio > 1.3 and disagreement.skewness > 0.8
    assert not posterior.disagreements["x"].notable


def test_a_prior_cut_at_its_mean_is_half_a_gaussian_and_one_of_a_logarithmic_parameter_is_of_its_value():
    half = Parameter("half", 2.1, prior=Prior(2.0, 0.5, 2.0, 10.0))
    parameters = Parameters(half, Parameter("x", 1.0, scale="log", prior=Prior(1.0, 0.4, 0.1, 5.0)))
    posterior = sample(Target.from_log_likelihood(constant, parameters), parameters, Settings(seed=2))
    assert posterior.converged
    within(posterior, "half", 2.0 + 0.5 * np.sqrt(2.0 / np.pi), 0.5 * np.sqrt(1.0 - 2.0 / np.pi))
    assert posterior.draws["half"].min() >= 2.0
    exact = stats.truncnorm((0.1 - 1.0) / 0.4, (5.0 - 1.0) / 0.4, 1.0, 0.4)
    within(posterior, "x", exact.mean(), exact.std())


def test_a_bound_cuts_a_flat_prior_and_the_posterior_leans_on_it():
    def residual(values, data):
        return (values["x"] - data["y"])[None]

    parameters = Parameters(Parameter("x", 0.5, min=0.0))
    posterior = sample(Target.from_residual(residual, parameters, {"y": -1.0}), parameters, Settings(seed=4))
    exact = stats.truncnorm(1.0, np.inf, -1.0, 1.0)
    assert posterior.converged and posterior.laplace.at_bound.all()
    within(posterior, "x", exact.mean(), exact.std())
    assert "has no Laplace approximation" in posterior.disagreements["x"].reasons[0]


def test_unknown_noise_gives_students_t():
    def residual(values, data):
        return values["level"] - data["y"]

    y = np.array([1.0, 1.8, 0.7, 1.1, 1.9, 0.4])
    parameters = Parameters(Parameter("level", 1.0))
    target = Target.from_residual(residual, parameters, {"y": y}, noise="unknown")
    posterior = sample(target, parameters, Settings(seed=5, max_steps=6000))
    assert isinstance(target.likelihood, UnknownNoise) and posterior.converged
    exact = stats.t(len(y) - 1, y.mean(), y.std(ddof=1) / np.sqrt(len(y)))
    found = posterior.summary["level"]
    for level, quantile in ((0.05, found.low), (0.5, found.median), (0.95, found.high)):
        assert abs(exact.cdf(quantile) - level) < 4.0 * np.sqrt(level * (1 - level) / found.effective)
    assert posterior.disagreements["level"].ratio > 1.15  # the tails that Laplace does not have


def test_tied_parameters_follow_and_their_priors_count():
    parameters = Parameters(
        Parameter("x", 1.0, prior=Prior(1.0, 1.0)), Parameter("twice", tie="2*x", prior=Prior(4.0, 1.0))
    )
    posterior = sample(Target.from_log_likelihood(constant, parameters), parameters, Settings(seed=6))
    within(posterior, "x", (1.0 + 2.0 * 4.0) / 5.0, 0.2**0.5)
    np.testing.assert_allclose(posterior.draws["twice"], 2.0 * posterior.draws["x"])
    assert posterior.laplace.sd["twice"] == pytest.approx(2.0 * 0.2**0.5)


@pytest.mark.slow
def test_a_product_is_moved_through_by_logarithms():
    def residual(values, data):
        return (values["a"] * values["b"] - 6.0)[None] / 1e-3

    def parameters():
        return Parameters(
            Parameter("a", 2.0, prior=Prior(2.0, 0.2, 0.1, 10.0)),
            Parameter("b", 3.0, prior=Prior(3.0, 0.3, 0.1, 10.0)),
        )

    posterior = sample(Target.from_residual(residual, parameters()), parameters(), Settings(max_steps=6000))
    assert posterior.converged
    grid = np.linspace(1.2, 3.2, 4001)  # b = 6 / a; the density of a along the ridge carries 1 / a
    density = np.exp(-0.5 * ((grid - 2.0) / 0.2) ** 2 - 0.5 * ((6.0 / grid - 3.0) / 0.3) ** 2) / grid
    density /= density.sum()
    mean = float(grid @ density)
    within(posterior, "a", mean, float(np.sqrt((grid - mean) ** 2 @ density)))


@pytest.mark.slow
def test_calibration_ranks_are_uniform():
    """Talts and others 2018: the rank of the truth among draws of its posterior is uniform, if both are right."""
    draws, replicas, bins = 19, 100, 10
    settings = {"walkers": 16, "ensembles": 2, "max_steps": 100, "chunk": 100}
    random = np.random.default_rng(11)
    ranks = np.zeros((replicas, 2), int)
    for k in range(replicas):
        truth = np.array([random.normal(0.0, 1.0), random.normal(1.0, 0.5)])
        data = line_data(seed=1000 + k, offset=truth[0], slope=truth[1])
        target = Target.from_residual(line, line_parameters(), data)
        posterior = sample(target, line_parameters(), Settings(seed=k, **settings))
        chosen = posterior.flat(draws)
        ranks[k] = np.sum(chosen < truth, axis=0)
    for k in range(2):
        counts = np.bincount(ranks[:, k] * bins // (draws + 1), minlength=bins)
        assert stats.chisquare(counts).pvalue > 0.01, counts


@pytest.mark.slow
def test_scales_that_differ_by_many_decades_are_sampled_alike():
    def residual(values, data):
        return (values["modulus"] / 3e9 + values["wall"] / 1e-3 - 2.0)[None] / 0.02

    parameters = Parameters(
        Parameter("modulus", 3e9, prior=Prior(3e9, 1.5e8)), Parameter("wall", 1e-3, prior=Prior(1e-3, 3e-5))
    )
    posterior = sample(Target.from_residual(residual, parameters), parameters, Settings(seed=8))
    precision = np.ones((2, 2)) / 0.02**2 + np.diag([1 / 0.05**2, 1 / 0.03**2])
    sd = np.sqrt(np.diag(np.linalg.inv(precision)))
    assert posterior.converged
    within(posterior, "modulus", 3e9, 3e9 * sd[0])
    within(posterior, "wall", 1e-3, 1e-3 * sd[1])
    first = posterior.chains[:, 0].std(axis=(0, 1)) / np.array([3e9, 1e-3])
    assert np.all(first > 0.5 * sd) and np.all(first < 4.0 * sd)  # walkers begin as wide as the posterior
