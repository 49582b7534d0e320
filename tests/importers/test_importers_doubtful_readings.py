"""Readings at a limit, turned signs, a clock that leaps by an hour, and rows that a workbook hides."""

import re
from datetime import datetime, timedelta
from types import SimpleNamespace

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, make_options
from fitting.data.importers.doubtful_readings import _Course, _question_first

N = 60
TIME = 0.5 * np.arange(N)
STRAIN = 0.6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N)))
STRESS = 90.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)


def table(stress, time=TIME, strain=STRAIN, digits=5):
    rows = "".join(f"{t},{e:.6f},{s:.{digits}f}\n" for t, e, s in zip(time, strain, stress, strict=True))
    return f"Time (s),Strain (-),Stress (kPa)\n{rows}"


def asked(path, words):
    return [note for note in checks(import_file(path, make_options(kind="elastomer"))) if words in note]


def test_a_largest_value_that_stays_is_asked_about(put):
    rows = np.flatnonzero(STRESS > 70.0) + 2
    note, = asked(put("a.csv", table(np.minimum(STRESS, 70.0))), "end of the instrument's range")
    assert f"stays at its largest value, 70 kPa, from row {rows[0]} to {rows[-1]} while strain changes" in note


@pytest.mark.parametrize("resolution", [1.0, 8.0, 20.0])
def test_a_coarse_resolution_is_no_limit(put, resolution):
    path = put("a.csv", table(resolution * np.round(STRESS / resolution)))
    assert not asked(path, "end of the instrument's range")


def test_a_largest_value_at_which_nothing_moves_is_no_limit(put):
    strain = np.concatenate([STRAIN[:30], np.full(20, STRAIN[29]), STRAIN[30:]])
    stress = 90.0 * (1.0 + strain - (1.0 + strain) ** -2)
    assert not asked(put("a.csv", table(stress, 0.5 * np.arange(N + 20), strain)), "end of the instrument's range")


def test_a_sign_that_turns_between_two_rows_is_asked_about(put):
    note, = asked(put("a.csv", table(np.where(np.arange(N) < 40, STRESS, -STRESS))), "turns its sign")
    assert "kPa at row 42 while strain goes on" in note


def test_a_test_of_both_ways_turns_no_sign(put):
    strain = 0.3 * np.sin(np.linspace(0.0, 12.0, N))
    stress = 90.0 * (1.0 + strain - (1.0 + strain) ** -2)
    assert not asked(put("a.csv", table(stress, TIME, strain)), "turns its sign")


def test_a_clock_that_leaps_by_an_hour_is_asked_about(put):
    start = datetime(2026, 3, 29, 1, 59, 50)
    moments = [start + timedelta(seconds=t + 3600.0 * (t >= 10.0)) for t in TIME]
    note, = asked(put("a.csv", table(STRESS, [m.isoformat(" ") for m in moments])), "daylight saving")
    assert "leaps by an hour at row 22" in note
    assert not asked(put("b.csv", table(STRESS, TIME + 3600.0 * (TIME >= 10.0))), "daylight saving")


def workbook(path, rows=(), columns=""):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Time (s)", "Strain (-)", "Stress (kPa)"])
    for row in zip(TIME.tolist(), STRAIN.tolist(), STRESS.tolist(), strict=True):
        book.active.append(row)
    for row in rows:
        book.active.row_dimensions[row].hidden = True
    for column in columns:
        book.active.column_dimensions[column].hidden = True
    book.save(path)
    return path


def test_rows_and_columns_that_a_sheet_hides_are_read_and_said(tmp_path):
    note, = asked(workbook(tmp_path / "a.xlsx", range(10, 20), "B"), "hides")
    assert "hides rows 10, 11, 12, 13, 14, 15 and 4 more and column 2, which were read" in note
    assert not asked(workbook(tmp_path / "b.xlsx"), "hides")
    assert not asked(workbook(tmp_path / "c.xlsx", range(200, 210), "K"), "hides")  # nothing is there


PULLED = np.linspace(0.0, 2.0, 120)
RUBBER = 150.0 * (1.0 + PULLED - (1.0 + PULLED) ** -2)


def pull(put, strain, stress, **options):
    path = put("a.csv", table(stress, 0.5 * np.arange(len(strain)), strain))
    notes = checks(import_file(path, make_options(**{"kind": "elastomer", **options})))
    return [note for note in notes if "did the specimen break" in note]


@pytest.mark.parametrize("rows", [1, 2, 4])
def test_a_stress_that_vanishes_while_the_pull_goes_on_is_asked_about(put, rows):
    broken = RUBBER.copy()
    broken[100 : 100 + rows] *= np.linspace(0.9, 0.3, rows) if rows > 1 else 0.02
    broken[100 + rows :] = 0.4
    (note,) = pull(put, PULLED, broken)
    assert "kPa in row 10" in note and "in row 10" in note and "These rows are kept" in note
    (note,) = pull(put, -0.4 * PULLED, -broken)
    assert f"If it did: --rows 1:{int(re.search('in row ([0-9]+) to', note)[1])}" in note


@pytest.mark.parametrize("coarse", [False, True])
def test_a_break_is_seen_under_a_load_cell_that_reads_something_at_rest_and_a_coarse_position(put, coarse):
    """The reading after the break is that before the pull. Most rows of a coarse position repeat the last."""
    offset = 0.1 * RUBBER.max()
    broken = np.append(RUBBER[:100], 0.05 * RUBBER[100:]) + offset
    strain = np.floor(PULLED * 10.0) / 10.0 if coarse else PULLED
    (note,) = pull(put, strain, broken)
    assert "in row 101 to" in note and note.endswith("--rows 1:101")


