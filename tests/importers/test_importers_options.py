"""What the person states: nothing is dropped, everything is of use or refused, and an error's advice works."""

import numpy as np
import pytest
from answers import refusal
from click.testing import CliRunner

from fitting.cli import main
from fitting.data.importers import import_file, import_files, make_options
from pneusma_jax.errors import InputError

PRESS = "Time (s),Position (mm),Load (N)\n" + "".join(f"{i},{0.1 * i:.1f},{0.6 * i * (1 + 0.02 * i):.4f}\n" for i in range(31))
COUPON = "Strain (%),Stress (kPa)\n" + "".join(f"{i},{5 * i}\n" for i in range(20))
HUNG = "Temperature (C),Strain (mm/mm)\n" + "".join(f"{30 + 2 * i},{0.04 / (1 + np.exp((30 + 2 * i - 60) / 4)):.5f}\n" for i in range(40))
PULL = "Strain (%),Stress (MPa)\n" + "".join(f"{0.1 * i:.1f},{min(40 * 0.1 * i * 10, 400 + i)}\n" for i in range(60))
SPRING = "Time (s),Displacement (mm),Load (N),Resistance (ohm)\n" + "".join(f"{i},{i},{0.1 * i},3.7\n" for i in range(9))
TUBE = "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{i},{i},{56 + 0.1 * i}\n" for i in range(9))
ANGLE = "time (s),Pressure command (kPa),Bend angle (deg)\n" + "".join(f"{0.2 * i:.1f},{i},{2 * i}\n" for i in range(31))
SIZES = ["gauge_length_mm=10", "area_mm2=100"]


@pytest.mark.parametrize(
    ("text", "named", "words"),
    [
        (PRESS, {"scales": ["resistance=-1"]}, "--scale resistance: nothing in this file is read as resistance; read are elongation, force, time"),
        (PRESS, {"units": ["pressure=kPa"]}, "--unit pressure: nothing in this file is read as pressure"),
        (PRESS, {"units": ["strain=percent"]}, "--unit strain: strain is made here ('Position (mm)' over the gauge length of 10 mm); say --unit elongation=..."),
        (PRESS, {"units": ["stress=kPa"]}, "say --unit force=... instead"),
        (PRESS, {"dimensions": [*SIZES, "wall_thickness_mm=1"]}, "--dimension wall_thickness_mm: a recording of kind elastomer has no use for it"),
        (PRESS, {"dimensions": [*SIZES, "width_mm=5"]}, "--dimension width_mm: stress is 'Load (N)' (N) over the cross-section of 100 mm2"),
        (PRESS, {"constants": ["temperature_degC=22"]}, "--constant temperature: a recording of kind elastomer has no temperature"),
        (PRESS, {"subtracted": ["pressure_kPa=101"]}, "--subtract pressure: nothing in this file is read as pressure"),
        (PRESS, {"circuit": ["adjust_V=1.2"]}, "--circuit adjust_V: no voltage is converted to a resistance here"),
        (PRESS, {"interval_s": 0.1}, "--interval: the file has a clock of its own"),
        (COUPON, {"dimensions": ["area_mm2=18"]}, "--dimension area_mm2: stress is read from 'Stress (kPa)' and there is no load to divide; name one with --map force=..."),
        (COUPON, {"dimensions": ["gauge_length_mm=18"]}, "--dimension gauge_length_mm: strain is read from 'Strain (%)' and there is no extension"),
        (COUPON, {"scales": ["force=-1"]}, "--scale force: nothing in this file is read as force"),
        (TUBE, {"compression": True}, "--compression: it turns strain and stress of a coupon or wire, and this is of kind tube"),
        (TUBE, {"slack": "auto"}, "--slack: a recording of kind tube has no stroke"),
        (SPRING, {"dimensions": ["gauge_length_mm=18"]}, "a recording of kind spring has no use for it"),
        (SPRING, {"scales": ["temperature=2"]}, "--scale temperature: nothing in this file is read as temperature"),
        (PULL, {"dimensions": ["wire_diameter_mm=0.5"]}, "--dimension wire_diameter_mm: that is the wire of a spring; of this specimen say --dimension diameter_mm"),
        (PRESS, {"columns": ["temperature=Time (s)"]}, "--map temperature: a recording of kind elastomer has no temperature"),
    ],
)  # fmt: skip
def test_an_option_that_nothing_uses_is_refused(put, text, named, words):
    if text == PRESS:
        named = {"kind": "elastomer", "dimensions": SIZES, **named}
    assert words in refusal(put("a.csv", text), **named)


