"""Headings that say of which spring a resistance or a current is."""

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli.import_ import import_command
from fitting.data.importers import import_tests, make_options


def imported(tmp_path, headings, columns):
    file = tmp_path / "run.csv"
    rows = np.stack(columns, axis=1)
    file.write_text("\n".join([",".join(headings), *(",".join(f"{x:.6g}" for x in row) for row in rows)]) + "\n", "utf-8")
    (test,) = import_tests(file, make_options())
    return test.recording if hasattr(test, "recording") else test


TIME = np.arange(20.0)
OHMS, AMPERES = 3.6 - 0.01 * TIME, 0.1 + 0.001 * TIME


@pytest.mark.parametrize(
    ("ohms", "amperes"),
    [
        ("R2 (ohm)", "I2 (A)"), ("R_2 (Ω)", "I_2 (A)"), ("R spring 2 [Ohm]", "I spring 2 [A]"),
        ("Spring 2 resistance [Ohm]", "Spring 2 current [A]"), ("SMA 2 R [Ohm]", "SMA 2 I [A]"),
        ("Resistance of spring 2 [Ohm]", "Current of spring 2 [A]"),
    ],
)  # fmt: skip
def test_a_spring_is_read_by_its_number(tmp_path, ohms, amperes):
    """A spring whose resistance is left aside is taken as cold."""
    headings = ("t [s]", "Pressure [kPa]", ohms, amperes, "Curvature [1/m]")
    recording = imported(tmp_path, headings, (TIME, 10.0 + TIME, OHMS, AMPERES, 5.0 + TIME))
    np.testing.assert_allclose(recording.columns["resistance_2_ohm"], OHMS, rtol=1e-5)
    np.testing.assert_allclose(recording.columns["current_2_A"], AMPERES, rtol=1e-5)
    assert not any(notice.startswith("check:") and "spring" in notice for notice in recording.notices)


def test_a_resistance_of_no_spring_is_asked_about(tmp_path):
    headings = ("t [s]", "Pressure [kPa]", "R right (ohm)", "Curvature [1/m]")
    recording = imported(tmp_path, headings, (TIME, 10.0 + TIME, OHMS, 5.0 + TIME))
    assert any(
        notice.startswith("check: 'R right (ohm)' is a resistance, but of which spring is not said")
        for notice in recording.notices
    )


@pytest.mark.parametrize("ohms", ["Spring 1 resistance [Ohm]", "R_1 [Ohm]", "R1 (ohm)"])
def test_one_spring_on_a_stand_needs_no_number(tmp_path, ohms):
    headings = ("t [s]", "elongation [mm]", "force [N]", ohms)
    recording = imported(tmp_path, headings, (TIME, 0.3 * TIME, 0.02 * TIME, OHMS))
    assert recording.kind == "spring"
    np.testing.assert_allclose(recording.columns["resistance_ohm"], OHMS, rtol=1e-5)


def previewed(*arguments):
    return CliRunner().invoke(import_command, [*map(str, arguments), "--preview"]).output


def test_files_without_a_specimen_are_asked_whether_they_are_of_one(tmp_path):
    """Leads of an actuator hide in constants that every file has of its own."""
    headings = ("t [s]", "Pressure [kPa]", "R2 (ohm)", "Curvature [1/m]")
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        imported(folder, headings, (TIME, 10.0 + TIME, OHMS, 5.0 + TIME))
        (folder / "run.csv").rename(tmp_path / f"{name}.csv")
    files = (tmp_path / "a.csv", tmp_path / "b.csv")
    asked = "check: each of 2 recordings is taken as a specimen of its own"
    assert asked in previewed(*files)
    assert asked not in previewed(*files, "--specimen", "A")
    assert asked not in previewed(files[0])


def test_recordings_are_not_added_to_results(tmp_path):
    headings = ("t [s]", "Pressure [kPa]", "R2 (ohm)", "Curvature [1/m]")
    imported(tmp_path, headings, (TIME, 10.0 + TIME, OHMS, 5.0 + TIME))
    out = tmp_path / "results"
    out.mkdir()
    (out / "report.json").write_text("{}")
    result = CliRunner().invoke(import_command, [str(tmp_path / "run.csv"), "--out", str(out)])
    assert "results of another command are here" in str(result.exception)
    assert [path.name for path in out.iterdir()] == ["report.json"]
