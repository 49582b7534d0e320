"""Logs of instruments: pages with repeated headings, newest rows first, parts of a second, moments of their own."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from answers import checks, refusal

from fitting.characterise import characterise
from fitting.data.importers import import_file, import_files, import_tests, make_options
from fitting.data.recordings import write_recording
from pneusma_jax.errors import InputError

N = 90
TIME = 0.5 * np.arange(N)
STRAIN = 0.6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N)))
STRESS = 90.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
HEAD = "Time (s),Strain (-),Stress (kPa)\n"
ROWS = [f"{t:.1f},{e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
NOON = datetime(2024, 5, 31, 12)


def right(recording):
    """True if time from the first row, strain and stress are those of the test."""
    wanted = {"time_s": TIME, "strain": STRAIN, "stress_kPa": STRESS}
    found = {name: recording.columns[name] - (recording.columns[name][0] if name == "time_s" else 0.0) for name in wanted}
    return all(len(found[n]) == N and np.allclose(found[n], wanted[n], atol=2e-4) for n in wanted)


def pages(between, rows=ROWS, head=HEAD):
    return between.join(head + "".join(rows[k : k + 30]) for k in range(0, N, 30))


@pytest.mark.parametrize("between", ["\n", "\nPage 2\n\n", "\nData Acquisition: Timed\n"])
def test_pages_of_one_log_are_one_test_and_that_is_said(put, between):
    recording = import_file(put("a.csv", pages(between)))
    assert right(recording)
    (said,) = [note for note in checks(recording) if "read as one test" in note]
    assert "3 tables with the same headings" in said and "row 3" in said
    assert recording.notices[0] == "90 rows of 3 columns, separated by commas"


def test_pages_with_dates_are_one_test(put):
    rows = [f"{NOON + timedelta(seconds=float(t))},{e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    assert right(import_file(put("a.csv", pages("\n", rows, "Time stamp,Strain (-),Stress (kPa)\n"))))


@pytest.mark.parametrize(
    ("between", "shift"), [("\nSpecimen B\n", 0.0), ("\nWidth (mm),6\n", 0.0), ("\n", 20.0), ("\n", -15.0)]
)
def test_tables_of_other_specimens_or_with_a_pause_stay_apart(put, between, shift):
    rows = [f"{t + shift * (k // 30):.1f},{e:.6f},{s:.4f}\n" for k, (t, e, s) in enumerate(zip(TIME, STRAIN, STRESS, strict=True))]
    assert len(import_tests(put("a.csv", pages(between, rows)))) == 3


@pytest.mark.parametrize("heading", ["Time (s)", "Time stamp", "Date"])
def test_a_log_that_begins_with_the_newest_row_is_turned(put, heading):
    times = [f"{t:.1f}" if heading == "Time (s)" else str(NOON + timedelta(seconds=float(t))) for t in TIME]
    rows = [f"{t},{e:.6f},{s:.4f}\n" for t, e, s in zip(times, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", f"{heading},Strain (-),Stress (kPa)\n" + "".join(rows[::-1])))
    assert right(recording) and recording.columns["time_s"][0] == 0.0
    assert any("goes back in every row, so the rows were read from the last to the first" in note for note in checks(recording))


@pytest.mark.parametrize("heading", ["timestamp", "unix_time", "Epoch time"])
@pytest.mark.parametrize(("parts", "said"), [(1.0, "seconds"), (1e3, "milliseconds"), (1e6, "microseconds")])
def test_seconds_since_1970_are_a_clock(put, heading, parts, said):
    rows = [f"{parts * (1717156800.0 + t):.3f},{e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", f"{heading},Strain (-),Stress (kPa)\n" + "".join(rows)))
    assert right(recording) and any(f"{said} since 1970" in note for note in recording.notices)


@pytest.mark.parametrize(("heading", "scale", "digits"), [("Fractional Seconds", 1.0, 6), ("Milliseconds", 1e3, 0)])
def test_parts_of_a_second_in_a_column_of_their_own_count(put, heading, scale, digits):
    rows = [
        f"{NOON + timedelta(seconds=int(t)):%m/%d/%Y,%H:%M:%S},{scale * (t % 1.0):.{digits}f},{e:.6f},{s:.4f}\n"
        for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)
    ]
    recording = import_file(put("a.csv", f"Date,Time,{heading},Strain (-),Stress (kPa)\n" + "".join(rows)))
    assert right(recording) and any("is the part of a second of 'Time'" in note for note in recording.notices)
    assert not any("aside" in note or "spread" in note for note in recording.notices)


def test_units_and_clock_of_a_labview_file_are_its_own(put):
    above = (
        "LabVIEW Measurement\t\nDecimal_Separator\t,\nDate\t2024/05/31\n***End_of_Header***\t\n\t\nChannels\t2\n"
        "Y_Unit_Label\t%\tMPa\nX_Dimension\tTime\tTime\nDelta_X\t0,5\t0,5\n***End_of_Header***\t\t\nX_Value\tStrain\tStress\tComment\n"
    )
    rows = [f"{t:.6f}\t{100 * e:.6f}\t{s / 1e3:.8f}\t\n".replace(".", ",") for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.lvm", above + "".join(rows)))
    assert right(recording) and any("as the LabVIEW file states" in note for note in recording.notices)


def test_a_clock_without_a_heading_is_named_by_its_number(put):
    rows = [f"{NOON + timedelta(seconds=float(t))},{20 + t:.2f},{e:.6f},200\n" for t, e in zip(TIME, STRAIN / 12.0, strict=True)]
    recording = import_file(put("a.csv", ",Thermocouple Ave. (C),Strain Ave. (-),Stress (MPa)\n" + "".join(rows)))
    assert recording.kind == "wire" and recording.columns["temperature_degC"][1] == 20.5
    assert any("column 1 is a clock" in note for note in checks(recording)) and "time_s from 'column 1'" in recording.notices


def test_a_clock_that_is_not_understood_is_said(put):
    rows = [f"{e:.6f},{s:.4f},{k % 7}\n" for k, (e, s) in enumerate(zip(STRAIN, STRESS, strict=True))]
    recording = import_file(put("a.csv", "Strain (-),Stress (kPa),Clock tick\n" + "".join(rows)))
    assert any("'Clock tick' was left aside, and nothing else is a clock" in note for note in checks(recording))


def test_the_second_of_two_gauges_is_said_with_its_difference(put):
    rows = [f"{t},{100 * e:.4f},{103 * e:.4f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Time (s),Strain 1 (%),Strain 2 (%),Stress (kPa)\n" + "".join(rows)))
    (said,) = checks(recording)
    assert "'Strain 2 (%)' was left aside, and 'Strain 1 (%)' taken, from which it differs by up to 1.7" in said
    other = import_file(recording.path, make_options(columns=["strain=3"]))
    np.testing.assert_allclose(other.columns["strain"], 1.03 * STRAIN, atol=1e-5)


def test_columns_that_were_logged_at_moments_of_their_own_are_said_and_refused_in_one_line(put, tmp_path):
    rows = [f"{2 * t},,{20 + t:.2f}\n{2 * t + 0.4:.1f},{4 - 8 * e:.4f},\n" for t, e in zip(TIME, STRAIN / 12.0, strict=True)]
    options = make_options(constants=["stress_MPa=200"])
    recording = import_file(put("a.csv", "Time (s),Strain (%),Temperature (C)\n" + "".join(rows)), options)
    assert any("no row has both strain and temperature_degC" in note for note in checks(recording))
    write_recording(recording, tmp_path / "out")
    with pytest.raises(InputError, match="no row has both strain and .*temperature.* bring them to one clock"):
        characterise(tmp_path / "out")


@pytest.mark.parametrize(("heading", "unit"), [("Microstrain", 1e6), ("Strain (µε)", 1e6)])
def test_a_heading_that_is_a_unit_of_strain_is_strain(put, heading, unit):
    rows = [f"{t},{20 + t:.2f},{unit * e:.1f},200\n" for t, e in zip(TIME, STRAIN / 12.0, strict=True)]
    recording = import_file(put("a.csv", f"Time (s),Temp (C),{heading},Stress (MPa)\n" + "".join(rows)))
    np.testing.assert_allclose(recording.columns["strain"], STRAIN / 12.0, atol=1e-6)


def test_a_stated_stress_that_no_rubber_bears_is_that_of_a_wire(put):
    rows = [f"{t},{4 - 8 * e:.4f}\n" for t, e in zip(TIME, STRAIN / 12.0, strict=True)]
    path = put("a.csv", "Time (s),Strain (%)\n" + "".join(rows))
    assert import_file(path, make_options(constants=["stress_MPa=200"])).kind == "wire"


def test_a_row_of_units_that_contradicts_the_headings_is_said(put):
    rows = [f"{t},{25 * e:.4f},{0.02 * s:.5f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    sizes = make_options(dimensions=["gauge_length_mm=25", "area_mm2=20"])
    head = "Time (s),Extension (mm),Load ({})\n(s),(mm),({})\n"
    both = import_file(put("a.csv", head.format("N", "mN") + "".join(rows)), sizes)
    (said,) = [note for note in checks(both) if "row of units" in note]
    assert "'Load (N)' states N, and mN stands after it" in said and "--unit QUANTITY=N" in said
    once = import_file(put("b.csv", head.format("N", "N") + "".join(rows)), sizes)
    assert right(once) and not checks(once) and any("'Extension (mm)' over" in note for note in once.notices)


def test_a_number_in_brackets_behind_a_unit_is_no_unit(put):
    rows = [f"{t},{100 * e:.4f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Time (s),Strain (%) (1),Stress (kPa) (1)\n" + "".join(rows)))
    assert right(recording) and not checks(recording)


@pytest.mark.parametrize("spoilt", ["0.0,---,OVLD\n", "0.0,---,OVLD\n0.2,---,OVLD\n"])
def test_an_overload_in_the_first_rows_hides_no_heading(put, spoilt):
    recording = import_file(put("a.csv", HEAD + spoilt + "".join(ROWS[1:])))
    assert recording.columns["strain"].max() == pytest.approx(STRAIN.max(), abs=1e-5) and len(recording) == N - 1
    assert any("below the header" in note and "'---' (row 2)" in note for note in checks(recording))


def test_what_was_wished_is_never_advised_for_what_was_measured(put):
    rows = [f"{t},{25 * e + 1:.4f},{25 * e:.4f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    path = put("a.csv", "Zeit [s];Weg Soll [mm];{} [mm];Spannung [kPa]\n".format("Weg Ist").replace(";", ",") + "".join(rows))
    recording = import_file(path, make_options(dimensions=["gauge_length_mm=25"]))
    assert right(recording)
    other = put("b.csv", path.read_text().replace("Weg Ist", "Kanal 7"))
    with pytest.raises(InputError) as refused:
        import_file(other, make_options(dimensions=["gauge_length_mm=25"]))
    assert "--map elongation='Kanal 7 [mm]'" in str(refused.value) and "elongation='Weg Soll" not in str(refused.value)


@pytest.mark.parametrize(("unit", "zero"), [("bar rel.", 0.0), ("bar relativ", 0.0), ("bar abs", 101.325)])
def test_a_pressure_says_its_zero_in_german_too(put, unit, zero):
    rows = [f"{t};{t / 100:.4f};{t:.2f}\n" for t in TIME]
    recording = import_file(put("a.csv", f"Zeit [s];Druck ({unit});Biegewinkel (°)\n" + "".join(rows)), make_options(kind="actuator"))
    np.testing.assert_allclose(recording.columns["pressure_kPa"], TIME - zero, atol=1e-9)


def test_a_resistance_is_voltage_over_current_where_both_are_measured(put):
    ohms = 3.2 + 0.1 * STRAIN
    rows = [f"{t},{10 * e:.4f},{e:.4f},{0.05 * r:.6f},{50 if k else 0}\n" for k, (t, e, r) in enumerate(zip(TIME, STRAIN, ohms, strict=True))]
    path = put("a.csv", "Time (s),Displacement (mm),Force (N),Voltage (V),Current (mA)\n" + "".join(rows))
    recording = import_file(path, make_options(kind="spring", dimensions=["wire_diameter_mm=0.5", "active_coils=10", "mandrel_diameter_mm=4"]))
    found = recording.columns["resistance_ohm"]
    assert np.isnan(found[0]) and np.allclose(found[1:], ohms[1:], atol=1e-4)
    assert any("resistance is 'Voltage (V)' over 'Current (mA)'" in note for note in checks(recording))


def test_a_current_that_never_flows_makes_no_resistance(put):
    rows = [f"{t},{10 * e:.4f},{e:.4f},{2 + e:.6f},0\n" for t, e in zip(TIME, STRAIN, strict=True)]
    path = put("a.csv", "Time (s),Displacement (mm),Force (N),Voltage (V),Current (A)\n" + "".join(rows))
    assert "needs the circuit: state it with --circuit adjust_V=... --circuit set_ohm=..." in refusal(path)


@pytest.mark.parametrize(("gap", "decimal", "mark"), [(" ", ".", ","), ("", ".", "\t"), (" ", ",", ";")])
def test_units_behind_every_number_are_those_of_their_column(put, gap, decimal, mark):
    rows = [f"{t:.1f}{gap}s|{1000 * e:.4f}{gap}mm|{0.02 * s:.6f}{gap}N\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    path = put("a.csv", ("Time|Displacement|Force (N)\n" + "".join(rows)).replace(".", decimal).replace("|", mark))
    recording = import_file(path, make_options(dimensions=["gauge_length_mm=1000", "area_mm2=20"]))
    assert right(recording) and any("numbers with their unit: 'Time' in s, 'Displacement' in mm, 'Force (N)' in N" in n for n in recording.notices)


@pytest.mark.parametrize(("head", "unit"), [("Force", "N mm"), ("Force (kN)", "N mm"), ("Force", "Zug Zug")])
def test_units_that_change_or_contradict_behind_the_numbers_are_refused(put, head, unit):
    first, second = unit.split()
    rows = [f"{t},{25 * e:.4f},{0.02 * s:.5f} {first if k % 2 else second}\n" for k, (t, e, s) in enumerate(zip(TIME, STRAIN, STRESS, strict=True))]
    with pytest.raises(InputError, match="no numbers"):
        import_file(put("a.csv", f"Time (s),Extension (mm),{head}\n" + "".join(rows)), make_options(dimensions=["gauge_length_mm=25", "area_mm2=20"]))


def dated(moment, form):
    return [(moment + timedelta(seconds=float(t))).strftime(form) for t in TIME]


@pytest.mark.parametrize("clock", [dated(NOON.replace(microsecond=0), "%Y-%m-%d %H:%M:%S"), [f"{t:.0f}" for t in range(N)]])
@pytest.mark.parametrize("heading", ["Martensite fraction", "Fraction", "Volume fraction (-)"])
def test_another_fraction_is_no_part_of_a_second(put, clock, heading):
    rows = [f"{c},{e:.6f},{s:.4f},{k / N:.4f}\n" for k, (c, e, s) in enumerate(zip(clock, STRAIN, STRESS, strict=True))]
    recording = import_file(put("a.csv", f"Time{' (s)' if '-' not in clock[0] else ''},Strain (-),Stress (kPa),{heading}\n" + "".join(rows)))
    assert not any("part of a second" in note for note in recording.notices)
    assert any("columns left aside" in note and heading in note for note in recording.notices)


@pytest.mark.parametrize("heading", ["Fraction of a second", "Fraction (s)", "time_ms", "msec", "Sekundenbruchteil"])
def test_other_names_of_parts_of_a_second_count(put, heading):
    scale = 1e3 if "ms" in heading else 1.0
    rows = [
        f"{NOON + timedelta(seconds=int(t)):%H:%M:%S},{scale * (t % 1.0):.1f},{e:.6f},{s:.4f}\n"
        for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)
    ]
    for order in (1, -1):
        recording = import_file(put("a.csv", f"Time,{heading},Strain (-),Stress (kPa)\n" + "".join(rows[::order])))
        assert right(recording) and any("is the part of a second of 'Time'" in note for note in recording.notices)


MIDNIGHT = datetime(2024, 5, 31, 23, 59, 50)


@pytest.mark.parametrize("moment", [NOON, MIDNIGHT, datetime(2024, 5, 31), datetime(2024, 6, 13, 23, 59, 59)])
@pytest.mark.parametrize("form", ["%Y-%m-%d,%H:%M:%S.%f", "%d.%m.%Y,%I:%M:%S.%f %p"])
@pytest.mark.parametrize("order", [1, -1])
def test_a_date_and_a_time_of_day_are_a_clock_over_midnight_in_either_order(put, moment, form, order):
    rows = [f"{c},{e:.6f},{s:.4f}\n" for c, e, s in zip(dated(moment, form), STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Date,Time,Strain (-),Stress (kPa)\n" + "".join(rows[::order])))
    assert right(recording)


@pytest.mark.parametrize("order", [1, -1])
def test_a_time_of_day_alone_goes_on_over_midnight_in_either_order(put, order):
    rows = [f"{c},{e:.6f},{s:.4f}\n" for c, e, s in zip(dated(MIDNIGHT, "%H:%M:%S.%f"), STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Time,Strain (-),Stress (kPa)\n" + "".join(rows[::order])))
    assert right(recording) and recording.columns["time_s"][0] == 86390.0


@pytest.mark.parametrize("first_only", [False, True])
def test_a_date_that_stays_that_of_the_start_is_counted_on_over_midnight(put, first_only):
    dates = ["2024-05-31" if not k or not first_only else "" for k in range(N)]
    rows = [f"{d},{c},{e:.6f},{s:.4f}\n" for d, c, e, s in zip(dates, dated(MIDNIGHT, "%H:%M:%S.%f"), STRAIN, STRESS, strict=True)]
    first = put("a.csv", "Date,Time,Strain (-),Stress (kPa)\n" + "".join(rows))
    recording = import_file(first)
    assert right(recording) and any("stays the same past midnight" in note for note in checks(recording))
    second = put("b.csv", "Date,Time,Strain (-),Stress (kPa)\n" + "".join(f"2024-06-01,0{k % 10}:10:00,0,0\n" for k in range(1, 9)))
    both = import_files([first, second], make_options(successive=True))[0]
    assert both.columns["time_s"][N] - both.columns["time_s"][0] == 10.0 + 4200.0


def test_an_elapsed_time_beside_the_date_of_every_row_is_no_time_of_day(put):
    rows = [f"2024-0{5 if t < 10 else 6}-{31 if t < 10 else 1:02d},00:00:{t:06.3f},{e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Date,Time,Strain (-),Stress (kPa)\n" + "".join(rows)))
    assert right(recording) and recording.columns["time_s"][0] == 0.0


@pytest.mark.parametrize("rows_back", [False, True])
def test_pages_of_which_the_newest_is_the_first_are_one_test(put, rows_back):
    parts = ["".join(ROWS[k : k + 30][:: -1 if rows_back else 1]) for k in (60, 30, 0)]
    recording = import_file(put("a.csv", "Width (mm),6\n" + "\n".join(HEAD + part for part in parts)))
    assert right(recording) and recording.notices[0] == "90 rows of 3 columns, separated by commas"
    assert any("3 tables with the same headings" in note for note in checks(recording))


def lvm(units, dimensions, heads, columns="One", samples="90\t90"):
    return (
        f"LabVIEW Measurement\t\nX_Columns\t{columns}\n***End_of_Header***\t\nChannels\t2\nSamples\t{samples}\n"
        f"Y_Unit_Label\t{units}\nX_Dimension\t{dimensions}\n***End_of_Header***\t\t\n{heads}\tComment\n"
    )


@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_the_clocks_of_a_labview_file_with_one_for_each_channel_are_compared(put, shift):
    head = lvm("%\t\tkPa", "Time\t\tTime", "X_Value\tStrain\tX_Value\tStress", "Multi")
    rows = [f"{t}\t{100 * e:.6f}\t{t + shift}\t{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.lvm", head + "".join(rows)))
    assert right(recording)
    said = [note for note in recording.notices if "'X_Value' (column 3) is named as column 1" in note]
    assert len(said) == 1 and ("differs from it by up to 0.2" if shift else "repeats it") in said[0]


@pytest.mark.parametrize(("dimensions", "clock"), [("Time\tTime", True), ("Time\tFrequency", False), ("Frequency\tFrequency", False)])
def test_the_first_column_of_a_labview_file_is_a_clock_where_its_dimension_is_time(put, dimensions, clock):
    rows = [f"{t}\t{100 * e:.6f}\t{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.lvm", lvm("%\tkPa", dimensions, "X_Value\tStrain\tStress") + "".join(rows)))
    assert ("time_s" in recording.columns) == clock
    assert any("'X_Value' is of several dimensions (frequency, time)" in note for note in checks(recording)) == (dimensions == "Time\tFrequency")


def test_a_unit_of_a_labview_file_that_contradicts_a_heading_is_said(put):
    rows = [f"{t}\t{100 * e:.6f}\t{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.lvm", lvm("%\tN", "Time\tTime", "X_Value\tStrain\tStress (kPa)") + "".join(rows)))
    assert right(recording) and any("states kPa, and the row Y_Unit_Label N: kPa was taken" in note for note in checks(recording))
    (said,) = [note for note in recording.notices if "as the LabVIEW file states" in note]
    assert "kPa" not in said and "'Strain' in percent" in said


def test_segments_of_a_labview_file_are_not_named_by_their_number_of_samples(put):
    rows = [f"{t}\t{100 * e:.6f}\t{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    segment = lvm("%\tkPa", "Time\tTime", "X_Value\tStrain\tStress") + "".join(rows)
    recordings = import_tests(put("a.lvm", "\n".join([segment, segment])))
    assert [one.source["raw_part"] for one in recordings] == ["test 1", "test 2"]


@pytest.mark.parametrize("line", ["Specimen name: B-7", "Probenname: B-7", "Probekörper B-7", "Test no. 7"])
def test_tables_are_named_by_the_lines_above_them(put, line):
    recordings = import_tests(put("a.csv", f"{line}\n" + HEAD + "".join(ROWS) + f"\n{line}x\n" + HEAD + "".join(ROWS)))
    assert [one.source["raw_part"] for one in recordings] == [line, f"{line}x"]


def test_columns_of_one_name_in_units_that_cannot_be_compared_are_said(put):
    clock = dated(NOON, "%H:%M:%S.%f")
    rows = [f"{c},{e:.6f},{t},{s:.4f}\n" for c, t, e, s in zip(clock, TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", "Time,Strain (-),Time,Stress (kPa)\n" + "".join(rows)))
    assert right(recording)
    (said,) = checks(recording)
    assert "column 1 is in s and column 3 states no unit: column 1 was taken; --map time=3 takes the other" in said


@pytest.mark.parametrize(("parts", "option"), [(1e3, "--map time=ts --unit time=ms"), (1.0, "--map time=ts --unit time=s")])
def test_numbers_that_may_count_since_1970_are_pointed_to(put, parts, option):
    rows = [f"{parts * (1717156800.0 + t):.3f},{e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    path = put("a.csv", "ts,Strain (-),Stress (kPa)\n" + "".join(rows))
    (said,) = checks(import_file(path))
    assert said.endswith(option) and "may count" in said and "since 1970" in said
    assert right(import_file(path, make_options(columns=["time=ts"], units=[option.split()[-1]])))


@pytest.mark.parametrize("own", ["Strain (%)", "Strain %", "Strain, %"])
@pytest.mark.parametrize("below", ["(s),(-),(kPa)", "s,1,kPa"])
def test_a_row_of_units_that_contradicts_the_headings_is_taken(put, own, below):
    rows = [f"{t};{e:.6f};{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recording = import_file(put("a.csv", f"Time (s);{own};Stress (MPa)\n{below.replace(',', ';')}\n" + "".join(rows)))
    assert right(recording)
    said = [note for note in checks(recording) if "row of units" in note]
    assert len(said) == 2 and "states percent" in said[0] and "1 was taken" in said[0] and "kPa was taken" in said[1]


def test_a_letter_behind_a_name_is_no_unit_that_contradicts(put):
    head = "Time (s),Strain (A) (%),Stress (A) (kPa),Strain (B) (%),Stress (B) (kPa)\n"
    rows = [f"{t},{100 * e:.6f},{s:.4f},{100 * e:.6f},{s:.4f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    recordings = import_tests(put("a.csv", head + "".join(rows)))
    assert [one.source["raw_part"] for one in recordings] == ["a", "b"]
    assert not any("row of units" in note for one in recordings for note in one.notices)
