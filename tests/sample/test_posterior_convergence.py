"""Judging chains: known autocorrelation times, disagreement, chains that stand still, budgets that end."""

import re

import jax.numpy as jnp
import numpy as np
import pytest
from posterior_cases import constant, line, line_data, line_parameters

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import Settings, Target, sample
from fitting.sample.convergence import assess, split_r_hat
from pneusma_jax.errors import InputError


def first_order(seed, steps=6000, walkers=32, memory=0.8):
    """Chains of a first-order process, whose autocorrelation time is (1 + r) / (1 - r)."""
    white = np.random.default_rng(seed).standard_normal((steps, walkers, 1))
    chain = np.empty_like(white)
    chain[0] = white[0]
    for k in range(1, steps):
        chain[k] = memory * chain[k - 1] + np.sqrt(1.0 - memory**2) * white[k]
    return chain


def test_autocorrelation_time_and_effective_samples_are_those_of_the_process():
    state = assess([first_order(seed) for seed in range(4)])
    assert state.tau == pytest.approx(np.full((4, 1), 9.0), rel=0.1)
    assert state.effective[0] == pytest.approx(4 * 32 * state.kept / 9.0, rel=0.1)
    assert state.burn_in == pytest.approx(45, rel=0.15) and state.converged
    assert abs(state.r_hat[0] - 1.0) < 2e-3


@pytest.mark.parametrize("change", [lambda c: c + 0.6, lambda c: 1.8 * c], ids=["location", "scale"])
def test_one_ensemble_that_differs_is_noticed(change):
    chains = [first_order(seed) for seed in range(4)]
    chains[2] = change(chains[2])
    state = assess(chains)
    assert state.long_enough and not state.agree and not state.converged
    assert split_r_hat(chains)[0] > 1.01


def test_drift_within_an_ensemble_is_noticed():
    chains = [first_order(seed) + np.linspace(0.0, 2.0, 6000)[:, None, None] for seed in range(4)]
    assert not assess(chains).agree


def test_walkers_that_never_move_are_not_converged():
    state = assess([np.ones((400, 32, 2)) for _ in range(4)])
    assert np.all(np.isinf(state.tau)) and state.lengths == 0.0 and not state.converged


def test_a_run_that_ends_too_soon_says_so():
    target = Target.from_residual(line, line_parameters(), line_data())
    posterior = sample(target, line_parameters(), Settings(max_steps=30))
    assert not posterior.converged
    assert posterior.verdict[0].startswith("NOT CONVERGED after 30 steps")
    assert "Do not quote these numbers" in posterior.verdict[0]
    (wanted,) = re.findall(r"Go on with `--resume --max-steps (\d+)` or more", posterior.verdict[1])
    state = posterior.convergence
    assert int(wanted) == pytest.approx(30 * max(50.0 / state.lengths, 1000.0 / state.effective.min(), 2.0), rel=0.06)
    assert "state a prior, hold it" in posterior.verdict[1]


def test_separate_modes_that_ensembles_cannot_join_are_reported():
    def two_hills(values, data):
        return jnp.logaddexp(
            -0.5 * ((values["x"] - 1.0) / 0.01) ** 2, -0.5 * ((values["x"] + 1.0) / 0.01) ** 2
        )

    parameters = Parameters(Parameter("x", 0.02, min=-2.0, max=2.0))
    target = Target.from_log_likelihood(two_hills, parameters)
    posterior = sample(target, parameters, Settings(max_steps=300, seed=1))
    spread = np.abs(posterior.flat()).mean()
    assert spread == pytest.approx(1.0, abs=0.05) or not posterior.converged


def test_points_without_an_answer_are_counted_and_never_returned():
    def residual(values, data):
        return jnp.stack([jnp.sqrt(values["x"]) - 0.3])  # not a number below zero

    parameters = Parameters(Parameter("x", 0.2, prior=Prior(0.2, 0.2)))
    posterior = sample(Target.from_residual(residual, parameters), parameters, Settings(max_steps=400))
    assert posterior.failures > 0 and posterior.evaluations > posterior.failures
    assert np.all(np.isfinite(posterior.chains)) and np.all(np.isfinite(posterior.log_probabilities))
    assert posterior.draws["x"].min() >= 0.0
    assert "had no finite answer at" in posterior.verdict[1]


@pytest.mark.parametrize(
    ("make", "settings", "message"),
    [
        (lambda: Parameters(Parameter("x", 1.0, vary=False)), {}, "no parameter is free"),
        (lambda: Parameters(Parameter("x", 1.0)), {}, "'x': the data do not determine it and nothing bounds it"),
        (lambda: Parameters(Parameter("x", 1.0, prior=Prior(1, 1))), {"walkers": 7}, "walkers = 7 must be even"),
        (lambda: Parameters(Parameter("x", 1.0, prior=Prior(1, 1))), {"ensembles": 1}, "ensembles = 1 must be at"),
    ],
)  # fmt: skip
def test_what_cannot_be_sampled_is_refused_in_one_line(make, settings, message):
    parameters = make()
    with pytest.raises(InputError, match=message) as caught:
        sample(Target.from_log_likelihood(constant, parameters), parameters, Settings(**settings))
    assert "\n" not in str(caught.value)


def test_a_start_without_an_answer_is_refused():
    def residual(values, data):
        return jnp.log(values["x"])[None]

    parameters = Parameters(Parameter("x", -1.0, prior=Prior(1.0, 1.0)))
    with pytest.raises(InputError, match="no finite answer at the starting values"):
        sample(Target.from_residual(residual, parameters), parameters)