def test_it_is_refused_on_the_command_line_with_exit_code_2_and_nothing_is_written(put, tmp_path):
    import subprocess
    import sys

    args = ["import", str(put("a.csv", COUPON)), "--out", str(tmp_path / "out"), "--scale", "force=-1"]
    done = subprocess.run([sys.executable, "-m", "fitting.cli", *args], capture_output=True, text=True)
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    assert len(done.stderr.strip().splitlines()) == 1 and "--scale force" in done.stderr


@pytest.mark.parametrize(
    ("scales", "strain", "stress"),
    [
        (["strain=-1", "stress=-1"], -0.3, -288.0), (["elongation=-1", "force=-1"], -0.3, -288.0), (["displacement=-1", "load=-1"], -0.3, -288.0),
        (["strain=0.5"], 0.15, 288.0), (["extension=0.5", "stress=2"], 0.15, 576.0),
    ],
)  # fmt: skip
def test_a_factor_acts_on_what_was_made_and_on_what_it_was_made_of(put, scales, strain, stress):
    recording = import_file(put("a.csv", PRESS), make_options(kind="elastomer", dimensions=SIZES, scales=scales))
    last = [values[-1] for values in (recording.columns["strain"], recording.columns["stress_kPa"])]
    assert last == pytest.approx([strain, stress], rel=1e-3)


def test_a_factor_on_a_stretch_and_on_a_resistance_that_are_made(put):
    text = "Stretch,Stress (kPa)\n1,0\n1.1,5\n1.2,10\n"
    assert import_file(put("a.csv", text), make_options(scales=["strain=0.5"])).columns["strain"].max() == pytest.approx(0.1)
    text = SPRING.replace("Resistance (ohm)", "Voltage (V)")
    named = {"kind": "spring", "circuit": ["adjust_V=1", "set_ohm=1"]}
    one, two = (import_file(put("b.csv", text), make_options(**named, scales=s)).columns["resistance_ohm"] for s in ([], ["resistance=2"]))
    np.testing.assert_allclose(two, 2.0 * one)


def test_of_several_files_one_is_enough_and_the_others_say_so(put):
    paths = [put("a.csv", PRESS), put("b.csv", COUPON)]
    options = make_options(kind="elastomer", dimensions=SIZES)
    one, other = import_files(paths, options)
    assert not any("not used here" in note for note in one.notices)
    assert sum("not used here" in note for note in other.source["notes"]) == 2
    with pytest.raises(InputError, match="--scale resistance"):
        import_files(paths, make_options(kind="elastomer", dimensions=SIZES, scales=["resistance=2"]))


@pytest.mark.parametrize("name", ["displacement", "extension", "elongation"])
def test_synonyms_of_elongation(put, name):
    text = SPRING.replace("Displacement (mm)", "Way")
    recording = import_file(put("a.csv", text), make_options(columns=[f"{name}=Way"], units=[f"{name}=cm"], scales=[f"{name}=2"]))
    assert recording.columns["elongation_mm"].max() == pytest.approx(160.0)


# --map adds.


@pytest.mark.parametrize(
    ("text", "named", "column", "last"),
    [
        (ANGLE, {"kind": "actuator", "columns": ["pressure=Pressure command (kPa)"]}, "time_s", 6.0),
        (ANGLE, {"columns": ["bend_angle=3", "pressure=2"]}, "time_s", 6.0),
        (SPRING.replace("Load", "Zug"), {"columns": ["force=Zug (N)"]}, "resistance_ohm", 3.7),
        (PRESS.replace("Position", "Way"), {"kind": "elastomer", "columns": ["elongation=Way (mm)"], "dimensions": SIZES}, "time_s", 30.0),
        ("Temperature (C),Dehn (%),Stress (MPa),Time (min)\n" + "".join(f"{30 + i},{0.1 * i},300,{i}\n" for i in range(9)), {"columns": ["strain=Dehn (%)"]}, "time_s", 480.0),
    ],
)  # fmt: skip
def test_map_adds_to_what_is_recognised(put, text, named, column, last):
    recording = import_file(put("a.csv", text), make_options(**named))
    assert recording.columns[column][-1] == pytest.approx(last)
    assert not any("no clock" in note for note in recording.notices)


def test_what_map_names_comes_before_what_headings_name(put):
    text = "Strain (%),Extension (mm),Stress (kPa)\n" + "".join(f"{i},{2 * i},{5 * i}\n" for i in range(9))
    recording = import_file(put("a.csv", text), make_options(columns=["elongation=Extension (mm)"], dimensions=["gauge_length_mm=100"]))
    assert recording.columns["strain"].max() == pytest.approx(0.16)
    assert any("'Strain (%)' set aside for what --map names" in note for note in recording.notices)


# What did not change.


