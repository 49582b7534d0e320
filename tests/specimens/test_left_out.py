"""A chain takes models of instruments, says what it leaves out, and refuses effects that would change it."""

import numpy as np
import pytest

from fitting.simulate.chain_state import chain_state
from fitting.specimens.saved_models import AugmentedModel, add_effect
from fitting.specimens.saved_models.left_out import chain_without, of_states_at_rest
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError
from pneusma_jax.serial_chain.designs import load_chain


def model_of(**effects):
    return AugmentedModel(added=tuple(add_effect(find_effect(slug)(**own), "here") for slug, own in effects.items()))


INSTRUMENTS = model_of(
    camera_calibration={"scale": 1.1}, series_resistance={"ohms": 0.05}, pressure_calibration={"offset": 500.0}
)
WITHOUT = (
    "a chain is without camera_calibration, series_resistance and pressure_calibration: they change what instruments "
    "show, not its shape"
)


def test_a_chain_takes_a_model_of_instruments():
    assert chain_without(INSTRUMENTS) == chain_without(INSTRUMENTS, history=True) == [WITHOUT]
    design = load_chain("orthogonal_chain")
    given = [{"xi0_1": 0.4}, *({} for _ in design.designs[1:])]
    found, plain = (chain_state(design, {}, 10e3, given, model) for model in (INSTRUMENTS, AugmentedModel()))
    np.testing.assert_array_equal(found.tip, plain.tip)
    assert f"all segments: {WITHOUT}" in found.notices


def test_a_chain_at_rest_takes_what_only_a_history_wakes():
    asleep = model_of(viscoelastic_relaxation={"g_1": 0.2})
    sentence = "viscoelastic_relaxation acts only along a history, so it changes nothing here"
    assert chain_without(asleep) == of_states_at_rest(asleep) == [sentence]
    with pytest.raises(InputError, match=r"but not its effects \(viscoelastic_relaxation\); simulate one segment"):
        chain_without(asleep, history=True)


def test_a_chain_refuses_what_would_change_it():
    with pytest.raises(InputError, match=r"not its effects \(gravity and wrap_friction\); simulate one segment"):
        chain_without(model_of(gravity={"mass": 1e-3}, camera_calibration={}, wrap_friction={"begun": 1.0}))


def test_a_model_without_effects_leaves_nothing_out():
    assert chain_without(AugmentedModel()) == of_states_at_rest(AugmentedModel()) == []
