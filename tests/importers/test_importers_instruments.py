"""Files as instruments and people write them: serial monitors, data loggers, drawn tables, other languages."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, import_tests, make_options
from fitting.data.importers.numerals import to_number

N = 40
TIME = 0.5 * np.arange(N)
STRAIN = 0.6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N)))
STRESS = 90.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
SIZES = {"dimensions": ["gauge_length_mm=25", "area_mm2=20"]}
NOON = datetime(2024, 5, 31, 12)
ALL = list(zip(TIME, STRAIN, STRESS, strict=True))


def right(recording, first=0.0):
    columns = recording.columns
    wanted = {"time_s": TIME + first, "strain": STRAIN, "stress_kPa": STRESS}
    return all(len(columns[n]) == N and np.allclose(columns[n], wanted[n], atol=2e-4) for n in wanted)


def clock(t, form="%H:%M:%S.%f"):
    return (NOON + timedelta(seconds=float(t))).strftime(form)


@pytest.mark.parametrize("mark", [",", "\t", ";", " "])
@pytest.mark.parametrize("own", [True, False])
def test_a_serial_monitors_clock_stands_before_an_arrow(put, mark, own):
    """The file's own clock comes first; without one, that of the monitor is taken."""
    head = mark.join([*["t_ms"] * own, "strain", "stress_kPa"])
    lines = [f"{clock(t)[:-3]} -> " + mark.join([*[f"{1000 * t:.0f}"] * own, f"{e:.6f}", f"{s:.4f}"]) for t, e, s in ALL]
    recording = import_file(put("a.txt", "\n".join([f"11:59:58.000 -> {head}", *lines]) + "\n"))
    assert right(recording, 0.0 if own else 43200.0)
    assert any("'Logged_at' is a clock, too" in note for note in recording.notices) == own
    assert any("no heading names a time" in note for note in checks(recording)) != own


@pytest.mark.parametrize(
    "form",
    ["Time: {0:.0f} ms, Force: {1:.6f} N, Extension: {2:.5f} mm", "Time={0:.0f}ms\tForce={1:.6f}N\tExtension={2:.5f}mm",
     "Time (ms): {0:.0f} Force (N): {1:.6f} Extension (mm): {2:.5f}"],
)  # fmt: skip
@pytest.mark.parametrize("above", ["", "HX711 ready\nScale: 1.02\n"])
def test_a_label_before_every_number_is_its_heading(put, form, above):
    lines = "".join(form.format(1000 * t, 0.02 * s, 25 * e) + "\n" for t, e, s in ALL)
    recording = import_file(put("a.txt", above + lines), make_options(**SIZES))
    assert right(recording) and any("a label stands before every number: 'Time (ms)'" in note for note in recording.notices)


def test_labelled_lines_in_another_unit_are_to_be_looked_at(put):
    """An instrument that changes its range goes on in newtons."""
    forces = [f"{20 * s:.4f} mN" if s < 0.7 * STRESS.max() else f"{0.02 * s:.6f} N" for s in STRESS]
    lines = "".join(f"Time: {t} s, Extension: {25 * e:.5f} mm, Force: {f}\n" for t, e, f in zip(TIME, STRAIN, forces, strict=True))
    assert any("with other units left aside (line " in note for note in checks(import_file(put("a.txt", lines), make_options(**SIZES))))


def test_labels_of_a_preamble_are_no_table(put):
    above = "Width: 5 mm\nThickness: 4 mm\nGauge length: 25 mm\nPreload: 0 N\nRate: 10 Hz\n"
    rows = "".join(f"{t},{25 * e:.6f},{0.02 * s:.6f}\n" for t, e, s in ALL)
    assert right(import_file(put("a.csv", above + "Time (s),Extension (mm),Load (N)\n" + rows)))


def test_a_sign_may_stand_apart_from_its_digits():
    assert to_number("+ 25.3", ".") == 25.3 and to_number("-   4,5", ",") == -4.5
    assert to_number("+ -3", ".") is None and np.isnan(to_number("-", "."))


