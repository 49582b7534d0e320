"""Ends of intervals that a bound or a prior makes, and no datum: the report of a posterior says which."""

import dataclasses
import re

import jax.numpy as jnp
import numpy as np
import pytest
from posterior_cases import line, line_data

import pneusma_jax as pj
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report.posterior import text
from fitting.report.posterior.payload import entry
from fitting.report.posterior.tables import parameter_table
from fitting.sample.campaign import CampaignPosterior
from fitting.sample.determined import estimates, held
from fitting.sample.problem import Problem
from fitting.sample.sampling import sample
from fitting.sample.settings import Settings
from fitting.sample.target import Target

pj.enable_float64()
LIMIT = r"Of least the recordings give only an upper limit \(least below (.*) mm\)"
SETTINGS = Settings(max_steps=1500, seed=3, sampler="emcee", ensembles=2)


def sampled(*more: Parameter, residual=line) -> CampaignPosterior:
    """Draws of a line's offset and slope beside parameters of which the data say nothing, or little."""
    parameters = Parameters(Parameter("offset", 0.0, -50.0, 50.0), Parameter("slope", 1.0, -50.0, 50.0), *more)
    target = Target.from_residual(residual, parameters, line_data())
    problem = Problem("a line", "tube", False, target, parameters, lambda v, d: jnp.zeros(0), None, (), ())
    return CampaignPosterior(problem, sample(target, parameters, SETTINGS, progress=False))


@pytest.fixture(scope="module")
def result():
    more = Parameter("unseen", 0.5, 0.0, 2.0), Parameter("expected", 1.0, prior=Prior(1.0, 0.1))
    most = Parameter("least", 0.05, 0.0, 5.0, unit="mm")
    return sampled(*more, most, residual=lambda v, d: jnp.append(line(v, d), 2.0 * v["least"]))


def test_a_flat_prior_that_fills_a_posterior_is_said(result):
    said = text.not_measured(result)
    assert "Both ends of the interval of unseen come from priors or bounds more than from the recordings." in said
    (limit,) = [float(found[1]) for one in said if (found := re.match(LIMIT, one))]
    assert limit == pytest.approx(1e3 * 0.5 * 1.96, rel=0.1)  # half of a Gaussian of 0.5 m
    assert any(one.startswith("expected is merely its prior") for one in said)
    assert "unseen and least have flat priors between bounds: an end there is a bound, not a measurement." in said
    assert set(said) <= set(text.verdict(result))
    assert not any("offset" in one or "slope" in one for one in said)


def test_tables_and_files_mark_each_parameter(result):
    remarks = {row[0]: row[-1] for row in parameter_table(result).rows}
    assert remarks == {
        "offset": "", "slope": "", "unseen": "by priors", "expected": "merely its prior", "least": "upper limit only",
    }  # fmt: skip
    ends = {name: entry(result, name)["recordings_bound"] for name in remarks}
    assert ends == {"offset": "both", "slope": "both", "unseen": "none", "expected": "both", "least": "above"}
    assert [name for name in remarks if entry(result, name)["merely_prior"]] == ["expected"]


def test_a_posterior_that_the_data_bracket_says_nothing():
    assert text.not_measured(sampled()) == []


@pytest.mark.parametrize(("cut", "determined"), [(-4.0, True), (-2.2, True), (-1.2, False), (0.0, False)])
def test_a_bound_makes_an_end_where_the_density_there_is_that_of_a_90_percent_interval(cut, determined):
    """At -1.645 standard deviations a Gaussian has the limit; draws above any bound are the same Gaussian."""
    draws = np.random.default_rng(5).standard_normal(20000)
    inside = draws[draws > cut]
    assert held(inside, cut, np.inf) == (determined, True)
    assert held(-inside, -np.inf, -cut) == (True, determined)


def test_a_value_that_never_moves_is_no_end_of_an_interval(result):
    assert held(np.ones(100), 0.0, 2.0) == (True, True)
    still = dataclasses.replace(result.posterior, chains=np.ones_like(result.posterior.chains))
    assert all(e.determined == (True, True) for e in estimates(result.problem, still).values())
