"""Chains that follow gradients and chains that start from the prior, on distributions that are known exactly."""

from contextlib import nullcontext

import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from posterior_cases import banana, constant, line, line_data, line_parameters, line_posterior, within

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample
from fitting.sample.chart import Chart
from fitting.sample.gradients import differentiation
from fitting.sample.laplace import laplace
from fitting.sample.pilot import pilot
from fitting.sample.tempered import draw_prior
from fitting.sample.unbounded import WhitenedMaps
from pneusma_jax.errors import InputError

NUTS = Settings(sampler="nuts", max_steps=4000, warm_up=300)


def line_target() -> Target:
    return Target.from_residual(line, line_parameters(), line_data())


@pytest.mark.slow
def test_gradient_chains_have_the_moments_of_a_gaussian():
    posterior = sample(line_target(), line_parameters(), NUTS)
    mean, covariance = line_posterior(line_data())
    assert posterior.converged and posterior.convergence.effective.min() >= 1000
    for k, name in enumerate(("offset", "slope")):
        within(posterior, name, mean[k], covariance[k, k] ** 0.5)
    assert posterior.verdict[0].startswith("Converged: 4 independent chains that follow gradients")
    assert posterior.diagnostics["gradient"] == "reverse" and posterior.diagnostics["divergences"] == 0
    assert posterior.diagnostics["gradients_per_draw"] < 8


@pytest.mark.slow
def test_gradient_chains_follow_a_banana():
    parameters = Parameters(Parameter("x", 0.3), Parameter("y", -0.3))
    posterior = sample(Target.from_log_likelihood(banana, parameters, {"bend": 1.0}), parameters, NUTS)
    assert posterior.converged
    within(posterior, "x", 0.0, 1.0)
    assert abs(posterior.summary["y"].mean) < 4.0 * posterior.summary["y"].mcse
    assert posterior.summary["y"].sd == pytest.approx(np.sqrt(3.0), rel=0.15)


@pytest.mark.slow
def test_bounds_are_mirrors_that_keep_the_density():
    """Half a Gaussian beside one bound, a flat density between two, a logarithm with a prior."""
    parameters = Parameters(
        Parameter("half", 2.1, prior=Prior(2.0, 0.5, 2.0, 10.0)), Parameter("flat", 0.4, min=0.0, max=1.0)
    )
    posterior = sample(Target.from_log_likelihood(constant, parameters), parameters, NUTS)
    assert posterior.converged
    within(posterior, "half", 2.0 + 0.5 * np.sqrt(2.0 / np.pi), 0.5 * np.sqrt(1.0 - 2.0 / np.pi))
    within(posterior, "flat", 0.5, np.sqrt(1.0 / 12.0))
    assert posterior.draws["half"].min() >= 2.0
    assert 0.0 <= posterior.draws["flat"].min() and posterior.draws["flat"].max() <= 1.0


def test_a_logarithmic_chart_carries_its_jacobian():
    parameters = Parameters(Parameter("x", 2.0, min=0.5, max=8.0))
    target = Target.from_log_likelihood(lambda values, data: -values["x"], parameters)
    found = laplace(target, jnp.asarray([2.0]))
    maps = WhitenedMaps.around(target, found, Chart(np.array([1])))
    for z in (-3.0, 0.1, 4.0):
        u = float(maps.coordinates(jnp.asarray([z]))[0])
        assert 0.5 <= u <= 8.0
        density = float(maps.log_density(target, jnp.asarray([z])))
        assert density == pytest.approx(-u + np.log(u), abs=1e-12)


def test_a_loop_of_unknown_length_is_differentiated_forwards_and_other_errors_are_not_taken_for_it():
    def halved(z):
        return jnp.sum(jax.lax.while_loop(lambda x: jnp.max(x) > 1.0, lambda x: 0.5 * x, z))

    def unusable(z):
        raise InputError("pull.csv, row 3: no number")

    here = jnp.asarray([3.0, 5.0])
    assert differentiation(halved, here) == "forward"
    assert differentiation(jnp.sum, here) == "reverse"
    with pytest.raises(InputError, match="row 3"):
        differentiation(unusable, here)


@pytest.mark.slow
def test_a_stopped_gradient_chain_ends_with_the_same_bytes(tmp_path):
    settings = Settings(sampler="nuts", ensembles=2, max_steps=60, chunk=20, warm_up=100, seed=5)
    path = tmp_path / "chain.h5"
    sample(line_target(), line_parameters(), Settings(**{**settings.__dict__, "max_steps": 25}), file=path)
    resumed = sample(line_target(), line_parameters(), settings, file=path, resume=True)
    whole = sample(line_target(), line_parameters(), settings)
    np.testing.assert_array_equal(resumed.chains, whole.chains)
    np.testing.assert_array_equal(resumed.log_probabilities, whole.log_probabilities)
    assert resumed.evaluations == whole.evaluations and resumed.diagnostics == whole.diagnostics
    auto = Settings(**{**settings.__dict__, "sampler": "auto"})
    assert sample(line_target(), line_parameters(), auto, file=path, resume=True).settings.sampler == "nuts"
    with pytest.raises(InputError, match="run with sampler = nuts, not emcee"):
        other = Settings(**{**settings.__dict__, "sampler": "emcee"})
        sample(line_target(), line_parameters(), other, file=path, resume=True)