def test_a_loggers_row_of_units_may_hold_other_words(put):
    rows = "".join(
        f"{k + 1},{clock(int(t), '%Y/%m/%d %H:%M:%S')},{1000 * (t % 1):.0f},+ {100 * e:.4f},+ {s:.4f}\n" for k, (t, e, s) in enumerate(ALL)
    )
    head = "Model,GL000\nSampling,500ms\nNumber,Date&Time,ms,Strain,Stress\nNO.,Time,ms,%,kPa\n"
    recording = import_file(put("a.csv", head + rows))
    assert right(recording) and any("'ms' is the part of a second of 'Date&Time'" in note for note in recording.notices)


@pytest.mark.parametrize("rule", ["|---|---|---|", "|:--|--:|--:|", "+======+======+======+"])
def test_a_line_that_is_drawn_below_the_headings_is_no_heading(put, rule):
    rows = "".join(f"| {t} | {100 * e:.5f} | {s:.4f} |\n" for t, e, s in ALL)
    assert right(import_file(put("a.txt", f"| Time (s) | Strain (%) | Stress (kPa) |\n{rule}\n{rows}")))


@pytest.mark.parametrize(
    "head", ["   Time s    Strain %   Stress kPa\n", "  Elapsed Time   Tensile Strain   Tensile Stress\n      s      %      kPa\n"]
)
def test_headings_of_several_words_stand_apart_by_wide_gaps(put, head):
    rows = "".join(f"{t:10.3f}{100 * e:12.5f}{s:12.4f}\n" for t, e, s in ALL)
    assert right(import_file(put("a.txt", head + rows)))


@pytest.mark.parametrize(("heading", "scale"), [("millis", 1e3), ("Seconds", 1.0), ("micros", 1e6), ("ms", 1e3)])
def test_a_column_that_a_unit_of_time_names_is_the_clock(put, heading, scale):
    rows = "".join(f"{scale * t:.0f},{e:.6f},{s:.4f}\n" for t, e, s in ((2 * a, b, c) for a, b, c in ALL))
    recording = import_file(put("a.csv", f"{heading},Strain (-),Stress (kPa)\n{rows}"))
    np.testing.assert_allclose(recording.columns["time_s"], 2.0 * TIME)


@pytest.mark.parametrize("heading", ["Min", "Std"])
def test_a_statistic_of_a_column_is_no_clock(put, heading):
    rows = "".join(f"{k},{e:.6f},{s:.4f}\n" for k, (_, e, s) in enumerate(ALL))
    assert "time_s" not in import_file(put("a.csv", f"{heading},Strain (-),Stress (kPa)\n{rows}")).columns


def test_a_counter_that_begins_anew_at_another_number_is_to_be_looked_at(put):
    rows = "".join(f"{(59500 + 100 * k) % 60000},{e:.6f},{s:.4f}\n" for k, (_, e, s) in enumerate(ALL))
    assert any("--map time=millis --unit time=ms" in note for note in checks(import_file(put("a.csv", f"millis,Strain (-),Stress (kPa)\n{rows}"))))


def test_numbers_without_a_clock_that_have_canonical_names_are_a_recording_and_others_are_imported(put):
    rows = "".join(f"{t},{e:.6f},{s:.4f}\n" for t, e, s in ALL)
    assert right(import_file(put("a.csv", f"Time (s),strain,stress_kPa\n{rows}")))
    assert "already is in the recording format" in refusal(put("b.csv", f"time_s,strain,stress_kPa\n{rows}"))


@pytest.mark.parametrize(
    ("head", "code"),
    [
        ("时间(s);变形(mm);试验力(N)", "gb18030"), ("時間(s);ストローク(mm);試験力(N)", "shift_jis"), ("시간(s);변위(mm);하중(N)", "cp949"),
        ("Tempo (s);Spostamento (mm);Forza (N)", "utf-8"), ("Tiempo (s);Desplazamiento (mm);Fuerza (N)", "cp1252"),
        ("Tempo (s);Deslocamento (mm);Força (N)", "cp1252"), ("Czas [s];Przemieszczenie [mm];Siła [N]", "cp1250"),
        ("Время, с;Удлинение, мм;Сила, Н", "cp1251"), ("Tid (s);Förlängning (mm);Kraft (N)", "cp1252"),
    ],
)  # fmt: skip
def test_headings_in_other_languages_are_read(put, head, code):
    rows = "".join(f"{t};{25 * e:.6f};{0.02 * s:.6f}\n".replace(".", ",") for t, e, s in ALL)
    assert right(import_file(put("a.csv", f"{head}\n{rows}".encode(code)), make_options(**SIZES)))


