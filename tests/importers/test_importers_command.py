"""`pneusma import`: shows what it understood, writes all or nothing, never over a file unasked."""

import pytest
from click.testing import CliRunner

from fitting.cli.import_ import import_command
from fitting.data.importers import folders, other_workbooks
from fitting.data.recordings import read_recording
from pneusma_jax.errors import InputError

GOOD = "Time (s),Strain,Stress (kPa)\n0,0,0\n1,0.1,1\n2,0.2,2\n"


def run(*args):
    return CliRunner().invoke(import_command, [str(arg) for arg in args])


def refused(*args):
    result = run(*args)
    assert isinstance(result.exception, InputError) and "\n" not in str(result.exception)
    return str(result.exception)


def test_preview_shows_and_writes_nothing(put, tmp_path):
    result = run(put("a.csv", GOOD), "--preview", "--out", tmp_path / "out")
    assert result.exit_code == 0
    for words in ("a: kind elastomer, specimen a, 3 rows", "stress_kPa", "first rows:", "licence: not stated", "nothing written"):
        assert words in result.output
    assert not (tmp_path / "out").exists()


def test_what_several_recordings_share_is_told_once(put):
    """A file of four tests repeated ten notes four times."""
    files = [put(f"{name}.csv", GOOD if name == "c" else f"{GOOD}3,0.3,3\n") for name in "abc"]
    said = run(*files, "--preview", "--kind", "elastomer").output
    assert said.count("- time_s from 'Time (s)'") == 1 and "all 3 recordings:\n" in said
    both = said[said.index("a, b:\n") :]
    assert both.startswith("a, b:\n  - 4 ") and "  - 3 " in said[: said.index("a, b:\n")]


def test_preview_writes_units_as_headings_do(put):
    rows = "".join(f"{k},{5 + k},{20 + 0.1 * k}\n" for k in range(5))
    result = run(put("a.csv", f"time [s],pressure [kPa],curvature [1/m]\n{rows}"), "--preview", "--kind", "actuator")
    (line,) = [line for line in result.output.splitlines() if line.split()[:1] == ["curvature_1pm"]]
    assert line.split()[1] == "1/m"


def test_import_writes_pairs_that_read_back(put, tmp_path):
    result = run(
        put("a.csv", GOOD), put("b.csv", GOOD), "--out", tmp_path / "out", "--licence", "CC BY 4.0", "--citation", "Ada",
        "--specimen", "E", "--role", "validation", "--scale", "stress=2", "--unit", "stress=Pa",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.csv", "a.toml", "b.csv", "b.toml"]
    recording = read_recording(tmp_path / "out" / "a.csv")
    assert recording.real and recording.role == "validation" and recording.specimen == "E"
    assert recording.si("stress").tolist() == [0.0, 2.0, 4.0] and recording.source["citation"] == "Ada"


def test_columns_can_be_named(put, tmp_path):
    path = put("a.txt", "5 0 0\n6 10 1\n7 20 2\n8 30 3\n")
    result = run(
        path, "--out", tmp_path / "out", "--map", "strain=2", "--map", "stress=3", "--unit", "strain=%",
        "--unit", "stress=MPa", "--kind", "elastomer", "--licence", "ours",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert read_recording(tmp_path / "out" / "a.csv").columns["strain"].tolist() == pytest.approx([0, 0.1, 0.2, 0.3])


def test_a_file_of_ones_own_needs_no_licence(put, tmp_path):
    result = run(put("a.csv", GOOD), "--out", tmp_path / "out")
    assert result.exit_code == 0 and "fine for numbers of your own" in result.output
    recording = read_recording(tmp_path / "out" / "a.csv")
    assert recording.real and recording.source["licence"] == recording.source["citation"] == "not stated"


def test_one_bad_file_and_nothing_is_written(put, tmp_path):
    message = refused(put("a.csv", GOOD), put("b.csv", "prose\n"), "--out", tmp_path / "out", "--licence", "ours")
    assert "b.csv" in message and not (tmp_path / "out").exists()


def test_files_in_the_way_need_force(put, tmp_path):
    args = (put("a.csv", GOOD), put("b.csv", GOOD), "--out", tmp_path / "out", "--licence", "ours")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "b.toml").write_text("mine")
    assert "b.toml: this file is already there" in refused(*args) and "--force" in refused(*args)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["b.toml"]
    assert run(*args, "--force").exit_code == 0
    assert len(list((tmp_path / "out").iterdir())) == 4


def test_folders_and_what_is_left_aside(put, tmp_path):
    put("bench/a.csv", GOOD)
    put("bench/notes.txt", "prose")
    result = run(tmp_path / "bench", "--preview")
    assert "left aside" in result.output and "notes.txt" in result.output


def test_formats_are_listed_and_usage_is_checked(put, tmp_path):
    listed = run("--formats").output
    assert "sma-columns" in listed and "refused: this is a calorimeter scan" in listed
    assert run().exit_code == 2 and "name one or more files" in run().output
    assert run(put("a.csv", GOOD)).exit_code == 2
    assert "did you mean 'spring'" in refused(put("a.csv", GOOD), "--preview", "--kind", "sprin")


def test_dimensions_of_a_spring_go_into_the_sidecar(put, tmp_path):
    raw = "Time (s),Elongation (mm),Force (N),Resistance (ohm)\n" + "".join(f"{k},{k},{0.1 * k},3\n" for k in range(5))
    given = ("--dimension", "wire_diameter_mm=0.3", "--dimension", "active_coils=40", "--kind", "spring")
    result = run(put("pull.csv", raw), "--out", tmp_path / "out", "--licence", "ours", *given)
    assert result.exit_code == 0, result.output
    recording = read_recording(tmp_path / "out" / "pull.csv")
    assert recording.geometry == {"wire_diameter_mm": 0.3, "active_coils": 40.0}
    assert "no [geometry]" not in result.output
    message = refused(put("pull.csv", raw), "--preview", "--kind", "spring", "--dimension", "wire_diametr_mm=0.3")
    assert "wire_diameter_mm" in message


def test_what_a_folder_holds_besides_is_named(tmp_path, monkeypatch):
    """Other endings, old workbooks without their library, and folders; a licence and hidden files are no data."""
    monkeypatch.setattr(folders, "RAW_ENDINGS", tuple({*folders.RAW_ENDINGS} - {*other_workbooks.ENDINGS}))
    table = "Strain (%),Stress (kPa)\n" + "".join(f"{k},{3 * k}\n" for k in range(9))
    bench = tmp_path / "bench"
    (bench / "day two" / "deep").mkdir(parents=True)
    (bench / "empty").mkdir()
    for name in ("a.csv", "b.lvm", "day two/c.csv", "day two/deep/d.txt"):
        (bench / name).write_text(table)
    for name in ("old.xls", "1.jpg", "2.jpg", "3.jpg", "4.jpg", "log", "LICENSE", ".hidden"):
        (bench / name).write_text("x")
    result = run(bench, "--preview")
    assert result.exit_code == 0
    left = [line for line in result.output.splitlines() if line.startswith("check: left aside")]
    assert len(left) == 4
    assert any("old.xls (a workbook in the format .xls: save it as .xlsx, or pip install" in line for line in left)
    assert any("1.jpg, 2.jpg, 3.jpg, ... (ending .jpg, not looked into" in line for line in left)
    assert any("day two, a folder with 2 text files or workbooks: name it" in line for line in left)
    assert any("log (without an ending, not looked into: name the file to try it)" in line for line in left)
    assert "a: kind" in result.output and "b: kind" in result.output and "c: kind" not in result.output
