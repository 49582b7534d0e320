"""The plant is the model's own history; a controller that knows its plant follows, one that does not goes astray."""

import dataclasses
import re
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.cli import main
from fitting.control.loop import Loop, Run
from fitting.control.plant import Plant
from fitting.control.sweep import (
    Case,
    Sweep,
    _pressure_that_balances,
    all_effects,
    run_model,
    run_sweep,
    usual_loop,
)
from fitting.report.control.words import case_table, verdict
from fitting.specimens.saved_models import AugmentedModel, add_effect, fitted
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError


def run_of(curvature, wanted):
    time = np.arange(len(curvature)) * 1.0
    blank = np.zeros((len(curvature), 2))
    return Run(
        time,
        np.array(wanted),
        np.array(curvature),
        np.zeros(len(curvature)),
        np.array(wanted),
        blank,
        blank,
        blank,
        blank[:, 0] == 0,
    )


def test_errors_and_settling_times_are_counted_from_the_courses():
    run = run_of([0, 5, 12, 9, 10, 10, 10], [0, 10, 10, 10, 10, 10, 10])
    assert run.rmse() == pytest.approx(np.sqrt((25 + 4 + 1) / 7))
    assert run.rmse(since=3.0) == pytest.approx(0.5)
    assert run.settling(1.0, 7.0) == 3.0
    assert run_of([0, 5, 5, 5], [0, 10, 10, 10]).settling(1.0, 4.0) == float("inf")


@pytest.fixture
def told(monkeypatch):
    """Plants that balance between -19.5 and 300 kPa: what is said of others does not depend on the loop's rows."""

    def good(loop):
        return np.full(loop.time.size, -19.5e3 < loop.pressure < 300e3)

    def run(loop, plant, model):
        blank = np.zeros((loop.time.size, 2))
        return Run(loop.time, loop.wanted, loop.wanted, loop.wanted, loop.wanted, blank, blank, blank, good(loop))

    monkeypatch.setattr(Loop, "planned", lambda loop, _: (None, SimpleNamespace(good=good(loop), curvature=loop.wanted)))
    monkeypatch.setattr(Loop, "run", run)


def test_why_a_plant_has_no_equilibrium_is_said_in_one_line(told):
    words = r"-50 kPa no row of the loop .*; all rows have one down to -19\.5 kPa\. .* the wall would be sucked flat\.$"
    with pytest.raises(InputError, match=words):
        run_sweep("pneusma2", loop=usual_loop(pressure=-50e3))


def test_the_command_refuses_a_pressure_beyond_all_equilibria_in_one_line(told, tmp_path):
    done = CliRunner().invoke(main, ["control", "--pressure-kPa", "500", "--out", str(tmp_path / "o")])
    assert done.exit_code == 2 and done.stderr.count("\n") == 1 and not (tmp_path / "o").exists()
    assert "under 500 kPa no row of the loop has an equilibrium; all rows have one up to 300 kPa" in done.stderr


@pytest.mark.slow
def test_a_plant_without_equilibrium_is_refused_in_one_line():
    words = r"-50 kPa no row .*; all rows have one down to -19\.\d kPa\. .* the wall would be sucked flat\.$"
    with pytest.raises(InputError, match=words):
        run_sweep("pneusma2", loop=usual_loop(pressure=-50e3))


@pytest.mark.slow
def test_a_pressure_beyond_all_equilibria_is_refused_with_the_pressure_up_to_which_there_is_one(tmp_path):
    done = CliRunner().invoke(main, ["control", "--pressure-kPa", "500", "--out", str(tmp_path / "o")])
    said = re.search(
        r"under 500 kPa no row .* from [\d.]+ s on; all rows have one up to (\d+) kPa$", done.stderr.strip()
    )
    assert done.exit_code == 2 and said and not (tmp_path / "o").exists(), done.output
    body = pj.make_actuator("pneusma2")
    place = body.section.enclosed_centroid
    plant = Plant(body.with_loads(pj.TipForce(jnp.zeros(3), place)), all_effects({}))
    whole = lambda kPa: bool(np.all(usual_loop(pressure=1e3 * kPa).planned(plant)[1].good))  # noqa: E731
    assert whole(float(said[1]) - 1.0) and not whole(float(said[1]) + 2.0)