@pytest.mark.parametrize(("heading", "kind"), [("Tensione (kPa)", "stress"), ("Tensione (V)", "voltage"), ("Spanning [V]", "voltage")])
def test_a_word_for_stress_and_voltage_is_told_by_its_unit(heading, kind):
    from fitting.data.importers.words import meaning_of

    assert meaning_of(heading).quantity == kind


def test_quantities_in_rows_are_refused_with_what_helps(put):
    text = "".join(f"{name},{','.join(f'{x:.4f}' for x in values)}\n" for name, values in (("Time (s)", TIME), ("Strain (-)", STRAIN)))
    assert "'Time (s)', 'Strain (-)' stand in rows; write each in a column" in refusal(put("a.csv", text))


@pytest.mark.parametrize("heading", ["T_wire (°C)", "T specimen [K]", "Temp chamber [°C]", "Oven temp (C)"])
def test_a_temperature_is_known_by_its_symbol_and_its_place(put, heading):
    cold = 300 if "[K]" in heading else 27
    rows = "".join(f"{t};{e / 12:.6f};200;{cold + 60 * e:.3f}\n" for t, e, _ in ALL)
    recording = import_file(put("a.csv", f"Time (s);Strain (-);Stress (MPa);{heading}\n{rows}"))
    assert "temperature_degC" in recording.columns


@pytest.mark.parametrize("heading", ["T_ambient (°C)", "T room (°C)", "I_motor (A)"])
def test_a_symbol_of_another_part_of_a_rig_is_not_taken(put, heading):
    rows = "".join(f"{t};{e / 12:.6f};200;{22 + e:.3f}\n" for t, e, _ in ALL)
    recording = import_file(put("a.csv", f"Time (s);Strain (-);Stress (MPa);{heading}\n{rows}"))
    assert "temperature_degC" not in recording.columns and any("left aside" in note and heading in note for note in recording.notices)


@pytest.mark.parametrize(
    "head",
    ["Time,Strain,Stress\ns,%,kPa\nclock,video,load cell / area\n", "Time,Strain,Stress\n,,\ns,%,kPa\n,DIC,coupon 3\n",
     "Time,Strain,Stress\nremark,first,second\n(s),(%),(kPa)\n"],
)  # fmt: skip
def test_remarks_about_the_columns_may_stand_below_the_headings(put, head):
    rows = "".join(f"{t},{100 * e:.5f},{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.csv", head + rows))
    assert right(recording) and any("between the headings and the numbers were left aside" in note for note in recording.notices)


@pytest.mark.parametrize("below", ["s,%,x10\n", ",,factor 10\n", "s,%,kPa\n,,x10\n", "(s),(%),(x10)\n"])
def test_a_factor_below_the_headings_is_to_be_looked_at(put, below):
    rows = "".join(f"{t},{100 * e:.5f},{s:.4f}\n" for t, e, s in ALL)
    (said,) = checks(import_file(put("a.csv", f"Time (s),Strain (%),Stress (kPa)\n{below}{rows}")))
    assert "left aside: '" in said and "10" in said and "a factor in them is not applied" in said


def test_a_row_above_numbers_of_another_table_is_no_heading(put):
    rows = "".join(f"{t},{25 * e:.6f},{0.02 * s:.6f}\n" for t, e, s in ALL)
    text = f"Time (s),Extension (mm),Force (N)\n0,0,0\n\nKanal 1,Kanal 2,Kanal 3\n{rows}"
    assert "'Kanal 1', 'Kanal 2', 'Kanal 3'" in refusal(put("a.csv", text), **SIZES)


