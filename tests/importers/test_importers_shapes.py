"""Imitations of every raw shape, made here, so that a fresh machine tests the importers too."""

import numpy as np
import pytest

from fitting.data.importers import FORMATS, detect, import_file, import_tests, make_options
from fitting.data.importers.parts import samples_of
from fitting.data.importers.raw import open_raw
from fitting.data.recordings import read_recording, write_recording
from pneusma_jax.errors import InputError

STRETCH = np.linspace(1.0, 2.0, 21)
STRESS = 0.085 * (STRETCH - STRETCH**-2)  # MPa, neo-Hookean


def format_of(path):
    return detect(samples_of(open_raw(path))[0]).name


def refusal(path, options=None):
    with pytest.raises(InputError) as caught:
        import_file(path, options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def said(recording, words):
    return any(words in text for text in recording.notices)


def tensile(times):
    head = [
        "PARAMETER;INFO;URL;;", "Specimen Thickness (mm);3;;;", "Specimen Cross-section (cm\xb2);0.18;;;",
        "Strain calculation;Derived from the machine crosshead displacement readings;;;",
        "Lab;Somewhere else;;;", "Material;Rubber 7;;;", ";;;;",
        "Time (s);True Strain;True Stress (MPa);Engineering Strain;Engineering Stress (MPa)",
    ]  # fmt: skip
    rows = [f"{t};{np.log(s)};{p * s};{s - 1};{p}" for t, s, p in zip(times, STRETCH, STRESS, strict=True)]
    return "\n".join(head + rows + [""]).encode("latin-1")


def test_tensile_database(put, tmp_path):
    path = put("Rubber 7.csv", tensile(np.arange(21) / 10))
    assert format_of(path) == "tensile-database"
    recording = import_file(path, make_options(licence="ODbL", citation="Us", role="validation"))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1e3 * STRESS)
    np.testing.assert_allclose(recording.columns["strain"], STRETCH - 1)
    assert (recording.specimen, recording.role, recording.name) == ("Rubber_7", "validation", "Rubber_7")
    assert recording.source["citation"] == "Us" and recording.source["licence"] == "ODbL"
    assert len(read_recording(write_recording(recording, tmp_path / "out"))) == 21


def test_tensile_database_with_a_clock_that_resets(put, tmp_path):
    times = np.concatenate([np.arange(10), np.arange(11)]) / 10
    recording = import_file(put("a.csv", tensile(times)), make_options(licence="ODbL"))
    assert not recording.has("time") and said(recording, "the clock goes back 1 time (row 19)")
    np.testing.assert_allclose(recording.columns["clock_as_logged"], times)
    assert not [note for note in recording.notices if note.startswith("time_s from")]
    wire = refusal(put("a.csv", tensile(times)), make_options(kind="wire"))
    assert "row 19, column time" in wire and "cut the file there" in wire


def compression():
    head = ["EF99_0T_C_sample_3", "Compression test;", "Cylinder Diameter: 50mm;", "Speed (mm/min): 10;"]
    names = "Time (s),Compression (mm),Load (N),Engineering Strain [-],Engineering Stress (kPa),True Strain [-]"
    rows = [f"{i / 10},{i},{i * 2},{-i / 30},{-1.5 * i},{-i / 29}" for i in range(20)]
    return "\n".join([*head, names, *rows]) + "\n"


