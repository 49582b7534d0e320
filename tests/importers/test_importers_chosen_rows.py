"""`--rows`: rows that the user keeps, by the numbers that messages give them."""

import re
import shlex

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli.import_ import import_command
from fitting.data.importers import import_file, import_files, make_options
from fitting.data.importers.row_ranges import RowRange, option_to_keep
from fitting.data.recordings import read_campaign, read_recording, write_recording
from pneusma_jax.errors import InputError

HEAD = ["# a line before", "Time (s),Strain (-),Stress (kPa)"]
STRAIN = np.linspace(0.0, 2.0, 120)
STRESS = 150.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
BROKEN = np.where(np.arange(120) < 100, STRESS, 0.4)


def lines(stress=STRESS, begin=0.0):
    rows = zip(begin + 0.5 * np.arange(stress.size), STRAIN, stress, strict=True)
    return [",".join(f"{x:.6g}" for x in row) for row in rows]


def text(*parts):
    return "\n".join([*HEAD, *(line for part in parts for line in part)]) + "\n"


def cut(path, *rows, **named):
    return import_file(path, make_options(kind="elastomer", rows=rows, **named))


@pytest.mark.parametrize(
    ("rows", "kept"),
    [
        (["1:50"], range(3, 51)),
        ([":50"], range(3, 51)),
        (["20:"], range(20, 123)),
        (["20 : 50"], range(20, 51)),
        ([":10,20:30, 40, 100:"], [*range(3, 11), *range(20, 31), 40, *range(100, 123)]),
        (["20:30", "25:40"], range(20, 41)),
        (["a.csv=20:30"], range(20, 31)),
        (["A=20:30"], range(20, 31)),
    ],
)
def test_rows_are_kept_by_their_line_in_the_file(put, rows, kept):
    recording = cut(put("a.csv", text(lines())), *rows)
    np.testing.assert_allclose(recording.columns["strain"], STRAIN[[row - 3 for row in kept]], atol=1e-5)


def test_every_row_left_out_is_told_and_stands_in_the_sidecar(put, tmp_path):
    recording = cut(put("a.csv", text(lines()[:30], ["", ""], lines()[30:])), ":10,20:40,50,60:")
    said = "--rows 1:10,20:40,50,60:: 27 rows left out (rows 11 to 19, 41 to 49, 51 to 59)"
    assert said in recording.notices and "93 of 120 rows of 3 columns, separated by commas" in recording.notices
    written = read_recording(write_recording(recording, tmp_path / "out"))
    assert written.source["rows_left_out"] == "rows 11 to 19, 41 to 49, 51 to 59 of a.csv"
    assert said in written.source["notes"]


def test_a_range_across_lines_without_numbers_is_one(put):
    recording = cut(put("a.csv", text(lines()[:30], ["", ""], lines()[30:])), ":20")
    assert recording.source["rows_left_out"] == "rows 21 to 124 of a.csv"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["30:20"], r"--rows 30:20: 30:20 ends before it begins; did you mean 20:30\?"),
        (["0:20"], "--rows 0:20: rows are counted from 1"),
        ([":0"], "--rows :0: rows are counted from 1"),
        (["-5:20"], "--rows -5:20: '-5:20' must be FIRST:LAST"),
        (["1-20"], "'1-20' must be FIRST:LAST"),
        ([":"], "':' must be FIRST:LAST"),
        ([""], "'' must be FIRST:LAST"),
        (["1:20,"], "'' must be FIRST:LAST"),
        (["1:9999999999"], "must be FIRST:LAST"),
        (["=1:20"], "the name of a test is missing"),
        (["1:20", "a=3:9"], "--rows 1:20 names no test, and --rows a=... does; name the test of each"),
        (["500:600"], "a.csv: --rows 500:600: no row of this test is in 500:600; its rows of numbers are 3 to 122"),
        ([":20,500:"], "no row of this test is in 500:; its rows"),
        (["20:200"], "there is no row 200; its rows of numbers are 3 to 122. 20: keeps all to the end"),
        (["1:122"], "a.csv: --rows 1:122 leaves out no row, since its rows of numbers are 3 to 122; leave the option out"),
        (["5:6"], "a.csv: --rows 5:6 keeps 2 rows of 120, and a test has at least 3; its rows"),
        (["b=1:20"], "--rows b=1:20: no test here is called so; there is a$"),
    ],
)
def test_a_range_that_cannot_be_is_one_line_with_exit_code_2(put, rows, said):
    path = put("a.csv", text(lines()))
    with pytest.raises(InputError, match=said) as error:
        import_files([path], make_options(kind="elastomer", rows=rows))
    assert "\n" not in str(error.value)
    with pytest.raises(InputError, match=said):
        cut(path, *rows)


