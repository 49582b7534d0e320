"""One state at rest for all who ask for one: simulate, workspace, design and invert agree under every effect."""

import functools

import numpy as np
import pytest

import pneusma_jax as pj
from fitting.design.bodies import build_body, plan_of, solve_body
from fitting.invert import Inverse
from fitting.simulate.state import actuator_state, described_actuator
from fitting.simulate.workspace import compute_workspace, grid
from fitting.specimens.saved_models import AddedEffect, AugmentedModel
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import CATALOGUE, specs_of
from pneusma_jax.pipeline import changes_states

PRESSURE, XI0 = 30e3, 0.4
SLUGS = tuple(slug for slug, effect in CATALOGUE.items() if "A" in effect.kinds)


def model_with(present):
    """A model of all effects, absent but for some: one program then serves all of them."""
    added = []
    for slug in SLUGS:
        values = {
            name: spec.typical if slug in present else spec.neutral for name, spec in specs_of(CATALOGUE[slug], "A").items()
        }
        if slug == "tip_contact":
            values["angle"] = 0.3
        quantities = {n: Quantity(n, float(x), "1", "fitted", "here") for n, x in values.items()}
        added.append(AddedEffect(slug, quantities))
    return AugmentedModel(added=tuple(added))


def numbers(found):
    """Bend [rad], length [m] and resistances [ohm] of an equilibrium."""
    parts = (found.bend_angle, found.length, *(spring.resistance for spring in found.springs))
    return np.array([np.ravel(x)[0] for x in parts])


@functools.cache
def simulated_with(present, design, pressure=PRESSURE, heated=2):
    """State of a model of all effects of which some act; several tests ask for the same."""
    return simulated(design, model_with(present), pressure, heated)


def simulated(design, model, pressure=PRESSURE, heated=2):
    specimen = described_actuator(None, {"design": design})
    return numbers(actuator_state(specimen, pressure, {f"xi0_{heated}": XI0}, model).found)


def in_workspace(design, model):
    space = compute_workspace(design, np.array([0.0, PRESSURE]), np.array([1.0, XI0]), model=model)
    branch = space.heated.index(2)
    return np.array([space.bend[branch, 1, 1], space.length[branch, 1, 1]])


def designed(design, model):
    plan = plan_of(design, model=model)
    body = build_body(plan, {}, plan.materials())
    return numbers(solve_body(body, np.asarray(PRESSURE), np.array([1.0, XI0])).only)


def inverted(design, model):
    return numbers(Inverse(design, model=model).verified(np.array([[PRESSURE, 1.0, XI0]])).only)


@pytest.fixture(scope="module")
def horizontal(tmp_path_factory):
    """PneuSMA2 that is clamped sideways, as its table says."""
    text = pj.calibration.load_calibration("pneusma2", "actuator").path.read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("rest") / "aside.toml"
    path.write_text(f'orientation = "horizontal"\n{text}', encoding="utf-8")
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize("slug", SLUGS)
def test_four_commands_give_one_state(slug, horizontal):
    model = model_with({slug})
    state = simulated_with(frozenset({slug}), horizontal)
    np.testing.assert_allclose(in_workspace(horizontal, model), state[:2], rtol=1e-8)
    np.testing.assert_allclose(designed(horizontal, model), state, rtol=1e-8)
    np.testing.assert_allclose(inverted(horizontal, model), state, rtol=1e-8)


def test_effects_feel_the_gravity_that_weighs_the_actuator(horizontal):
    """A direction that the design's table states is that of the effect, too; one of a recording comes before it."""
    model = model_with({"gravity"})
    stated = {"design": horizontal, "orientation": "horizontal"}
    aside = actuator_state(described_actuator(None, stated), PRESSURE, {"xi0_2": XI0}, model).found
    np.testing.assert_array_equal(simulated(horizontal, model), numbers(aside))
    up = actuator_state(
        described_actuator(None, stated | {"orientation": "vertical_base_up"}), PRESSURE, {"xi0_2": XI0}, model
    ).found
    assert abs(float(up.bend_angle - aside.bend_angle)) > 1e-3


@pytest.mark.parametrize("slug", SLUGS)
def test_effects_say_whether_they_act_at_rest(slug, horizontal):
    model = model_with({slug})
    (effect,) = (effect for effect in model.effects if effect.slug == slug)
    moved = [
        simulated_with(frozenset({slug}), horizontal, *at) - simulated_with(frozenset(), horizontal, *at)
        for at in ((PRESSURE, 2), (0.0, 1))
    ]
    acts = bool(np.any(np.abs(moved) > 1e-6))
    assert acts == (changes_states(effect) and effect.acts_at_rest())


def test_friction_acts_at_rest_where_a_recording_begins_with_it():
    friction = CATALOGUE["wrap_friction"]
    assert friction(begun=1.0).acts_at_rest() and not friction(constant=1e-4).acts_at_rest()


def test_a_workspace_names_effects_that_change_nothing_in_it(horizontal, monkeypatch):
    # states under every effect take ten seconds to trace side by side; a longer test compares them
    monkeypatch.setattr(grid, "_at_rest", lambda actuator, pressure, given, *_: (pj.solve_batch(actuator, pressure, given), {}))
    space = compute_workspace(horizontal, np.array([0.0, PRESSURE]), np.array([1.0, XI0]), model=model_with(()))
    assert (
        "cyclic_shakedown, mullins_softening, opposing_spring_heating, permanent_set, pressure_lag, "
        "transformation_hysteresis, viscoelastic_relaxation and wrap_friction act only along a history, so they change "
        "nothing here"
    ) in space.cautions
    assert (
        "camera_calibration and channel_lag act on what instruments or a test stand show, and change nothing here"
        in space.cautions
    )


def test_a_state_says_where_it_is_a_reading(horizontal):
    specimen = described_actuator(None, {"design": horizontal})
    notices = actuator_state(specimen, PRESSURE, {"xi0_2": XI0}, model_with(())).notices
    assert "by camera_calibration this shape is what instruments show, not the true one" in notices
    assert sum("act only along a history, so they change nothing here" in sentence for sentence in notices) == 1
