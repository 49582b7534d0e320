"""A study of a model on disk: its numbers and effects act in every state, and what cannot act is refused."""

import dataclasses
from types import SimpleNamespace
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from study_files import CHAIN, PLAIN, changed, write_study

import pneusma_jax as pj
from fitting.design import program, read_study, run_study
from fitting.design.bodies import build_body, plan_of, solve_body
from fitting.design.conclude import notes_on_model
from fitting.design.program import Model
from fitting.design.quantities import bending_stiffness, blocking_force
from fitting.design.run import fingerprint
from fitting.report.design.documents import files
from fitting.specimens.saved_models import AddedDiscrepancy, AugmentedModel, load_model, render_model
from pneusma_jax.actuator.loads import Load
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import CATALOGUE, Effect, Spec, find_effect


def stated(value, unit):
    """A number of a model on disk."""
    return f'{{value = {value}, unit = "{unit}", status = "fitted", source = "here"}}'


def effect_table(slug, **parameters):
    """Table of an effect of a model on disk, from `(value, unit)` of each parameter."""
    lines = [f"{name} = {stated(*one)}" for name, one in parameters.items()]
    return "\n".join(["", "[[effect]]", f'slug = "{slug}"', "[effect.parameters]", *lines, ""])


MODEL = f"""
schema = "pneusma-model/1"
name = "mine"
[base]
design = "pneuflex_s"
material = "dragon_skin_10_fast"
wall_thickness = {stated(1.1, "mm")}
silicone_stiffness = {stated(0.9, "1")}
"""
CONTACT = effect_table("tip_contact", stiffness=(0.01, "N m/rad"), angle=(1.0, "rad"), exponent=(1.5, "1"))
STUDY = PLAIN.replace('design = "pneuflex_s"', 'model = "mine.toml"')


def written(folder, study=STUDY, model=MODEL + CONTACT):
    (folder / "mine.toml").write_text(model, encoding="utf-8")
    return write_study(folder, study)


def curvature(wall, effects):
    """Curvature of the tube of the model [1/m], by a history of one row."""
    stiff = load_stiffened()
    tube = pj.make_actuator("pneuflex_s", None, stiff, wall_thickness=wall)
    return float(pj.simulate_history(tube, np.array([30e3]), time=np.zeros(1), effects=effects).rows.curvature[0])


def load_stiffened():
    law = pj.load_silicone("dragon_skin_10_fast")
    return pj.silicone.RegularisedSilicone(**{**vars(law), "stiffness": 0.9 * float(law.stiffness)})


def planned(study):
    """Plan of the first choice of a study."""
    return plan_of(*(one[0] for one in (study.designs, study.alloys, study.materials)), study.model)


@pytest.mark.slow
def test_effects_act_in_states_with_exact_derivatives(tmp_path):
    study = read_study(written(tmp_path))
    model = Model(study, planned(study))
    effect = find_effect("tip_contact")(stiffness=0.01, angle=1.0, exponent=1.5)
    place = np.array([0.4])
    wall = float(model.space.parameters(place)["wall_thickness"])
    values, slopes = model.evaluate(place[None])
    assert -values[0, 0] == pytest.approx(curvature(wall, (effect,)), rel=1e-9)
    assert abs(values[0, 0]) < 0.9 * curvature(wall, ())  # the contact holds it back
    step = 1e-4
    around = model.values(np.array([place - step, place + step]))
    assert slopes[0, 0, 0] == pytest.approx((around[1, 0] - around[0, 0]) / (2.0 * step), rel=1e-5)


STAND = (
    effect_table("force_calibration", offset=(0.05, "N"))
    + effect_table("camera_calibration", scale=(1.1, "1"))
    + f"[specimen.A]\nwall_thickness = {stated(1.3, 'mm')}\n"
)


WOKEN = effect_table("wrap_friction", constant=(2e-4, "N m"))
THICK = effect_table("thick_wall", share=(0.3, "1"))
LEADS = effect_table("series_resistance", ohms=(0.04, "ohm"))


def test_an_effect_that_only_a_history_wakes_is_named(tmp_path):
    notes = notes_on_model(read_study(written(tmp_path, model=MODEL + WOKEN + CONTACT)))
    assert notes[-1] == "wrap_friction acts only along a history, so it changes nothing here"
    begun = WOKEN + f"begun = {stated(1.0, '1')}\n"
    assert "along a history" not in "".join(notes_on_model(read_study(written(tmp_path, model=MODEL + begun))))