@pytest.mark.parametrize(("first", "second"), [("Crosshead (mm)", "Extensometer (mm)"), ("Crosshead (mm)", "LVDT (um)")])
def test_two_ways_to_one_quantity_that_differ_are_said(put, first, second):
    scale = 1e3 if "um" in second else 1.0
    rows = "".join(f"{t},{27 * e:.6f},{scale * 25 * e:.6f},{0.02 * s:.6f}\n" for t, e, s in ALL)
    path = put("a.csv", f"Time (s),{first},{second},Load (N)\n{rows}")
    (said,) = [note for note in checks(import_file(path, make_options(**SIZES))) if "left aside" in note]
    assert f"'{second}' was left aside, and '{first}' taken, from which it differs by up to 1.1" in said
    assert right(import_file(path, make_options(columns=["elongation=3"], **SIZES)))


@pytest.mark.parametrize("second", ["Step time (s)", "Oven temperature (C)"])
def test_clocks_and_temperatures_of_other_things_are_no_second_way(put, second):
    rows = "".join(f"{t},{t % 5:.1f},{e / 12:.6f},200,{25 + t}\n" for t, e, _ in ALL)
    recording = import_file(put("a.csv", f"Time (s),{second},Strain (-),Stress (MPa),Wire temperature (C)\n{rows}"))
    assert not any("was left aside, and" in note for note in recording.notices)
    assert any("columns left aside" in note and second in note for note in recording.notices)


@pytest.mark.parametrize("heading", ["Extension ratio", "Stretch ratio", "Elongation ratio"])
def test_an_extension_ratio_is_a_stretch(put, heading):
    rows = "".join(f"{t},{1 + e:.6f},{s:.4f}\n" for t, e, s in ALL)
    assert right(import_file(put("a.csv", f"Time (s),{heading},Nominal stress (kPa)\n{rows}")))


def test_a_labview_file_without_a_clock_has_units_and_a_step(put):
    head = (
        "LabVIEW Measurement\t\nX_Columns\tNo\n***End_of_Header***\t\nChannels\t2\t\nY_Unit_Label\t%\tkPa\nX_Dimension\tTime\tTime\n"
        "Delta_X\t0.5\t0.5\n***End_of_Header***\t\t\nStrain\tStress\tComment\n"
    )
    path = put("a.lvm", head + "".join(f"{100 * e:.5f}\t{s:.4f}\n" for _, e, s in ALL))
    assert any(note.endswith("states a step (Delta_X): --interval 0.5") for note in checks(import_file(path)))
    assert right(import_file(path, make_options(interval_s=0.5)))


def test_an_empty_first_column_of_a_labview_file_is_no_clock(put):
    """With `X_Columns No` the heading of the clock may stay; nothing was said of the step then."""
    head = (
        "LabVIEW Measurement\t\nX_Columns\tNo\n***End_of_Header***\t\nChannels\t2\t\t\nY_Unit_Label\t%\tkPa\nX_Dimension\tTime\tTime\n"
        "Delta_X\t0.5\t0.5\n***End_of_Header***\t\t\t\nX_Value\tStrain\tStress\tComment\n"
    )
    path = put("a.lvm", head + "".join(f"\t{100 * e:.5f}\t{s:.4f}\t\n" for _, e, s in ALL))
    assert any(note.endswith("states a step (Delta_X): --interval 0.5") for note in checks(import_file(path)))
    assert right(import_file(path, make_options(interval_s=0.5)))


@pytest.mark.parametrize(("volts", "amperes"), [("U (V)", "I (A)"), ("Spring voltage (V)", "Spring current (A)")])
def test_symbols_of_voltage_and_current_make_a_resistance(put, volts, amperes):
    rows = "".join(f"{t},{40 * e:.5f},{0.5 * e:.5f},{0.05 * (2 + e):.7f},0.05\n" for t, e, _ in ALL)
    recording = import_file(put("a.csv", f"Time (s),Displacement (mm),Force (N),{volts},{amperes}\n{rows}"))
    np.testing.assert_allclose(recording.columns["resistance_ohm"], 2.0 + STRAIN, rtol=1e-4)


def test_a_list_of_channels_above_headings_is_not_taken_for_them(put):
    rows = "".join(f"{t},{25 * e:.6f},{0.02 * s:.6f}\n" for t, e, s in ALL)
    path = put("a.csv", f"Time,Displacement,Force\nTime (s),Gap (mm),Load (N)\n{rows}")
    assert right(import_file(path, make_options(columns=["elongation=Gap (mm)"], **SIZES)))