def test_compression_test(put):
    path = put("c.csv", compression())
    assert format_of(path) == "compression-test"
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["stress_kPa"], -1.5 * np.arange(20))
    np.testing.assert_allclose(recording.columns["strain"], -np.arange(20) / 30)
    assert recording.specimen == "EF99_0T_C" and said(recording, "repeat 3") and recording.source["licence"] == "not stated"
    assert said(recording, "citation and licence not stated")


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "a fraction"), (100.0, "percent")])
def test_sma_columns(put, factor, unit):
    temperature = np.concatenate([np.linspace(80, -20, 30), np.linspace(-20, 80, 30)])
    strain = 0.03 / (1 + np.exp((temperature - 20) / 5)) + 0.002
    rows = [f"  {t:.4e} {factor * e:.6e}  {100 + (i % 3):.2e}" for i, (t, e) in enumerate(zip(temperature, strain, strict=True))]
    path = put("NiTi_9/100 MPa.txt", "\n".join(rows))
    assert format_of(path) == "sma-columns"
    recording = import_file(path)
    assert said(recording, f"taken as {unit}") and recording.specimen == "NiTi_9" and recording.kind == "wire"
    np.testing.assert_allclose(recording.columns["strain"], strain, rtol=1e-5)
    np.testing.assert_allclose(recording.columns["temperature_degC"], temperature, atol=1e-2)
    assert list(recording.columns)[0] == "time_s" and recording.columns["time_s"][-1] == 59.0


LOG_HEAD = '"Test Method","{method}"\n"Sample I. D.","Nr7.mss"\n"Specimen Number","1"\n\n'


def straight_log(stress):
    """Quoted line by line with doubled quotes inside, hours, inches, coarse clock."""
    head = ['"Test Method,""Pull.msm"""', '"Sample I. D.,""Nr7.mss"""', '"Specimen Number,""1"""', ""]
    names = '"Time (h),""Load (N)"",""Crosshead (in)"",""Temperature Chamber (C)"",""Extension (mm)"",""Stress (MPa)"""'
    rows = [f'"{(i // 2) / 1000:.3f},{10 * i},{0.01 * i},{50 - i},{0.1 * i},{stress * i}"' for i in range(20)]
    return "\n".join([*head, names, "", *rows])


def test_machine_log_of_a_wire(put):
    path = put("log.txt", straight_log(stress=5.0))
    assert format_of(path) == "machine-log"
    assert "gauge_length_mm" in refusal(path) and "area_mm2" not in refusal(path)
    recording = import_file(path, make_options(dimensions=["gauge_length_mm=50"]))
    np.testing.assert_allclose(recording.columns["stress_MPa"], 5.0 * np.arange(20))
    np.testing.assert_allclose(recording.columns["strain"], 0.1 * np.arange(20) / 50)
    np.testing.assert_allclose(recording.columns["time_s"], 1.8 * np.arange(20), atol=1e-9)
    assert recording.specimen == "Nr7" and recording.source["test_method"] == "Pull.msm"
    assert said(recording, "10 rows repeat the time")


def test_machine_log_with_a_stress_that_cannot_be(put):
    path = put("log.txt", straight_log(stress=500.0))
    assert "area_mm2" in refusal(path, make_options(dimensions=["gauge_length_mm=50"]))
    sizes = ["gauge_length_mm=50", "width_mm=2", "thickness_mm=0.5"]
    recording = import_file(path, make_options(dimensions=sizes))
    np.testing.assert_allclose(recording.columns["stress_MPa"], 10.0 * np.arange(20))
    assert said(recording, "cross-section of 1 mm2")


def test_machine_log_of_a_bent_beam(put):
    names = '"Time (s)","Load (N)","Extension (mm)","_COM1 (C)","FlexureStress (MPa)","FlexureStrain (mm/mm)"\n\n'
    rows = "".join(f"{i}.5,{-i},{-0.1 * i},{100 - i},{-2 * i},****\n" for i in range(20))
    path = put("bent.txt", '"MTS Start 09:32\n' + LOG_HEAD.format(method="3Point_Bending.msm") + names + rows + "\n\n")
    assert "three-point bending" in refusal(path)
    recording = import_file(path, make_options(dimensions=["span_mm=30", "depth_mm=2"]))
    np.testing.assert_allclose(recording.columns["strain"], 6 * 2 * 0.1 * np.arange(20) / 900)
    np.testing.assert_allclose(recording.columns["stress_MPa"], 2.0 * np.arange(20))
    np.testing.assert_allclose(recording.columns["temperature_degC"], 100.0 - np.arange(20))