def test_a_frame_that_springs_back_as_the_specimen_breaks_is_asked_about(put):
    strain = np.append(PULLED[:100], PULLED[100:] + 0.12)
    (note,) = pull(put, strain, np.append(RUBBER[:100], 0.0 * RUBBER[100:] - 2.0))
    assert note.endswith("--rows 1:101")


def test_neither_an_unloading_nor_a_spike_nor_a_whole_pull_is_a_break(put):
    back = np.concatenate([PULLED, PULLED[::-6]])
    assert not pull(put, back, np.concatenate([RUBBER, 0.9 * RUBBER[::-6]]))
    assert not pull(put, PULLED, RUBBER)
    spike = RUBBER.copy()
    spike[60] = 2e4
    assert not pull(put, PULLED, spike)
    held = np.concatenate([PULLED, np.full(200, 2.0)])
    assert not pull(put, held, np.concatenate([RUBBER, RUBBER[-1] * (0.05 + 0.95 * np.exp(-np.arange(200) / 40.0))]))


def test_a_wire_that_cools_at_one_strain_does_not_break(put):
    strain = 0.02 + 1e-5 * np.sin(np.arange(N)) + 1e-6 * np.arange(N)
    stress = np.where(np.arange(N) < 40, 300.0, 5.0)
    rows = "".join(f"{t},{e:.6f},{s:.3f},{k:.2f}\n" for t, e, s, k in zip(TIME, strain, stress, np.linspace(90.0, 25.0, N), strict=True))
    path = put("a.csv", f"Time (s),Strain (-),Stress (MPa),Temperature (degC)\n{rows}")
    assert not [note for note in checks(import_file(path, make_options(kind="wire"))) if "did the specimen break" in note]


def first_row(put, position, stress=None, head="Time (s),Strain (-),Stress (kPa)"):
    force = position - position.min() if stress is None else stress
    rows = "".join(f"{0.5 * k},{x:.5f},{f:.5f}\n" for k, (x, f) in enumerate(zip(position, force, strict=True)))
    notes = checks(import_file(put("a.csv", f"{head}\n{rows}"), make_options(kind="elastomer", slack="keep")))
    return [note for note in notes if "logged before the test began" in note]


ON = 0.018 + 0.01 * np.arange(60)


def test_a_first_row_far_from_the_second_is_asked_about(put):
    (note,) = first_row(put, np.concatenate([[0.113], ON]))
    assert "strain is 0.113 in row 2 and 0.018 in row 3, from where it rises: was the first row" in note
    assert note.endswith("If it was: --rows 3:")
    recording = import_file(put("b.csv", table(*(x.copy() for x in (ON, 0.5 * np.arange(60), ON)))), make_options(kind="elastomer"))
    assert not [n for n in checks(recording) if "logged before" in n]
    (note,) = first_row(put, -0.5 * np.concatenate([[0.113], ON]), -np.concatenate([[0.1], ON]))
    assert "from where it falls" in note
    waits = np.concatenate([[0.113], np.full(12, 0.018), ON])
    assert first_row(put, waits)


def test_a_spring_whose_position_begins_elsewhere_is_asked_about(put):
    rows = "".join(f"{0.5 * k},{x:.4f},{0.1 * x:.5f},22\n" for k, x in enumerate([0.113, *(0.018 + 0.02 * np.arange(60))]))
    path = put("a.csv", f"Time (s),Position (mm),Force (N),Temperature (degC)\n{rows}")
    named = {"kind": "spring", "dimensions": ["wire_diameter_mm=0.25"]}
    (note,) = [n for n in checks(import_file(path, make_options(**named))) if "logged before" in n]
    assert "elongation is 0.113 in row 2 and 0.018 in row 3" in note and note.endswith("--rows 3:")
    mended = import_file(path, make_options(rows=["3:"], **named))
    assert len(mended) == 60 and not [n for n in checks(mended) if "logged before" in n]


def test_neither_noise_nor_a_step_nor_a_turn_is_a_first_row_before_the_test(put):
    noise, said = np.random.default_rng(7), []
    making = SimpleNamespace(warn=said.append, keep_rows=lambda *_: "")
    for k in range(200):
        position = np.concatenate([0.02 + 0.001 * noise.standard_normal(20), ON]).round(5)
        if k < 3:  # a file takes 30 ms
            assert not first_row(put, position)
        _question_first(_Course("strain", "stress", "kPa", position, position, np.arange(len(position)) + 2), making)
    assert not said
    _question_first(_Course("strain", "stress", "kPa", np.append(0.113, ON), np.append(0.113, ON), np.arange(61) + 2), making)
    assert len(said) == 1
    assert not first_row(put, np.concatenate([[0.0], 0.5 + 1e-4 * np.arange(60)]))  # loaded at once, then held
    assert not first_row(put, np.concatenate([[0.023, 0.018], ON[1:]]))  # half a step
    quantum = 0.02 + 5e-4 * np.array([1, 0, 0, 0, 0, 0, 0, 1, 0, 0])
    assert not first_row(put, np.concatenate([quantum, ON]))


def test_one_reading_of_the_other_sign_is_no_instrument_that_was_connected_the_other_way(put):
    time = np.arange(60.0)
    angle = -2.0 - 0.5 * time
    angle[30] *= -1.0
    rows = "".join(f"{t},{t + 1},{a}\n" for t, a in zip(time, angle, strict=True))
    notes = checks(import_file(put("a.csv", f"Time (s),Pressure (kPa),Bend angle (deg)\n{rows}"), make_options()))
    (note,) = [note for note in notes if "sign" in note]
    assert "bend_angle is 17 deg in row 32 alone, between -16.5 and -17.5, while pressure goes on: is its sign right?" in note
