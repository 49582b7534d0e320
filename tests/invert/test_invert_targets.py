"""Targets and lumens from files, and distances from a centre line."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli import main
from fitting.design.log import Evaluation
from fitting.invert.lumen import Lumen, distances, progress, read_lumen
from fitting.invert.passage import Passage
from fitting.invert.targets import read_targets
from fitting.invert.touching import Touch, held_drives, touch_of
from fitting.report.invert.documents import passage_files, passage_summary
from fitting.report.invert.words import passage_table, passage_verdict
from pneusma_jax.errors import InputError


def test_columns_in_any_unit_become_goals(tmp_path):
    path = tmp_path / "targets.csv"
    path.write_text("time_s,length_cm,curvature_1pm\n0,6.0,10\n1,6.1,20\n")
    found = read_targets(path)
    assert found.goals == ("curvature", "length")
    np.testing.assert_allclose(found.wanted, [[10.0, 0.06], [20.0, 0.061]])
    np.testing.assert_allclose(found.time, [0.0, 1.0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("curvature_1pm\n", "there is no target"),
        ("curvatur_1pm\n1\n", "did you mean 'curvature_1pm'"),
        ("curvature_1pm\nten\n", "row 2, column curvature_1pm must be a number"),
        ("curvature_1pm\nnan\n", "must be finite"),
        ("time_s;curvature_1pm\n0;1,5\n", "targets.csv, row 1: semicolons separate the columns; separate them by commas, and write"),
        ("\ntime_s\tcurvature_1pm\n0\t1\n", "targets.csv, row 2: tabs separate the columns"),
        ("tip_x_mm,tip_y_mm\n1,2\n", "tip needs column 'tip_z_mm' too"),
        ("time_s,curvature_1pm\n1,1\n0,1\n", "time_s goes backwards"),
        ("direction_x,direction_y,direction_z\n0,0,0\n", "a direction must not be zero"),
        ("length_mm,length_mm\n60,61\n", "column length_mm is there twice"),
        ("length_mm,length_cm\n60,6.1\n", "column 'length_cm' says again"),
        ("length_mm\n60,61\n", "row 2 has 2 fields, but the header has 1"),
        ("length_mm,\n60,61\n", "a column of the header has no name"),
        ("length_kPa\n60\n", "column 'length_kPa' is no length; length_mm is one"),
        ("length_ell\n60\n", "targets.csv: column 'length_ell': unknown unit 'ell'"),
        ("time_s,curvature_1pm\n1,1\n1,2\n", "time_s stands still: after 1 s comes 1 s"),
        ("curvature_1pm\n1e300\n", "column curvature_1pm must lie within 6.7e+07 of 0"),
        ("tip_x_mm,tip_y_mm,tip_z_m\n0,0,1e9\n", "column tip_z_mm must lie within 6.7e+07 of 0"),
        ("curvature_1pm\n" + 200_000 * "1" + "\n", "cannot be read as a CSV file (field larger"),
    ],
)
def test_bad_targets_are_refused_in_one_line(text, words, tmp_path):
    path = tmp_path / "targets.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(words)):
        read_targets(path)


def test_a_direction_of_any_length_is_one(tmp_path):
    path = tmp_path / "targets.csv"
    path.write_text("direction_x,direction_y,direction_z\n1e308,1e308,0\n0,0,1e-308\n")
    half = np.sqrt(0.5)
    np.testing.assert_allclose(read_targets(path).wanted, [[half, half, 0.0], [0.0, 0.0, 1.0]])


def test_blank_lines_and_a_mark_of_the_encoding_are_no_rows(tmp_path):
    path = tmp_path / "targets.csv"
    path.write_bytes(b"\xef\xbb\xbfcurvature_1pm\r\n10\r\n\r\n20\r\n\r\n")
    np.testing.assert_allclose(read_targets(path).wanted[:, 0], [10.0, 20.0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x_mm,y_mm,z_mm\n0,0,0\n0,0,1\n", "column diameter_mm is missing"),
        ("x_mm,y_mm,z_mm,diameter_mm\n0,0,0,5\n", "at least two points"),
        ("x_mm,y_mm,z_mm,diameter_mm\n0,0,0,5\n0,0,0,5\n", "are the same"),
        ("x_mm,y_mm,z_mm,diameter_mm\n0,0,0,5\n0,0,9,0\n", "must be positive"),
        ("x_mm,y_mm,z_mm,diameter_mm\n0,0,0,5\n0,x,9,5\n", "row 3, column y_mm must be a number"),
        ("x_mm,y_mm,z_mm,diameter_mm,clearance_mm\n0,0,0,5,1\n0,0,9,5,1\n", "unknown column 'clearance_mm'"),
        ("x_mm,x_cm,y_mm,z_mm,diameter_mm\n0,0,0,0,5\n0,0,0,9,5\n", "x_mm and x_cm say the same"),
        ("x_mm,y_mm,z_kPa,diameter_mm\n0,0,0,5\n0,0,9,5\n", "column z_kPa is no length"),
        ("x_mm,y_mm,z_mm,diameter_mm\n120,80,3,5\n120,80,9,5\n", "the lumen at 120, 80, 3 mm"),
        ("x_mm,y_mm,z_mm,diameter_mm\n0,0,0,5\n0,0,1e300,5\n", "column z_mm must lie within 6.7e+07 of 0"),
        ("x_mm,y_mm,z_ell,diameter_mm\n0,0,0,5\n0,0,9,5\n", "lumen.csv: column 'z_ell': unknown unit"),
    ],
)
def test_bad_lumens_are_refused_in_one_line(text, words, tmp_path):
    path = tmp_path / "lumen.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(words)):
        read_lumen(path)


def test_distances_from_a_bent_line():
    line = jnp.asarray([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 2.0, 2.0]])
    diameter = jnp.asarray([2.0, 4.0, 4.0])
    points = jnp.asarray([[1.0, 0.0, 1.0], [0.0, 1.0, 2.5], [0.0, 0.0, -1.0]])
    away, room = jax.jit(distances)(points, (line, diameter))
    np.testing.assert_allclose(away, [1.0, 0.5, 1.0])
    np.testing.assert_allclose(room, [1.5, 2.0, 1.0])


@pytest.mark.parametrize(
    ("clearance", "wanted", "passes", "words"),
    [
        (0.6e-3, 0.5e-3, True, "the chain fits as far as it reaches, with 0.60 mm to the wall, least at 30 mm along "
         "the lumen (segment 2)."),
        (0.4e-3, 0.5e-3, False, "comes within 0.40 mm of the wall, most at 30 mm along the lumen (segment 2); a "
         "lumen 0.20 mm wider would let it."),
        (-1.7e-3, 0.0, False, "overlaps the wall by 1.70 mm, most at 30 mm along the lumen (segment 2); a lumen "
         "3.40 mm wider would let it."),
        (0.5e-3 - 1e-8, 0.5e-3, True, "with 0.50 mm to the wall"),
    ],
)  # fmt: skip
def test_a_chain_passes_where_it_keeps_the_wanted_clearance(clearance, wanted, passes, words):
    found = _passage(clearance, wanted, held="pressure at its lowest, 0 kPa")
    assert found.passes is passes
    said = passage_verdict(found)
    assert words in said[0]
    assert "Its tip is at 80 of the lumen's 100 mm. Nothing is said of the 20 mm beyond." in said
    assert passes is not any("held by: pressure at its lowest, 0 kPa." in line for line in said)


def _passage(clearance, wanted, **more):
    lumen = Lumen("straight", np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]), np.full(2, 12e-3))
    touch = Touch(30e-3, 2, np.array([[20e-3, 40e-3], [70e-3, 70e-3]]))
    return Passage(
        "c", lumen, ((1, 1),), 1e4, np.ones(1), np.full(1, 3.6), np.zeros(1), 1e-3, clearance, wanted,
        **{"reached": 0.08, "line": np.zeros((2, 3)), "solved": None, "touch": touch} | more,
    )  # fmt: skip


def test_only_a_tip_at_the_end_has_passed():
    through = passage_verdict(_passage(1e-3, 0.0, reached=0.0995))
    assert "the chain passes with 1.00 mm" in through[0]
    assert "Its tip is at the lumen's end, 100 mm along it." in through
    alone = passage_verdict(_passage(1e-3, 0.0, alone=True))
    assert "the actuator fits as far as it reaches, with 1.00 mm to the wall, least at 30 mm" in alone[0]
    assert "segment" not in alone[0] and not any("passes" in line for line in alone)


def test_a_passage_tells_resistances_and_currents():
    found = _passage(1e-3, 0.0)
    assert passage_table(found).rows == [["1", "1", "3.6", "0"]]
    content = passage_summary(found)
    assert content["resistance_ohm"] == {"1": 3.6} and content["current_A"] == {"1": 0.0}
    assert not content["to_the_end"]
    header, row = passage_files(found)["drives.csv"].splitlines()
    assert header == "pressure_kPa,xi0_1,resistance_1_ohm,current_1_A" and row == "10,1,3.6,0"


def test_where_a_lumen_is_touched_is_said():
    assert "It touches at 20 to 40 and 70 mm along the lumen." in passage_verdict(_passage(-1e-3, 0.0))
    near = passage_verdict(_passage(1e-3, 2e-3))
    assert "It is too near to the wall at 20 to 40 and 70 mm along the lumen." in near
    assert any("No bound holds it" in line for line in near)
    tangled = _passage(1e-3, 0.0, apart=-2e-3)
    assert not tangled.passes and "it overlaps itself by 2.00 mm" in passage_verdict(tangled)[0]


def test_stretches_that_touch_are_found_along_the_lumen():
    line = jnp.asarray([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]])
    points = np.zeros((9, 3))
    points[:, 2] = np.linspace(0.0, 0.08, 9)  # two segments of four points, and the tip
    gaps = 1e-3 * np.array([1.0, -1.0, -2.0, 1.0, 1.0, -3.0, 1.0, 1.0, -1.0])
    found = touch_of(points, gaps, line, 2, 0.0)
    assert found.along == pytest.approx(0.05) and found.segment == 2
    np.testing.assert_allclose(found.stretches, [[0.01, 0.02], [0.05, 0.05], [0.08, 0.08]], atol=1e-12)
    assert touch_of(points, gaps + 1.0, line, 2, 0.0).stretches.shape == (0, 2)


def test_the_bounds_that_hold_the_least_overlap_are_those_with_a_weight():
    # the larger of 1 - x0 and 1 - x0 - x1 / 2 falls with x0 alone at its end: x1 gives no room to the first
    place = np.array([1.0, 1.0, 0.0])
    jacobian = np.array([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -0.5, 0.0]])
    one = Evaluation(place, np.array([9.0, 0.0, -0.5]), jacobian)
    low, high = held_drives(one, np.arange(1, 3))
    assert low.tolist() == [] and high.tolist() == [0]
    # where room at one place is lost at another, no bound holds
    ends = Evaluation(
        np.array([0.5, 0.0]), np.array([0.0, 0.3, 0.3]), np.array([[0, 0], [1.0, 0], [-1.0, 0]])
    )
    assert [x.tolist() for x in held_drives(ends, np.arange(1, 3))] == [[], []]


@pytest.mark.parametrize(
    ("point", "along"),
    [([0.3, 0.0, 1.0], 1.0), ([0.0, 1.5, 2.2], 3.5), ([0.0, 0.0, -1.0], 0.0), ([0.0, 5.0, 2.0], 4.0)],
)
def test_progress_along_a_bent_line(point, along):
    line = jnp.asarray([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 2.0, 2.0]])
    assert float(progress(jnp.asarray(point), line)) == pytest.approx(along)


def test_the_command_wants_one_thing(tmp_path):
    for arguments in ([], ["--curvature-1pm", "3", "--lumen", "x.csv"]):
        done = CliRunner().invoke(main, ["invert", *arguments])
        assert done.exit_code == 2 and "in one way" in done.stderr and done.stderr.count("\n") == 1
    done = CliRunner().invoke(main, ["invert", "--curvature-1pm", "3", "--clearance-mm", "1"])
    assert done.exit_code == 2 and "there is none" in done.stderr