def test_loading_and_unloading_in_a_sheet_and_in_text(put, put_sheet):
    rows = [(10.0 * i, float(s), 1e3 * float(p)) for i, (s, p) in enumerate(zip(STRETCH, STRESS, strict=True))]
    sheet = put_sheet("loading.xlsx", rows)
    text = put("loading.txt", "\n".join("\t".join(map(str, row)) for row in rows))
    for path in (sheet, text):
        assert format_of(path) == "loading-unloading"
        recording = import_file(path)
        np.testing.assert_allclose(recording.columns["strain"], STRETCH - 1, atol=1e-15)
        np.testing.assert_allclose(recording.columns["stress_kPa"], 1e3 * STRESS)
        assert said(recording, "taken as kPa")


@pytest.mark.parametrize("swapped", [False, True])
def test_stress_and_stretch_in_two_columns(put, swapped):
    pairs = [(s, p) if swapped else (p, s) for p, s in zip(STRESS, STRETCH, strict=True)]
    path = put("Somebody_1944/UT/stress_stretch.txt", "\r\n".join(f"   {a:.6f}   {b:.6f}" for a, b in pairs))
    assert format_of(path) == "stress-stretch"
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1e3 * STRESS, atol=1e-3)
    np.testing.assert_allclose(recording.columns["strain"], STRETCH - 1, atol=1e-6)
    assert recording.specimen == "Somebody_1944_UT"


def test_other_modes_of_loading_are_refused_unless_the_columns_are_named(put):
    text = "\n".join(f"{p:.6f} {s:.6f}" for p, s in zip(STRESS, STRETCH, strict=True))
    path = put("Somebody_1944/PS/stress_stretch.txt", text)
    assert "pure shear" in refusal(path)
    named = make_options(columns=["stress=1", "stretch=2"], units=["stress=MPa"], kind="elastomer")
    np.testing.assert_allclose(import_file(path, named).columns["stress_kPa"], 1e3 * STRESS, atol=1e-3)


def fluke():
    rows = [f"{i},{99 - i},\xb0C,1/23/2019 9:27:5{i % 10}.0,0:04:10.7" for i in range(1, 30)]
    return "\n".join(["FLUKE 287,  V1.16,  1", "", "Reading,Sample,,Start Time,Duration", *rows]).encode("latin-1")


def dsc():
    rows = [f"\t{i / 60:.6f}\t{-339 + i:.6f}\t0.0\t110.0\t107.6" for i in range(30)]
    head = ["Filename:\tC:\\Program Files\\Pyris\\a.dcd", "Sample Weight:\t60.2 mg", "Time\tHeat Flow\tb\tc\td"]
    return "\n".join([*head, *rows])


def shear(n=30):
    t = np.arange(n)
    return [(float(2 * i), 0.05 * i**0.5, 0.005 * i, 0.5 * i**0.5, 0.04 * i) for i in t]


@pytest.mark.parametrize(
    ("name", "text", "format_name", "words"),
    [
        ("log.csv", fluke(), "fluke-log", "multimeter"),
        ("scan.txt", dsc(), "dsc", "calorimeter"),
        ("one.txt", "0\n0.1\n0.2\n0.3\n", "single-column", "side by side"),
        ("bend.csv", "\ufeffConfiguration,Pressure,Theta1,Theta2\n" + "A,0,1,2\nA,1,2,3\nA,2,3,4\n", "bending-actuators", "marker"),
    ],
)
def test_recognised_and_refused(put, name, text, format_name, words):
    path = put(name, text)
    assert format_of(path) == format_name
    assert words in refusal(path) and name in refusal(path)


def test_a_recording_is_refused_as_such_and_is_no_raw_format(put):
    path = put("run.csv", "time_s,strain,stress_kPa\n0,0,0\n1,0.1,5\n2,0.2,9\n3,0.3,12\n")
    assert "already is in the recording format; it can be used as it is" in refusal(path)
    assert "recording" not in [known.name for known in FORMATS]