class Moment(Load):
    """A moment that turns the tip in the plane of bending [N m]."""

    size: Array
    side: Array

    def potential(self, length, bend):
        return self.size * (bend @ self.side)

    def generalised_force(self, length, bend):
        return 0.0 * length, self.size * self.side


@pytest.mark.parametrize("design", ["pneuflex_s", "pneusma1"])
def test_stiffness_and_blocking_force_count_effects(design, tmp_path):
    """The stiffness is a small moment over the bend that it makes, and the force across the tip ends in a straight body.

    An inextensible fibre ties the elongation to the bend, which a spring does not. Leads of springs change neither.
    """
    effects = CONTACT + THICK
    plan = plan_of(design, None, None, load_model(written(tmp_path, model=MODEL + effects).with_name("mine.toml")))
    body = build_body(plan, {}, plan.materials())
    (tube,) = body.segments
    side, state = jnp.asarray(tube.side_direction), (np.asarray(30e3), np.full(len(tube.springs), 0.5))

    def measured(body):
        solved = solve_body(body, *state)
        return solved.only.bend_angle, bending_stiffness(solved, 0), blocking_force(solved, 0)

    @jax.jit  # one program for all loads
    def loaded(size, across):
        own = Moment(size, side), pj.TipForce(across, tube.section.enclosed_centroid)
        return measured(dataclasses.replace(body, segments=(tube.with_loads(*own),)))

    bend = lambda size, across=np.zeros(3): float(loaded(size, across)[0])  # noqa: E731
    size, (angle, stiffness, blocked) = 1e-6, map(float, loaded(0.0, np.zeros(3)))
    assert 2.0 * size / abs(bend(size) - bend(-size)) == pytest.approx(stiffness, rel=1e-5)
    plain = jax.jit(lambda: measured(dataclasses.replace(body, effects=(), gravity=None)))()
    assert stiffness > 1.1 * float(plain[1])
    if tube.springs:
        leads = find_effect("series_resistance")(ohms=0.04)
        found = jax.jit(lambda: measured(dataclasses.replace(body, effects=(leads,))))()
        np.testing.assert_allclose(found, plain, rtol=1e-9)
    across = np.append(side, 0.0) * blocked * np.sign(angle)
    assert abs(bend(0.0, across)) < 1e-6 * abs(angle)


@pytest.mark.slow
def test_instruments_change_no_stiffness(tmp_path):
    force = '[constraint.force]\nquantity = "blocking_force"\nat_most = {value = 5, unit = "N"}\n'
    text, found = changed('quantity = "curvature"', 'quantity = "bending_stiffness"', STUDY) + force, []
    for effects in ("", STAND + LEADS):
        study = read_study(written(tmp_path, text, MODEL + effects))
        found.append(Model(study, planned(study)).values(np.array([[0.4]]))[0])
    assert found[0].size == 3 and np.all(found[0] != 0.0)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


def test_instruments_and_single_specimens_change_no_design(tmp_path):
    study = read_study(written(tmp_path, model=MODEL + STAND))
    plan = planned(study)
    assert plan.effects == () and plan.tables[0].values()["wall_thickness"] == pytest.approx(1.1e-3)
    values = Model(study, plan).values(np.array([[0.4]]))
    wall = float(Model(study, plan).space.parameters(np.array([0.4]))["wall_thickness"])
    assert -values[0, 0] == pytest.approx(curvature(wall, ()), rel=1e-9)
    notes = notes_on_model(study)
    assert "numbers of single specimens of mine.toml are left out: a design is none of them" in notes
    assert notes[-1] == (
        "force_calibration and camera_calibration act on what instruments or a test stand show, and change nothing here"
    )


class Own(Effect):
    """Pressure that is lost on the way, by an effect that is no part of the package."""

    lost: Array = eqx.field(converter=jnp.asarray, default=0.0)
    slug: ClassVar[str] = "own_loss"
    kinds: ClassVar[str] = "A"
    specs: ClassVar[dict[str, Spec]] = {"lost": Spec(0.0, 0.0, 1.0, 0.1, "1", "part of the pressure that is lost")}

    def pressure(self, value, at, memory):
        return value * (1.0 - self.lost)


OWN = effect_table("own_loss", lost=(0.5, "1"))


