"""Foreign files with columns named by hand or by their headings; provenance; names; the options themselves."""

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli.import_ import import_command
from fitting.data.importers import import_file, import_files, make_options, raw_files
from fitting.data.recordings import read_campaign, write_recording
from pneusma_jax.errors import InputError

FOREIGN = (
    "Prüfbericht;7\nBediener;Ada\n\nZeit;Weg;Kraft;Bemerkung\n(s);(mm);(N);\n"
    "0,0;0,00;0,0;\n0,5;1,25;10,5;Start\n1,0;2,50;1.021,0;\n1,5;3,75;---;\n\n2,0;5,00;40,0;\nEnde der Prüfung\n"
)


def refusal(call, *args, **named):
    with pytest.raises(InputError) as caught:
        call(*args, **named)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_decimal_commas_semicolons_units_below_the_names_and_stray_rows(put):
    path = put("bericht.csv", FOREIGN.encode("cp1252"))
    options = make_options(
        kind="elastomer", columns=["time=Zeit", "elongation=weg", "force=3"], scales=["force=-1", "elongation=-1"],
        dimensions=["gauge_length_mm=25", "area_mm2=2"], licence="ours",
    )  # fmt: skip
    recording = import_file(path, options)
    np.testing.assert_allclose(recording.columns["time_s"], [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(recording.columns["strain"], [0, -0.05, -0.1, -0.15, -0.2])
    np.testing.assert_allclose(recording.columns["stress_kPa"], [0, -5250, -510500, np.nan, -20000])
    text = "\n".join(recording.notices)
    assert "decimal commas" in text and "semicolons" in text and "1 row below the header is not numbers and was dropped" in text
    assert "(row 12)" in text and "column 'Bemerkung" in text


def test_a_sheet_with_an_empty_first_page_and_units_in_a_row_of_their_own(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    page = book.create_sheet("data")
    rows = [["Report"], [], ["Time", "Extension", "Load", "Remark"], ["s", "mm", "N", None]]
    for row in [*rows, [0, 0, 0, "start"], [1, 0.5, 3.5, None], [2, 1, 6.1, None], [3, 1.5, None, "slip"]]:
        page.append(row)
    book.save(tmp_path / "report.xlsx")
    options = make_options(kind="elastomer", dimensions=["gauge_length_mm=10", "area_mm2=4"])
    recording = import_file(tmp_path / "report.xlsx", options)
    np.testing.assert_allclose(recording.columns["time_s"], [0, 1, 2, 3])
    np.testing.assert_allclose(recording.columns["strain"], [0, 0.05, 0.1, 0.15])
    np.testing.assert_allclose(recording.columns["stress_kPa"], [0, 875, 1525, np.nan])


def test_headings_name_the_quantities_by_themselves(put):
    rows = "".join(f"{i},{0.5 * i},{100 * i},{3.7 - 0.01 * i},{20 + i}\n" for i in range(5))
    path = put("stand.csv", "Time (ms),Displacement [mm],Load (mN),Resistance (Ohm),Temp (°C)\n" + rows)
    recording = import_file(path, make_options(licence="ours"))
    assert recording.kind == "spring" and recording.outputs == ["force_N", "resistance_ohm"]
    np.testing.assert_allclose(recording.columns["time_s"], np.arange(5) / 1000)
    np.testing.assert_allclose(recording.columns["force_N"], 0.1 * np.arange(5))
    assert any("no [geometry]" in text for text in recording.notices)


def test_true_strain_and_stress_become_engineering_ones(put):
    stretch = np.linspace(1, 2, 11)
    rows = "".join(f"{np.log(s)},{s * (s - s**-2)}\n" for s in stretch)
    path = put("true.csv", "True Strain (-),True Stress (kPa)\n" + rows)
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["strain"], stretch - 1, atol=1e-12)
    np.testing.assert_allclose(recording.columns["stress_kPa"], stretch - stretch**-2, atol=1e-12)


def test_an_actuator_from_columns_named_by_hand(put):
    text = "t,P,R1,R2,kappa\n" + "".join(f"{i},{i},{3.7},{3.6},{2 * i}\n" for i in range(4))
    options = make_options(
        columns=["time=t", "pressure=P", "resistance_1=R1", "resistance_2=R2", "curvature=kappa"],
        units=["time=s", "pressure=psi", "resistance_1=ohm", "resistance_2=Ohm", "curvature=1/m"],
    )  # fmt: skip
    recording = import_file(put("a.csv", text), options)
    assert recording.kind == "actuator" and list(recording.columns)[0] == "time_s"
    np.testing.assert_allclose(recording.si("pressure"), 6894.757293168361 * np.arange(4))
    wrong = make_options(columns=["time=t", "pressure=P", "curvature=kappa"], units=["time=s", "curvature=1/m"])
    assert "--unit pressure=" in refusal(import_file, put("a.csv", text), wrong)


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"columns": ["strain=Engineering Strain"]}, "there is no such column; there are 'Time (s)', 'Strain (%)', 'Foo'"),
        ({"columns": ["strain=9"]}, "there is no such column"),
        ({"columns": ["strain=2", "stress=3"], "kind": "elastomer"}, "unit of 'Foo' is not stated"),
        ({"columns": ["strain=2", "stress=1"], "kind": "elastomer"}, "'Time (s)' is in s, which is not a unit of stress"),
        ({"columns": ["strain=2"], "kind": "elastomer"}, "needs stress_kPa, which was not found"),
        ({"columns": ["strain=2"]}, "its columns fit no kind of recording"),
        ({"columns": ["force=3", "strain=2"], "kind": "elastomer"}, "area_mm2"),
        ({"columns": ["elongation=3", "stress=3"], "kind": "elastomer"}, "gauge_length_mm"),
        ({"columns": ["pressure=3"], "units": ["pressure=kPa"], "kind": "actuator"}, "needs one of curvature_1pm"),
    ],
)  # fmt: skip
def test_what_is_missing_is_said(put, named, words):
    path = put("a.csv", "Time (s),Strain (%),Foo\n0,0,0\n1,1,1\n2,2,2\n")
    message = refusal(import_file, path, make_options(**named))
    assert words in message and "a.csv" in message


