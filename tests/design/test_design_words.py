"""What a study says of its design: targets, sensitivities, limits of zero, optima inside all limits."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from study_files import PLAIN, changed, write_study

import fitting.characterise  # noqa: F401  results know how they look
import fitting.report.results  # noqa: F401
import pneusma_jax as pj
from fitting.design import read_study, run_study
from fitting.design.bodies import build_body, plan_of
from fitting.design.study import Sweep
from fitting.design.uncertain import soft_failure
from fitting.design.workspace import finer_area
from fitting.report.design.documents import summary
from fitting.report.design.words import _gradient_words, measure_words, sensitivities, whose
from fitting.report.results import text
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel

GOAL = 'goal = "maximise"'
LIMIT = 'at_most = {value = 90, unit = "mm"}'


def solved(folder, study):
    return run_study(read_study(write_study(folder, study)))


def said(result):
    return re.sub(r"\s+", " ", text(result))


def curvature(**sizes):
    """Curvature of the plain study's tube [1/m], from `solve` alone."""
    return float(pj.solve(pj.make_actuator("pneuflex_s", **sizes), 30e3).curvature)


def test_a_target_that_is_met_tells_what_is_reached_and_how_it_changes(tmp_path):
    result = solved(tmp_path, changed(GOAL, 'goal = "target"\ntarget = {value = 40, unit = "1/m"}', PLAIN))
    words = said(result)
    assert "bend 40 1/m, which meets its target" in words and "its target is met" in words
    assert f"The tables' own dimensions give bend {curvature():.4g} 1/m" in words
    assert "balance" not in words
    wall = result.made.parameters["wall_thickness"]
    around = [curvature(wall_thickness=wall + h) for h in (5e-5, -5e-5)]
    assert sensitivities(result, result.made)[0, 0] == pytest.approx(around[0] - around[1], rel=0.01)
    entry = summary(result)["design"]["objectives"]["bend"]
    assert entry["reached"] == pytest.approx(40.0, abs=1e-3) and entry["target"] == pytest.approx(40.0)


def test_a_target_out_of_reach_tells_the_value_and_the_distance(tmp_path):
    result = solved(tmp_path, changed(GOAL, 'goal = "target"\ntarget = {value = 500, unit = "1/m"}', PLAIN))
    best = curvature(wall_thickness=0.7e-3)
    assert f"bend {best:.4g} 1/m, {500.0 - best:.4g} 1/m away from its target 500 1/m" in said(result)
    assert "the lower end of wall_thickness" in said(result)


def test_a_sensitivity_leaves_parameters_with_dependent_bounds_as_they_are(tmp_path):
    linked = changed(
        'to = 1.6, unit = "mm"}',
        'to = {parameter = "outer_diameter", times = 0.2, plus = -0.4}, unit = "mm"}\n'
        'outer_diameter = {from = 9, to = 12, unit = "mm"}',
        PLAIN,
    )
    result = solved(tmp_path, changed(GOAL, 'goal = "target"\ntarget = {value = 40, unit = "1/m"}', linked))
    sizes = dict(result.made.parameters)
    for k, name in enumerate(result.model.space.names):
        ends = [curvature(**sizes | {name: sizes[name] + h}) for h in (5e-5, -5e-5)]
        assert sensitivities(result, result.made)[k, 0] == pytest.approx(ends[0] - ends[1], rel=0.01)


def test_a_front_that_is_a_point_is_rounded(tmp_path):
    stepped = changed(
        'made = "continuous", from = 0.7', 'made = "steps", step = 0.2, from = 0.75', PLAIN
    )
    target = 'goal = "target"\ntarget = {value = 40, unit = "1/m"}'
    again = f'[objective.again]\nquantity = "curvature"\n{target}\nstate = "hot"\n\n[constraint.length]'
    result = solved(tmp_path, changed("[constraint.length]", again, changed(GOAL, target, stepped)))
    assert result.front.made and not result.notes
    wall = 1e3 * result.made.parameters["wall_thickness"]
    walls = np.arange(0.75, 1.6, 0.2)
    best = min(walls, key=lambda x: abs(curvature(wall_thickness=1e-3 * x) - 40.0))
    assert wall == pytest.approx(best, abs=1e-9)


def test_a_design_that_cannot_be_made_is_called_so(tmp_path):
    """One wall is too thin for the limits and the other too thick, so the design stays between them."""
    two = changed(
        'made = "continuous", from = 0.7, to = 1.6', 'made = "catalogue", values = [0.7, 1.6]', PLAIN
    )
    length = [float(pj.solve(pj.make_actuator("pneuflex_s", wall_thickness=w), 30e3).length) for w in (8e-4, 15e-4)]
    low, high = (f"{{value = {1e3 * x:.6f}, unit = 'mm'}}" for x in sorted(length))
    result = solved(tmp_path, changed(LIMIT, f"at_least = {low}\nat_most = {high}", two))
    assert "It cannot be made" in said(result) and "costs nothing" not in said(result)


def test_room_at_a_limit_of_zero_is_told_in_its_unit(tmp_path):
    result = solved(
        tmp_path, changed('"length"\n' + LIMIT, '"bend_angle"\nat_least = {value = 0, unit = "deg"}', PLAIN)
    )
    found = pj.solve(pj.make_actuator("pneuflex_s", wall_thickness=0.7e-3), 30e3)
    assert f"{np.rad2deg(float(found.bend_angle)):.3g} deg" in said(result)


