"""Pulls of one specimen in files of their own, joined in the order given."""

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli.import_ import import_command
from fitting.data.importers import import_files, make_options, open_raw, run
from fitting.data.recordings import read_campaign
from pneusma_jax.errors import InputError

HEAD = "Time (s),Extension (mm),Load (N)\n"


def pull(put, name, most, begin=0.0, preamble="Gauge length (mm),50\nCross-section (mm2),20\n\n", head=HEAD):
    """A pull and its return, in a file of 21 rows with a clock of 0.5 s."""
    x = most * (1.0 - np.abs(np.linspace(-1.0, 1.0, 21)))
    rows = zip(begin + 0.5 * np.arange(21), x, 0.05 * x, strict=True)
    return put(name, preamble + head + "".join(",".join(f"{value:.4f}" for value in row) + "\n" for row in rows))


def joined(paths, **named):
    (recording,) = import_files(paths, make_options(successive=True, **named))
    return recording


def test_pulls_are_joined_in_the_order_given_and_the_clock_goes_on(put):
    paths = [pull(put, name, most) for name, most in (("z.csv", 20.0), ("a.csv", 30.0), ("m.csv", 25.0))]
    recording = joined(paths)
    assert recording.name == "z_to_m" and recording.specimen == "z" and len(recording) == 63
    np.testing.assert_allclose(recording.columns["time_s"], 0.5 * np.arange(63))
    np.testing.assert_allclose([recording.columns["strain"][k : k + 21].max() for k in (0, 21, 42)], [0.4, 0.6, 0.5])
    text = "\n".join(recording.notices)
    assert "check: 3 files were joined in this order" in text and "z.csv (21 rows), a.csv (21 rows), m.csv (21 rows)" in text
    assert "check: a.csv begins at 0 s, and the one before ends at 10 s. Its times were counted on from there, one step of 0.5 s later" in text
    assert recording.source["raw_file"] == "z.csv; a.csv; m.csv" and recording.source["notes"] == recording.notices


def test_a_clock_that_goes_on_from_file_to_file_is_kept(put):
    recording = joined([pull(put, "a.csv", 20.0, 100.0), pull(put, "b.csv", 20.0, 140.0)])
    assert recording.columns["time_s"][21] == 140.0
    assert any("check: b.csv begins at 140 s, 30 s after the end of the one before: kept" in note for note in recording.notices)


def dated(put, name, hour, mark="2024-05-01 {:02d}:00:{:02d}"):
    """A pull of 21 rows of one second each, with the date in every row."""
    x = 20.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 21)))
    rows = "".join(f"{mark.format(hour, k)},{a:.4f},{0.05 * a:.4f}\n" for k, a in enumerate(x))
    return put(name, "Gauge length (mm),50\nCross-section (mm2),20\n\nDate time,Extension (mm),Load (N)\n" + rows)


def test_the_pause_between_files_with_dates_is_theirs(put):
    recording = joined([dated(put, "a.csv", 12), dated(put, "b.csv", 13), dated(put, "c.csv", 15)])
    np.testing.assert_allclose(recording.columns["time_s"][[0, 20, 21, 42]], [0.0, 20.0, 3600.0, 10800.0])
    assert any("check: b.csv begins at 3600 s, 3580 s after the end" in note for note in recording.notices)


def test_files_whose_dates_contradict_the_order_given_are_refused(put):
    with pytest.raises(InputError, match="b.csv: by its dates it begins 3620 s before the end of the file before"):
        joined([dated(put, "a.csv", 13), dated(put, "b.csv", 12)])


def test_a_date_whose_day_and_month_cannot_be_told_states_no_pause(put):
    paths = [dated(put, name, hour, "01/02/2024 {:02d}:00:{:02d}") for name, hour in (("a.csv", 13), ("b.csv", 12))]
    assert joined(paths).columns["time_s"][21] == 21.0


def test_a_clock_that_begins_before_the_end_of_the_file_before_is_said_with_both_times(put):
    recording = joined([pull(put, "a.csv", 20.0), pull(put, "b.csv", 20.0, 8.0)])
    assert any("check: b.csv begins at 8 s, and the one before ends at 10 s" in note for note in recording.notices)


def test_another_cross_section_in_other_sizes_is_refused(put):
    other = pull(put, "b.csv", 20.0, preamble="Gauge length (mm),50\nWidth (mm),6\nThickness (mm),3\n\n")
    with pytest.raises(InputError, match="b.csv: it states a cross-section of 18 mm2, and .*a.csv states one of 20 mm2"):
        joined([pull(put, "a.csv", 20.0), other])
    same = pull(put, "c.csv", 20.0, preamble="Gauge length (mm),50\nWidth (mm),5\nThickness (mm),4\n\n")
    assert len(joined([pull(put, "a.csv", 20.0), same])) == 42


