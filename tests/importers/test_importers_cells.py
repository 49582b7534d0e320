"""Cells of a workbook: numbers beside texts, and formulas that nobody computed."""

import numpy as np
import pytest
from answers import refusal

from fitting.data.importers import import_file, make_options

STRAIN = np.linspace(0.0, 0.6, 30)
LOAD = 1.0 + 4.0 * STRAIN  # N: from 1 to 3.4
SIZES = {"kind": "elastomer", "dimensions": ["area_mm2=10"]}


def rows_of(load, *more):
    return [["Strain (%)", "Load (N)"], *([float(100 * e), f, *more] for e, f in zip(STRAIN, load, strict=True))]


def mixed(digits, every, mark=","):
    """Numbers, with texts in some rows."""
    return [f"{f:.{digits}f}".replace(".", mark) if k % every == 0 else round(float(f), digits) for k, f in enumerate(LOAD)]


@pytest.mark.parametrize("every", [1.5, 2, 7])
def test_a_text_that_may_be_a_thousandfold_is_asked_about(put_sheet, every):
    message = refusal(put_sheet("a.xlsx", rows_of(mixed(3, every))), **SIZES)
    assert "'1,000' in row 2 of 'Load (N)' may be 1.000 or 1000" in message and "write it as the other numbers are" in message


@pytest.mark.parametrize(("digits", "every"), [(2, 2), (2, 7), (4, 3)])
def test_another_text_proves_the_mark(put_sheet, digits, every):
    recording = import_file(put_sheet("a.xlsx", rows_of(mixed(digits, every))), make_options(**SIZES))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 100 * LOAD, atol=1.0)


def test_numbers_keep_their_decimals_beside_texts_with_commas(put_sheet):
    """Most cells are texts with a decimal comma; 1.234 as a number is no thousand."""
    load = [f"{f:.2f}".replace(".", ",") if k % 3 else round(float(f), 3) for k, f in enumerate(LOAD)]
    recording = import_file(put_sheet("a.xlsx", rows_of(load)), make_options(**SIZES))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 100 * LOAD, atol=1.0)


def test_texts_alone_are_read_as_those_of_a_file(put_sheet):
    load = [f"{1000 * f:,.1f}" for f in LOAD]
    recording = import_file(put_sheet("a.xlsx", rows_of(load)), make_options(**SIZES))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1e5 * LOAD, rtol=1e-3)
    assert any("thousands are grouped: '1,000.0' in row 2" in note for note in recording.notices)


@pytest.mark.parametrize(("field", "point"), [("1,205", True), ("3.125", False), ("-1,205", True)])
def test_a_doubtful_field_of_a_text_file_is_asked_about(put, field, point):
    lines = [f"{100 * e:.2f};{field if k == 20 else f'{f:.3f}'}" for k, (e, f) in enumerate(zip(STRAIN, LOAD, strict=True))]
    text = "\n".join(lines) if point else "\n".join(lines).replace(".", ",").replace(field.replace(".", ","), field)
    message = refusal(put("a.csv", f"Strain (%);Load (N)\n{text}\n"), **SIZES)
    assert f"{field!r} in row 22 of 'Load (N)' may be" in message


@pytest.mark.parametrize("form", ["{:,.0f}", "{:,.1f}"])
def test_grouped_thousands_beside_smaller_numbers_are_no_doubt(put, form):
    lines = [f"{100 * e:.1f};{form.format(3000 * e)}" for e in STRAIN]
    recording = import_file(put("a.csv", "Strain (%);Load (N)\n" + "\n".join(lines) + "\n"), make_options(**SIZES))
    assert recording.columns["stress_kPa"].max() == pytest.approx(1.8e5)
    assert any("thousands are grouped" in note for note in recording.notices)


# Formulas that no program computed, as writing libraries leave them.


def test_a_column_that_is_a_formula_in_some_rows_is_refused(put_sheet):
    load = [f"=A{k + 2}*0.04+1" if k % 3 == 1 else float(f) for k, f in enumerate(LOAD)]
    message = refusal(put_sheet("a.xlsx", rows_of(load)), **SIZES)
    assert "sheet 'Sheet' holds 10 formulas that no program has computed (B3: '=A3*0.04+1')" in message


def test_a_needed_column_of_formulas_is_named_rather_than_a_missing_size(put_sheet):
    rows = [["Extension (mm)", "Load (N)", "Stress (kPa)"]] + [[20 * e, f, f"=B{k + 2}/0.01"] for k, (e, f) in enumerate(zip(STRAIN, LOAD, strict=True))]
    book = {"Data": [[float(x) if not isinstance(x, str) else x for x in row] for row in rows]}
    assert "holds 30 formulas that no program has computed (C2: '=B2/0.01')" in refusal(put_sheet("a.xlsx", book))


def test_a_formula_that_nothing_needs_is_said(put_sheet):
    rows = rows_of(LOAD, "=1+1")
    rows[0].append("Note")
    recording = import_file(put_sheet("a.xlsx", rows), make_options(**SIZES))
    assert len(recording) == 30 and any(note.startswith("check: sheet 'Sheet' holds 30 formulas") for note in recording.notices)


def test_empty_cells_beside_formulas_on_another_sheet_are_only_missing(put_sheet):
    load = [None if k == 5 else float(f) for k, f in enumerate(LOAD)]
    path = put_sheet("a.xlsx", {"Data": rows_of(load), "Summary": [["Largest load", "=MAX(Data!B2:B31)"]]})
    assert np.isnan(import_file(path, make_options(**SIZES)).columns["stress_kPa"]).sum() == 1