def test_an_optimum_inside_all_limits_is_called_one(tmp_path):
    (tmp_path / "mine.py").write_text(
        "def bend(states, parameters):\n    return 1.0 + (1e3 * parameters['wall_thickness'] - 1.1) ** 2\n"
    )
    function = 'quantity = "function"\nfile = "mine.py"\ngoal = "minimise"\n'
    result = solved(tmp_path, changed('quantity = "curvature"\n' + GOAL + '\nstate = "hot"\n', function, PLAIN))
    assert result.conditions.steepness < 1e-3 and not result.notes
    assert "Nothing limits it: it lies within all constraints and ranges." in said(result)
    assert "The continuous design is at no limit." in said(result) and "1e+02" not in said(result)


@pytest.mark.parametrize("spread", [1e-4, 1e-2, 1.0])
def test_a_smooth_share_of_failures_is_near_to_the_probability(spread):
    """Whatever the spread, 2.3 % beyond two standard deviations count as 1.5 to 4.5 %."""
    even = stats.norm.ppf((np.arange(64) + 0.5) / 64)
    assert 0.015 < float(soft_failure(spread * (even - 2.0))) < 0.045
    assert float(soft_failure(spread * even)) == pytest.approx(0.5, abs=0.01)


def test_a_finer_polygon_has_the_area_of_the_shape_that_the_tip_covers():
    """Against the area of all cells of a grid over pressure and activation."""
    plan = plan_of("pneusma2")
    body = build_body(plan, {}, plan.materials())
    pressure, heat = np.meshgrid(np.linspace(0.0, 50e3, 61), np.linspace(-0.7, 0.7, 121), indexing="ij")
    drives = [pj.MartensiteFraction(1.0 - np.maximum(s * heat, 0.0).ravel()) for s in (-1.0, 1.0)]
    found = pj.solve_batch(body.segments[0], pressure.ravel(), tuple(drives))
    angle, length = np.asarray(found.bend_angle), np.asarray(found.length)
    tip = length * np.sinc(0.5 * angle / np.pi) * np.exp(0.5j * angle)  # along the tube, and across
    tip = tip.reshape(pressure.shape)
    a, b = tip[1:, 1:] - tip[:-1, :-1], tip[1:, :-1] - tip[:-1, 1:]
    covered = 0.5 * np.abs(np.sum((a.conj() * b).imag))
    area = finer_area(body, plan.tables[0], Sweep(0.0, 50e3, 0.3, 8))
    assert area == pytest.approx(covered, rel=2e-3)


@pytest.mark.parametrize(
    ("rule", "measure"),
    [
        ("", "the mean"),
        ('objective = "mean_plus_sigma"\nk = 1', "the mean, made worse by 1 standard deviation,"),
        ('objective = "mean_plus_sigma"\nk = 2', "the mean, made worse by 2 standard deviations,"),
        ('objective = "cvar"\nlevel = 0.9', "the mean of the worst 10 %"),
    ],
)
def test_a_study_under_uncertainty_says_what_its_number_is_of_the_draws(rule, measure, tmp_path):
    unsure = f'{PLAIN}\n[uncertainty]\n{rule}\ndraws = 8\n[uncertainty.tolerance]\n'
    study = read_study(write_study(tmp_path, unsure + 'wall_thickness = {sd = 0.03, unit = "mm"}\n'))
    assert measure_words(study) == [f"What is told of 'bend' is {measure} of 8 draws."]
    assert measure_words(read_study(write_study(tmp_path, PLAIN))) == []


@pytest.mark.parametrize(("left", "balanced"), [(0.0123, "all but 1.2 % of it"), (0.0, "all of it"), (4e-5, "all of it")])
def test_what_limits_leave_of_a_gradient_is_told_in_short_sentences(left, balanced):
    result = SimpleNamespace(conditions=SimpleNamespace(inside=False, left=left))
    assert _gradient_words(result) == (
        f"At an exact optimum the limits that hold the design balance the gradient of the objective. Here they balance {balanced}."
    )


def test_the_dimensions_that_a_study_begins_at_are_those_of_the_tables_or_of_its_model():
    found = [whose(SimpleNamespace(study=SimpleNamespace(model=one))) for one in (BASE, AugmentedModel(name="mine.toml"))]
    assert found == ["the tables'", "the model mine.toml's"]


@pytest.mark.slow
def test_the_page_s_python_finds_the_wall_that_it_says():
    page = (Path(__file__).parents[2] / "docs" / "design.md").read_text(encoding="utf-8")
    section = page.partition("## In Python")[2].partition("## How it works")[0]
    exec(re.search(r"```python\n(.*?)```", section, re.DOTALL)[1], scope := {})
    by_wall, by_wire = map(float, scope["slopes"])
    assert f"{1e-3 * by_wall:.1f} 1/m for 1 mm of wall and by {1e-5 * by_wire:.2f} 1/m for 0.01 mm" in " ".join(section.split())
    assert f"A wall of {scope['found'].x[0]:.3f} mm" in section