def test_an_option_that_one_file_asks_for_is_said_to_act_on_all(put):
    odd = pull(put, "b.csv", 20.0)
    odd.write_text("".join(
        f"{line.rpartition(',')[0]},{float(line.rpartition(',')[2]) + 0.5:.4f}\n" if line[:1].isdigit() else line
        for line in odd.read_text().splitlines(keepends=True)
    ))
    (said,) = (note for note in joined([pull(put, "a.csv", 20.0), odd]).notices if "--subtract" in note)
    assert said.startswith("check: b.csv: ") and said.endswith("(which acts on every file that is joined)")


@pytest.mark.parametrize(("slack", "said"), [(None, True), ("auto", True), ("keep", False)])
def test_a_flat_start_after_a_pull_may_be_its_permanent_set(put, slack, said):
    x = np.linspace(0.0, 1.0, 61)
    later = np.maximum(x - 0.15, 0.0) / 1.15
    paths = []
    for name, stretch in (("a.csv", 1.0 + x), ("b.csv", 1.0 + later)):
        rows = zip(0.5 * np.arange(61), x, 40.0 * (stretch - stretch**-2), strict=True)
        paths.append(put(name, "Time (s),Strain (-),Stress (kPa)\n" + "".join(",".join(f"{v:.4f}" for v in row) + "\n" for row in rows)))
    notices = joined(paths, slack=slack).notices
    assert any(note.startswith("check: b.csv:") and "permanent set" in note and "--slack keep" in note for note in notices) is said


def test_tests_of_a_wire_under_several_stresses_are_joined(put):
    """Each file states its own stress, which is no size of the wire."""
    paths = []
    for stress in (200, 400):
        rows = "".join(f"{k},{1.0 + 0.1 * k:.2f},{90 - k}\n" for k in range(30))
        paths.append(put(f"{stress}.csv", f"Constant stress: {stress} MPa\nDiameter: 0.3 mm\n\nTime (s),Strain (%),Temperature (C)\n{rows}"))
    np.testing.assert_allclose(joined(paths).columns["stress_MPa"], np.repeat([200.0, 400.0], 30))


def test_a_zero_of_every_file_is_refused_with_what_would_do(put):
    with pytest.raises(InputError, match="--slack fit leaves one zero to every recording.*--slack keep"):
        joined([pull(put, "a.csv", 20.0), pull(put, "b.csv", 20.0)], slack="fit")


def test_a_specimen_that_is_stated_names_the_joined_recording(put):
    assert joined([pull(put, "a.csv", 20.0), pull(put, "b.csv", 20.0)], specimen="S1").specimen == "S1"


def test_notices_of_one_file_name_it_and_those_of_all_stand_once(put):
    odd = pull(put, "b.csv", 20.0)
    odd.write_text(odd.read_text().replace("0.5000,2.0000,0.1000", "0.5000,2.0000,oops"))
    notices = joined([pull(put, "a.csv", 20.0), odd]).notices
    assert any(note.startswith("check: b.csv: 1 field of column 'Load (N)' is no number") for note in notices)
    assert sum("'Extension (mm)' over the gauge length" in note for note in notices) == 1


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"preamble": "Gauge length (mm),40\nCross-section (mm2),20\n\n"}, "b.csv: it states 'Gauge length (mm) 40', and"),
        ({"head": "Time (s),Extension (mm),Load (N),Temperature (C)\n"}, ""),
    ],
)
def test_files_of_other_sizes_are_refused(put, other, words):
    with pytest.raises(InputError) as caught:
        joined([pull(put, "a.csv", 20.0), pull(put, "b.csv", 20.0, **other)] if words else [pull(put, "a.csv", 20.0), put("b.csv", "Strain (-),Stress (kPa)\n" + "".join(f"{0.1 * k:g},{k}\n" for k in range(9)))])
    assert "b.csv" in str(caught.value) and words in str(caught.value) and "\n" not in str(caught.value)
    assert words or "it lacks time_s, and has nothing besides" in str(caught.value)


def test_files_of_another_kind_are_refused(put):
    x = np.linspace(0.0, 20.0, 21)
    spring = put("b.csv", "Time (s),Elongation (mm),Force (N),Resistance (ohm)\n" + "".join(f"{k},{a},{0.1 * a},{4 + 0.01 * a}\n" for k, a in enumerate(x)))
    with pytest.raises(InputError, match="b.csv: this is of kind spring, and .*a.csv is of kind elastomer"):
        joined([pull(put, "a.csv", 20.0), spring])