def test_damaged_energies_of_stored_draws_are_refused_or_do_no_harm(tmp_path):
    settings = Settings(sampler="nuts", ensembles=2, max_steps=20, chunk=20, warm_up=50, seed=5)
    path = tmp_path / "chain.h5"
    whole = sample(line_target(), line_parameters(), settings, file=path).diagnostics["energy_fraction"]
    for energy, words in ((1e300, ""), (np.nan, "energy of some draws is not finite")):
        with h5py.File(path, "r+") as file:
            file["chain_1/Draws/energy"][7] = energy
        with pytest.raises(InputError, match=words) if words else nullcontext():
            found = sample(line_target(), line_parameters(), settings, file=path, resume=True)
            fractions = found.diagnostics["energy_fraction"]
            assert np.all(np.isfinite(fractions)) and fractions[1] == whole[1]


def two_modes(values, data):
    near = -0.5 * ((values["x"] + 4.0) ** 2 + values["y"] ** 2) / 0.25
    far = -0.5 * ((values["x"] - 4.0) ** 2 + values["y"] ** 2) / 0.25
    return jnp.logaddexp(jnp.log(0.3) + near, jnp.log(0.7) + far)


@pytest.mark.slow
def test_starts_from_the_prior_find_both_modes_and_the_evidence():
    ends = {"min": -10.0, "max": 10.0}
    parameters = Parameters(Parameter("x", 4.0, **ends), Parameter("y", 0.0, **ends))
    target = Target.from_log_likelihood(two_modes, parameters)
    posterior = sample(target, parameters, Settings(sampler="tempered", seed=2))
    assert posterior.converged
    assert np.mean(posterior.draws["x"] > 0.0) == pytest.approx(0.7, abs=0.08)
    exact = np.log(2.0 * np.pi * 0.25 / 400.0)
    evidence = np.array(posterior.diagnostics["log_evidence"])
    assert abs(evidence.mean() - exact) < max(4.0 * evidence.std() / np.sqrt(len(evidence)), 0.2)


def test_draws_of_the_prior_are_those_of_the_values():
    parameters = Parameters(
        Parameter("x", 2.0, prior=Prior(2.0, 0.5, 0.5, 10.0), scale="log"),
        Parameter("flat", 0.1, min=-1.0, max=3.0),
    )
    draws = draw_prior(Target.from_log_likelihood(constant, parameters), 20000, 0)
    assert np.exp(draws[:, 0]).mean() == pytest.approx(2.0, abs=0.02)
    assert draws[:, 1].mean() == pytest.approx(1.0, abs=0.04)
    free = Parameters(Parameter("x", 2.0))
    with pytest.raises(InputError, match="neither"):
        draw_prior(Target.from_log_likelihood(constant, free), 5, 0)


def chosen(log_likelihood, parameters, tell=lambda _: None, **settings) -> tuple[str, str]:
    target = Target.from_log_likelihood(log_likelihood, parameters)
    resolved = Settings(**settings).resolved(target.dimension)
    choice = pilot(target, laplace(target, target.pack(parameters)), resolved, tell)
    return choice.settings.sampler, choice.why


def valley(values, data):
    """Bent in pairs: slow for ensembles, smooth for gradients."""
    xs = jnp.stack(list(values.values()))
    return -0.5 * jnp.sum(xs[::2] ** 2) - 0.5 * jnp.sum(((xs[1::2] - 2.0 * xs[::2] ** 2) / 0.2) ** 2)


@pytest.mark.slow
def test_a_pilot_chooses_gradients_only_where_they_pay_and_hold():
    many = Parameters(*[Parameter(f"p{i}", 0.1) for i in range(16)])
    sampler, why = chosen(
        lambda v, d: valley(v, d) + jnp.floor(4.0 * v["p0"]) + jnp.floor(9.0 * v["p3"]), many
    )
    assert sampler == "emcee" and "kinks or steps" in why
    assert chosen(lambda v, d: -0.5 * v["x"] ** 2, Parameters(Parameter("x", 0.1)))[0] == "emcee"


def test_a_pilot_chooses_gradients_in_a_valley_and_tells_what_it_does():
    words: list[str] = []
    parameters = Parameters(*[Parameter(f"p{i}", 0.1) for i in range(10)])
    assert chosen(valley, parameters, words.append)[0] == "nuts"
    assert words[1:3] == [f"a pilot of emcee, {k} of 200 steps" for k in (0, 20)] and "slopes" in words[-1]