@pytest.mark.parametrize(
    ("text", "constant", "column", "value"),
    [
        (HUNG, "stress_MPa=300", "stress_MPa", 300.0), (HUNG, "stress_ksi=10", "stress_MPa", 68.94757), (PULL, "temperature_degC=22", "temperature_degC", 22.0),
        (PULL, "temperature_K=295.15", "temperature_degC", 22.0), (HUNG.replace("Strain (mm/mm)", "Strain (%)"), "stress_N/mm2=150", "stress_MPa", 150.0),
    ],
)  # fmt: skip
def test_a_constant_quantity_can_be_stated(put, text, constant, column, value):
    recording = import_file(put("a.csv", text), make_options(constants=[constant]))
    assert recording.kind == "wire" and set(np.round(recording.columns[column], 5)) == {value}
    assert any("as stated with --constant" in note for note in recording.notices)


def test_the_refusal_of_a_hung_weight_names_the_option(put, follow):
    path = put("a.csv", HUNG)
    message, _ = follow(path)
    assert "--constant stress_MPa=..." in message
    assert "--constant stress_MPa=..." in follow(path, "--kind", "wire")[0]
    output, (recording,) = follow(path, "--constant", "stress_MPa=300")
    assert recording.kind == "wire" and recording.columns["stress_MPa"][0] == 300.0


def test_a_wire_without_temperature_is_told_what_it_needs(put, follow):
    path = put("a.csv", PULL)
    output, (recording,) = follow(path)
    assert recording.kind == "wire" and "--constant temperature_degC=..." in output and "characterise and diagnose refuse it" in output
    output, (recording,) = follow(path, "--constant", "temperature_degC=22")
    assert "characterise and diagnose refuse it" not in output and recording.has("temperature")


def test_a_constant_that_the_file_has_is_refused(put):
    assert "the file has it in 'Stress (MPa)'; leave the option out" in refusal(put("a.csv", PULL), constants=["stress_MPa=3"], kind="wire")


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"constants": ["temperature=22"]}, "the unit is missing; write temperature_degC"),
        ({"constants": ["temprature_degC=22"]}, "did you mean 'temperature_degC'"),
        ({"constants": ["temperature_kPa=22"]}, "not of temperature"),
        ({"constants": ["temperature_degC"]}, "must be NAME_UNIT=VALUE"),
        ({"constants": ["temperature_degC=warm"]}, "must be a number"),
        ({"subtracted": ["stress_kPa=1", "stress_MPa=1"]}, "given twice"),
        ({"slack": "some"}, "--slack some: must be auto, fit, keep"),
        ({"slack": "-0.1"}, "--slack -0.1"),
    ],
)
def test_options_that_cannot_be_are_refused(named, words):
    with pytest.raises(InputError) as caught:
        make_options(**named)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_recording_can_be_mended_too(put):
    text = "time_s,strain,stress_kPa\n" + "".join(f"{i},{0.01 * i},{i + 0.02 * i * i}\n" for i in range(30))
    path = put("a.csv", text)
    assert "used as it is" in refusal(path)
    recording = import_file(path, make_options(compression=True))
    assert recording.columns["strain"].min() == pytest.approx(-0.29) and recording.columns["stress_kPa"].min() < 0.0


# Words.


def test_notes_name_the_unit_of_the_column_that_was_read(put):
    text = "Time (s),Extension (in),Load (lbf)\n" + "".join(f"{i},{0.1 * i},{2 * i}\n" for i in range(9))
    recording = import_file(put("a.csv", text), make_options(kind="elastomer", dimensions=SIZES))
    assert "stress_kPa is 'Load (lbf)' (lbf) over the cross-section of 100 mm2" in recording.notices
    assert not any("from 'Load (lbf)', in MPa" in note for note in recording.notices)


def test_no_library_warns_on_an_import(put, put_sheet, recwarn):
    blank = "Time (s),Strain (-),Stress (kPa),Load (N),Spare (V)\n" + "".join(f"{i},{0.1 * i},{i},,\n" for i in range(9))
    zero = "Time (s),Strain (-),Stress (kPa),Load (N),Extension (mm)\n" + "".join(f"{i},{0.1 * i},0,0,0\n" for i in range(9))
    for path in (put("a.csv", blank), put("b.csv", zero), put_sheet("c.xlsx", [["Strain (%)", "Stress (kPa)"], [1, 2], [2, 3], [3, 4]])):
        result = CliRunner().invoke(main, ["import", str(path), "--preview"])
        assert result.exception is None or isinstance(result.exception, (InputError, SystemExit))
    assert not recwarn.list


# What is not modelled.


