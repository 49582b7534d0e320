"""Every sampler on targets whose moments are known: a funnel, and for starts from the prior a banana and cuts."""

import jax.numpy as jnp
import numpy as np
import pytest
from posterior_cases import banana, constant, within

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample


def funnel(values, data):
    """R. M. Neal's funnel (Ann. Stat. 31 (2003) 705) in two dimensions: the width of x is exp(v / 2)."""
    v, x = values["v"], values["x"]
    return -0.5 * v**2 - 0.5 * v - 0.5 * x**2 * jnp.exp(-v)


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["nuts", "emcee", "tempered"])
def test_the_width_of_a_funnel_is_found(sampler):
    parameters = Parameters(Parameter("v", 0.2, min=-8.0, max=8.0), Parameter("x", 0.1, min=-60.0, max=60.0))
    settings = Settings(sampler=sampler, seed=3, **({"warm_up": 300} if sampler == "nuts" else {}))
    posterior = sample(Target.from_log_likelihood(funnel, parameters), parameters, settings)
    assert posterior.converged, posterior.verdict
    within(posterior, "v", 0.0, 1.0)
    found = posterior.summary["x"]
    assert abs(found.mean) < 4.0 * found.mcse
    # |x| is below exp(v / 2) with the probability of one standard deviation, at every v
    share = np.mean(np.abs(posterior.draws["x"]) < np.exp(0.5 * posterior.draws["v"]))
    assert share == pytest.approx(0.6827, abs=4.0 * 0.466 / np.sqrt(found.effective))


@pytest.mark.slow
def test_starts_from_the_prior_follow_a_banana():
    parameters = Parameters(Parameter("x", 0.3, min=-6.0, max=6.0), Parameter("y", -0.3, min=-20.0, max=40.0))
    target = Target.from_log_likelihood(banana, parameters, {"bend": 1.0})
    posterior = sample(target, parameters, Settings(sampler="tempered", seed=1))
    assert posterior.converged
    within(posterior, "x", 0.0, 1.0)
    assert abs(posterior.summary["y"].mean) < 4.0 * posterior.summary["y"].mcse


def test_starts_from_the_prior_keep_the_cuts_of_priors():
    parameters = Parameters(
        Parameter("half", 2.1, prior=Prior(2.0, 0.5, 2.0, 10.0)), Parameter("flat", 0.4, min=0.0, max=1.0)
    )
    target = Target.from_log_likelihood(constant, parameters)
    posterior = sample(target, parameters, Settings(sampler="tempered", seed=1))
    assert posterior.converged
    within(posterior, "half", 2.0 + 0.5 * np.sqrt(2.0 / np.pi), 0.5 * np.sqrt(1.0 - 2.0 / np.pi))
    within(posterior, "flat", 0.5, np.sqrt(1.0 / 12.0))
    assert posterior.draws["half"].min() >= 2.0