@pytest.mark.parametrize("head", ["Time Strain(%) Stress(kPa)", "Strain(%),Stress(kPa)", "[11:59:59.000] Strain(%);Stress(kPa)"])
def test_a_clock_in_brackets_before_every_line_is_a_column(put, head):
    mark = next(mark for mark in ";, " if mark in head.replace("59.000] ", ""))
    rows = "".join(f"[{clock(t)[:-3]}] {100 * e:.5f}{mark}{s:.4f}\n" for t, e, s in ALL)
    assert right(import_file(put("a.txt", f"{head}\n{rows}")), 43200.0)


@pytest.mark.parametrize(("heading", "scale"), [("millis", 1e3), ("micros", 1e6), ("time_us", 1e6)])
def test_a_counter_of_32_bits_is_counted_on(put, heading, scale):
    first = 2**32 - round(scale * 8.0)
    rows = "".join(f"{(first + round(scale * t)) % 2**32},{e:.6f},{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.csv", f"{heading},Strain (-),Stress (kPa)\n{rows}"))
    np.testing.assert_allclose(recording.columns["time_s"] - first / scale, TIME, atol=1e-5)
    assert any("begins anew in row 18, where a counter of 32 bits does" in note for note in checks(recording))


def test_a_clock_that_begins_anew_elsewhere_is_not_counted_on(put):
    rows = "".join(f"{3e9 + 1000 * t if t < 8 else 1000 * t:.0f},{e:.6f},{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.csv", f"time_ms,Strain (-),Stress (kPa)\n{rows}"))
    assert "time_s" not in recording.columns and any("the clock goes back" in note for note in checks(recording))


@pytest.mark.parametrize(("heads", "asked"), [(("Load cell 1 (N)", "Load cell 2 (N)"), True), (("Sample A load (N)", "Sample B load (N)"), False)])
def test_two_loads_over_one_extension_are_asked_about(put, heads, asked):
    rows = "".join(f"{t},{25 * e:.6f},{0.02 * s:.6f},{0.021 * s:.6f}\n" for t, e, s in ALL)
    recordings = import_tests(put("a.csv", f"Time (s),Extension (mm),{','.join(heads)}\n{rows}"), make_options(**SIZES))
    assert len(recordings) == 2 and right(recordings[0])
    assert all(any("were taken as those of 2 specimens" in note for note in checks(one)) == asked for one in recordings)


def test_a_name_that_is_a_unit_too_gets_the_unit_below_it(put):
    rows = "".join(f"{t},{e:.6f},{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.csv", f"Time,Strain,Stress\n[s],[-],[kPa]\n{rows}"))
    assert right(recording) and "strain from 'Strain (-)'" in recording.notices


def test_rows_whose_last_fields_are_empty_may_be_the_first_ones(put):
    rows = "".join(f"{t},{e:.6f},{s:.4f}\n" for t, e, s in ALL[2:])
    path = put("a.csv", f"Time (s),Strain (-),Stress (kPa)\n0,,\n0.5,,\n{rows}")
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["time_s"], TIME[2:])
    assert any("2 rows without a time or without any value left out (rows 2, 3)" in note for note in recording.notices)
    other = put("b.csv", f"Time (s),Strain (-),Stress (kPa)\n40\n{rows}")
    assert "without headings" in refusal(other)


@pytest.mark.parametrize("mark", ["Unit", "unit_string", "Einheit"])
def test_a_list_of_channels_states_the_units_of_headings(put, mark):
    """A text export of TDMS names units in such a list; they were asked for."""
    head = f"Root Name\tTitle\npull\tKM\n\nChannel\tDatatype\t{mark}\tLength\nTime\tDOUBLE\ts\t40\nStrain\tDOUBLE\t%\t40\nStress\tDOUBLE\tkPa\t40\n\nData\nTime\tStrain\tStress\n"
    rows = "".join(f"{t}\t{100 * e:.4f}\t{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.txt", head + rows))
    np.testing.assert_allclose(recording.columns["strain"], [e for _, e, _ in ALL], atol=1e-5)
    np.testing.assert_allclose(recording.columns["stress_kPa"], [s for *_, s in ALL], atol=1e-3)
    assert any("list of channels" in note and "'Stress' in kPa" in note for note in recording.notices)


