"""Files as laboratories produce them, each with a truth: numbers with prefixes, pauses, merged headings, hours."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, import_tests, make_options
from fitting.data.importers.spelling import parse_heading

TIME = 2.0 * np.arange(40)
STRAIN = np.linspace(0.0, 1.5, 40)
STRESS = 60.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)


def rows(*columns):
    return "".join(",".join(map(str, row)) + "\n" for row in zip(*columns, strict=True))


def scaled(value, unit=""):
    """A number as instruments display it: `1.2k`, `750m`."""
    power, prefix = next((p, n) for p, n in ((1e3, "k"), (1.0, ""), (1e-3, "m"), (0.0, "")) if value >= p)
    return f"{value / (power or 1.0):.5g}{prefix}{unit}"


def right(recording, **columns):
    for name, truth in columns.items():
        np.testing.assert_allclose(recording.columns[name], truth, rtol=1e-3, atol=2e-3 * np.ptp(truth))


@pytest.mark.parametrize("quantity", ["Stress (Pa)", "Stress [Pa]"])
def test_a_prefix_behind_a_number_is_read_and_said(put, quantity):
    path = put("a.csv", f"Time (s),Strain,{quantity}\n" + rows(TIME, map(scaled, STRAIN), map(scaled, 1e3 * STRESS)))
    recording = import_file(path, make_options(units=["strain=1"]))
    right(recording, time_s=TIME, strain=STRAIN, stress_kPa=STRESS)
    assert sum("have a prefix and no unit" in note for note in checks(recording)) == 2


def test_a_prefix_in_the_place_of_the_decimal_mark_is_read(put):
    force, ohm = 0.05 * TIME, 3.32 + 0.002 * TIME
    marked = [f"{r:.4f}".replace(".", "R") for r in ohm]
    path = put("a.csv", "Time (s),Elongation (mm),Force (N),Resistance (ohm)\n" + rows(TIME, TIME / 2, force, marked))
    recording = import_file(path, make_options(kind="spring"))
    right(recording, resistance_ohm=ohm, force_N=force)
    assert any("'3R3200' in row 2 was read as 3.3200" in note for note in checks(recording))


def test_letters_that_may_be_units_are_no_prefixes(put):
    """`3m` of a length are metres, of a time minutes; `3M` names a specimen."""
    path = put("a.csv", "Time (s),Length (mm),Force (N)\n" + rows(TIME, [f"{x:.2f}m" for x in STRAIN], STRESS))
    assert "are no numbers" in refusal(path, kind="elastomer", dimensions=["area_mm2=10"], columns=["length=Length (mm)"])
    path = put("b.csv", "Specimen,Time (s),Strain (-),Stress (kPa)\n" + rows(["3M"] * 40, TIME, STRAIN, STRESS))
    recording = import_file(path)
    right(recording, stress_kPa=STRESS)
    assert not any("prefix" in note for note in recording.notices)


def test_a_clock_before_labelled_numbers_is_a_column(put):
    lines = [f"12:00:{int(t) % 60:02d}.000 -> Strain: {e:.5f} , Stress: {s:.4f} kPa" for t, e, s in zip(TIME[:25], STRAIN, STRESS, strict=False)]
    recording = import_file(put("a.txt", "\n".join(lines) + "\n"), make_options(units=["strain=1"]))
    right(recording, strain=STRAIN[:25], stress_kPa=STRESS[:25])
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), 2.0)


HEAD = "Time (s),Strain (-),Stress (kPa)\n"


@pytest.mark.parametrize(("between", "pause", "tests"), [("\nTest paused\n", 0.0, 1), ("\nTest resumed\n", 600.0, 2), ("\n", 600.0, 2)])
def test_headings_that_come_again_after_a_pause(put, between, pause, tests):
    """A table that goes on where the one above ended begins at no rest: it is one test, or asked about."""
    first = rows(TIME[:20], STRAIN[:20], STRESS[:20])
    path = put("a.csv", HEAD + first + between + HEAD + rows(TIME[20:] + pause, STRAIN[20:], STRESS[20:]))
    recordings = import_tests(path)
    assert len(recordings) == tests
    asked = checks(recordings[-1])
    said = "read as one test" if tests == 1 else "and the clock 602 later: read as a test of its own"
    assert any(said in note for note in asked)


def test_a_clock_that_goes_back_an_hour_asks_for_daylight_saving(put):
    start = datetime(2024, 10, 27, 2, 59, 20)
    stamps = [start + timedelta(seconds=t) - timedelta(hours=int(t >= 40)) for t in TIME]
    recording = import_file(put("a.csv", "Timestamp,Strain (-),Stress (kPa)\n" + rows(stamps, STRAIN, STRESS)))
    assert any("did daylight saving end? Then add an hour to the times from row 22" in note for note in checks(recording))


@pytest.mark.filterwarnings("error")
def test_a_column_without_numbers_goes_on_without_a_warning(put):
    head, first, second = HEAD.replace("\n", ",Temperature (C)\n"), slice(0, 20), slice(20, None)
    empty, known = ([text] * 20 for text in ("", "22.1"))
    tables = [rows(TIME[k] + pause, STRAIN[k], STRESS[k], last) for k, pause, last in ((first, 0.0, empty), (second, 600.0, known))]
    (_, after) = import_tests(put("a.csv", head + tables[0] + "\n" + head + tables[1]))
    assert any("'Strain (-)' and 'Stress (kPa)' go on from the table above" in note for note in checks(after))


def test_a_unit_below_its_name_counts_beside_a_merged_heading(put_sheet):
    body = [[float(x) for x in row] for row in zip(TIME, 100.0 * STRAIN, STRESS, strict=True)]
    path = put_sheet("a.xlsx", [["Time", "Mechanical", ""], ["s", "Strain (%)", "Stress (kPa)"], *body])
    right(import_file(path), time_s=TIME, strain=STRAIN, stress_kPa=STRESS)


@pytest.mark.parametrize("line", ["Temperature (C),25", "Time,12:30:05", "Length (mm),50"])
def test_a_line_with_a_number_above_the_headings_heads_no_column(put, line):
    """The numbers of rows, which have no heading, were refused as a temperature or a time without a unit."""
    table = f"{line}\n,Time (s),Strain (-),Stress (kPa)\n" + rows(map(str, range(40)), TIME, STRAIN, STRESS)
    recording = import_file(put("a.csv", table))
    right(recording, time_s=TIME, strain=STRAIN, stress_kPa=STRESS)
    assert any("column 1, which has no heading" in note for note in recording.notices)


def test_kelvins_are_no_prefix(put):
    table = "Time (s),Strain (-),Stress (kPa),Temperature (C)\n" + rows(TIME, STRAIN, STRESS, [f"{295 + k % 3}K" for k in range(40)])
    recording = import_file(put("a.csv", table))
    right(recording, time_s=TIME, strain=STRAIN, stress_kPa=STRESS)
    assert not any("prefix" in note for note in recording.notices)


def test_a_channel_in_the_heading_of_a_frame_repeats_its_name():
    heading = parse_heading("Position(Linear:Position) (mm)")
    assert (heading.name, heading.unit) == ("position", "mm")
    assert parse_heading("Position(Axis:Load) (mm)").name != "position"


def test_names_of_rows_without_a_heading_are_asked_about(put):
    """The headings are quoted and divided by spaces, as statistics programs write them."""
    named = "".join(f'"{k}" {t} {e:.4f} {s:.4f}\n' for k, (t, e, s) in enumerate(zip(TIME, STRAIN, STRESS, strict=True)))
    assert "write a heading above every column" in refusal(put("a.txt", '"Time (s)" "Strain (-)" "Stress (kPa)"\n' + named))


@pytest.mark.filterwarnings("error")
def test_numbers_up_to_the_largest_do_not_warn_where_a_file_may_be_cut_off(put):
    big = [*(f"{s:.4f}" for s in STRESS[:37]), 1e308, f"{STRESS[38]:.4f}", 12]
    assert len(import_file(put("a.csv", (HEAD + rows(TIME, STRAIN, big)).rstrip("\n")))) >= 39
