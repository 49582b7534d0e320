"""Studies stay within what can be made: turns side by side, a bore, springs that are stretched."""

import itertools
import re

import numpy as np
import pytest
from study_files import CHAIN, SMALL, changed, write_study

import pneusma_jax as pj
from fitting.design import buildable, read_study, run_study
from fitting.design.bodies import plan_of
from fitting.design.buildable import MOST_CORNERS, corners
from fitting.design.program import Model
from fitting.report.design.documents import tables
from fitting.report.results import text
from pneusma_jax.errors import InputError

COILS = 'active_coils = {made = "integer", from = 40, to = 70}'
WIRES = (
    'wire_diameter = {made = "catalogue", values = [0.2, 0.25, 0.3, 0.35], unit = "mm"}\n'
    'initial_pitch = {made = "steps", from = 0.25, to = 0.4, step = 0.01, unit = "mm"}'
)

PITCH = 'initial_pitch = {made = "continuous", from = 0.2, to = 0.5, unit = "mm"}'
OTHERS = (
    'outer_diameter = {made = "continuous", from = 9, to = 11, unit = "mm"}',
    'mandrel_diameter = {made = "continuous", from = 0.8, to = 1.2, unit = "mm"}',
    'active_coils = {made = "integer", from = 40, to = 200}',
)


@pytest.mark.parametrize(
    ("free", "names"),
    [
        (COILS, []),
        (WIRES, ["turns do not overlap"]),
        ('active_coils = {made = "integer", from = 40, to = 220}\ninitial_pitch = {from = 0.25, to = 0.3, unit = "mm"}',
         ["springs are no longer than their place"]),
        ('outer_diameter = {from = 2.5, to = 8, unit = "mm"}', ["the wall leaves a bore"]),
    ],
)  # fmt: skip
def test_what_forbids_a_design_of_the_box_becomes_a_constraint(free, names, tmp_path):
    study = read_study(write_study(tmp_path, changed(COILS, free)))
    assert [one.name for one in study.constraints] == ["length", "shear", *names]


@pytest.mark.parametrize(
    ("wires", "words"),
    [
        ("[0.2, 0.25, 0.3]", "nothing can be made with 0.3 mm, the largest of its values: `initial_pitch` must be at least"),
        ("[0.2, 0.25, 0.28]", None),  # turns may overlap by a twentieth of the wire, as in the tables' own priors
    ],
)  # fmt: skip
def test_a_wire_that_is_thicker_than_the_pitch_is_refused(wires, words, tmp_path):
    gauges = f'wire_diameter = {{made = "catalogue", values = {wires}, unit = "mm"}}'
    path = write_study(tmp_path, changed(COILS, gauges))
    if words is None:
        assert len(read_study(path).constraints) == 2
        return
    with pytest.raises(InputError, match=re.escape(words)):
        read_study(path)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(("thickest", "refused"), [pytest.param(0.4, False, marks=pytest.mark.slow), (0.6, True)])
def test_the_order_of_free_parameters_makes_no_difference(thickest, refused, first, tmp_path):
    """With `wall_thickness`, six are free; the thick wire can be made where the pitch is at its upper end."""
    wire = f'wire_diameter = {{made = "continuous", from = 0.15, to = {thickest}, unit = "mm"}}'
    free = [PITCH, *OTHERS, wire] if first else [wire, *OTHERS, PITCH]
    text = changed(COILS, free[-1]).replace("[free]\n", "[free]\n" + "\n".join(free[:-1]) + "\n")
    path = write_study(tmp_path, text)
    if refused:
        with pytest.raises(InputError, match="wire_diameter: nothing can be made at the upper end"):
            read_study(path)
        return
    names = [one.name for one in read_study(path).constraints]
    assert names == ["length", "shear", "turns do not overlap", "springs are no longer than their place"]


@pytest.mark.parametrize("first", [True, False])
def test_constraints_of_ten_free_dimensions_do_not_depend_on_their_order(first, tmp_path):
    (tmp_path / "two.toml").write_text(CHAIN)
    pair = [
        '"1.wire_diameter" = {from = 0.2, to = 0.3, unit = "mm"}',
        '"1.initial_pitch" = {from = 0.25, to = 0.4, unit = "mm"}',
    ]
    rest = [
        *(f'"{k}.wall_thickness" = {{from = 0.8, to = 1.2, unit = "mm"}}' for k in (1, 2)),
        *(f'"{k}.outer_diameter" = {{from = 9.5, to = 10.5, unit = "mm"}}' for k in (1, 2)),
        *(f'"{k}.active_coils" = {{from = 45, to = 50}}' for k in (1, 2)),
        '"2.wire_diameter" = {from = 0.2, to = 0.22, unit = "mm"}',
        '"2.initial_pitch" = {from = 0.25, to = 0.26, unit = "mm"}',
    ]
    free = "\n".join([*pair, *rest] if first else [*rest, *pair])
    text = changed('design = "pneusma2"', 'design = "two.toml"')
    text = re.sub(r"(?s)\[free\].*?\n\n", lambda _: f"[free]\n{free}\n\n", text, count=1)
    text = text.replace("xi0_2 = 0.3", "segment_1 = {xi0_2 = 0.3}").replace('"curvature"', '"bend_angle"')
    names = [one.name for one in read_study(write_study(tmp_path, text)).constraints]
    assert names == ["length", "shear", "turns do not overlap"]


