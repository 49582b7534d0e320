"""`pneusma simulate` of one state: the JSON contract, the page, every refusal."""

import json

import numpy as np
import pytest
from cli_samples import simulated

import pneusma_jax as pj

PLANAR = [
    "status", "delta_1_mm", "delta_2_mm", "length_mm", "bend_angle_deg", "curvature_1pm", "force_1_N", "force_2_N",
]  # fmt: skip


def test_json_holds_what_the_model_says(run):
    printed = simulated(run, "--design", "pneusma2", "--pressure-kPa", 30, "--xi0-1", 1.0, "--xi0-2", 0.4)
    assert list(printed) == PLANAR and printed["status"] == "converged"
    body = pj.make_actuator("pneusma2")
    found = pj.solve(body, 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.4)))
    assert printed["curvature_1pm"] == pytest.approx(float(found.curvature), rel=1e-9)
    assert printed["delta_1_mm"] == pytest.approx(1e3 * float(found.delta_1), rel=1e-9)
    assert printed["bend_angle_deg"] == pytest.approx(np.degrees(float(found.bend_angle)), rel=1e-9)
    assert printed["force_2_N"] == pytest.approx(float(found.springs[1].force), rel=1e-9)


def test_defaults_are_pneusma2_with_cold_springs(run):
    stated = simulated(
        run, "--design", "pneusma2", "--pressure-kPa", 30, "--xi0-1", 1, "--xi0-2", 1, "--alloy", "krl35"
    )
    assert simulated(run, "--pressure-kPa", 30) == stated


@pytest.mark.parametrize(("design", "there"), [("pneusma1", [2]), ("pneuflex_s", [])])
def test_forces_of_springs_that_are_not_there_are_null(run, design, there):
    printed = simulated(run, "--design", design, "--pressure-kPa", 20)
    assert [k for k in (1, 2) if printed[f"force_{k}_N"] is not None] == there


@pytest.mark.slow
def test_triad_adds_its_third_side_and_the_direction(run):
    printed = simulated(run, "--design", "triad", "--pressure-kPa", 20, "--xi0-3", 0.4)
    assert {"delta_3_mm", "bend_direction_deg", "force_3_N"} <= set(printed)
    # spring 3 sits at 330 degrees and shortens, so the opposite side, at 150, is the longest
    assert printed["bend_direction_deg"] == pytest.approx(150.0)
    assert printed["delta_1_mm"] == pytest.approx(printed["delta_2_mm"]) and printed["delta_3_mm"] < 0.0


def test_a_resistance_leads_back_to_its_state(run):
    body = pj.make_actuator("pneusma2")
    found = pj.solve(body, 20e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.6)))
    ohms = float(found.springs[1].resistance)
    printed = simulated(run, "--pressure-kPa", 20, "--resistance-2-ohm", ohms)
    assert printed["curvature_1pm"] == pytest.approx(float(found.curvature), rel=1e-6)


def test_geometry_file_in_other_units_and_precedence(run, tmp_path):
    file = tmp_path / "thick.toml"
    file.write_text('[geometry]\ndesign = "pneusma1"\nwall_thickness_in = 0.059055118110236220\n')
    printed = simulated(run, "--geometry", file, "--design", "pneuflex_s", "--pressure-kPa", 20)
    assert printed == pytest.approx(simulated(run, "--design", "pneuflex_t", "--pressure-kPa", 20))
    bare = tmp_path / "bare.toml"
    bare.write_text("wall_thickness_mm = 1.5\n")
    assert simulated(run, "--geometry", bare, "--design", "pneuflex_s", "--pressure-kPa", 20) == pytest.approx(
        printed
    )


def test_page_says_units_and_what_to_read_with_care(run):
    result = run("simulate", "--pressure-kPa", 20, "--resistance-2-ohm", 6.0)
    assert result.exit_code == 0
    assert all(word in result.stdout for word in ("curvature", "1/m", "pull [N]", "from resistance", "cold"))
    assert "blind" in result.stderr and "spring 2" in result.stderr


