"""What a workbook shows beside the values of its cells: formats, hidden and struck cells, comments."""

import zipfile

import numpy as np
import openpyxl
import pytest
from answers import checks, refusal
from openpyxl.comments import Comment
from openpyxl.styles import Font

from fitting.data.importers import import_file, import_tests, make_options
from fitting.data.importers.number_formats import Display, display_of

N = 40
TIME = 0.5 * np.arange(N)
STRAIN = np.linspace(0.0, 0.6, N)
STRESS = 30.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
HEAD = ["Time (s)", "Strain (-)", "Stress (kPa)"]


def book(path, head=HEAD, columns=(TIME, STRAIN, STRESS), formats=(), mark=lambda sheet: None):
    """A workbook of one table, with the number format of each column."""
    made = openpyxl.Workbook()
    made.active.append(head)
    for row in zip(*(column.tolist() for column in columns), strict=True):
        made.active.append(row)
        for column, text in enumerate(formats, start=1):
            made.active.cell(made.active.max_row, column).number_format = text
    mark(made.active)
    made.save(path)
    return path


@pytest.mark.parametrize(
    ("text", "display"),
    [
        ("General", Display()), ("#,##0.00", Display()), ("0.00;[Red]-0.00", Display()), ("0.0%", Display(100.0, percent=True)),
        ('0.0"%"', Display(percent=True)), ("0.0,", Display(1e-3)), ("#,##0,", Display(1e-3)), ("0.00,,", Display(1e-6)),
        ('0.00" kPa"', Display(unit="kPa")), ('0.00,"k"', Display()), ('0.0,, "M"', Display()), ('0.0,"kPa"', Display(1e-3, unit="kPa")), ("[>=1000]0.0,;0.0", Display()), ("[Red]0.0,", Display(1e-3)), ('0.0 "N";-0.0 "N"', Display(unit="N")), ('0 "pcs"', Display()),
    ],
)  # fmt: skip
def test_a_number_format_says_how_a_number_is_displayed(text, display):
    shown = display_of(text)
    assert shown.factor == pytest.approx(display.factor) and shown[1:] == display[1:]


def test_numbers_in_thousands_below_a_unit_are_asked_about(tmp_path):
    """A stress of 20.8 under a heading of kPa may be 20.8 kPa, or 20800 kPa."""
    path = book(tmp_path / "a.xlsx", columns=(TIME, STRAIN, 1e3 * STRESS), formats=["0.0", "0.000", "0.000,"])
    said = refusal(path)
    assert "displays 'Stress (kPa)' in thousands" in said and "--unit stress=Pa or --unit stress=kPa" in said
    for unit, factor in (("Pa", 1.0), ("kPa", 1e3)):
        recording = import_file(path, make_options(units=[f"stress={unit}"]))
        np.testing.assert_allclose(recording.columns["stress_kPa"], factor * STRESS, rtol=1e-9)


@pytest.mark.parametrize(
    ("heading", "cells", "shown"),
    [
        ("Stress (kPa)", 1.0, '0.000,"MPa"'),
        ("Stress (kPa)", 1e3, '0.0,"kPa"'),
        ("Stress (Pa)", 1e3, "#,##0,"),
        ("Stress", 1e3, '0.0,"kPa"'),
        ("Stress (kPa)", 1.0, "[>=10]0.0,;0.0"),
        ("Stress (kPa)", 1.0, "[>=1000]#,##0.0,;[<0]-0.0;0.0"),
    ],
)
def test_a_number_in_thousands_and_its_unit_are_from_one_place(tmp_path, heading, cells, shown):
    """A force of 3 N, displayed as 0.003 kN below a heading in N, was 0.003 N."""
    path = book(tmp_path / "a.xlsx", [*HEAD[:2], heading], (TIME, STRAIN, cells * STRESS), ["0.0", "0.000", shown])
    np.testing.assert_allclose(import_file(path).columns["stress_kPa"], STRESS, rtol=1e-9)


def test_a_displayed_unit_that_contradicts_the_heading_in_thousands_is_asked_about(tmp_path):
    said = refusal(book(tmp_path / "a.xlsx", [*HEAD[:2], "Stress (Pa)"], formats=["0.0", "0.000", '0.000,"MPa"']))
    assert "--unit stress=kPa or --unit stress=Pa" in said and "displays 'Stress (Pa)' in MPa" in said


def test_numbers_in_thousands_below_a_row_of_units_are_in_its_unit(tmp_path):
    path = book(tmp_path / "a.xlsx", ["Time", "Strain", "Stress"], (TIME, STRAIN, STRESS), ["0.0", "0.000", '0.000,"MPa"'], mark=lambda sheet: (sheet.insert_rows(2), [sheet.cell(2, c, u) for c, u in enumerate(("s", "-", "kPa"), start=1)]))
    np.testing.assert_allclose(import_file(path).columns["stress_kPa"], STRESS, rtol=1e-9)


