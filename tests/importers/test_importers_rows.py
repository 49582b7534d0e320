"""Rows and fields: none is read for what it is not, and none is left out without a word."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, import_tests, make_options

MU = 150.0
STRAIN = np.linspace(0.0, 0.6, 24)
STRESS = MU * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
SIZES = {"dimensions": ["gauge_length_mm=20", "area_mm2=10"]}


def lines(*columns, sep=",", digits=4):
    return [sep.join(x if isinstance(x, str) else f"{x:.{digits}f}" for x in row) for row in zip(*columns, strict=True)]


def text(*parts):
    return "\n".join(line for part in parts for line in ([part] if isinstance(part, str) else part)) + "\n"


def comma(values, digits):
    return [f"{x:.{digits}f}".replace(".", ",") for x in values]


def modulus(recording):
    strain = recording.columns["strain"]
    shape = 1.0 + strain - (1.0 + strain) ** -2
    return float(shape @ recording.columns["stress_kPa"] / (shape @ shape))


# More fields than headings.

WIDE = {
    "extension and load, three decimals": ("Extension (mm),Load (N)", [comma(20 * STRAIN, 3), comma(0.01 * STRESS, 3)], SIZES),
    "a clock in whole seconds": (
        "Time (s),Strain (%),Stress (kPa)", [[str(k) for k in range(24)], comma(100 * STRAIN, 1), comma(STRESS, 2)], {},
    ),
    "a wire": (
        "Strain (%),Stress (MPa),Temperature (C)",
        [comma(6 * STRAIN, 2), comma(900 * STRAIN, 1), comma(22 + 0 * STRAIN, 1)], {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WIDE)
def test_commas_that_separate_and_mark_decimals_are_refused(put, name):
    head, columns, options = WIDE[name]
    message = refusal(put("a.csv", text(head, lines(*columns))), **options)
    assert "24 of 24 rows have more fields than the" in message and "row 2: " in message
    assert "commas both separate the fields and mark decimals" in message and "semicolons or tabs" in message


@pytest.mark.parametrize("sep", [",", ";", "\t"])
def test_a_column_without_a_heading_at_the_front_is_refused(put, sep):
    """As statistics programs write a table: the names of the rows have no heading."""
    counted = [str(k + 1) for k in range(24)]
    path = put("a.csv", text(f"Strain (%){sep}Stress (kPa)", lines(counted, 100 * STRAIN, STRESS, sep=sep)))
    assert "write a heading above every column" in refusal(path)
    mended = put("b.csv", text(f"No{sep}Strain (%){sep}Stress (kPa)", lines(counted, 100 * STRAIN, STRESS, sep=sep)))
    assert modulus(import_file(mended)) == pytest.approx(MU, rel=1e-4)


def test_a_heading_that_is_left_empty_is_one(put):
    path = put("a.csv", text("Strain (%),Stress (kPa),", lines(100 * STRAIN, STRESS, STRESS)))
    assert modulus(import_file(path)) == pytest.approx(MU, rel=1e-4)


def test_a_sheet_has_columns_whatever_the_headings(put_sheet):
    rows = [[float(100 * e), float(s), "", 3.0] for e, s in zip(STRAIN, STRESS, strict=True)]
    assert modulus(import_file(put_sheet("a.xlsx", [["Strain (%)", "Stress (kPa)"], *rows]))) == pytest.approx(MU)


# Statistics among the rows.

def foot(*rows):
    return lambda head, body: text(head, body, *rows)


STATISTICS = {
    "German words at the end": foot("Mittelwert;30;100", "Standardabweichung;18;60"),
    "with a number of rows": foot("Mean (n=24);30;100", "S.D.;18;60", "C.V. (%);60;60"),
    "below a title": foot("", "Ergebnisse", "24;30;100", "1;18;60"),
    "below a title in two cells": foot("Statistics;all rows", "24;30;100", "1;18;60"),
    "French words at the end": foot("Moyenne;30;100", "Écart type;18;60", "Médiane;30;99"),
    "at the top": lambda head, body: text(head, "Max.;60;210", "Min.;0;0", body),
    "in the middle": lambda head, body: text(head, body[:12], "Average;15;60", body[12:]),
}  # fmt: skip


@pytest.mark.parametrize("name", STATISTICS)
def test_rows_of_statistics_are_left_out_and_said(put, name):
    body = lines([str(k) for k in range(24)], 100 * STRAIN, STRESS, sep=";")
    recording = import_file(put("a.csv", STATISTICS[name]("Point;Strain (%);Stress (kPa)", body)))
    assert len(recording) == 24 and modulus(recording) == pytest.approx(MU, rel=1e-4)
    (said,) = [note for note in checks(recording) if "of statistics was left out" in note or "of statistics were left out" in note]
    assert "(row " in said


def test_statistics_on_a_sheet(put_sheet):
    rows = [[k, 0.15 * e, 200.0, 20.0 + k] for k, e in enumerate(map(float, STRAIN))]
    head = ["Reading", "Strain (-)", "Stress (MPa)", "Temperature (°C)"]
    (recording,) = import_tests(put_sheet("a.xlsx", [head, *rows, [], ["Mean", 0.045, 200, 31.5], ["Range", 0.09, 0, 23]]))
    assert recording.kind == "wire" and len(recording) == 24
    assert any("2 rows of statistics were left out: 'Mean' (row 27)" in note for note in checks(recording))


def test_phases_that_are_called_max_are_no_statistics(put):
    phases = ["load"] * 11 + ["max"] + ["unload"] * 12
    path = put("a.csv", text("Phase,Strain (%),Stress (kPa)", lines(phases, 100 * STRAIN, STRESS)))
    assert len(import_file(path)) == 24


def test_peaks_and_valleys_are_data_where_all_rows_are(put):
    names = ["Max" if k % 2 else "Min" for k in range(24)]
    path = put("a.csv", text("Type,Strain (%),Stress (kPa)", lines(names, 100 * STRAIN, STRESS)))
    assert len(import_file(path)) == 24


def test_numbers_below_a_remark_at_the_end_are_asked_about(put):
    path = put("a.csv", text("Strain (%),Stress (kPa)", lines(100 * STRAIN, STRESS), "Tangent, secant", "1.0,450.0"))
    recording = import_file(path)
    assert any("below 'Tangent, secant' (row 26) were read as measurements (row 27)" in note for note in checks(recording))


@pytest.mark.parametrize("first", ["1;2;3", "0;1;2"])
def test_a_row_that_counts_the_columns_is_none(put, first):
    path = put("a.csv", text("Time (s);Strain (%);Stress (kPa)", first, lines(np.arange(24.0), 100 * STRAIN, STRESS, sep=";")))
    recording = import_file(path)
    assert len(recording) == 24 and any("row 2 only counts the columns" in note for note in checks(recording))


def test_a_first_row_of_whole_numbers_is_data(put):
    whole = [[str(k * c) for k in range(1, 20)] for c in (1, 2, 3)]
    assert len(import_file(put("a.csv", text("Time (s),Strain (%),Stress (kPa)", lines(*whole))))) == 19


# Rows that cannot be read.

@pytest.mark.parametrize("marked", ["{}*", "{} (over)", "> {}"])
def test_rows_of_numbers_with_words_are_said(put, marked):
    stress = [marked.format(f"{s:.3f}") if k >= 20 else f"{s:.3f}" for k, s in enumerate(STRESS)]
    recording = import_file(put("a.csv", text("Strain (%),Stress (kPa)", lines(100 * STRAIN, stress))))
    (said,) = [note for note in checks(recording) if "are not numbers and were dropped" in note]
    assert "4 rows" in said and f"{stress[20]!r} (row 22)" in said


def test_a_quoted_remark_is_not_cut_at_its_comma(put):
    body = lines(np.arange(24.0), 100 * STRAIN, STRESS)
    body.insert(9, '"paused, refilled, went on"')
    recording = import_file(put("a.csv", text("Time (s),Strain (%),Stress (kPa)", body)))
    assert any("'paused, refilled, went on' (row 11)" in note for note in recording.notices)


@pytest.mark.parametrize("at", [1, 2, (1, 2)])
def test_a_remark_near_the_start_does_not_hide_the_headings(put, at):
    body = lines(np.arange(24.0), 100 * STRAIN, STRESS)
    for place in sorted([at] if isinstance(at, int) else at, reverse=True):
        body.insert(place, "*** contact found ***")
    recording = import_file(put("a.csv", text("Run 3", "Time (s),Strain (%),Stress (kPa)", body)))
    assert len(recording) == 24 and modulus(recording) == pytest.approx(MU, rel=1e-4)
    assert any("'*** contact found ***' (row " in note for note in recording.notices)


def test_two_tables_with_a_remark_near_the_start_of_the_second(put):
    body = lines(np.arange(24.0), 100 * STRAIN, STRESS)
    head = "Time (s),Strain (%),Stress (kPa)"
    twice = text(head, body, "", head, body[:1], "preload reached", body[1:])
    assert [len(recording) for recording in import_tests(put("a.csv", twice))] == [24, 24]


# Quotation marks.

def test_fields_over_several_lines(put):
    head = '"Elapsed\ntime\n(s)","Strain\n(%)","Stress\n(kPa)","Remark"'
    rows = lines(np.arange(24.0), 100 * STRAIN, STRESS)
    body = [row + (',"the grip slipped,\nsee photograph 4"' if k == 9 else ',""') for k, row in enumerate(rows)]
    recording = import_file(put("a.csv", text(head, body)))
    assert len(recording) == 24 and modulus(recording) == pytest.approx(MU, rel=1e-4) and "time_s" in recording.columns


def test_a_stray_quotation_mark_swallows_no_lines(put):
    rows = lines(np.arange(24.0), 100 * STRAIN, STRESS)
    rows[5] += ',grip 1/2"'
    rows[8] += ',"note'
    recording = import_file(put("a.csv", text('Grip: 1/2" steel', "Time (s),Strain (%),Stress (kPa),Remark", rows)))
    assert len(recording) == 24


def test_line_numbers_are_those_of_the_file(put):
    rows = lines(100 * STRAIN, STRESS)
    rows[15] = "21.0,lost"
    recording = import_file(put("a.csv", text('"Strain\n(%)","Stress\n(kPa)"', rows)))
    assert any("'lost' (row 19)" in note for note in recording.notices)


@pytest.mark.parametrize("head", ["Remark", "", "Kind"])
@pytest.mark.parametrize("words", [("Mean", "Std. dev."), ("max", "min"), ("Mittelwert", "Standardabweichung")])
def test_statistics_named_in_a_column_of_remarks_are_left_out(tmp_path, head, words):
    path = tmp_path / "remarks.csv"
    rows = [f"{k:.2f},{3.1 * k:.3f}," for k in range(30)] + [f"14.5,44.95,{words[0]}", f"8.8,27.3,{words[1]}"]
    path.write_text(f"Strain (%),Stress (kPa),{head}\n" + "\n".join(rows) + "\n")
    recording = import_file(path, make_options())
    assert len(recording) == 30 and any("2 rows of statistics" in note for note in recording.notices)


@pytest.mark.parametrize("line", ["# next specimen: B", "*** second pull ***", "next test"])
def test_a_test_that_begins_anew_below_a_line_of_words_is_asked_about(tmp_path, line):
    path = tmp_path / "anew.csv"
    pull = [f"{2 * k:.2f},{3.1 * k:.3f}" for k in range(30)]
    path.write_text("\n".join(["Strain (%),Stress (kPa)", *pull, line, *pull]) + "\n")
    checks = [note for note in import_file(path, make_options()).notices if note.startswith("check:")]
    assert any("begins anew (row 33)" in note and line[:9] in note for note in checks)


# Cells at the side of a table, and rows with a field too many.


def test_a_cell_apart_from_the_table_costs_no_row(put_sheet):
    rows = [[float(1.0 + e), float(s / 1e3)] for e, s in zip(STRAIN, STRESS, strict=True)]
    rows[6] += [None, None, 1]
    recording = import_file(put_sheet("a.xlsx", rows), make_options())
    assert len(recording.columns["strain"]) == len(STRAIN) and modulus(recording) == pytest.approx(MU)
    assert "cells apart from the table were left aside: '1' (row 7)" in recording.notices
    assert not any("not numbers" in note for note in recording.notices)


@pytest.mark.parametrize("sep", [",", ";"])
def test_a_cell_apart_under_headings_costs_no_row(put, sep):
    body = lines(100 * STRAIN, STRESS, sep=sep)
    body[3] += f"{sep}{sep}7"
    recording = import_file(put("a.csv", text(f"Strain (%){sep}Stress (kPa)", body)), make_options())
    assert len(recording.columns["strain"]) == len(STRAIN) and modulus(recording) == pytest.approx(MU, rel=1e-4)


def test_a_row_with_a_field_too_many_is_said_to_have_it(put_sheet):
    """The row may be shifted, so it is not read; but it is not said to hold no numbers."""
    rows = [[float(1.0 + e), float(s / 1e3)] for e, s in zip(STRAIN, STRESS, strict=True)]
    rows[6] += [1]
    recording = import_file(put_sheet("a.xlsx", rows), make_options())
    assert any("1 row has more fields than the 2 columns and was dropped" in note for note in checks(recording))


# A column that is called a stretch but is none; kinds that lack one quantity.


@pytest.mark.parametrize("sep", [",", ";", "\t"])
def test_a_stretch_of_zero_is_said_to_be_no_stretch(put, sep):
    path = put("a.csv", text(sep.join(("stretch", "stress (kPa)")), lines(STRAIN, STRESS, sep=sep)))
    message = refusal(path)
    assert "'stretch' falls to 0, but a stretch is 1 at rest" in message
    assert "--map strain='stretch'" in message and "percent" not in message
    assert modulus(import_file(path, make_options(columns=["strain=stretch"]))) == pytest.approx(MU, rel=1e-3)


MISSING = {
    "Time (s),Pressure (kPa)": "of a tube the length is missing, of an actuator the curvature, bend angle or length",
    "Time (s),Bend angle (deg)": "of a tube or an actuator the pressure is missing",
    "Extension (mm),Temperature (C)": "of a wire the gauge length and the stress are missing",
}


@pytest.mark.parametrize("head", MISSING)
def test_what_is_missing_of_the_nearest_kind_is_said(put, head):
    names = [name.partition(" (")[0] for name in head.split(",")]
    quantity = {"Time": "time", "Pressure": "pressure", "Bend angle": "bend_angle", "Extension": "elongation",
                "Temperature": "temperature"}  # fmt: skip
    path = put("a.csv", text(head, lines(STRAIN, STRESS)))
    columns = [f"{quantity[name]}={column}" for name, column in zip(names, head.split(","), strict=True)]
    assert MISSING[head] in refusal(path, columns=columns)