def test_no_equilibrium_is_null_with_a_sentence_and_exit_code_1(run):
    result = run("simulate", "--design", "pneusma1", "--pressure-kPa", -90, "--json")
    printed = json.loads(result.stdout)
    assert result.exit_code == 1
    assert printed["status"] in [s.name for s in pj.Status if s != pj.Status.converged]
    assert all(printed[key] is None for key in PLANAR[1:])
    assert pj.Status[printed["status"]].sentence in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "--pressure-kPa is missing"),
        (("--pressure-kPa", "much"), "not a valid float"),
        (("--pressure-kPa", "nan"), "'--pressure-kPa': 'nan' is not a finite number"),
        (("--pressure-kPa", 20, "--xi0-2", 1.2), "from 0 (hot) to 1 (cold)"),
        (("--pressure-kPa", 20, "--xi0-2", -0.1), "from 0 (hot) to 1 (cold)"),
        (("--pressure-kPa", 20, "--resistance-2-ohm", 0), "positive"),
        (("--pressure-kPa", 20, "--resistance-2-ohm", -3), "positive"),
        (("--pressure-kPa", 20, "--resistance-2-ohm", 60), "half to twice the range of alloy 'krl35'"),
        (("--pressure-kPa", 20, "--resistance-2-ohm", 0.5), "half to twice the range of alloy 'krl35'"),
        (("--pressure-kPa", 20, "--xi0-2", 0.5, "--resistance-2-ohm", 3.5), "not both"),
        (("--pressure-kPa", 20, "--design", "pneusma3"), "did you mean 'pneusma2'?"),
        (("--pressure-kPa", 20, "--alloy", "krl53"), "did you mean"),
        (("--pressure-kPa", 20, "--alloy", "nowhere.toml"), "no such file"),
        (("--pressure-kPa", 20, "--material", "dragon_skin"), "dragon_skin_10_fast"),
        (("--pressure-kPa", 20, "--material", "krl35"), "kind"),
        (("--pressure-kPa", 20, "--geometry", "nowhere.toml"), "nowhere.toml"),
        (("--pressure-kPa", 20, "--raw-resistance"), "goes with a recording"),
        (("--pressure-kPa", 20, "--protocol", "thermal_cycle", "--out", "x"), "brings its own inputs"),
        (("--protocol", "thermal_cycle"), "needs --out"),
        (("--pressure-kPa", 20, "--xi0", "2=1.4"), "from 0 (hot) to 1 (cold)"),
        (("--pressure-kPa", 20, "--xi0", "2:0.4"), "SPRING=VALUE"),
        (("--pressure-kPa", 20, "--xi0", "2=0.4", "--xi0-2", 0.5), "not both"),
        (("--pressure-kPa", 20, "--xi0", "1.2=0.4"), "goes with the --design of a chain"),
        (("--pressure-kPa", 20, "--design", "orthogonal_chain", "--xi0", "5.1=0.4"), "the chain has 4"),
        (("--pressure-kPa", 20, "--design", "nowhere.toml"), "no such file"),
    ],
)
def test_refusals(refused, arguments, words):
    assert words in refused("simulate", *arguments)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[geometry]\nwall_thickness_mm = -1.0\n", "wall_thickness_mm = -1 must be more than 0"),
        ("[geometry]\nwall_thickness_mm = 6.0\n", "no bore"),
        ("[geometry]\nwall_thicknes_mm = 1.0\n", "did you mean 'wall_thickness_mm'?"),
        ("[geometry]\nwall_thickness_kPa = 1.0\n", "unit"),
        ('[geometry]\nwall_thickness_mm = "thin"\n', "finite number"),
        ("[geometry\n", "not a TOML file"),
        ("[noise]\ncurvature_1pm = 1.0\n", "[geometry]"),
        ('[geometry]\nalloy = "fit"\n', "to be fitted"),
    ],
)
def test_geometry_refusals_name_the_file(refused, tmp_path, text, words):
    file = tmp_path / "body.toml"
    file.write_text(text)
    line = refused("simulate", "--pressure-kPa", 20, "--geometry", file)
    assert words in line and "body.toml" in line


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--design", "pneusma2", "--xi0-3", 0.4), ("xi0_3 cannot be used", "no spring 3 (it has: 1, 2)")),
        (("--design", "pneusma1", "--xi0-1", 0.5, "--json"), ("xi0_1", "no spring 1 (it has: 2)")),
        (("--design", "pneusma1", "--resistance-1-ohm", 3.7), ("resistance_1", "no spring 1 (it has: 2)")),
        (("--design", "pneuflex_s", "--xi0-1", 0.4), ("xi0_1", "no spring 1 (it has: none)")),
        (("--design", "orthogonal_chain", "--xi0", "2.7=0.4"), ("xi0_7", "orthogonal_chain has no spring 7")),
    ],
)
def test_an_input_of_a_spring_that_is_not_there_is_refused(refused, arguments, said):
    line = refused("simulate", "--pressure-kPa", 30, *arguments)
    for words in said:
        assert words in line