def test_the_option_that_a_break_names_ends_the_question(put, tmp_path):
    path = put("pull 1.csv", text(lines(BROKEN)))
    runner, out = CliRunner(), str(tmp_path / "out")
    first = runner.invoke(import_command, [str(path), "--kind", "elastomer", "--preview"])
    advised = re.search(r"did the specimen break.* If it did: (--rows \S+)", first.output)[1]
    assert advised == "--rows 1:102"
    second = runner.invoke(import_command, [str(path), "--kind", "elastomer", *shlex.split(advised), "--out", out])
    assert second.exit_code == 0 and "did the specimen break" not in second.output, second.output
    (recording,) = read_campaign(tmp_path / "out").recordings
    assert len(recording) == 100 and recording.source["rows_left_out"] == "rows 103 to 122 of pull 1.csv"


def test_a_break_below_rows_left_out_names_both_ends(put):
    (note,) = [n for n in cut(put("a.csv", text(lines(BROKEN))), "6:").notices if "specimen break" in n]
    assert note.endswith("If it did: --rows 6:102")
    assert option_to_keep("b", (RowRange(1, 9), RowRange(20, 30), RowRange(40, None)), 5, 25) == "--rows b=5:9,20:25"
    assert option_to_keep("", (), 40, None) == "--rows 40:"


def test_a_log_that_begins_with_its_newest_row_keeps_the_later_lines(put):
    (note,) = [n for n in cut(put("a.csv", text(lines(BROKEN)[::-1]))).notices if "specimen break" in n]
    assert note.endswith("If it did: --rows 23:")
    recording = cut(put("a.csv", text(lines(BROKEN)[::-1])), "23:")
    assert len(recording) == 100 and recording.source["rows_left_out"] == "rows 3 to 22 of a.csv"


def test_of_several_files_the_break_names_the_test_and_a_bare_range_is_refused(put):
    paths = [put("a.csv", text(lines(0.9 * STRESS))), put("b 2.csv", text(lines(BROKEN)))]
    options = make_options(kind="elastomer")
    (note,) = [n for r in import_files(paths, options) for n in r.notices if "specimen break" in n]
    assert note.endswith("If it did: --rows b_2=1:102")
    first, second = import_files(paths, make_options(kind="elastomer", rows=["b_2=1:102"]))
    assert len(first) == 120 and len(second) == 100 and not [n for n in second.notices if "specimen break" in n]
    assert not [n for n in first.notices if "--rows" in n] and "rows_left_out" not in first.source
    with pytest.raises(InputError, match=r"--rows 1:102: 2 tests are imported \(a, b_2\); say of which, e.g. --rows a=1:102$"):
        import_files(paths, make_options(kind="elastomer", rows=["1:102"]))
    both = import_files(paths, make_options(kind="elastomer", rows=["b_2=1:102", "a=20:"]))
    assert [len(one) for one in both] == [103, 100]


def test_files_that_are_joined_are_cut_by_their_names(put):
    paths = [put("a.csv", text(lines())), put("b.csv", text(lines(BROKEN)))]
    named = {"kind": "elastomer", "successive": True, "slack": "keep"}
    (whole,) = import_files(paths, make_options(**named))
    (note,) = [n for n in whole.notices if "specimen break" in n]
    advised = re.search(r"If it did: --rows (b=1:102)", note)[1]
    (recording,) = import_files(paths, make_options(rows=[advised, "a=:100"], **named))
    assert len(recording) == 98 + 100
    assert recording.source["rows_left_out"] == "rows 101 to 122 of a.csv; rows 103 to 122 of b.csv"
    assert any("b.csv: --rows b=1:102: 20 rows left out (rows 103 to 122)" in n for n in recording.notices)
    with pytest.raises(InputError, match="2 tests are imported"):
        import_files(paths, make_options(rows=[":100"], **named))


def test_files_of_one_name_are_not_told_apart_by_it(put):
    paths = [put("x/a.csv", text(lines())), put("y/a.csv", text(lines(0.9 * STRESS)))]
    with pytest.raises(InputError, match=r"--rows a=1:50: 2 tests are called so \(a, a\); import these files one by one"):
        import_files(paths, make_options(kind="elastomer", rows=["a=:50"]))
    first, second = import_files(paths, make_options(kind="elastomer", rows=[f"{paths[1]}=:50"]))
    assert (len(first), len(second)) == (120, 48)