def saved_model(design):
    wall = fitted("actuator", "wall_thickness", 1.3e-3, "test")
    return AugmentedModel(
        {"actuator": {"wall_thickness": wall}},
        (add_effect(find_effect("series_resistance")(ohms=0.15), "test"),),
        {"design": design, "alloy": "krl45"},
    )


@pytest.mark.parametrize(("given", "driven"), [(None, "pneusma1"), ("pneusma2", "pneusma2")])
def test_a_model_on_disk_brings_its_design_and_its_constants(given, driven, monkeypatch):
    seen = []
    monkeypatch.setattr(Loop, "run", lambda loop, plant, model: seen.append((plant, model)))
    monkeypatch.setattr("fitting.control.sweep._balanced", lambda *args: None)
    assert run_model(given, saved_model("pneusma1")).design == driven
    body = pj.make_actuator(driven, "krl45", wall_thickness=1.3e-3)
    (plant, base), (_, whole) = seen
    for one in (plant, base, whole):
        assert eqx.tree_equal(one.body, body)
    assert not base.effects and eqx.tree_equal(whole.effects, plant.effects) and len(plant.effects) == 1


def test_the_pressure_that_is_told_is_one_at_which_the_plant_balances_too(monkeypatch):
    plant, model, loop = object(), object(), Loop(np.arange(3.0), np.ones(3), 80e3)
    good = np.ones(3, bool)
    monkeypatch.setattr(
        Loop, "planned", lambda loop, _: (None, SimpleNamespace(good=good, curvature=np.ones(3)))
    )
    monkeypatch.setattr(Loop, "run", lambda loop, *_: SimpleNamespace(good=good & (loop.pressure < 30e3)))
    assert _pressure_that_balances(plant, model, loop) == pytest.approx(30e3, abs=50.0)


def sweep_of(level, planned, curvature):
    loop = usual_loop(level=level)
    blank, full = np.zeros((loop.time.size, 2)), lambda x: np.full(loop.time.size, float(x))
    arrays = (full(curvature), full(planned), full(curvature), blank, blank, blank, full(1.0) > 0.0)
    run = Run(loop.time, loop.wanted, *arrays)
    return Sweep("pneusma2", loop, (Case("no mismatch", run, None), Case("friction", run, run)))


def test_a_level_out_of_reach_is_said_first():
    far = sweep_of(200.0, 64.66, 64.66)
    said = verdict(far)
    assert not far.in_reach and far.step == (200.0, 64.66)
    assert said[0].startswith("A curvature of 200 1/m is out of reach") and "64.66 1/m" in said[0]
    assert "out of reach" not in " ".join(verdict(sweep_of(20.0, 19.9, 19.9)))


@pytest.mark.parametrize(
    ("level", "reached", "code"), [(200.0, 64.66, 1), (20.0, 19.9, 0), pytest.param(20.0, np.nan, 1, marks=pytest.mark.slow)]
)
def test_the_exit_code_says_whether_the_level_is_in_reach(level, reached, code, monkeypatch, tmp_path):
    ended = sweep_of(level, reached, reached)
    monkeypatch.setattr("fitting.control.sweep.run_sweep", lambda *args, **kwargs: ended)
    result = CliRunner().invoke(main, ["control", "--level-1pm", str(level), "--out", str(tmp_path / "o")])
    assert result.exit_code == code and (tmp_path / "o" / "report.html").is_file(), result.output
    assert ("out of reach" in result.output) == bool(code)


