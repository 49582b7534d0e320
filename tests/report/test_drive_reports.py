"""Reports of drives, closed loops and filters: what is met, missed and lost is said; all files appear."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends import backend_agg as agg

from fitting.control.loop import Run
from fitting.control.sweep import Case, Sweep, usual_loop
from fitting.invert.lumen import Lumen
from fitting.invert.passage import Passage
from fitting.invert.result import Inversion
from fitting.invert.touching import Touch
from fitting.invert.trajectory import Trajectory
from fitting.report.control.words import about_the_step
from fitting.report.invert.figures import passage_figure, targets_figure
from fitting.report.invert.words import target_table
from fitting.report.results import save, text
from fitting.wiring import Bounds, Springs, choose_filters


def inversion(values):
    """Curvatures wanted to be 10 and 60, of an actuator with two springs."""
    values, wanted = np.array(values)[:, None], np.array([[10.0], [60.0]])
    missed = np.abs(values - wanted)[:, 0]
    fractions, electrical = np.array([[1.0, 0.5], [1.0, 0.1]]), np.array([[3.6, 3.3], [3.6, 3.1]])
    way = np.array([[40e3, 0.9, 0.4]])
    return Inversion(
        "pneusma2", ("curvature",), wanted, ((1, 1), (1, 2)), np.array([30e3, 50e3]), fractions, electrical,
        0.1 * electrical, values, {"curvature": missed}, missed < 0.1,
        ("", "xi0_2 at its lowest, 0.1"), (way, way[:0]), np.full(2, 0.973), np.full(2, 0.973),
        (np.array([0.25]), np.zeros(0)),
    )  # fmt: skip


def test_one_target_out_of_reach_tells_wanted_and_reached_and_only_what_is_missed():
    """The length is met to a millionth of a millimetre; only the curvature is missed."""
    one = dataclasses.replace(
        inversion([10.0, 58.5]),
        goals=("curvature", "length"),
        **{
            name: getattr(inversion([10.0, 58.5]), name)[1:]
            for name in ("pressure", "fractions", "resistances", "currents", "met", "held", "ways", "way_heat")
        },
        wanted=np.array([[60.0, 62e-3]]),
        values=np.array([[58.5, 62e-3]]),
        misses={"curvature": np.array([1.5]), "length": np.array([1e-9])},
    )
    assert one.verdict[:2] == [
        "The target is out of reach: curvature 60 1/m and length 62 mm.",
        "The nearest is curvature 58.5 1/m and length 62 mm: it misses curvature by 1.5 1/m.",
    ]


def test_drives_say_what_is_met_and_what_holds_the_rest(tmp_path):
    result = inversion([10.0, 58.5])
    said = text(result)
    assert result.verdict == [
        "1 of 2 targets are met.",
        "Springs that are not named stay at 0.973, their fraction without a current in air of 22 degC.",
    ]
    words = [" ".join(line.split()) for line in said.splitlines()]
    assert "1 10 1/m 10 1/m 30.000 xi0_2 0.500 met" in words
    far_off = ["misses curvature by 1.5 1/m", "xi0_2 at its lowest, 0.1"]
    assert target_table(result).rows[1] == ["2", "60 1/m", "58.5 1/m", "50.000", "xi0_2 0.100", *far_off]
    assert "1 40.000 xi0_1 0.900, xi0_2 0.400 0.25" in words  # the other way
    files = {path.name for path in save(result, tmp_path / "out")}
    assert files == {"report.html", "report.json", "targets.csv", "targets.png"}
    found = json.loads((tmp_path / "out" / "report.json").read_text())
    assert (found["schema"], found["met"], found["goals"]) == ("pneusma-inversion/1", 1, ["curvature"])
    near, far = found["results"]
    assert near["wanted"] == {"curvature_1pm": 10.0} and near["reached"] == {"curvature_1pm": 10.0}
    assert near["met"] and near["miss"] == {"curvature_1pm": 0.0} and near["pressure_kPa"] == 30.0
    assert not far["met"] and far["miss"]["curvature_1pm"] == 1.5 and far["held_by"] == "xi0_2 at its lowest, 0.1"
    assert far["xi0"] == {"1": 1.0, "2": 0.1} and far["resistance_ohm"] == {"1": 3.6, "2": 3.1}
    assert found["ways_heat_W"] == [[0.25], []]
    header = (tmp_path / "out" / "targets.csv").read_text().splitlines()[0]
    assert header.startswith("wanted_curvature_1pm,model_curvature_1pm,pressure_kPa,xi0_1")


def test_targets_are_counted_in_whole_numbers_and_rounding_errors_do_not_fill_an_axis():
    drawn = targets_figure(inversion([10.0 + 1e-11, 60.0 - 1e-11]))
    assert drawn.axes[-1].get_xticks().tolist() == [1.0, 2.0]
    first = inversion([10.0 + 1e-11, 60.0])
    one = dataclasses.replace(
        first, wanted=first.wanted[:1], values=first.values[:1], pressure=first.pressure[:1],
        fractions=first.fractions[:1], met=first.met[:1],
    )  # fmt: skip
    drawn = targets_figure(one)
    assert drawn.axes[-1].get_xticks().tolist() == [1.0]
    assert np.ptp(drawn.axes[0].get_ylim()) == pytest.approx(0.2)  # the tolerance on both sides


def test_ticks_of_a_narrow_lumen_have_room():
    tube = SimpleNamespace(section=SimpleNamespace(radius=5e-3))
    straight = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.2]])
    found = Passage(
        "c", Lumen("straight", straight, np.full(2, 12e-3)), ((1, 1),), 1e4, np.ones(1), np.ones(1), np.zeros(1),
        0.0, 1e-3, 0.0, 0.1, 0.5 * straight, SimpleNamespace(body=SimpleNamespace(segments=[tube])),
        Touch(0.05, 1, np.zeros((0, 2))),
    )  # fmt: skip
    figure = passage_figure([found])
    agg.FigureCanvasAgg(figure).draw()
    for axes in figure.axes:
        boxes = [t.get_window_extent() for t in axes.get_xticklabels() if t.get_text()]
        shown = sorted((b.x0, b.x1) for b in boxes)
        assert all(a[1] < b[0] for a, b in zip(shown, shown[1:], strict=False))
        assert axes.get_legend() is None  # it stands below all panels


def test_a_trajectory_warns_first_of_what_cannot_be_undone(tmp_path):
    course = Trajectory(
        inversion([10.0, 58.5]), np.array([0.0, 20.0]), np.array([[1.0, 0.5], [1.0, 0.1]]),
        np.array([True, True]), 1e-8,
    )  # fmt: skip
    said = " ".join(text(course).split())
    cause = "From 20 s on, 1 target needs what spring 2 lost when it was heated to a fraction of 0.5 at 0 s"
    assert said.index("Warnings") < said.index("Targets") and cause in said
    assert "Only stretching the spring again brings it back" in said
    save(course, tmp_path / "out")
    assert "time_s" in (tmp_path / "out" / "targets.csv").read_text()


@pytest.fixture(scope="module")
def sweep():
    loop = usual_loop()

    def run(error):
        rows = (len(loop.time), 2)
        return Run(loop.time, loop.wanted, loop.wanted + error, loop.wanted, loop.wanted, np.zeros(rows),
                   np.ones(rows), np.ones(rows), np.ones(rows[0], bool))  # fmt: skip

    cases = (Case("no mismatch", run(0.1), None), Case("series_resistance", run(3.0), run(0.5)),
             Case("wrap_friction", run(2.0), run(1.0)))  # fmt: skip
    return Sweep("pneusma2", loop, cases)


def test_a_sweep_names_what_spoils_most(sweep, tmp_path):
    assert sweep.verdict == [
        "Curvature is spoilt most by series resistance: 3.00 1/m root mean square.",
        "Knowing it gives back most for series resistance: 0.50 instead of 3.00 1/m.",
    ]
    assert "does not" in text(sweep) and "SIMULATED" in text(sweep)
    files = {path.name for path in save(sweep, tmp_path / "out")}
    assert files == {"report.html", "report.json", "control.csv", "rmse.png", "course.png", "step.png"}
    cases = json.loads((tmp_path / "out" / "report.json").read_text())["cases"]
    assert cases[0]["known"] is None and cases[1]["known"]["rmse_1pm"] == pytest.approx(0.5)


def test_a_jump_past_the_step_is_explained_and_no_other(sweep):
    assert about_the_step(sweep) == []  # 0.1 of 20 1/m
    run = sweep.cases[0].without
    for sign in (1.0, -1.0):
        wanted = sign * run.wanted
        past = sign * np.where((run.time > 5.5) & (run.time < 7.0), 8.0, 0.0)
        jumping = dataclasses.replace(run, wanted=wanted, curvature=wanted + past)
        (said,) = about_the_step(Sweep("x", sweep.loop, (Case("no mismatch", jumping, None),)))
        assert f"with no mismatch jumps to {28 * sign:g} 1/m, 40 % past the wanted {20 * sign:g} 1/m" in said
    late = dataclasses.replace(run, curvature=run.wanted + np.where(run.time > 60.0, 8.0, 0.0))
    assert about_the_step(Sweep("x", sweep.loop, (Case("no mismatch", late, None),))) == []


def test_one_plant_alone_is_compared_with_itself(sweep):
    alone = Sweep("pneusma2", sweep.loop, sweep.cases[1:2])
    assert alone.verdict == [
        "With series resistance concealed the curvature errs by 3.00 1/m (root mean square); with it in the "
        "controller, by 0.50 1/m."
    ]


def test_filters_say_how_much_one_spring_heats_another(tmp_path):
    result = choose_filters(Springs(3.9, 6e-8), Bounds(10e3, 100e3, (10e-6, 1e-3)), 2)
    assert result.verdict[0].startswith("2 springs on one pair of wires; worst crosstalk:")
    files = {path.name for path in save(result, tmp_path / "out")}
    assert files == {"report.html", "report.json", "wiring.png"}
    content = json.loads((tmp_path / "out" / "report.json").read_text())
    assert np.shape(content["crosstalk_matrix"]) == (2, 2) and content["crosstalk"] == result.crosstalk


def test_a_loop_that_cannot_follow_or_balance_says_so(sweep):
    assert "Warnings" not in text(sweep)
    first = sweep.cases[0].without
    current = np.full(first.currents.shape, float(sweep.loop.converter.current))
    full = dataclasses.replace(first, planned=first.wanted - 4.0, currents=current)
    lost = dataclasses.replace(first, good=first.time > 2.0)
    cases = Case("no mismatch", full, None), Case("wrap_friction", first, lost)
    said = " ".join(text(Sweep("x", sweep.loop, cases)).split())
    assert (
        "misses the wanted curvature by up to 4.00 1/m; a heater is at its limit of 0.4 A for 100 %" in said
    )
    assert "wrap friction, told: in 9 of 600 rows, from 0 to 2 s, the plant has no equilibrium" in said


def small(curvatures, reach, met=True):
    """Curvatures that are wanted of an actuator with two springs, and what it reaches [1/m]."""
    count = len(curvatures)
    blank = np.full((count, 2), 0.973)
    wanted = np.array(curvatures)[:, None]
    return Inversion(
        "pneusma2", ("curvature",), wanted, ((1, 1), (1, 2)), np.full(count, 30e3), blank, blank, blank,
        0.0 * wanted, {"curvature": np.abs(wanted[:, 0])}, np.full(count, met), ("",) * count,
        (np.zeros((0, 3)),) * count, np.full(2, 0.973), np.full(2, 0.973), (np.zeros(0),) * count,
        {"curvature": reach},
    )  # fmt: skip


def test_a_target_near_zero_is_told_with_the_range_and_the_unit_that_may_be_meant():
    """0.04 1/m was met by a straight actuator, and 0.04 1/mm was meant."""
    said = small([0.04], (-65.6, 65.6)).verdict
    assert "The target is near zero: curvature 0.04 1/m, and within the limits it is -65.6 to 65.6 1/m." in said
    assert "Every curvature below 0.1 1/m counts as met, so that 0 meets it, too." in said
    assert "Was 0.04 1/cm (a curvature of 4 1/m) or 0.04 1/mm (a curvature of 40 1/m) meant?" in said
    several = " ".join(small([0.01, -0.04, 0.0], (-65.6, 65.6)).verdict)
    assert "All targets of curvature are near zero: curvature 0.04 1/m" in several


@pytest.mark.parametrize("curvatures", [[0.0], [5.0], [0.04, 30.0]])
def test_a_target_of_zero_or_of_an_ordinary_size_is_not_asked_about(curvatures):
    assert "near zero" not in " ".join(small(curvatures, (-65.6, 65.6)).verdict)


def test_a_target_out_of_reach_is_told_with_the_range():
    assert "Within the limits curvature is -65.6 to 65.6 1/m." in small([400.0], (-65.6, 65.6), met=False).verdict