def test_a_unit_of_a_heading_comes_before_that_of_a_list(put):
    head = "Channel\tUnit\nStress (kPa)\tMPa\nTime (s)\tmin\n\nTime (s)\tStrain (-)\tStress (kPa)\n"
    rows = "".join(f"{t}\t{e:.5f}\t{s:.4f}\n" for t, e, s in ALL)
    np.testing.assert_allclose(import_file(put("a.txt", head + rows)).columns["stress_kPa"], [s for *_, s in ALL], atol=1e-3)


def test_a_buffer_with_one_reading_a_row_is_refused_with_what_helps(put):
    rows = "".join(f"{2 * i + k},{101 + k},{x:.5E},{unit},{t + 0.02 * k:.3f}\n" for i, (t, e, s) in enumerate(ALL) for k, (x, unit) in enumerate(((3.0 + e, "Ohm"), (s, "V"))))
    said = refusal(put("a.csv", f"Index,Channel,Reading,Unit,Relative Time\n{rows}"), kind="spring")
    assert "every row holds a reading of one channel (Channel 101, 102)" in said and "Write a column for each" in said


def test_a_buffer_whose_rows_are_mostly_words_and_clocks_is_a_table(put):
    """Its columns were not found, so that no name of any helped."""
    rows = "".join(f"{3.0 + e:.6E},Ohm,5,6,F,F,F,03/01/2024,12:00:{int(t):02d},{t % 1:.6f}\n" for t, e, _ in ALL)
    path = put("a.csv", f"Reading,Unit,Range Digits,Disp Digits,Math,Start Group,Limit1 High,Date,Time,Fractional Seconds\n{rows}")
    assert "--map resistance=Reading" in refusal(path)
    named = make_options(columns=["resistance=Reading"], constants=["force_N=1", "elongation_mm=0"], kind="spring")
    recording = import_file(path, named)
    np.testing.assert_allclose(recording.columns["resistance_ohm"], [3.0 + e for _, e, _ in ALL], rtol=1e-5)
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), 0.5, atol=1e-6)


@pytest.mark.parametrize("name", ["pull", "Stress"])
def test_a_table_of_a_test_with_a_column_of_units_is_no_list_of_channels(put, name):
    """Its 40 rows disappeared without a word."""
    first = "".join(f"{name},{t},{e:.5f},{s:.4f},kPa\n" for t, e, s in ALL)
    second = "".join(f"{t},{e:.5f},{1.1 * s:.4f}\n" for t, e, s in ALL)
    path = put("a.csv", f"Signal,Time (s),Strain (-),Stress,Unit\n{first}\nTime (s),Strain (-),Stress (kPa)\n{second}")
    one, two = import_tests(path)
    assert right(one)
    np.testing.assert_allclose(two.columns["stress_kPa"], [1.1 * s for *_, s in ALL], atol=1e-3)


def test_a_list_of_channels_with_numbers_is_left_aside_and_said(put):
    head = "Channel,Datatype,Unit,Length\nTime,DOUBLE,s,40\nStrain,DOUBLE,%,40\nStress,DOUBLE,kPa,40\n\nTime,Strain,Stress\n"
    rows = "".join(f"{t},{100 * e:.4f},{s:.4f}\n" for t, e, s in ALL)
    recording = import_file(put("a.csv", head + rows))
    assert right(recording)
    assert [note for note in checks(recording) if "list of channels above" in note]


@pytest.mark.parametrize("amount", ["Limit", "Value", "Measuring range", "Max"])
def test_a_list_of_limits_states_no_units_of_columns(put, amount):
    """A limit of 5 kN made a force of newtons one of kilonewtons without a question."""
    rows = "".join(f"{t},{e:.5f},{s:.4f}\n" for t, e, s in ALL)
    said = refusal(put("a.csv", f"Quantity,Unit,{amount}\nStress,MPa,5\nTorque,N m,10\n\nTime (s),Strain (-),Stress\n{rows}"))
    assert "--unit stress=" in said