def test_numbers_that_cannot_be_are_refused_with_the_files_own_row(put):
    text = "made by hand\n\nTime (s),Strain,Stress (kPa)\n0,0,0\n1,-1.5,1\n2,0.1,2\n"
    assert "a.csv, row 5, column strain" in refusal(import_file, put("a.csv", text))


def test_unreadable_fields_are_missing_and_said(put):
    rows = "".join(f"{i},{0.1 * i},{'OVLD' if i == 3 else i}\n" for i in range(8))
    recording = import_file(put("a.csv", "Time (s),Strain,Stress (kPa)\n" + rows))
    assert np.isnan(recording.columns["stress_kPa"][3]) and np.isfinite(recording.columns["strain"]).all()
    assert any("'OVLD' in row 5" in text for text in recording.notices)


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"kind": "sprung"}, "did you mean 'spring'"),
        ({"role": "test"}, "no such role"),
        ({"columns": ["strain"]}, "must be NAME=VALUE"),
        ({"columns": ["strin=2"]}, "did you mean 'strain'"),
        ({"columns": ["strain=2", "strain=3"]}, "given twice"),
        ({"units": ["stress=furlong"]}, "unknown unit 'furlong'"),
        ({"scales": ["stress=much"]}, "must be a number other than 0"),
        ({"scales": ["stress=0"]}, "must be a number other than 0"),
        ({"dimensions": ["gauge_length=5"]}, "did you mean 'gauge_length_mm'"),
        ({"dimensions": ["gauge_length_mm=-5"]}, "must be more than 0"),
        ({"interval_s": 0.0}, "must be more than 0"),
        ({"interval_s": float("nan")}, "must be more than 0"),
    ],
)
def test_options_are_checked(named, words):
    assert words in refusal(make_options, **named)


GOOD = "Time (s),Strain,Stress (kPa)\n0,0,0\n1,0.1,1\n2,0.2,2\n"


@pytest.mark.parametrize(
    ("neighbour", "text", "key", "value"),
    [
        ("LICENSE", "MIT License\n\nCopyright (c) 2024 Somebody\n", "licence", "MIT"),
        ("License.md", "## ODC Open Database License (ODbL)\n", "licence", "ODbL 1.0"),
        ("DATA_LICENSE.md", "released under the **Creative Commons Attribution\n4.0** license", "licence", "CC BY 4.0"),
        ("LICENCE.txt", "Ask Ada.\n", "licence", "Ask Ada."),
        ("PROVENANCE.md", "# From\n- Licence: CC0 1.0\n- Cite: Ada (1843)\n", "licence", "CC0 1.0"),
        ("PROVENANCE.md", "# From\n- Licence: CC0 1.0\n- Cite: Ada (1843)\n", "citation", "Ada (1843)"),
        ("CITATION.cff", 'cff-version: 1.2.0\ntitle: "Springs: a study"\ndoi: 10.1/x\n', "citation", "Springs: a study, 10.1/x"),
        ("Data Source.txt", "@article{a,\n\tauthor = {Ada},\n\ttitle = {Springs},\n\tdoi = {10.1/x},\n}", "citation", "Ada, Springs, 10.1/x"),
    ],
)  # fmt: skip
def test_provenance_beside_the_file(put, neighbour, text, key, value):
    path = put("data/run/a.csv", GOOD)
    put(f"data/{neighbour}", text)
    found = import_file(path)
    assert found.source[key] == value
    assert any(f"{key} taken from ../{neighbour}" in notice for notice in found.notices)
    assert import_file(path, make_options(**{key: "as stated"})).source[key] == "as stated"