def test_a_percent_sign_that_is_only_written_scales_nothing(tmp_path):
    recording = import_file(book(tmp_path / "a.xlsx", ["Time (s)", "Strain (%)", "Stress (kPa)"], (TIME, 100 * STRAIN, STRESS), ["0.0", '0.0"%"', "0.0"]))
    np.testing.assert_allclose(recording.columns["strain"], STRAIN, rtol=1e-9)


def test_a_unit_behind_the_displayed_numbers_is_that_of_a_heading_without(tmp_path):
    path = book(tmp_path / "a.xlsx", ["Time", "Strain (-)", "Stress"], (TIME, STRAIN, 1e-3 * STRESS), ['0.0" s"', "0.0", '0.000" MPa"'])
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-9)
    assert any("the unit of 'Stress' is MPa" in note for note in recording.notices)


def test_a_unit_behind_the_displayed_numbers_that_contradicts_the_heading_is_to_be_looked_at(tmp_path):
    path = book(tmp_path / "a.xlsx", formats=["0.0", "0.0", '0.000" MPa"'])
    (said,) = [note for note in checks(import_file(path)) if "displayed" in note]
    assert "'Stress (kPa)' states kPa" in said and "--unit QUANTITY=MPa" in said
    np.testing.assert_allclose(import_file(path, make_options(units=["stress=MPa"])).columns["stress_kPa"], 1e3 * STRESS, rtol=1e-9)


def test_struck_cells_and_comments_are_to_be_looked_at(tmp_path):
    def mark(sheet):
        sheet["C20"].font = Font(strike=True)
        sheet["B30"].comment = Comment("load cell tared here", "a person")

    recording = import_file(book(tmp_path / "a.xlsx", mark=mark))
    assert len(recording) == N
    struck, comment = (note for note in checks(recording) if "strikes" in note or "comments" in note)
    assert "strikes through cell C20, which was read" in struck and "'load cell tared here' (cell B30)" in comment
    assert not checks(import_file(book(tmp_path / "b.xlsx")))


@pytest.mark.parametrize(("before", "after"), [('<row r="20"', '<row r="20" ht="0" customHeight="1"'), ("<sheetData>", '<cols><col min="3" max="3" width="0" customWidth="1"/></cols><sheetData>')])
def test_rows_and_columns_without_size_are_hidden(tmp_path, before, after):
    book(tmp_path / "a.xlsx")
    with zipfile.ZipFile(tmp_path / "a.xlsx") as plain, zipfile.ZipFile(tmp_path / "b.xlsx", "w") as changed:
        for name in plain.namelist():
            content = plain.read(name).decode()
            changed.writestr(name, content.replace(before, after) if name.endswith("sheet1.xml") else content)
    assert not any("hides" in note for note in checks(import_file(tmp_path / "a.xlsx")))
    assert any("hides row 20" in note or "hides column 3" in note for note in checks(import_file(tmp_path / "b.xlsx")))


def test_marks_are_found_wherever_the_sheets_are_stored(tmp_path):
    """Sheets are found by their relations, not by the names of their parts."""
    made = openpyxl.Workbook()
    made.active.title = "notes"
    made.active.append(["of the second test"])
    sheet = made.create_sheet("data")
    for row in [HEAD, *zip(TIME.tolist(), STRAIN.tolist(), STRESS.tolist(), strict=True)]:
        sheet.append(row)
    sheet.row_dimensions[12].hidden = True
    made.move_sheet("data", -1)
    made.save(tmp_path / "a.xlsx")
    assert any("hides row 12" in note for note in checks(import_file(tmp_path / "a.xlsx")))


def test_days_that_count_from_1900_begin_at_zero_as_other_dates_do(tmp_path):
    recording = import_file(book(tmp_path / "a.xlsx", ["Timestamp", *HEAD[1:]], (45352.5 + TIME / 86400.0, STRAIN, STRESS)))
    np.testing.assert_allclose(recording.columns["time_s"], TIME, atol=1e-4)


def test_pages_without_a_clock_that_go_on_are_asked_about(put):
    rows = [f"{e:.5f},{s:.4f}" for e, s in zip(STRAIN, STRESS, strict=True)]
    head = "Strain (-),Stress (kPa)"
    first, second = import_tests(put("a.csv", "\n".join([head, *rows[:20], "", head, *rows[20:]]) + "\n"))
    assert not any("goes on" in note for note in checks(first))
    assert any("every column goes on from the table above to row 24" in note for note in checks(second))
    loops = "\n".join([head, *rows, *rows[::-1], "", head, *rows, *rows[::-1]]) + "\n"
    assert not any("goes on" in note for recording in import_tests(put("b.csv", loops)) for note in checks(recording))


def test_formats_do_not_hide_a_unit_that_is_asked_for(tmp_path):
    assert "--unit stress=" in refusal(book(tmp_path / "a.xlsx", ["Time (s)", "Strain (-)", "Stress"], formats=["0.0", "0.0", '0.0 "pcs"']))
