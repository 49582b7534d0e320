"""Tables without headings: their clocks are found, no column is lost, and what is wrong has its column's number."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options

N = 24
PRESSURE = 1.5 * np.arange(N)
LENGTH = 56.0 + 0.02 * np.arange(N)
TUBE = {"kind": "tube", "units": ["pressure=kPa", "length=mm"]}


def table(*columns, sep="\t"):
    return "".join(sep.join(x if isinstance(x, str) else f"{x:.4f}" for x in row) + "\n" for row in zip(*columns, strict=True))


def times(step=0.25, hour=0, minute=0):
    return [f"{hour}:{minute:02d}:{step * k:06.3f}" for k in range(N)]


def test_a_column_of_times_is_the_clock(put):
    path = put("a.txt", table(times(), PRESSURE, LENGTH))
    recording = import_file(path, make_options(columns=["pressure=2", "length=3"], **TUBE))
    np.testing.assert_allclose(recording.columns["time_s"], 0.25 * np.arange(N), atol=1e-9)
    assert any("column 1 is a clock" in note for note in recording.notices)
    assert not any("no clock" in note for note in recording.notices)


def test_a_clock_that_is_named_needs_no_unit(put):
    path = put("a.txt", table(times(), PRESSURE, LENGTH))
    recording = import_file(path, make_options(columns=["time=1", "pressure=2", "length=3"], **TUBE))
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), 0.25, atol=1e-9)


@pytest.mark.parametrize("sep", ["\t", ",", " "])
def test_a_date_and_a_time_of_day_are_one_clock(put, sep):
    days = ["2024-02-17"] * 12 + ["2024-02-18"] * 12
    clock = [f"23:59:{48 + k:02d}" for k in range(12)] + [f"00:00:{k:02d}" for k in range(12)]
    path = put("a.txt", table(days, clock, PRESSURE, LENGTH, sep=sep))
    recording = import_file(path, make_options(columns=["pressure=3", "length=4"], **TUBE))
    np.testing.assert_allclose(recording.columns["time_s"], np.arange(N), atol=1e-9)


def test_of_several_clocks_each_is_named(put):
    path = put("a.txt", table(times(), times(0.5, 9, 30), PRESSURE, LENGTH))
    named = ["pressure=3", "length=4"]
    recording = import_file(path, make_options(columns=named, interval_s=0.25, **TUBE))
    asked = [note for note in checks(recording) if "read as a clock" in note]
    assert [f"--map time={k}" in note for k, note in zip((1, 2), asked, strict=True)] == [True, True]
    recording = import_file(path, make_options(columns=[*named, "time=2"], **TUBE))
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), 0.5, atol=1e-9)


def test_columns_that_nobody_names_are_listed(put):
    path = put("a.txt", table(np.arange(N), PRESSURE, 3.0 + 0 * LENGTH, LENGTH, LENGTH + 1))
    recording = import_file(path, make_options(columns=["time=1", "pressure=2", "length=4"], kind="tube", units=["time=s", *TUBE["units"]]))
    assert any(note.startswith("columns left aside: column 3, column 5 (") for note in recording.notices)


def test_a_column_whose_heading_alone_is_missing_is_listed(put):
    head = ",Time (s),Pressure (kPa),Length (mm)\n"
    path = put("a.csv", head + table(7.0 * np.arange(N), np.arange(N), PRESSURE, LENGTH, sep=","))
    assert any("column 1, which has no heading" in note for note in import_file(path, make_options()).notices)


def test_a_named_column_of_words_is_refused_as_such(put):
    words = [f'"[{3.5 + 0.01 * k:.2f}, 0]"' for k in range(N)]
    path = put("a.csv", table(np.arange(N), 0.1 * PRESSURE, 0.01 * LENGTH, words, sep=","))
    options = {"units": ["time=s", "elongation=mm", "force=N", "resistance=ohm"], "dimensions": ["gauge_length_mm=40", "area_mm2=1"]}
    said = refusal(path, kind="wire", columns=["time=1", "elongation=2", "force=3", "resistance=4"], **options)
    assert "24 of 24 fields of column 4 are no numbers ('[3.50, 0]' in row 1)" in said


def test_marks_that_contradict_each_other_are_shown(put):
    clock = ["0.000", *(f"{70 * k}.000" for k in range(2, 15)), *(f"{k}.{210 * j:03d}.000" for k in (1, 2) for j in range(5))]
    path = put("a.csv", table(clock, PRESSURE, LENGTH, sep=";"))
    said = refusal(path, columns=["time=1", "pressure=2", "length=3"], kind="tube", units=["time=ms", *TUBE["units"]])
    assert "of column 1 cannot be told: its marks are not those of the other numbers ('" in said
    assert "'1.000.000' in row 15" in said and "'0.000'" in said


def test_an_interval_wins_over_a_clock_without_a_heading(put):
    path = put("a.txt", table(times(), PRESSURE, LENGTH))
    recording = import_file(path, make_options(columns=["pressure=2", "length=3"], interval_s=0.1, **TUBE))
    np.testing.assert_allclose(recording.columns["time_s"], 0.1 * np.arange(N), atol=1e-9)
    (said,) = [note for note in checks(recording) if "clock" in note]
    assert "column 1 was read as a clock and left aside, as --interval states" in said and "--map time=1" in said


def below_numbers(put, first, last=40, mark=","):
    x = np.linspace(0.0, 1.0, last)
    rows = "".join(f"{2.0 * k:.1f},{a:.4f},{0.5 * a * a:.4f}\n" for k, a in enumerate(x)).replace(",", mark)
    return put("a.csv", f"{first}\n{rows}")


MAPPED = {"columns": ["time=1", "strain=2", "stress=3"], "units": ["time=s", "strain=1", "stress=MPa"], "kind": "elastomer"}


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_first_row_of_numbers_without_a_first_field_may_be_headings(put, mark):
    path = below_numbers(put, f"{mark}900{mark}805", mark=mark)
    asked = "row 1 has no first field, and its numbers (900, 805) are far from all below: are these its headings?"
    assert asked in refusal(path)
    (note,) = [n for n in import_file(path, make_options(**MAPPED)).notices if "its headings" in n]
    assert note.startswith(f"check: {asked}") and "--rows 2: leaves that row out" in note
    assert len(import_file(path, make_options(rows=["2:"], **MAPPED))) == 40


@pytest.mark.parametrize("first", [",0.01,0.02", "0,900,805", ",,805", ",0.5,900"])
def test_a_first_row_like_the_others_is_asked_nothing(put, first):
    recording = import_file(below_numbers(put, first), make_options(**MAPPED))
    assert not [n for n in recording.notices if "its headings" in n]
