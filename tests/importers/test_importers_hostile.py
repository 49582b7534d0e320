"""Files as a hostile reviewer would make them: read right, or refused in one line that says what is wrong."""

import gzip

import numpy as np
import openpyxl
import pytest

from fitting.data.importers import import_file, import_tests, make_options
from pneusma_jax.errors import InputError

MU = 120.0
STRAIN = np.linspace(0.0, 1.0, 60)
STRESS = MU * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
TIME = 0.5 * np.arange(60)
SIZES = {"dimensions": ["gauge_length_mm=25", "area_mm2=18"]}
EXTENSION, LOAD = 25.0 * STRAIN, 18e-3 * STRESS


def german(value, digits=3):
    return f"{value:,.{digits}f}".translate(str.maketrans(",.", ".,"))


def rows(*columns, sep=",", form=str, end="\n"):
    return "".join(sep.join(form(x) for x in row) + end for row in zip(*columns, strict=True))


def plain(sep=",", end="\n", names=("Time (s)", "Strain (%)", "Stress (kPa)")):
    return sep.join(names) + end + rows(TIME, 100.0 * STRAIN, STRESS, sep=sep, form=lambda x: f"{x:.4f}", end=end)


def modulus(recording):
    strain = recording.columns["strain"]
    shape = 1.0 + strain - (1.0 + strain) ** -2
    there = np.isfinite(recording.columns["stress_kPa"])
    return float(recording.columns["stress_kPa"][there] @ shape[there] / (shape[there] @ shape[there]))


