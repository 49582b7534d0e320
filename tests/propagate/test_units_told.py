"""Units at the edges of a study: outputs, limits and inputs are told with theirs; contradictions are refused."""

import csv
import io
import json
import warnings
from importlib import resources

import pytest
from study_texts import ONE_STATE, PLAIN

import pneusma_jax as pj
from fitting.propagate import build_problem, propagate, read_study
from fitting.report.propagate import plan_text
from fitting.report.results import save, text
from pneusma_jax.errors import DISTRUSTED, Distrusted, InputError

pj.enable_float64()
STATE = f"""{ONE_STATE}[input.G_m]
mean = 3.0
sd = 0.3
unit = "GPa"
[input.T_mid]
low = 40.0
high = 60.0
unit = "degC"
[[output]]
name = "angle"
of = "bend_angle_deg"
[[output]]
name = "curvature_1pm"
"""
MORE = '[[output]]\nname = "{}"\nof = "bend_angle_deg - 0.1 * force_2_N"\n'


def problem_of(write, more="", study=STATE):
    return build_problem(read_study(write(study + more)))


def told_of(write, more="", study=STATE):
    return list(problem_of(write, more, study).notices)


def test_an_output_has_the_unit_of_the_one_that_it_is_of_its_name_or_the_stated_one(write):
    found = problem_of(write, MORE.format("tip") + 'unit = "deg"\n' + MORE.format("both_deg")).columns
    assert found.units == ["deg", "1pm", "deg", "deg"]
    assert found.shown == ["angle [deg]", "curvature_1pm", "tip [deg]", "both_deg"]
    assert found.labels == ["angle", "curvature_1pm", "tip", "both_deg"]
    assert not found.limit("curvature_1pm above 70").endswith("1/m") and found.limit("tip above 3") == "tip above 3 deg"


def test_an_output_whose_unit_nobody_states_is_named(write):
    assert told_of(write, MORE.format("tip"))[-1].startswith("tip has no unit: state unit in [[output]]")
    assert not any("no unit" in one for one in [*told_of(write), *told_of(write, study=PLAIN)])


@pytest.mark.parametrize(("more", "said"), [
    ('[[output]]\nname = "angle_rad"\nof = "bend_angle_deg"\n', "'rad' by its name and 'deg' by the output bend_angle_deg"),
    ('[[output]]\nname = "tip"\nof = "length_mm"\nunit = "m"\n', "'m' by unit and 'mm' by the output length_mm"),
    (MORE.format("tip") + 'unit = "degrees"\n', "unknown unit 'degrees', "),
    (MORE.format("tip") + "unit = 3\n", "unknown unit 3"),
])  # fmt: skip
def test_a_unit_that_contradicts_or_is_not_known_is_refused(write, more, said):
    with pytest.raises(InputError) as refused:
        problem_of(write, more)
    assert said in str(refused.value) and "[[output]]" in str(refused.value)


@pytest.mark.parametrize(("of", "unit", "shown"), [
    ("curvature_1pm", "1/m", "tip [1/m]"), ("bend_angle_deg", "deg", "tip [deg]"), ("xi0_1", "mm/mm", "tip [mm/mm]"),
])  # fmt: skip
def test_one_unit_in_two_spellings_is_no_contradiction(write, of, unit, shown):
    problem = problem_of(write, f'[[output]]\nname = "tip"\nof = "{of}"\nunit = "{unit}"\n')
    assert problem.columns.quantities[-1].shown == shown


def test_inputs_are_previewed_with_unit_and_quantiles(write):
    rows = {line.split()[0]: line.split() for line in plan_text(problem_of(write)).splitlines()[4:]}
    assert rows["G_m"][1:3] == ["GPa", "normal"] and float(rows["G_m"][-2]) == pytest.approx(3.0)
    assert rows["T_mid"][1:3] == ["degC", "uniform"] and [float(x) for x in rows["T_mid"][-3:]] == pytest.approx([41, 50, 59])


def test_text_tables_and_files_have_units(write, tmp_path):
    limit = '[[limit]]\non = "y"\nabove = 9.0\n[sampling]\nrows = 64\nchunk = 100\n'
    study = PLAIN + '[[output]]\nname = "y"\nunit = "mm"\n' + limit
    result = propagate(problem_of(write, study=study), tmp_path / "out")
    said = text(result)
    assert "y [mm]: " in said and "y above 9 mm: in " in said
    save(result, tmp_path / "out", force=True)
    (row,) = csv.DictReader(io.StringIO((tmp_path / "out" / "columns.csv").read_text()))
    assert row["unit"] == "mm"
    inputs = {r["input"]: r for r in csv.DictReader(io.StringIO((tmp_path / "out" / "inputs.csv").read_text()))}
    assert inputs["a"]["unit"] == "1" and float(inputs["a"]["q95"]) == pytest.approx(1.0 + 0.5 * 1.6449, rel=1e-4)
    assert json.loads((tmp_path / "out" / "report.json").read_text())["columns"]["y"]["unit"] == "mm"


def test_a_page_repeats_what_a_table_says_against_its_numbers(write, tmp_path):
    shipped = (resources.files("calibration_data") / "krl35.toml").read_text()
    said = shipped.replace('kind = "alloy"\n', 'kind = "alloy"\ncaution = "It misses."\n')
    (tmp_path / "alloy.toml").write_text(f"\ufeff{said}", encoding="utf-8")  # as some editors save it
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Distrusted)
        problem = problem_of(write, study=STATE.replace('design =', 'alloy = "alloy.toml"\ndesign ='))
    assert problem.cautions == [f"{tmp_path / 'alloy.toml'}: {DISTRUSTED}. It misses."]
    assert problem_of(write).cautions == []