@pytest.mark.parametrize(
    ("head", "name", "words"),
    [
        ("Pressure (kPa),Contraction (%),Force (N)", "a", "the contraction of a pneumatic muscle"),
        ("Pressure (bar),Force (N),Length (mm)", "mckibben_test", "actuator"),
        ("Pressure (mbar),Membrane height (mm),Time (s)", "a", "an inflated membrane"),
        ("Pressure (kPa),Apex displacement (mm),Volume (ml)", "bulge test 3", "an inflated membrane"),
        ("Time (s),Pressure (kPa),Piston position (mm)", "a", "a piston or bellows"),
        ("Pressure (kPa),Blocked force (N),Time (s)", "a", "the blocked force of an actuator"),
        ("Time (s),Pressure (kPa),Force (N)", "run 7", "pressure with force is that of a muscle, piston or membrane"),
        ("Time (s),Torque (Nmm),Twist (deg)", "a", "torsion"),
        ("Strain (-),Stress (kPa),Time (s)", "equibiaxial_2", "biaxial tension"),
    ],
)
def test_what_is_not_modelled_is_told_so_with_what_is(put, head, name, words):
    rows = "".join(f"{i},{0.1 * i},{0.5 * i + 10}\n" for i in range(9))
    if words == "actuator":  # a length over pressure can be a tube's all the same
        recording = import_file(put(f"{name}.csv", head + "\n" + rows))
        assert recording.kind == "tube"
        return
    message = refusal(put(f"{name}.csv", head + "\n" + rows))
    assert words in message
    for kind in ("spring (", "wire (", "elastomer (", "tube (", "actuator ("):
        assert kind in message


def test_all_units_that_are_missing_are_asked_for_at_once(put, follow):
    path = put("a.csv", "time,force,displacement\n" + "".join(f"{i},{0.1 * i},{i}\n" for i in range(9)))
    args = ("--kind", "elastomer", "--dimension", "gauge_length_mm=10", "--dimension", "area_mm2=10")
    message, _ = follow(path, *args)
    for word in ("'time', 'force', 'displacement'", "--unit elongation=...", "--unit force=...", "--unit time=..."):
        assert word in message
    _, (recording,) = follow(path, *args, "--unit", "elongation=mm", "--unit", "force=N", "--unit", "time=s")
    assert recording.columns["strain"].max() == pytest.approx(0.8)


def test_a_table_that_is_no_csv_is_not_taken_for_a_recording(put):
    text = "# strain stress_kPa\n" + "".join(f"{0.1 * i} {5 * i}\n" for i in range(9))
    recording = import_file(put("a.txt", text))
    assert recording.kind == "elastomer" and recording.columns["stress_kPa"].max() == pytest.approx(40.0)


def test_a_load_in_the_name_of_a_sheet_or_file_is_read(put, put_sheet):
    rows = [[30 + 2 * i, 4 / (1 + np.exp((30 + 2 * i - 60) / 4))] for i in range(40)]
    head = ["Temperature (°C)", "Strain (%)"]
    path = put_sheet("cycles.xlsx", {"100 MPa": [head, *rows], "200 MPa": [head, *rows]})
    from fitting.data.importers import import_tests

    assert [set(r.columns["stress_MPa"]) for r in import_tests(path)] == [{100.0}, {200.0}]
    first, second = import_tests(path, make_options(constants=["stress_MPa=100"]))
    assert not any("another stress" in note for note in first.notices)
    assert any("another stress than --constant does ('200 MPa')" in note for note in second.notices)
    assert set(import_file(put("hung_150MPa.csv", HUNG)).columns["stress_MPa"]) == {150.0}
    assert set(import_file(put("pull at 22 °C.csv", PULL)).columns["temperature_degC"]) == {22.0}


@pytest.mark.parametrize("head", ["t [s],p_abs [bar],angle [deg]", "Time (s);Druck absolute (bar);Biegewinkel (°)", "Time (s),p abs (bar),θ (deg)"])
def test_symbols_with_a_unit_are_recognised(put, head):
    mark = ";" if ";" in head else ","
    rows = "".join(mark.join([f"{0.5 * i}", f"{1.01325 + 0.01 * i:.5f}", f"{2 * i}"]) + "\n" for i in range(20))
    recording = import_file(put("a.csv", head + "\n" + rows))
    assert recording.kind == "actuator" and recording.columns["bend_angle_deg"].max() == 38.0
    np.testing.assert_allclose(recording.columns["pressure_kPa"], np.arange(20), atol=1e-9)


def test_a_wire_stronger_than_nitinol_is_asked_about(put):
    rows = "".join(f"{0.1 * i},{80 * i}\n" for i in range(40))
    recording = import_file(put("a.csv", "Diameter: 2 mm\nGauge length: 100 mm\nExtension (mm),Load (N)\n" + rows.replace(",", ",1")))
    assert recording.kind == "wire" and any("more than any nitinol bears" in note for note in recording.notices)