def written(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


three = lambda x: f"{x:.5f}"  # noqa: E731
READ = {
    "byte order mark, decimal commas, thousands": (
        "﻿Zeit (s);Dehnung (%);Spannung (Pa)\r\n"
        + rows(TIME, 100 * STRAIN, 1e3 * STRESS, sep=";", form=german, end="\r\n"), {},
    ),
    "units in a row below": ("Time,Extension,Load\nsec,mm,N\n" + rows(TIME, EXTENSION, LOAD, form=three), SIZES),
    "three rows of headings": (
        "Channel 1,Channel 2,Channel 3\nTime,Extension,Load\n[s],[mm],[N]\n" + rows(TIME, EXTENSION, LOAD, form=three),
        SIZES,
    ),
    "tabs": (plain("\t"), {}), "semicolons": (plain(";"), {}), "bars": (plain("|"), {}), "spaces": (
        plain("   ", names=("Time_s", "Strain_percent", "Stress_kPa")), {},
    ),
    "rows of a summary": (plain() + "\nMean,50,100\nStd. dev.,28.9,61\nMaximum,100,210\n", {}),
    "a summary of numbers": (plain() + ",50.0,100.0\n,28.9,61\n", {}),
    "percent in words": (plain(names=("Time (s)", "Percent strain", "Stress (kPa)")), {}),
    "percent signs": (
        "Strain,Stress (kPa)\n" + "".join(f"{100 * e:.4f}%,{s:.4f}\n" for e, s in zip(STRAIN, STRESS, strict=True)), {},
    ),
    "kilograms of force": ("Extension (mm),Load (kgf)\n" + rows(EXTENSION, LOAD / 9.80665, form=lambda x: f"{x:.7f}"), SIZES),
    "inches and pounds": (
        "Extension (in),Load (lbf)\n" + rows(EXTENSION / 25.4, LOAD / 4.4482216, form=lambda x: f"{x:.8f}"), SIZES,
    ),
    "mixed ends of lines": ("".join(
        line + ("\r", "\n", "\r\n")[k % 3] for k, line in enumerate(plain().splitlines())
    ), {}),
    "Latin letters": (("Zeit (s);Dehnung (%);Spannung (N/mm²);Prüfkörper\n" + "".join(
        f"{german(t)};{german(100 * e)};{german(s / 1e3, 6)};Prüfling 1\n"
        for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)
    )).encode("latin-1"), {}),
    "UTF-16": (plain("\t").encode("utf-16"), {}), "UTF-16 without mark": (plain("\t").encode("utf-16-le"), {}),
    "quoted thousands": (
        "Strain (%),Stress (Pa)\n"
        + "".join(f'"{100 * e:.3f}","{1e3 * s:,.1f}"\n' for e, s in zip(STRAIN, STRESS, strict=True)), {},
    ),
    "exponents with D": ("Strain(-) Stress(Pa)\n" + rows(
        STRAIN, 1e3 * STRESS, sep=" ", form=lambda x: f"{x:.5E}".replace("E", "D")
    ), {}),
    "trailing commas": (plain(end=",,,\n"), {}),
    "time stamps": ("Timestamp,Strain (%),Stress (kPa)\n" + "".join(
        f"2024-03-01 23:59:{int(t) + 45:02d}.{int(10 * t) % 10}00,{100 * e:.4f},{s:.4f}\n"
        for t, e, s in zip(TIME / 3.0, STRAIN, STRESS, strict=True)
    ), {}),
    "plural headings": ("Stretches,Stresses (kPa)\n" + rows(1.0 + STRAIN, STRESS, form=three), {}),
    "columns of torque": (
        "Position (mm),Force (N),Rotation (deg),Torque (N·m)\n" + rows(EXTENSION, LOAD, 0 * LOAD - 29.3, 0 * LOAD + 0.02, form=three),
        SIZES,
    ),
    "a video extensometer": (
        "Displacement (mm),Force (N),AVE2 (%)\n" + rows(1.3 * EXTENSION, LOAD, 100 * STRAIN, form=three), SIZES,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_it_is_read(tmp_path, name):
    content, options = READ[name]
    recording = import_file(written(tmp_path, "a.csv", content), make_options(**options))
    assert recording.kind == "elastomer" and len(recording) == 60
    assert modulus(recording) == pytest.approx(MU, rel=2e-4)
    assert recording.columns["strain"].max() == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("way", ["numbered", "row above", "unequal"])
def test_a_recording_for_each_specimen_side_by_side(tmp_path, way):
    names = "Strain 1 (%),Stress 1 (kPa),Strain 2 (%),Stress 2 (kPa)\n" if way == "numbered" else (
        ",Specimen A,,Specimen B\n" * (way == "row above") + "Strain (%),Stress (kPa),Strain (%),Stress (kPa)\n"
    )  # fmt: skip
    body = "".join(
        f"{100 * e:.3f},{s:.4f}," + (f"{90 * e:.3f},{2 * s:.4f}\n" if way != "unequal" or k < 40 else ",\n")
        for k, (e, s) in enumerate(zip(STRAIN, STRESS, strict=True))
    )
    first, second = import_tests(written(tmp_path, "a.csv", names + body))
    assert modulus(first) == pytest.approx(MU, rel=1e-3) and second.columns["strain"].max() < 0.91
    assert len(second) == (40 if way == "unequal" else 60)


def test_merged_headings_of_a_workbook(tmp_path):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet["A1"], sheet["A2"], sheet["C2"] = "Silicone", "Specimen 1", "Specimen 2"
    for cells in ("A1:D1", "A2:B2", "C2:D2"):
        sheet.merge_cells(cells)
    for row in (["Strain", "Stress"] * 2, ["%", "kPa"] * 2, *zip(100 * STRAIN, STRESS, 90 * STRAIN, 2 * STRESS, strict=True)):
        sheet.append([float(x) if not isinstance(x, str) else x for x in row])
    book.save(tmp_path / "a.xlsx")
    first, second = import_tests(tmp_path / "a.xlsx")
    assert modulus(first) == pytest.approx(MU, rel=1e-6) and second.columns["strain"].max() == pytest.approx(0.9)


def test_a_hidden_sheet_is_read_and_said(tmp_path):
    book = openpyxl.Workbook()
    for name, factor in (("Run", 1.0), ("Run old", 3.0)):
        sheet = book.create_sheet(name)
        sheet.append(["Strain (%)", "Stress (kPa)"])
        for e, s in zip(STRAIN, STRESS, strict=True):
            sheet.append([float(100 * e), float(factor * s)])
    sheet.sheet_state = "hidden"
    book.save(tmp_path / "a.xlsx")
    shown, hidden = import_tests(tmp_path / "a.xlsx")
    assert not any("is hidden" in note for note in shown.notices)
    assert any("sheet 'Run old' is hidden in the workbook" in note for note in hidden.notices)
    assert modulus(import_file(tmp_path / "a.xlsx", make_options(sheet="Run"))) == pytest.approx(MU, rel=1e-6)


def test_formulas_that_nobody_computed_are_said(tmp_path):
    book = openpyxl.Workbook()
    book.active.append(["Strain (%)", "Stress (kPa)"])
    for k in range(20):
        book.active.append([k, f"=A{k + 2}*2"])
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(InputError, match=r"formulas that no program has computed \(B2: '=A2\*2'\)"):
        import_file(tmp_path / "a.xlsx")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "the file is empty"),
        (b" \n\n ", "the file is empty"),
        ("Time (s),Strain (%),Stress (kPa)\n", "'Stress (kPa)' stand no numbers; a table needs 3"),
        ("Time (s),Strain (%),Stress (kPa)\n0,0,0\n", "stands 1 row of numbers; a table needs 3"),
        (b"Strain (%),Stress (kPa)\n" + b"\0" * 200 + b"1", "neither text nor an Excel workbook"),
        (b"\x89HDF\r\n\x1a\n" + b"\0" * 300, "cannot be read as an HDF5 file"),
        (b"MATLAB 5.0 MAT-file" + b"\0" * 300, "this file of MATLAB cannot be read"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 300, " .xls"),
        (gzip.compress(b"a,b\n1,2\n", mtime=0), "this is a gzip archive"),
        (b"%PDF-1.7\n" + b"x" * 300, "this is a PDF"),
        ('{"strain": [0, 1]}', "this is a JSON file"),
        ("<html><table><tr><td>Time</td></tr></table></html>", "this is a web page"),
        (b"PK\x03\x04" + b"\0" * 300, "not an Excel workbook that can be read"),
        ("Time,Extension,Load\n" + "".join(f"{k} s,{k} mm,{k} {'mm' if k % 2 else 'N'}\n" for k in range(20)), "are no numbers ('0 N' in row 2)"),
    ],
)
def test_it_is_refused_in_one_line(tmp_path, content, said):
    with pytest.raises(InputError) as error:
        import_file(written(tmp_path, "a.csv", content), make_options(**SIZES))
    assert said in str(error.value) and "\n" not in str(error.value) and "a.csv" in str(error.value)