@pytest.mark.parametrize("order", [("Scan", "Pull"), ("Pull", "Scan")])
def test_a_refused_sheet_beside_a_test_is_left_out_with_what_it_is(put_sheet, order):
    scan = [["Sample Weight:", "60.2 mg"], ["Time (s)", "Heat Flow (mW)"], *([i, -339.5 + i] for i in range(30))]
    pull = [["Strain (-)", "Stress (kPa)"], *([0.1 * i, 30.0 * i + 0.5] for i in range(12))]
    sheets = {"Scan": scan, "Pull": pull}
    (recording,) = import_tests(put_sheet("both.xlsx", {name: sheets[name] for name in order}))
    assert len(recording) == 12
    assert any("'Scan' was left out: this is a calorimeter scan" in note for note in recording.notices)


def test_shear_relaxation_in_a_sheet(put_sheet):
    path = put_sheet("shear.xlsx", shear())
    assert format_of(path) == "shear-relaxation" and "simple shear" in refusal(path)


def test_a_file_that_could_be_two_things_is_left_to_the_person(put):
    # Heating from 0 with a strain from one percent under 3 to 4 MPa, or time, stretch and stress.
    rows = [(i, 1.0 + 0.01 * i, 0.1 * i) for i in range(40)]
    path = put("two.txt", "\n".join(" ".join(map(str, row)) for row in rows))
    message = refusal(path)
    assert "could be sma-columns or loading-unloading" in message and "--format" in message
    assert import_file(path, make_options(format="loading-unloading")).kind == "elastomer"
    assert import_file(path, make_options(format="sma-columns")).kind == "wire"
    assert "does not look like --format dsc" in refusal(path, make_options(format="dsc"))
    assert "did you mean 'sma-columns'" in refusal(path, make_options(format="sma-column"))


def test_a_text_without_a_table_is_told_what_a_table_has_and_no_formats(put):
    """No format could read it, so that their names would not help."""
    message = refusal(put("prose.txt", "Dear colleague,\nno numbers here.\n"))
    assert "no table of numbers was found in it; a table has at least 3 rows of numbers, and a column for each quantity" in message
    assert not any(known.name in message for known in FORMATS) and "--map" not in message


