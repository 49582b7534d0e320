"""A small study against a grid of its whole box, and what is said of it."""

import dataclasses
import re

import numpy as np
import pytest
from click.testing import CliRunner
from study_files import PLAIN, SMALL, changed, write_study

import pneusma_jax as pj
from fitting.cli import main
from fitting.design import read_study, run_study
from fitting.design.bodies import plan_of
from fitting.design.program import Model
from fitting.design.search import LEAST_SIZE
from fitting.report.design.documents import tables
from fitting.report.design.figures import pictures
from fitting.report.results import text
from pneusma_jax.errors import InputError


def evaluated(result, places):
    """Values and derivatives at places, in lots of the search's own size, whose program is compiled."""
    size = max(result.study.starts, LEAST_SIZE)
    lots = [result.model.evaluate(places[k : k + size], size) for k in range(0, len(places), size)]
    return tuple(np.concatenate(parts) for parts in zip(*lots, strict=True))


def test_no_design_of_a_grid_is_better(small):
    result, _ = small
    walls, coils = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 31)
    grid = np.stack(np.meshgrid(walls, coils, indexing="ij"), axis=-1).reshape(-1, 2)
    values, _ = evaluated(result, grid)
    kept = np.all(values[:, 1:] <= 0.0, axis=1)
    best = -values[kept, 0].min()
    assert result.made.objectives[0] > best * (1.0 - 1e-9)
    assert result.made.objectives[0] < best * 1.03  # the grid is fine enough to know
    assert result.made.parameters["active_coils"] % 1.0 == pytest.approx(0.0, abs=1e-9)


def test_derivatives_are_those_of_differences(small):
    place, h = np.array([0.4, 0.6]), 1e-5
    _, (slopes,) = evaluated(small[0], place[None])
    around = np.array([place + h * e for e in (*np.eye(2), *-np.eye(2))])
    moved, _ = evaluated(small[0], around)
    np.testing.assert_allclose(slopes.T, (moved[:2] - moved[2:]) / (2.0 * h), rtol=1e-6, atol=1e-8)


def test_the_constraint_that_binds_has_a_multiplier(small):
    result, _ = small
    assert result.conditions.left < 1e-3
    rows = [k for k, m in enumerate(result.conditions.rows) if m > 0.0]
    assert [result.study.constraints[result.model.rows[k].constraint].name for k in rows] == ["length"]


@pytest.mark.slow
def test_multipliers_are_what_giving_way_is_worth(small):
    result, _ = small
    rows = [k for k, m in enumerate(result.conditions.rows) if m > 0.0]
    looser = dataclasses.replace(result.study.constraints[0], limit=58.3e-3 * 1.001)
    wider = dataclasses.replace(result.study, constraints=(looser, result.study.constraints[1]))
    again = run_study(wider)
    gain = again.ideal.objectives[0] - result.ideal.objectives[0]
    size = 1.0 / np.max(np.abs(result.problem.weights))
    assert gain == pytest.approx(result.conditions.rows[rows[0]] * 0.001 * size, rel=0.05)


def test_the_table_it_leaves_has_the_state_it_promises(small, tmp_path):
    result, _ = small
    (tmp_path / "design.toml").write_text(tables(result, result.made)["design.toml"])
    body = pj.make_actuator(tmp_path / "design.toml")
    found = pj.solve(body, 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.3)))
    assert float(found.curvature) == pytest.approx(result.made.objectives[0], rel=1e-9)
    assert float(found.length) <= 58.3e-3 * (1.0 + 1e-5)


def test_limits_are_those_of_the_design_that_can_be_made(small):
    """The wall is continuous and at its end; one coil more would break the limit of the length."""
    result, _ = small
    conditions = result.limits.conditions
    assert result.made.evaluation is not result.ideal.evaluation
    held = np.array([f.discrete for f in result.model.space.free])
    assert not conditions.low[held].any() and not conditions.high[held].any()
    assert [result.model.space.free[step.parameter].name for step in result.limits.blocked] == [
        "active_coils"
    ]
    step = result.limits.blocked[0]
    assert step.up and [result.model.rows[row - 1].constraint for row in step.rows] == [0]
    more = pj.make_actuator("pneusma2", **result.made.parameters | {"active_coils": 51.0})
    state = pj.solve(more, 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.3)))
    assert result.made.parameters["active_coils"] == 50.0 and float(state.length) > 58.3e-3
    said = re.sub(r"\s+", " ", text(result))
    assert "It is limited by constraint 'length' and the lower end of wall_thickness" in said


def test_the_report_says_what_limits_the_design(small):
    result, _ = small
    said = re.sub(r"\s+", " ", text(result))
    assert "It is limited by constraint 'length'" in said
    assert "Rounding to what can be made costs" in said and "0.1 mm" in said
    files = result.documents()
    assert {"report.html", "report.json", "design.toml", "shapes.png", "sensitivities.png"} <= set(files)


def in_closed_form(curvature, violation):
    """In place of `Model.evaluate` for a study of one number: both rows as straight lines, offset and slope."""
    lines = np.array([curvature, violation])

    def evaluate(model, places, size=None):
        values = lines[:, 0] + np.asarray(places) * lines[:, 1]
        return values, np.broadcast_to(lines[None, :, 1:], (len(places), 2, 1))

    return evaluate


def test_every_figure_has_a_title_and_axes_with_a_quantity_and_a_unit(small):
    result, _ = small
    for name, picture in pictures(result).items():
        figure = picture.figure
        labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
        assert figure.get_suptitle(), name
        assert labels and all(re.fullmatch(r"(?![xyz] ).+ \[.+\]", label) for label in labels), (name, labels)


