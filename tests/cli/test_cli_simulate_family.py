"""`pneusma simulate` and `workspace` of described actuators and chains: what Python says, from one TOML."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from cli_samples import simulated

import pneusma_jax as pj

DESIGNS = Path(pj.__file__).resolve().parents[1] / "calibration_data" / "examples" / "designs"


@pytest.mark.slow
@pytest.mark.parametrize("design", [pytest.param("rectangular", marks=pytest.mark.slow), "pneuflex_weighed"])
def test_a_table_by_name_and_by_path_is_what_python_solves(run, tmp_path, design):
    path = Path(shutil.copy(DESIGNS / f"{design}.toml", tmp_path / "mine.toml"))
    body = pj.make_actuator(design)
    given = tuple(pj.MartensiteFraction(0.4 if n == 2 else 1.0) for n in body.spring_numbers)
    found = pj.solve(body, 20e3, given)
    hot = ("--xi0-2", 0.4) if 2 in body.spring_numbers else ()
    for stated in (design, path):
        printed = simulated(run, "--design", stated, "--pressure-kPa", 20, *hot)
        assert printed["curvature_1pm"] == pytest.approx(float(found.curvature), rel=1e-9)
    if body.loads:
        bare = pj.solve(body.with_loads(), 20e3)
        assert abs(float(bare.curvature) - printed["curvature_1pm"]) > 1e-2


def _changed(tmp_path, old, new):
    text = (DESIGNS / "rectangular.toml").read_text()
    assert old in text
    path = tmp_path / "body.toml"
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("# Tube.", 'angle_1 = {value = 80.0, unit = "deg", status = "assumed", source = "x"}\n'
         'angle_2 = {value = 90.0, unit = "deg", status = "assumed", source = "x"}\n# Tube.', "overlap"),
        ("wall_thickness = {value = 1.0", "wall_thickness = {value = 4.0", "body.toml"),
        ("wall_thickness = {value = 1.0", "wall_thickness = {value = -1.0", "must be positive"),
        ("height = ", "hight = ", "did you mean 'height'?"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_file(refused, tmp_path, old, new, words):
    line = refused("simulate", "--design", _changed(tmp_path, old, new), "--pressure-kPa", 20)
    assert words in line and "body.toml" in line


def test_a_dimension_that_the_section_has_not_is_refused(refused, tmp_path):
    file = tmp_path / "body.toml"
    file.write_text("outer_diameter_mm = 9.0\n")
    line = refused("simulate", "--design", "rectangular", "--geometry", file, "--pressure-kPa", 20)
    assert "no dimension of 'rectangular'" in line


def _numbers(state):
    return {name: value for name, value in state.items() if isinstance(value, float)}


@pytest.mark.slow
def test_a_chain_is_its_segments(run, tmp_path):
    printed = simulated(
        run, "--design", "orthogonal_chain", "--pressure-kPa", 15, "--xi0", "2.1=0.4", "--out", tmp_path / "o"
    )
    alone = simulated(run, "--pressure-kPa", 15, "--xi0-1", 0.4)
    assert printed["status"] == "converged" and len(printed["segments"]) == 4
    assert _numbers(printed["segments"][1]) == pytest.approx(_numbers(alone), rel=1e-9, abs=1e-9)
    assert printed["segments"][0]["bend_angle_deg"] == pytest.approx(0.0, abs=1e-9)
    assert abs(printed["tip_mm"][1]) < 1e-9, "only a segment turned by 90 degrees bends"
    assert np.linalg.det(printed["tip_axes"]) == pytest.approx(1.0)
    assert json.loads((tmp_path / "o" / "state.json").read_text()) == printed
    assert (tmp_path / "o" / "shape.png").read_bytes().startswith(b"\x89PNG")
    everywhere = simulated(run, "--design", "orthogonal_chain", "--pressure-kPa", 15, "--xi0-1", 0.4)
    assert [s["bend_angle_deg"] for s in everywhere["segments"]] == pytest.approx(
        [alone["bend_angle_deg"]] * 4
    )


@pytest.mark.slow
def test_a_loaded_chain_is_what_python_says(run, tmp_path):
    """The shipped example: every segment weighed, bent out of the plane of its springs, and stable."""
    printed = simulated(run, "--design", "loaded_chain", "--pressure-kPa", 15, "--xi0", "1.1=0.6")
    body = dataclasses.replace(pj.make_actuator("pneusma2"), bending_plane=None)
    chain = pj.chain_of(body, 2, angles=(0.0, np.pi / 2), connectors=4e-3)
    fall = pj.gravity_vector("horizontal")
    heavy = pj.chain_weight(chain.segments, 1070.0, fall, 0.5e-3, None, 4e-3, 0.3e-3)
    cold, warm = pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.6)
    loaded = chain.with_loads(heavy, pj.PointLoad([2e-3, 0.0, 0.0]))
    found = pj.solve_chain(loaded, 15e3, ((warm, cold), (cold, cold)))
    assert printed["status"] == "converged" and printed["stable"] is True
    assert printed["tip_mm"] == pytest.approx(1e3 * np.asarray(found.end_pose)[:3, 3], abs=1e-6)
    assert abs(printed["tip_mm"][0]) > 1.0 and all("bend_direction_deg" in s for s in printed["segments"])


MASS = '{value = 1.0, unit = "g", status = "assumed", source = "x"}'
CHAIN = """schema = "pneusma-chain/1"
name = "mine"
[[segment]]
design = "pneusma2"
count = 2
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[[segment]]", "[[segments]]", "did you mean 'segment'?"),
        ('design = "pneusma2"', 'design = "pneusma3"', "did you mean 'pneusma2'?"),
        ("count = 2", "count = 0", "whole number from 1"),
        ("count = 2", "count = 2\nangle = 3.0", "angle"),
        (
            "count = 2",
            'connector = {value = -1.0, unit = "mm", status = "assumed", source = "x"}',
            "negative",
        ),
        ('name = "mine"', 'name = "mine"\norientation = "sideways"', "orientation is 'sideways'"),
        ('name = "mine"', f'name = "mine"\ntip_mass = {MASS}', "a mass weighs nothing without gravity"),
        ("count = 2", f"count = 2\nconnector_mass = {MASS}", "there is no 'connector'"),
        ('name = "mine"', f'name = "mine"\ntip_force_x = {MASS}', "tip_force_x"),
        ('name = "mine"', 'name = "mine"\ntip_follows = true', "add 'tip_force_x' or another"),
        (
            'name = "mine"\n[[segment]]\ndesign = "pneusma2"',
            'name = "mine"\norientation = "horizontal"\n[[segment]]\ndesign = "pneuflex_weighed"',
            "gravity is one for the whole chain",
        ),
        ('[[segment]]\ndesign = "pneusma2"\ncount = 2\n', "", "at least one segment"),
    ],
)
def test_chains_that_cannot_be_are_refused(refused, tmp_path, old, new, words):
    path = tmp_path / "mine.toml"
    assert old in CHAIN
    path.write_text(CHAIN.replace(old, new))
    line = refused("simulate", "--design", path, "--pressure-kPa", 10)
    assert words in line and "mine.toml" in line


def test_a_model_of_one_state(run, tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(
        'schema = "pneusma-model/1"\n[base]\n'
        'wall_thickness = {value = 1.5, unit = "mm", status = "fitted", source = "x"}\n'
    )
    thick = simulated(run, "--design", "pneuflex_t", "--pressure-kPa", 20)
    assert simulated(run, "--design", "pneuflex_s", "--pressure-kPa", 20, "--model", path)["curvature_1pm"] == (
        pytest.approx(thick["curvature_1pm"])
    )
    path.write_text(
        path.read_text() + '[[effect]]\nslug = "camera_calibration"\n[effect.parameters]\n'
        'scale = {value = 1.02, unit = "1", status = "fitted", source = "x"}\n'
    )
    shown = simulated(run, "--design", "pneuflex_s", "--pressure-kPa", 20, "--model", path)
    assert shown["curvature_1pm"] == pytest.approx(1.02 * thick["curvature_1pm"], rel=1e-6)
    assert shown["delta_1_mm"] == pytest.approx(thick["delta_1_mm"])