@pytest.mark.parametrize("mark", ["-9999", "9999", "999.9", "9.9e37", "-999.0"])
def test_marks_for_no_reading_are_missing_and_said(tmp_path, mark):
    body = "".join(f"{100 * e:.3f},{mark if k % 9 == 3 else f'{s:.4f}'}\n" for k, (e, s) in enumerate(zip(STRAIN, STRESS, strict=True)))
    recording = import_file(written(tmp_path, "a.csv", "Strain (%),Stress (kPa)\n" + body))
    assert np.isnan(recording.columns["stress_kPa"]).sum() == 7 and modulus(recording) == pytest.approx(MU, rel=1e-3)
    assert any("taken as a mark for no reading" in note and "in 7 rows of 'Stress (kPa)'" in note for note in recording.notices)


def test_nines_among_their_like_are_readings(tmp_path):
    text = "Strain (%),Stress (kPa)\n" + "".join(f"{k},{990 + k}\n" for k in range(20))
    recording = import_file(written(tmp_path, "a.csv", text))
    assert np.isfinite(recording.columns["stress_kPa"]).all()


def test_blanks_of_all_kinds_are_missing(tmp_path):
    marks = ["NaN", "nan", "#N/A", "-", "--", "NULL", "****", "", "n/a"]
    body = "".join(f"{100 * e:.3f},{marks[k % 9] if k % 6 == 3 else f'{s:.4f}'}\n" for k, (e, s) in enumerate(zip(STRAIN, STRESS, strict=True)))
    recording = import_file(written(tmp_path, "a.csv", "Strain (%),Stress (kPa)\n" + body))
    assert np.isnan(recording.columns["stress_kPa"]).sum() == 10 and modulus(recording) == pytest.approx(MU, rel=1e-3)


def test_a_row_with_a_field_too_many_is_spoken_of(tmp_path):
    lines = plain().splitlines()
    lines[31] += ",7"
    recording = import_file(written(tmp_path, "a.csv", "\n".join(lines)))
    assert any("1 row has more fields than the 3 headings (row 32: 4 fields)" in note for note in recording.notices)


@pytest.mark.parametrize("reach", [0.4, 1.2])
def test_a_pull_that_is_counted_negative_is_asked_about(tmp_path, reach):
    strain = reach * STRAIN
    text = "Extension (mm),Load (N)\n" + rows(-25 * strain, -18e-3 * MU * (1 + strain - (1 + strain) ** -2), form=lambda x: f"{x:.6f}")
    path = written(tmp_path, "a.csv", text)
    if reach > 1.0:
        with pytest.raises(InputError, match="--scale elongation=-1 --scale force=-1"):
            import_file(path, make_options(**SIZES))
    else:
        notes = import_file(path, make_options(**SIZES)).notices
        assert any("softens over strain" in note and "--scale elongation=-1 --scale force=-1" in note for note in notes)
    turned = import_file(path, make_options(**SIZES, scales=["elongation=-1", "force=-1"]))
    assert modulus(turned) == pytest.approx(MU, rel=1e-3)


def test_a_press_that_is_counted_negative_is_not_asked_about(tmp_path):
    strain = -0.4 * STRAIN
    text = "Strain (-),Stress (kPa)\n" + rows(strain, MU * (1 + strain - (1 + strain) ** -2), form=three)
    assert not any(note.startswith("check") for note in import_file(written(tmp_path, "a.csv", text)).notices)


def test_strain_that_is_counted_from_another_zero_is_spoken_of(tmp_path):
    text = "Strain (-),Stress (kPa)\n" + rows(STRAIN - 0.6, STRESS, form=three)
    (note,) = (n for n in import_file(written(tmp_path, "a.csv", text)).notices if "opposite signs" in n)
    assert "--subtract strain=-0.6" in note
    mended = import_file(tmp_path / "a.csv", make_options(subtracted=["strain=-0.6"]))
    assert modulus(mended) == pytest.approx(MU, rel=1e-3) and not any("opposite signs" in n for n in mended.notices)


def test_a_unit_that_is_assumed_is_to_be_looked_at_with_the_modulus_that_follows(tmp_path):
    text = "".join(f"{1 + e:.4f} {s:.4f}\n" for e, s in zip(0.3 * STRAIN, STRESS, strict=True))
    (note,) = (n for n in import_file(written(tmp_path, "a.txt", text)).notices if "taken as MPa" in n)
    assert note.startswith("check:") and "That makes a modulus of 700 MPa" in note and "--unit stress=" in note