def test_constraints_that_contradict_each_other_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(Model, "evaluate", in_closed_form((-20.0, 5.0), (0.2, -0.05)))
    both = changed("value = 90", "value = 50.0", PLAIN)
    with pytest.raises(InputError, match=r"keeps constraint 'length'.*missed by at least 7\.5 mm"):
        run_study(read_study(write_study(tmp_path, both)), tmp_path / "out" / "evaluations.jsonl")
    assert not (tmp_path / "out").exists()  # a study that is refused leaves nothing


def test_a_refusal_of_another_study_s_evaluations_leaves_them(tmp_path):
    log = tmp_path / "out" / "evaluations.jsonl"
    log.parent.mkdir()
    log.write_text("of another study\n")
    with pytest.raises(InputError, match="evaluations of another study"):
        run_study(read_study(write_study(tmp_path)), log)
    assert log.read_text() == "of another study\n"


@pytest.mark.slow
def test_draws_without_equilibrium_are_counted(tmp_path):
    wide = (
        SMALL + '\n[uncertainty]\ndraws = 8\n[uncertainty.tolerance]\nwall_thickness = {sd = 5, unit = "mm"}'
    )
    with pytest.raises(InputError, match="in all 8 draws: at the first one [1-8] of them have none"):
        run_study(read_study(write_study(tmp_path, wide)))


@pytest.mark.slow
def test_an_objective_that_nothing_free_changes_is_refused(tmp_path):
    held = changed('quantity = "curvature"', 'quantity = "outer_diameter"')
    with pytest.raises(InputError, match="'bend' changes with nothing that is free"):
        run_study(read_study(write_study(tmp_path, held)), tmp_path / "out" / "evaluations.jsonl")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_an_objective_that_only_rounding_errors_change_is_refused(tmp_path):
    """With both springs cold the curvature is zero, and its derivatives are rounding errors."""
    cold = changed("xi0_2 = 0.3\n", "")
    with pytest.raises(InputError, match="'bend' changes with nothing that is free"):
        run_study(read_study(write_study(tmp_path, cold)))


@pytest.mark.slow
def test_starts_that_are_lost_are_counted_and_said(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import jax.numpy as jnp\n\n\ndef bend(states, parameters):\n"
        "    thick = parameters['wall_thickness'] > 1.05e-3\n"
        "    return jnp.where(thick, jnp.nan, states['hot'].only.curvature)\n"
    )
    mine = changed('quantity = "curvature"', 'quantity = "function"\nfile = "mine.py"')
    mine = mine.replace('state = "hot"\n', "").replace("starts = 3", "starts = 4")
    result = run_study(read_study(write_study(tmp_path, mine)))
    said = re.sub(r"\s+", " ", text(result))
    assert result.lost > 0 and result.lost + len(result.starts) == 4
    assert f"{result.lost} of 4 starts were not solved" in said and f"4 starts; {result.lost} were not" in said


@pytest.mark.slow
def test_an_objective_that_only_the_choice_of_a_design_changes_is_none_to_refuse(tmp_path):
    held = changed('quantity = "curvature"\ngoal = "maximise"', 'quantity = "outer_diameter"\ngoal = "minimise"')
    wide = held.replace('design = "pneusma2"', 'design = ["pneusma1", "pneusma2"]').replace("58.3", "80")
    found = run_study(read_study(write_study(tmp_path, wide)))
    others = [one.objectives[0] for one in found.others]
    assert found.made.violation <= 1e-6 and all(found.made.objectives[0] <= other for other in others)
    assert {found.made.choice.design, *(one.choice.design for one in found.others)} == {"pneusma1", "pneusma2"}


@pytest.mark.slow
def test_two_constraints_that_contradict_each_other_are_named_and_no_third(tmp_path):
    more = (
        '[constraint.long]\nquantity = "length"\nat_least = {value = 58.6, unit = "mm"}\n[constraint.shear]'
    )
    with pytest.raises(InputError) as caught:
        run_study(read_study(write_study(tmp_path, changed("[constraint.shear]", more))))
    said = str(caught.value)
    assert "'length' (length at most 58.3 mm) and 'long' (length at least 58.6 mm) contradict" in said
    assert "shear" not in said and "\n" not in said
    assert re.search(r"misses 'length' by 0\.1\d mm or 'long' by 0\.1\d mm", said)


def test_an_objective_that_is_not_a_number_is_said(tmp_path):
    (tmp_path / "mine.py").write_text(
        "def bend(states, parameters):\n    return states['hot'].pressure * float('nan')\n"
    )
    mine = changed('quantity = "curvature"', 'quantity = "function"\nfile = "mine.py"', PLAIN).replace(
        'state = "hot"\n', ""
    )
    with pytest.raises(InputError, match="objective 'bend' is not a number at any of the 3 starts"):
        run_study(read_study(write_study(tmp_path, mine)))


def test_a_function_of_the_users_is_the_quantity_it_computes(tmp_path):
    (tmp_path / "mine.py").write_text(
        "def bend(states, parameters):\n    return states['hot'].only.curvature\n"
    )
    mine = changed('quantity = "curvature"', 'quantity = "function"\nfile = "mine.py"', PLAIN).replace(
        'state = "hot"\n', ""
    )
    place, plan = np.array([[0.3]]), plan_of("pneuflex_s")
    found, wanted = (
        Model(read_study(write_study(tmp_path, text)), plan).values(place) for text in (mine, PLAIN)
    )
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_the_command_refuses_results_that_are_there(small, tmp_path):
    _, folder = small
    (folder / "out").mkdir(exist_ok=True)
    (folder / "out" / "report.json").write_text("{}")
    done = CliRunner().invoke(main, ["design", str(folder / "study.toml"), "--out", str(folder / "out")])
    assert done.exit_code == 2 and "results are here already" in done.stderr
    assert SMALL