def test_provenance_stops_at_the_root_of_a_project(put):
    path = put("project/data/a.csv", GOOD)
    put("project/pyproject.toml", "")
    put("LICENSE", "MIT License")
    put("project/LICENSE", "MIT License")  # of the program, not of the data in its folders
    assert import_file(path).source["licence"] == "not stated"


def test_names_that_clash_get_their_folders(put, tmp_path):
    paths = [put(f"{folder}/pull 1.csv", GOOD) for folder in ("hot", "cold")] + [put("pull 2.csv", GOOD)]
    recordings = import_files(paths, make_options(licence="ours", specimen="E"))
    assert [r.name for r in recordings] == ["hot_pull_1", "cold_pull_1", "pull_2"]
    for recording in recordings:
        write_recording(recording, tmp_path / "out")
    assert len(read_campaign(tmp_path / "out").specimens()["E"]) == 3
    assert "given twice" in refusal(import_files, [paths[0], paths[0]])


def test_names_that_differ_in_capitals_alone_clash_too(put, tmp_path):
    """Some file systems do not tell them: the second one would replace the first."""
    paths = [put(name, GOOD) for name in ("hot/pull.csv", "cold/PULL.csv", "a b.csv", "a_b.csv", "A_B.csv")]
    recordings = import_files(paths, make_options(licence="ours", specimen="E"))
    assert [r.name for r in recordings] == ["hot_pull", "cold_PULL", "a_b", "a_b_2", "A_B_3"]
    for recording in recordings:
        write_recording(recording, tmp_path / "out")
    written = [path.name.casefold() for path in (tmp_path / "out").iterdir()]
    assert len(set(written)) == 10


def test_of_several_bad_files_the_first_is_named(put):
    paths = [put("a.csv", GOOD), put("b.csv", "prose\n"), put("c.csv", "prose\n")]
    message = refusal(import_files, paths)
    assert "b.csv" in message and message.endswith("(and 1 more file)")


def test_folders_are_searched_for_numbers(put, tmp_path):
    put("bench/a.csv", GOOD)
    put("bench/notes.txt", "prose")
    put("bench/photo.jpg", b"\xff\xd8")
    wanted, aside = raw_files([tmp_path / "bench"])
    assert [p.name for p in wanted] == ["a.csv"] and [p.name for p in aside] == ["notes.txt"]
    put("empty/notes.txt", "prose")
    assert "no raw file" in refusal(raw_files, [tmp_path / "empty"])


def test_of_a_folder_every_good_file_is_taken_and_each_bad_one_has_a_line(put, tmp_path):
    """It had stopped at the first bad file. Files that are named stay all or none."""
    for name, text in {"a.csv": GOOD, "empty.csv": "", "b.csv": "Foo,Bar\n1,2\n2,3\n3,5\n", "c.csv": GOOD}.items():
        put(f"bench/{name}", text)
    arguments = [str(tmp_path / "bench"), "--specimen", "E", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(import_command, arguments)
    assert result.exit_code == 1 and sorted(p.name for p in (tmp_path / "out").glob("*.csv")) == ["a.csv", "c.csv"]
    lines = result.stderr.splitlines()
    assert "/empty.csv: the file is empty" in lines[0] and "/b.csv: no known format" in lines[1]
    assert lines[2:] == ["pneusma: 2 files of the folder not imported"]
    put("bad/b.csv", "Foo,Bar\n1,2\n2,3\n3,5\n")
    assert "b.csv" in refusal(import_files, raw_files([tmp_path / "bad"])[0])
    assert "b.csv" in refusal(import_files, [tmp_path / "bench/a.csv", tmp_path / "bench/b.csv"])


def test_columns_that_nobody_takes_are_named(put):
    text = "Engineering Strain (-),Engineering Stress (MPa),Jaw Colour\n" + "".join(
        f"{0.1 * k:g},{0.02 * k:g},{k}\n" for k in range(8)
    )
    recording = import_file(put("a.csv", text))
    assert any("columns left aside: 'Jaw Colour'" in notice for notice in recording.notices)
    with pytest.raises(InputError, match="no known format; name its columns .*'Jaw Colour'"):
        import_file(put("b.csv", text.replace("Engineering", "Some")))