def test_rows_without_equilibrium_are_named_and_end_in_exit_code_1(monkeypatch, tmp_path):
    ended = sweep_of(20.0, 19.9, 19.9)
    good = np.ones(ended.loop.time.size, bool)
    good[80:84] = False
    lost = dataclasses.replace(ended.cases[1].without, good=good)
    ended = dataclasses.replace(ended, cases=(ended.cases[0], Case("friction", lost, lost)))
    assert not ended.balanced and sweep_of(20.0, 19.9, 19.9).balanced
    monkeypatch.setattr("fitting.control.sweep.run_sweep", lambda *args, **kwargs: ended)
    result = CliRunner().invoke(main, ["control", "--out", str(tmp_path / "o")])
    words = "friction, told: in 4 of 600 rows, from 20 to 20.75 s, the plant has no equilibrium"
    assert result.exit_code == 1 and words in " ".join(result.output.split())


def test_no_number_is_told_where_there_is_none():
    result = sweep_of(20.0, np.nan, np.nan)
    assert "no equilibrium" in verdict(result)[0] and "nan" not in " ".join(verdict(result))
    cells = case_table(result).rows[0]
    assert cells[1:4] == ["no equilibrium", "does not", "no equilibrium"]


@pytest.fixture(scope="module")
def body():
    body = pj.make_actuator("pneusma2")
    place = body.section.enclosed_centroid
    return body.with_loads(pj.TipForce(jnp.zeros(3), place))


def test_a_step_gives_back_a_memory_of_the_same_kind(body):
    plant = Plant(body, all_effects({"series_resistance": {"ohms": 0.1}}))
    pressure, currents, clock = jnp.asarray(20e3), jnp.zeros(2), jnp.asarray(0.25)
    memory = jax.jit(lambda pressure: plant.begin(pressure))(pressure)
    traced, seen = eqx.filter_eval_shape(plant.step, memory, pressure, currents, clock, clock)
    kind = lambda tree: jax.tree.map(lambda x: (jnp.shape(x), jnp.result_type(x)), tree)  # noqa: E731
    assert jax.tree.leaves(kind(traced)) == jax.tree.leaves(kind(memory))
    assert seen.resistances.shape == (2,) and seen.curvature.shape == ()


@pytest.mark.slow
def test_the_plant_steps_as_a_history_goes(body):
    rows, bare = 12, body.with_loads()
    time, currents = np.arange(rows) * 0.5, np.linspace(0.0, 0.2, rows)
    effects = all_effects({"viscoelastic_relaxation": {"g_1": 0.3}, "wrap_friction": {"constant": 2e-4}})
    heat = (pj.Heating(np.zeros(rows)), pj.Heating(currents))
    history = pj.simulate_history(bare, np.full(rows, 20e3), heat, time=time, effects=effects)
    plant = Plant(bare, effects)
    memory, seen = plant.begin(jnp.asarray(20e3)), []
    for k in range(rows):
        interval = jnp.asarray(time[k] - time[max(k - 1, 0)])
        drive = jnp.asarray([0.0, currents[k]])
        memory, row = plant.step(memory, jnp.asarray(20e3), drive, jnp.asarray(time[k]), interval)
        seen.append((float(row.curvature), float(row.bend)))
    known = np.stack([history.rows.curvature, history.rows.bend_angle], axis=1)
    np.testing.assert_allclose(seen, known, rtol=1e-7, atol=1e-9)


@pytest.mark.slow
def test_knowing_the_series_resistance_gives_control_back(body):
    whole = usual_loop()
    rows = whole.time < 40.0
    loop = dataclasses.replace(whole, time=whole.time[rows], wanted=whole.wanted[rows])
    nothing = Plant(body, all_effects({}))
    plant = Plant(body, all_effects({"series_resistance": {"ohms": 0.15}}))
    told = Plant(body, all_effects({"series_resistance": {"ohms": 0.15}}))
    good, bad, known = loop.run(nothing, nothing), loop.run(plant, nothing), loop.run(plant, told)
    assert good.rmse(10.0) < 1.0 and known.rmse(10.0) < 1.0
    assert bad.rmse(10.0) > 2.0 * known.rmse(10.0)
    assert np.max(good.currents) <= 0.4 and good.good.all()
