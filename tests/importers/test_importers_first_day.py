"""Files as laboratories have them: a right answer or one clear line, and nothing without a word."""

import openpyxl
import pytest
from answers import SPRING, checks, refusal

from fitting.data.importers import import_file, import_tests, make_options
from fitting.data.recordings import read_campaign
from pneusma_jax.errors import InputError, nearest


def written(tmp_path, text, name="raw.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def repeated(column, factor=1.0):
    """The table of a spring with one of its columns once more at the end."""
    head, *rows = SPRING.splitlines()
    cells = [row.split(",") for row in rows]
    more = "".join(f"{','.join(row)},{factor * float(row[column]):g}\n" for row in cells)
    return f"{head},{head.split(',')[column]}\n{more}"


def test_a_force_that_is_there_twice_is_no_second_specimen(tmp_path):
    """Two specimens of the same numbers had been made."""
    (found,) = import_tests(written(tmp_path, repeated(2)))
    assert any("(column 5) is named as column 3 and repeats it: left aside" in note for note in found.notices)
    assert not checks(found)


def test_of_three_forces_two_of_which_are_alike_two_specimens_are_made(tmp_path):
    text = repeated(2, 2.0)
    lines = [f"{line},{line.split(',')[2]}" for line in text.splitlines()]
    found = import_tests(written(tmp_path, "\n".join(lines) + "\n"))
    assert len(found) == 2
    assert any("column 6 repeats column 3: left aside" in note for note in found[0].notices)
    (asked,) = checks(found[0])
    assert asked.startswith("check: 'Force [N]', 'Force [N]' were taken as those of 2 specimens")


@pytest.mark.parametrize("name", ["Radius of curvature (mm)", "Krümmungsradius [mm]"])
def test_a_radius_of_curvature_is_no_length(tmp_path, name):
    """It had been offered as --map length=..., which makes a tube of it."""
    rows = "".join(f"{k},{2 * k},{200 - 10 * k}\n" for k in range(9))
    line = refusal(written(tmp_path, f"Time (s),Pressure (kPa),{name}\n{rows}"))
    assert "is one over the curvature: write that into a column headed 'Curvature (1/m)'" in line
    assert "--map length" not in line


def test_places_of_the_tip_are_no_length(tmp_path):
    rows = "".join(f"{k},{2 * k},{5 * k},{56 - k}\n" for k in range(9))
    line = refusal(written(tmp_path, f"Time (s),Pressure (kPa),Tip X (mm),Tip Y (mm)\n{rows}"))
    assert "'Tip X (mm)', 'Tip Y (mm)'" in line and "--map length" not in line


def test_a_clock_that_most_rows_lack_is_asked_about(tmp_path):
    """Nine of twelve rows had gone with a note alone."""
    rows = "".join(f"{k if k % 4 == 0 else ''},{k / 2},{k / 9:.3f},{3.3 + k / 99:.3f}\n" for k in range(12))
    path = written(tmp_path, "Time [s],Extension [mm],Force [N],Resistance [Ohm]\n" + rows)
    (asked,) = checks(import_file(path))
    assert asked.startswith("check: 9 of 12 rows have readings and no time") and "fill the clock in" in asked


def test_statistics_above_the_headings_are_told(tmp_path):
    found = import_file(written(tmp_path, f"Average,7,0.35,3.3\n{SPRING}"))
    assert "1 row of statistics above the headings left aside: 'Average' (row 1)" in found.notices
    assert len(found) == 8


@pytest.mark.parametrize(("clock", "asks"), [(False, True), (True, False)])
def test_rows_that_stand_from_the_newest_to_the_oldest_are_asked_about(tmp_path, clock, asks):
    """Without a clock the last row had been taken as the first."""
    rows = [f"{2.5 * k:g},{9.0 * k:g}" for k in range(12)]
    lines = [f"{k}," * clock + row for k, row in enumerate(rows[::-1])]
    path = written(tmp_path, "Time (s)," * clock + "Strain (%),Stress (kPa)\n" + "\n".join(lines) + "\n")
    asked = [note for note in checks(import_file(path)) if "the newest row stands first" in note]
    assert bool(asked) is asks


def test_microvolts_over_microamperes_are_a_resistance(tmp_path):
    rows = "".join(f"{k},{2 * k},{0.05 * k:.2f},{3300 + 10 * k},1000\n" for k in range(9))
    found = import_file(written(tmp_path, f"Time (s),Extension (mm),Force (N),Voltage (µV),Current (µA)\n{rows}"))
    assert found.columns["resistance_ohm"][[0, -1]] == pytest.approx([3.3, 3.38])


def test_a_sheet_is_found_by_a_name_whose_spaces_nobody_sees(tmp_path):
    book = openpyxl.Workbook()
    book.active.title = "Run 1 (slow) "
    for line in SPRING.splitlines():
        book.active.append([float(x) if x[0].isdigit() else x for x in line.split(",")])
    book.save(tmp_path / "runs.xlsx")
    assert len(import_file(tmp_path / "runs.xlsx", make_options(sheet="run 1 (slow)"))) == 8
    with pytest.raises(InputError, match="this is a workbook, not a CSV; `pneusma import` makes recordings"):
        read_campaign(tmp_path / "runs.xlsx")


def test_a_name_in_other_capitals_is_offered():
    assert nearest("PneuSMA2", ["pneusma1", "pneusma2", "triad"]) == "did you mean 'pneusma2'?"