def test_one_file_or_a_file_of_several_tests_is_refused(put):
    with pytest.raises(InputError, match="two files or more"):
        joined([pull(put, "a.csv", 20.0)])
    one = pull(put, "a.csv", 20.0, preamble="")
    two = put("b.csv", one.read_text() + "\nSpecimen 2\n" + one.read_text())
    with pytest.raises(InputError, match="b.csv: this file holds 2 tests, and --successive joins"):
        joined([one, two], kind="elastomer", dimensions=["gauge_length_mm=50", "area_mm2=20"])


def test_the_command_writes_one_recording_that_can_be_read(put, tmp_path):
    paths = [str(pull(put, name, most)) for name, most in (("pull1.csv", 20.0), ("pull2.csv", 30.0))]
    result = CliRunner().invoke(import_command, [*paths, "--successive", "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    (recording,) = read_campaign(tmp_path / "out").recordings
    assert recording.name == "pull1_to_pull2" and len(recording) == 42


def test_the_command_refuses_a_folder_whose_order_nobody_stated(put, tmp_path):
    folder = pull(put, "raw/a.csv", 20.0).parent
    result = CliRunner().invoke(import_command, [str(folder), "--successive", "--out", str(tmp_path / "out")])
    assert result.exit_code == 2 and "name its files in the order of the tests" in result.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("begin", "asked"), [(20.0, False), (5.0, True)])
def test_a_strain_that_goes_on_from_the_file_before_is_no_other_zero(put, begin, asked):
    """A pull in two halves: the second one begins where the first one ends. Another start is asked about."""
    paths = []
    for name, x in (("a.csv", np.linspace(0.0, 20.0, 21)), ("b.csv", np.linspace(begin, 40.0, 21))):
        rows = zip(0.5 * np.arange(21), x, 0.05 * x, strict=True)
        text = "".join(",".join(f"{value:.4f}" for value in row) + "\n" for row in rows)
        paths.append(put(name, f"Gauge length (mm),50\nCross-section (mm2),20\n\n{HEAD}{text}"))
    said = [note for note in joined(paths).notices if "counted from another zero" in note]
    assert bool(said) == asked and all(note.startswith("check: b.csv: strain begins at 0.1") for note in said)


def test_each_file_is_opened_once(put, monkeypatch):
    opened = []
    monkeypatch.setattr(run, "open_raw", lambda path: opened.append(path) or open_raw(path))
    paths = [pull(put, name, 20.0) for name in ("a.csv", "b.csv")]
    joined(paths)
    assert opened == paths


HEADER = "Gauge length (mm),50\nCross-section (mm2),20\n{}\n\n"


@pytest.mark.parametrize(
    ("one", "two", "pause"),
    [
        ("Datum;03.11.2026 09:10", "Datum;03.11.2026 10:10", 3590.0), ("Test date: 2026-11-03 09:10:00", "Test date: 2026-11-03 09:11:00", 50.0),
        ("Prüfdatum: 03.11.2026\nUhrzeit: 23:59 Uhr", "Prüfdatum: 04.11.2026\nUhrzeit: 00:00 Uhr", 50.0),
        ("Datum;03.11.2026 09:10", "Datum;03.11.2026 09:10", None), ("Datum;03.11.2026 09:10", "Datum;03.11.2026 08:10", None),
        ("Datum;03.11.2026", "Datum;04.11.2026", None), ("Kalibrierdatum;03.11.2026 09:10", "Kalibrierdatum;04.11.2026 09:10", None),
        ("Date: 01/02/2026 09:10", "Date: 01/02/2026 10:10", None), ("Operator: A", "Date: 2026-11-03 10:10", None),
    ],
)  # fmt: skip
def test_the_pause_that_lines_of_both_files_state_is_counted(put, one, two, pause):
    """Tests an hour apart followed each other by one step: a relaxed silicone then contradicted every law."""
    paths = [pull(put, name, 20.0, preamble=HEADER.format(line.replace(";", ","))) for name, line in (("a.csv", one), ("b.csv", two))]
    recording = joined(paths)
    (said,) = [note for note in recording.notices if "counted on from there" in note]
    assert recording.columns["time_s"][21] == pytest.approx(10.0 + (pause or 0.5))
    assert (f"{pause:g} s later, by " in said and "right if both state the begin" in said) if pause else "pause is not known" in said
    assert ("before that end" in said) == (two.endswith(("09:10", "08:10")) and one.startswith("Datum;03"))
