"""Readings that a file or a folder holds twice, and angles that are counted within one turn, are asked about."""

import numpy as np
import openpyxl
import pytest
from answers import checks

from fitting.data.importers import import_file, import_files, make_options
from fitting.data.recordings import read_campaign, write_recordings

T = 0.5 * np.arange(40)
EXTENSION = np.round(20.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, T.size))), 4)
LOAD = np.round(0.1 * EXTENSION, 4)
SIZES = make_options(kind="elastomer", dimensions=["gauge_length_mm=25", "area_mm2=20"])
HEAD = "Time (s),Extension (mm),Load (N)\n"
ROWS = [f"{t},{x},{y}\n" for t, x, y in zip(T, EXTENSION, LOAD, strict=True)]


def test_rows_that_are_all_written_twice_are_asked_about(put):
    """Their times were spread over half a step, and nothing was asked."""
    twice = import_file(put("a.csv", HEAD + "".join(row * 2 for row in ROWS)), SIZES)
    assert any("40 rows repeat the row before them in every column" in note for note in checks(twice))
    assert not checks(import_file(put("b.csv", HEAD + "".join(ROWS)), SIZES))


def test_rows_of_one_time_with_other_readings_are_not_asked_about(put):
    """A clock of whole seconds and two rows a second."""
    coarse = "".join(f"{int(t)},{x},{y}\n" for t, x, y in zip(T, EXTENSION, LOAD, strict=True))
    assert not checks(import_file(put("a.csv", HEAD + coarse), SIZES))


def test_rows_of_a_hold_under_a_clock_of_whole_seconds_are_not_asked_about(put):
    ramp = [(int(t), x, y) for t, x, y in zip(T, EXTENSION, LOAD, strict=True)]
    held = [(20 + n // 2, 20.0, 2.0) for n in range(60)]
    rows = "".join(f"{t},{x},{y}\n" for t, x, y in [*ramp, *held])
    assert not any("repeat the row before" in note for note in checks(import_file(put("a.csv", HEAD + rows), SIZES)))


def test_a_copied_sheet_is_asked_about(tmp_path):
    """`Test 1 (2)` is what a spreadsheet calls the copy of `Test 1`."""
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet("Test 1 (2)")):
        sheet.append(HEAD.strip().split(","))
        for row in zip(T, EXTENSION, LOAD, strict=True):
            sheet.append([float(x) for x in row])
    book.active.title = "Test 1"
    book.save(tmp_path / "a.xlsx")
    first, second = import_files([tmp_path / "a.xlsx"], SIZES)
    assert not [note for note in checks(first) if "same numbers" in note]
    (said,) = [note for note in checks(second) if "same numbers" in note]
    assert repr(first.name) in said and said in second.source["notes"]


def test_a_copied_file_is_asked_about_at_import_and_as_a_campaign(put, tmp_path):
    paths = [put(name, HEAD + "".join(ROWS)) for name in ("a.csv", "b.csv")]
    recordings = import_files(paths, SIZES)
    assert [sum("same numbers as 'a'" in note for note in checks(one)) for one in recordings] == [0, 1]
    write_recordings(recordings, tmp_path / "campaign")
    read = read_campaign(tmp_path / "campaign").recordings
    assert [sum("same numbers as 'a'" in note for note in checks(one)) for one in read] == [0, 1]
    assert [one.source["notes"] for one in read] == [one.source["notes"] for one in recordings]


@pytest.mark.parametrize(("angles", "asks"), [(np.linspace(-30.0, 60.0, 40), 0), (np.linspace(-30.0, 60.0, 40) % 360.0, 1)])
def test_an_angle_that_is_counted_within_one_turn_is_asked_about(put, angles, asks):
    """-1 degree was read as 359, a bend of almost one turn."""
    rows = "".join(f"{t},20,{x:.3f},3.6\n" for t, x in zip(T, angles, strict=True))
    text = f"Time (s),Pressure (kPa),Bend angle (deg),R2 (ohm)\n{rows}"
    recording = import_file(put("a.csv", text), make_options(kind="actuator"))
    assert sum("is it counted within one turn" in note for note in checks(recording)) == asks


RISE = np.linspace(0.0, 1.0, 33)
STEPS = np.repeat([0.0, 0.25, 0.5, 0.75, 1.0], 6)
SLOW = np.linspace(0.0, 1.0, 40)


@pytest.mark.parametrize(
    ("pressure", "angles", "asks"),
    [
        (np.append(RISE, [0.0] * 7), np.append(320.0 * RISE, [0.0] * 7), 0),
        (np.append(RISE, [0.0] * 7), np.append(340.0 * RISE, [0.0] * 7), 0),
        (0.0 * SLOW, np.append(320.0 * RISE, [0.0] * 7), 0),
        (np.append(STEPS, [0.0] * 10), np.append(320.0 * STEPS, [0.0] * 10), 0),
        (SLOW, (400.0 * SLOW) % 360.0, 1),
        (1.0 + 0.01 * np.random.default_rng(1).normal(size=40), (300.0 + 90.0 * SLOW) % 360.0, 1),
    ],
)
def test_an_actuator_that_falls_back_to_rest_is_not_asked_about_a_turn(put, pressure, angles, asks):
    """One that was vented at 320 degrees was taken for one that went on to 360."""
    rows = "".join(f"{t},{20 * p:.4f},{x:.3f},3.6\n" for t, p, x in zip(T, pressure, angles, strict=True))
    text = f"Time (s),Pressure (kPa),Bend angle (deg),R2 (ohm)\n{rows}"
    recording = import_file(put("a.csv", text), make_options(kind="actuator"))
    assert sum("is it counted within one turn" in note for note in checks(recording)) == asks


STAIRS = np.repeat(np.arange(10.0), 4)


@pytest.mark.parametrize(
    ("pressure", "angles", "asks"),
    [
        (STAIRS, (40.0 * STAIRS) % 360.0, 1),
        (STAIRS, (5.0 + 40.0 * STAIRS + 0.1 * np.sin(np.arange(40.0))) % 360.0, 1),
        (STAIRS[::-1], (40.0 * STAIRS[::-1] - 40.0) % 360.0, 1),
        (19.0 + (np.arange(40) >= 20), np.repeat([350.0, 355.0, 5.0], [5, 15, 20]), 1),
        (np.append(STAIRS[:32], [0.0] * 8), np.append(44.0 * STAIRS[:32], [0.0] * 8), 0),
    ],
)
def test_a_coarse_angle_that_goes_on_with_a_drive_that_leaps_is_asked_about(put, pressure, angles, asks):
    """A staircase leaps at every step. Only an actuator whose drive falls is at rest thereafter."""
    rows = "".join(f"{t},{20 * p:.4f},{x:.3f},3.6\n" for t, p, x in zip(T, pressure, angles, strict=True))
    text = f"Time (s),Pressure (kPa),Bend angle (deg),R2 (ohm)\n{rows}"
    recording = import_file(put("a.csv", text), make_options(kind="actuator"))
    assert sum("is it counted within one turn" in note for note in checks(recording)) == asks