def test_unknown_files_list_what_is_known(put):
    message = refusal(put("odd.csv", "a,b,c\n1,2,3\n2,3,4\n3,4,6\n"))
    assert "no known format" in message and all(known.name in message for known in FORMATS)
    assert "is empty" in refusal(put("empty.csv", " \n"))
    assert "neither text nor an Excel workbook" in refusal(put("a.csv", b"\x00\x01\x02\x03binary"))
    assert ".xls" in refusal(put("a.bin", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"))
    assert "not an Excel workbook that can be read" in refusal(put("a.xlsx", b"PK\x03\x04 cut short"))
    assert "no such file" in refusal(put("a.csv", "x").with_name("nowhere.csv"))


@pytest.mark.parametrize("first", [26.0, 2.0])
def test_a_clock_and_a_load_are_no_stretch_and_stress(put, first):
    """Two columns of a load cell's log, whose times would be a stretch of 26 to 344."""
    rows = [(first + 0.5 * i, 0.01 * i) for i in range(60)]
    path = put("log.csv", "\n".join(f"{a},{b}" for a, b in rows))
    message = refusal(path)
    assert "without headings right above them, numbers 1 to 2" in message
    named = make_options(columns=["stretch=1", "stress=2"], units=["stress=MPa"], kind="elastomer")
    assert import_file(path, named).kind == "elastomer"


RIG = (
    "Wire rig 2;operator JM\nSample;NT-38-A\nWire diameter;15 mil\nGauge length;4 in\n\n"
    "{clock};Thermocouple (°F);LVDT (mil);Hung mass (kg)\n"
    + "".join(f"{k / 60:.4f};{190 - 4 * k:.2f};{3.0 + 0.5 * k:.2f};0.578\n" for k in range(40))
)


@pytest.mark.parametrize("clock", ["Elapsed (min)", "Log point (min)", "t (min)"])
def test_a_rig_with_words_of_its_own_makes_a_wire_without_any_option(put, clock):
    recording = import_file(put("run.csv", RIG.format(clock=clock)))
    assert recording.kind == "wire" and list(recording.columns)[0] == "time_s"
    np.testing.assert_allclose(recording.columns["time_s"], np.arange(40.0), atol=0.003)
    np.testing.assert_allclose(recording.columns["temperature_degC"][:2], [(190 - 32) / 1.8, (186 - 32) / 1.8], rtol=1e-6)
    np.testing.assert_allclose(recording.columns["strain"], (3.0 + 0.5 * np.arange(40)) / 4000.0, rtol=1e-4)
    np.testing.assert_allclose(recording.columns["stress_MPa"], 0.578 * 9.80665 / (np.pi / 4 * 0.381**2), rtol=1e-9)
    assert said(recording, "--specimen NT-38-A")


def test_a_file_that_speaks_of_a_spring_is_asked_about(put):
    with pytest.raises(InputError, match="fit the kinds spring, wire"):
        import_file(put("run.csv", RIG.format(clock="t (min)").replace("Wire rig", "Spring rig")))


def test_a_column_in_seconds_that_does_not_rise_is_no_clock(put):
    text = RIG.format(clock="Dwell (s)").replace("\n0.0167;", "\n0.0000;")
    recording = import_file(put("run.csv", text))
    assert said(recording, "has no clock") and recording.source["clock"] == "rows counted" and recording.counts_rows
    stated = import_file(put("timed.csv", text), make_options(interval_s=2.0))
    assert stated.columns["time_s"][1] == 2.0 and not stated.counts_rows


def test_columns_of_no_known_format_are_asked_for_with_the_quantities_that_there_are(put):
    with pytest.raises(InputError, match=r"QUANTITY is one of .*temperature.*resistance"):
        import_file(put("run.csv", "foo;bar;baz\n" + "".join(f"{k};{2 * k};{3 * k}\n" for k in range(30))))


DISPLACED = "Time (s),Pressure (kPa),Displacement (mm)\n" + "".join(f"{k},{k},{0.02 * k:.2f}\n" for k in range(9))


def test_a_tube_is_as_long_as_at_rest_and_by_its_elongation(put):
    path = put("a.csv", DISPLACED)
    assert "--kind tube" in refusal(path) and "--dimension length_mm=" in refusal(path)
    assert "state it with --dimension length_mm=..." in refusal(path, make_options(kind="tube"))
    recording = import_file(path, make_options(kind="tube", dimensions=["length_mm=56"]))
    np.testing.assert_allclose(recording.columns["length_mm"], 56 + 0.02 * np.arange(9))
    assert recording.geometry["length_mm"] == 56
    assert any("'Displacement (mm)' was taken as the elongation of the tube" in note for note in recording.notices)
    stated = import_file(put("b.csv", "Tube length,56 mm\n\n" + DISPLACED), make_options(kind="tube"))
    np.testing.assert_allclose(stated.columns["length_mm"], recording.columns["length_mm"])


@pytest.mark.parametrize("text", ["No;Task;Result\n1;Start;done\n2;Go on;done\n3;Stop;late\n4;Start;done\n", "Only words\nand no number\n"])
def test_a_file_of_words_is_said_to_have_no_table(put, text):
    assert "no table of numbers was found in it" in refusal(put("a.csv", text))


def test_a_quantity_without_numbers_is_named(put):
    rows = "".join(f"{k},,{k + 1}\n" for k in range(6))
    said = refusal(put("a.csv", "Pressure (psi),disp (mm),Valve\n" + rows))
    assert "no number stands below 'disp (mm)')" in said