def test_sheets_of_a_workbook_have_rows_of_their_own(put_sheet):
    table = [["Time (s)", "Strain (-)", "Stress (kPa)"], *zip(*map(np.ndarray.tolist, (0.5 * np.arange(120), STRAIN, BROKEN)), strict=True)]
    whole = [*table[:1], *zip(*map(np.ndarray.tolist, (0.5 * np.arange(120), STRAIN, 0.9 * STRESS)), strict=True)]
    path = put_sheet("book.xlsx", {"Slow": table, "Fast": whole, "Notes": [["nothing"]]})
    made = import_files([path], make_options(kind="elastomer"))
    (note,) = [n for r in made for n in r.notices if "specimen break" in n]
    assert note.endswith("If it did: --rows book_Slow=1:101")
    for name in ("book_Slow", "slow"):
        slow, fast = import_files([path], make_options(kind="elastomer", rows=[f"{name}=1:101"]))
        assert (len(slow), len(fast)) == (100, 120)
    assert len(cut(path, "1:101", sheet="Slow")) == 100
    with pytest.raises(InputError, match=r"--rows 1:101: 2 tests are imported \(book_Slow, book_Fast\); say of which"):
        import_files([path], make_options(kind="elastomer", rows=["1:101"]))
    with pytest.raises(InputError, match=r"--rows book.xlsx=1:101: 2 tests are called so \(book_Slow, book_Fast\); e.g. --rows book_Slow=1:101"):
        import_files([path], make_options(kind="elastomer", rows=["book.xlsx=1:101"]))


def test_specimens_side_by_side_are_cut_one_by_one(put):
    head = ",".join(f"{name} {k}" for k in (1, 2) for name in ("Strain (-)", "Stress (kPa)"))
    rows = [f"{e:.5g},{s:.6g},{e:.5g},{b:.6g}" for e, s, b in zip(STRAIN, STRESS, BROKEN, strict=True)]
    path = put("ab.csv", "\n".join([head.replace("(-) ", "").replace("(kPa) ", ""), *rows]) + "\n")
    options = {"kind": "elastomer", "units": ["strain=1", "stress=kPa"]}
    made = import_files([path], make_options(**options))
    notes = [n for r in made for n in r.notices if "specimen break" in n]
    advised = re.search(r"--rows (\S+)", notes[0])[1]
    first, second = import_files([path], make_options(rows=[advised], **options))
    assert (len(notes), len(first), len(second)) == (1, 120, 100)


def test_a_file_that_is_a_recording_is_cut(put, tmp_path):
    target = write_recording(cut(put("a.csv", text(lines()))), tmp_path / "out")
    recording = cut(target, "5:50")
    assert len(recording) == 46 and "rows_left_out" in recording.source


def test_a_clock_that_goes_back_names_the_rows_of_the_first_piece(put):
    head = "Time (s),Pressure (kPa),Length (mm)\n"
    times = [*range(20), *range(5, 25)]
    path = put("a.csv", head + "".join(f"{t},{k},{56.0 + 0.1 * k:.1f}\n" for k, t in enumerate(times)))
    named = {"kind": "tube", "dimensions": ["length_mm=56"]}
    with pytest.raises(InputError, match="the clock goes back.*") as error:
        import_file(path, make_options(**named))
    advised = re.search(r"keep the first one: --rows (\S+)", str(error.value))[1]
    assert advised == "1:21" and len(import_file(path, make_options(rows=[advised], **named))) == 20


@pytest.mark.parametrize("field", ["1.2.3", "1,234.5,6"])
def test_a_number_that_cannot_be_told_is_no_obstacle_in_a_row_left_out(put, field):
    rows = [line.replace(",", ";") for line in lines()]
    rows[60] = rows[60].rpartition(";")[0] + f";{field}"
    path = put("a.csv", text(rows).replace(HEAD[1], HEAD[1].replace(",", ";")))
    with pytest.raises(InputError, match=f"{field!r} in row 63"):
        cut(path)
    with pytest.raises(InputError, match=f"{field!r} in row 63"):
        cut(path, "20:100")
    assert len(cut(path, ":62,64:")) == 119 and len(cut(path, "64:")) == 59


def test_a_doubtful_group_of_thousands_is_no_obstacle_in_a_row_left_out(put):
    rows = [line.replace(",", ";") for line in lines()]
    rows[60] = rows[60].rpartition(";")[0] + ";2,345"
    path = put("a.csv", text(rows).replace(HEAD[1], HEAD[1].replace(",", ";")))
    with pytest.raises(InputError, match="'2,345' in row 63"):
        cut(path)
    assert len(cut(path, ":62,64:")) == 119