@pytest.mark.parametrize(("widest", "refused"), [(0.34, False), (0.36, True)])
def test_an_end_that_only_one_combination_of_many_allows_is_not_refused(widest, refused, tmp_path, monkeypatch):
    """The thick wire of five segments needs all five pitches near their upper ends: one of 32 corners."""
    monkeypatch.setattr(buildable, "MOST_CORNERS", 8)
    (tmp_path / "two.toml").write_text(CHAIN + '[[segment]]\ndesign = "pneusma2"\n' * 3)
    pitches = [f'"{k}.initial_pitch" = {{from = 0.26, to = 0.33, unit = "mm"}}' for k in range(1, 6)]
    wire = f'wire_diameter = {{made = "continuous", from = 0.2, to = {widest}, unit = "mm"}}'
    free = "\n".join(['active_coils = {made = "continuous", from = 40, to = 200}', wire, *pitches])
    study = changed('design = "pneusma2"', 'design = "two.toml"')
    study = re.sub(r"(?s)\[free\].*?\n\n", lambda _: f"[free]\n{free}\n\n", study, count=1)
    study = study.replace("xi0_2 = 0.3", "segment_1 = {xi0_2 = 0.3}").replace('"curvature"', '"bend_angle"')
    path = write_study(tmp_path, study)
    if refused:
        words = "wire_diameter: nothing can be made at the upper end of its range: .* at all of 8 random combinations"
        with pytest.raises(InputError, match=words):
            read_study(path)
        return
    assert "turns do not overlap" in [one.name for one in read_study(path).constraints]


@pytest.mark.parametrize("count", [0, 1, 5, 8, 9, 14])
def test_corners_leave_no_parameter_out(count):
    """Up to the maximum all of them; beyond it, any three parameters still meet in all ways."""
    some = corners(count, MOST_CORNERS)
    assert some.shape == (min(2**count, MOST_CORNERS), count) and np.isin(some, (0.0, 1.0)).all()
    assert len(np.unique(some, axis=0)) == len(some) or count > 8
    for three in itertools.combinations(range(count), 3):
        assert len(np.unique(some[:, three], axis=0)) == 8
    np.testing.assert_array_equal(some, corners(count, MOST_CORNERS))


@pytest.mark.slow
def test_ratios_are_those_of_the_spring(tmp_path):
    study = read_study(write_study(tmp_path, changed(COILS, WIRES)))
    model = Model(study, plan_of("pneusma2"))
    place = model.space.place({"wall_thickness": 1e-3, "wire_diameter": 0.3e-3, "initial_pitch": 0.27e-3})
    values = model.values(place[None])[0, 1:]
    rows = [study.constraints[row.constraint].name == "turns do not overlap" for row in model.rows]
    np.testing.assert_allclose(values[rows], (0.95 - 0.9) / 0.95, rtol=1e-9)


@pytest.mark.slow
def test_a_search_that_is_drawn_to_overlapping_turns_ends_with_a_design_that_can_be_made(tmp_path):
    """Thick wires bend less, and a short pitch leaves them more pre-strain: the least length wants both."""
    short = changed(COILS, WIRES).replace('"curvature"\ngoal = "maximise"', '"length"\ngoal = "minimise"')
    result = run_study(read_study(write_study(tmp_path, short)))
    made = result.made.parameters
    assert made["initial_pitch"] >= 0.95 * made["wire_diameter"] * (1.0 - 1e-6)
    assert "turns do not overlap" in re.sub(r"\s+", " ", text(result))
    (tmp_path / "design.toml").write_text(tables(result, result.made)["design.toml"])
    found = pj.solve(pj.make_actuator(tmp_path / "design.toml"), 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.3)))  # fmt: skip
    assert float(found.length) == pytest.approx(result.made.objectives[0], rel=1e-9)


def test_the_small_study_needs_no_such_constraint(tmp_path):
    assert len(read_study(write_study(tmp_path, SMALL)).constraints) == 2