def test_programs_with_ones_own_effects_are_not_stored(tmp_path, monkeypatch):
    monkeypatch.setitem(CATALOGUE, "own_loss", Own)
    kept = []
    monkeypatch.setattr(program, "cached_program", lambda function, name, keep: kept.append(keep) or eqx.filter_jit(function))
    for model in (MODEL + OWN, MODEL + CONTACT):
        study = read_study(written(tmp_path, model=model))
        plan = planned(study)
        assert Model(study, plan)._values is not None
    assert kept == [False, True]


def test_evaluations_with_another_effect_of_ones_own_are_not_taken_over(tmp_path, monkeypatch):
    class Other(Own):
        """The same name, another law."""

        def pressure(self, value, at, memory):
            return value * (1.0 - 2.0 * self.lost)

    found = []
    for effect in (Own, Other, Own):
        monkeypatch.setitem(CATALOGUE, "own_loss", effect)
        found.append(fingerprint(read_study(written(tmp_path, model=MODEL + OWN))))
    assert found[0] == found[2] != found[1]


def made_of(study):
    """As much of a study's result as its files need, without a search."""
    made = SimpleNamespace(parameters={"wall_thickness": 0.83e-3})
    return SimpleNamespace(study=study, model=Model(study, planned(study)), made=made, front=None, notes=notes_on_model(study))


@pytest.mark.parametrize("result_of", [made_of, pytest.param(run_study, marks=pytest.mark.slow)])
def test_a_study_leaves_the_model_for_its_design(result_of, tmp_path):
    study = read_study(written(tmp_path))
    result = result_of(study)
    for name, content in files(result).items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    kept = load_model(tmp_path / "model.toml")
    assert kept.tables["design"] == str(tmp_path / "design.toml")
    assert not kept.quantities("actuator") and kept.added == study.model.added  # its size is the design's own
    wall = result.made.parameters["wall_thickness"]
    assert kept.table("actuator", kept.tables["design"]).values()["wall_thickness"] == pytest.approx(wall)
    assert kept.quantities("silicone")["silicone_stiffness"].value == 0.9
    assert "mine.toml adds tip_contact to the base model" in result.notes


def test_another_model_is_another_study(tmp_path):
    first = fingerprint(read_study(written(tmp_path)))
    assert first != fingerprint(read_study(written(tmp_path, model=MODEL + CONTACT.replace("1.5", "1.4"))))
    assert first == fingerprint(read_study(written(tmp_path)))


@pytest.mark.parametrize(
    ("study", "model", "line"),
    [
        (STUDY.replace('"mine.toml"', "3"), MODEL, "model must be the path of a model's TOML file, but it is 3"),
        (STUDY.replace("mine.toml", "none.toml"), MODEL, "none.toml: there is no such file"),
    ],
)  # fmt: skip
def test_what_a_model_cannot_do_in_a_study_is_refused(study, model, line, tmp_path):
    with pytest.raises(pj.InputError) as refused:
        read_study(written(tmp_path, study, model))
    assert line in str(refused.value) and "\n" not in str(refused.value)


def test_an_unnamed_correction_is_refused(tmp_path):
    pressures = [0.0, 20e3, 40e3]
    knots = tuple(Quantity(f"knot_{k}", x, "Pa", "fitted", "here") for k, x in enumerate(pressures, 1))
    added = tuple(Quantity(f"correction_{k}", 0.1, "1/m", "fitted", "here") for k in (1, 2, 3))
    model = AugmentedModel(
        added=(AddedDiscrepancy("actuator", "curvature", "pressure", knots, added),),
        tables={"design": "pneuflex_s", "material": "dragon_skin_10_fast"},
    )
    with pytest.raises(pj.InputError, match="mine.toml has an unnamed correction"):
        read_study(written(tmp_path, model=render_model(model)))


def test_a_chain_takes_numbers_but_no_effects(tmp_path):
    (tmp_path / "two.toml").write_text(CHAIN, encoding="utf-8")
    of_chain = STUDY.replace("starts = 3", 'design = "two.toml"\nstarts = 3')
    with pytest.raises(pj.InputError, match=r"a chain takes numbers of mine.toml, but not its effects \(tip_contact\)"):
        read_study(written(tmp_path, of_chain))
    notes = notes_on_model(read_study(written(tmp_path, of_chain, MODEL + WOKEN + LEADS + STAND)))
    assert "wrap_friction acts only along a history, so it changes nothing here" in notes
    assert (
        "a chain is without series_resistance, force_calibration and camera_calibration: they change what "
        "instruments show, not its shape"
    ) in notes
