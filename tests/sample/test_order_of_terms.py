"""Terms that may change places are one law in any order: draws keep the order of the fit."""

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.calibrate.registry import characterise
from fitting.data.recordings import read_campaign
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample.order import exchangeable, keeps_order
from fitting.sample.problems import sampling_problem
from fitting.sample.sampling import sample
from fitting.sample.settings import Settings
from fitting.sample.target import Target
from fitting.specimens.saved_models import AugmentedModel, add_effect, save_model
from pneusma_jax.effects import CATALOGUE

pj.enable_float64()
SETTINGS = Settings(max_steps=1500, seed=1, sampler="emcee")
TAU = [f"viscoelastic_relaxation_tau_{k}" for k in (1, 2, 3)]


def alike(values, data):
    """Residual of two numbers of which the sum and the product were measured: they may change places."""
    a, b = values["a"], values["b"]
    return jnp.stack([(a + b - 3.0) / 0.3, (a * b - 2.0) / 0.3])


def two() -> Parameters:
    return Parameters(Parameter("a", 2.0, 0.0, 5.0), Parameter("b", 1.0, 0.0, 5.0))


def test_draws_keep_the_order_of_the_fit():
    """Without it, walkers are in both orders, and the mean of each number is that of both."""
    check = keeps_order(two(), ["a", "b"])
    ordered, free = (
        sample(Target.from_residual(alike, two(), orders=orders), two(), SETTINGS, progress=False)
        for orders in ((check,), ())
    )
    assert ordered.converged and np.all(ordered.draws["b"] <= ordered.draws["a"])
    apart = ordered.summary["a"].mean - ordered.summary["b"].mean
    assert apart > 0.5 > abs(free.summary["a"].mean - free.summary["b"].mean)


def test_only_terms_of_like_priors_may_change_places():
    terms = [("a",), ("b",)]
    assert exchangeable(two(), terms)
    for change in ({"prior": Prior(1.0, 0.1, 0.0, 5.0)}, {"vary": False}, {"max": 4.0}, {"tie": "a"}):
        parameters = two()
        parameters["b"].set(**change)
        assert not exchangeable(parameters, terms)
    assert not exchangeable(Parameters(two()["a"]), terms)


@pytest.mark.parametrize("effect", [one for one in CATALOGUE.values() if one.alike], ids=lambda one: one.slug)
def test_terms_of_the_catalogue_that_may_change_places_are_alike(effect):
    for same in zip(*effect.alike, strict=True):
        specs = [effect.specs[name] for name in same]
        assert all((s.low, s.high, s.unit, s.shape) == (specs[0].low, specs[0].high, specs[0].unit, specs[0].shape) for s in specs)


@pytest.fixture(scope="module")
def fit(example, tmp_path_factory):
    """Three terms of relaxation, fitted to every fourth row of the example."""
    campaign = read_campaign(example)
    for recording in campaign.recordings:
        recording.columns.update({name: values[::4] for name, values in recording.columns.items()})
    numbers = {"g_1": 0.2, "g_2": 0.1, "g_3": 0.3, "tau_1": 10.0, "tau_2": 1.0, "tau_3": 100.0}
    effect = CATALOGUE["viscoelastic_relaxation"](**numbers)
    model = AugmentedModel(added=(add_effect(effect, "a guess", {}),), tables={"material": "dragon_skin_10_fast"})
    return characterise(campaign, model=str(save_model(model, tmp_path_factory.mktemp("m") / "three.toml")))


def test_a_model_with_three_terms_is_sampled_in_the_order_of_its_fit(fit):
    problem = sampling_problem(fit)
    target, here = problem.target, {name: p.value for name, p in problem.parameters.items()}
    first, second, _ = sorted(TAU, key=here.get)
    swapped = dict(here)
    for one, other in ((first, second), (first.replace("tau", "g"), second.replace("tau", "g"))):
        swapped[one], swapped[other] = here[other], here[one]
    arrays = [{name: jnp.asarray(v) for name, v in values.items()} for values in (here, swapped)]
    misfit = [np.asarray(target.likelihood.residual(values, target.data)) for values in arrays]
    np.testing.assert_allclose(misfit[0], misfit[1], atol=1e-6)
    kept, other = (float(target.likelihood(values, target.data)) for values in arrays)
    assert np.isfinite(kept) and other == -np.inf
    assert any(note.endswith("keep the order of the fit: terms that change places are the same law.") for note in problem.notes)
