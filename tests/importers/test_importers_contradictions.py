"""Units that differ in a capital alone, and options that contradict what a file states itself."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options
from fitting.data.importers.headers import is_type_k
from fitting.data.importers.spelling import parse_heading, unit_name
from pneusma_jax.errors import InputError
from pneusma_jax.units import UNITS

STRAIN = np.linspace(0.0, 0.8, 41)
STRESS = 130.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)  # kPa


def table(head, *columns):
    return head + "\n" + "".join(",".join(f"{x:.8g}" for x in row) + "\n" for row in zip(*columns, strict=True))


# Milli and mega.


@pytest.mark.parametrize(
    ("quantity", "written", "meant"),
    [("stress", "mPa", "MPa"), ("force", "MN", "mN"), ("resistance", "MΩ", "mohm"), ("resistance", "Mohm", "mohm"), ("resistance", "MOhm", "mohm"), ("resistance", "MOhms", "mohm"), ("current", "MA", "mA"), ("time", "Ms", "ms"), ("voltage", "MV", "mV")],
)
def test_a_unit_that_differs_in_its_prefix_alone_is_refused(quantity, written, meant):
    with pytest.raises(InputError, match=f"--unit {quantity}={written}: .*did you mean '{meant}'"):
        make_options(units=[f"{quantity}={written}"])


def test_no_known_unit_is_read_as_that_of_the_other_prefix():
    dimensions = ("force", "pressure", "current", "voltage", "resistance", "mass", "power", "angle", "stiffness")
    prefixed = [name for name, unit in UNITS.items() if unit.dimension in dimensions and name[0] in "mM" and name[:2] != "mm"]
    assert {"MPa", "mN", "mA", "mV", "mohm", "mN/mm", "MN/m2"} <= {*prefixed}
    for written in (known[0].swapcase() + known[1:] for known in prefixed):
        assert unit_name(written) not in UNITS or written in UNITS, written


@pytest.mark.parametrize(("written", "meant"), [("MPA", "MPa"), ("mpa", "MPa"), ("KPA", "kPa"), ("Kpa", "kPa"), ("MM", "mm"), ("Min", "min"), ("MS", "ms"), ("mn", "mN"), ("MBAR", "mbar"), ("mOhm", "mohm"), ("Ohms", "ohm"), ("kOhm", "kohm"), ("MOHM", "mohm")])
def test_units_in_one_case_alone_are_read_as_before(written, meant):
    assert unit_name(written) == meant


def test_a_heading_with_the_other_prefix_is_refused_with_the_unit_that_is_meant(put):
    said = refusal(put("a.csv", table("Strain (-),Stress (mPa)", STRAIN, STRESS / 1e3)))
    assert "'Stress (mPa)'" in said and "did you mean 'MPa'" in said and "--unit stress=" in said


def test_a_stated_unit_helps_a_heading_with_the_other_prefix_and_both_are_named(put):
    path = put("a.csv", table("Strain (-),Stress (mPa)", STRAIN, STRESS / 1e3))
    recording = import_file(path, make_options(units=["stress=MPa"]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-6)
    assert [check for check in checks(recording) if "mPa" in check and "MPa" in check]


def test_a_newton_metre_is_no_nanometre():
    assert parse_heading("Torque (Nm)").unit == "N m"


# A pressure's zero behind a unit.


@pytest.mark.parametrize("quantity", ["stress", "force", "strain"])
def test_only_a_pressure_has_an_absolute_unit(quantity):
    with pytest.raises(InputError, match=f"--unit {quantity}=MPaa: .*did you mean 'MPa'"):
        make_options(units=[f"{quantity}=MPaa"])


@pytest.mark.parametrize("unit", ["MPaa", "MPa abs", "MPag", "psia"])
def test_a_heading_of_a_stress_has_no_absolute_unit(put, unit):
    path = put("a.csv", table(f"Strain (-),Stress ({unit})", STRAIN, STRESS / 1e3))
    meant = "psi" if unit == "psia" else "MPa"
    said = refusal(path)
    assert repr(unit) in said and f"--unit stress={meant}" in said
    np.testing.assert_allclose(import_file(path, make_options(units=["stress=MPa"])).columns["stress_kPa"], STRESS, rtol=1e-6)


@pytest.mark.parametrize("head", ["Strain,stress_mPa", "Strain,Stress\n-,mPa"])
def test_the_other_prefix_is_named_wherever_the_unit_stands(put, head):
    said = refusal(put("a.csv", table(head, STRAIN, STRESS / 1e3)))
    assert "did you mean 'MPa'" in said and "--unit stress=" in said


def test_an_absolute_unit_of_a_pressure_is_less_an_atmosphere(put):
    pressure = np.linspace(101.325, 131.325, 41)
    path = put("a.csv", table("Time (s),Pressure,Length (mm)", np.arange(41.0), pressure, 80.0 + 0.1 * np.arange(41.0)))
    recording = import_file(path, make_options(units=["pressure=kPaa"]))
    np.testing.assert_allclose(recording.columns["pressure_kPa"], pressure - 101.325, atol=1e-9)
    assert any("atmosphere" in note for note in recording.notices)


@pytest.mark.parametrize(
    ("heading", "stated", "said"),
    [("Pressure (kPaa)", "kPag", True), ("Absolute pressure (kPa)", "kPag", True), ("Pressure (kPag)", "kPaa", True), ("Pressure (kPaa)", "kPaa", False), ("Pressure (kPa)", "kPaa", False), ("Pressure (kPaa)", "kPa", False)],
)
def test_a_zero_of_a_pressure_that_contradicts_the_heading_is_said(put, heading, stated, said):
    path = put("a.csv", table(f"Time (s),{heading},Length (mm)", np.arange(41.0), 110.0 + np.arange(41.0), 80.0 + 0.1 * np.arange(41.0)))
    found = [check for check in checks(import_file(path, make_options(units=[f"pressure={stated}"]))) if "--unit" in check]
    assert len(found) == said and all("absolute" in check and "gauge" in check for check in found)


# A unit of the file and another one of the user.


def test_a_unit_that_contradicts_the_heading_is_said_with_the_one_that_was_used(put):
    path = put("a.csv", table("Strain (-),Stress [MPa]", STRAIN, STRESS))
    recording = import_file(path, make_options(units=["stress=kPa"]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-6)
    (said,) = (check for check in checks(recording) if "--unit" in check)
    assert "'Stress [MPa]' states MPa" in said and "--unit stress=kPa" in said and "kPa was used" in said


@pytest.mark.parametrize(("heading", "unit"), [("Stress [MPa]", "MPa"), ("Stress [MPa]", "N/mm2"), ("Stress", "MPa")])
def test_a_unit_that_repeats_the_heading_is_no_contradiction(put, heading, unit):
    path = put("a.csv", table(f"Strain (-),{heading}", STRAIN, STRESS / 1e3))
    assert not checks(import_file(path, make_options(units=[f"stress={unit}"])))


def test_a_mass_that_is_stated_as_its_force_is_no_contradiction(put):
    path = put("a.csv", table("Extension (mm),Load (g)", 10 * STRAIN, 200.0 * STRESS / 9.80665))
    options = make_options(units=["force=gf"], dimensions=["gauge_length_mm=10", "area_mm2=2"], kind="elastomer")
    assert not [check for check in checks(import_file(path, options)) if "--unit" in check]


# A size of the file and another one of the user.

PREAMBLE = "Cross-section (mm2),20.0\nGauge length (mm),50.0\n\n"


def pulled(put, preamble=PREAMBLE):
    return put("a.csv", preamble + table("Time (s),Extension (mm),Load (N)", np.arange(41.0), 50.0 * STRAIN, 0.02 * STRESS))


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ("area_mm2=10", ("'Cross-section (mm2) 20.0'", "20 mm2", "--dimension area_mm2=10", "10 mm2 was used")),
        ("gauge_length_mm=25", ("'Gauge length (mm) 50.0'", "50 mm", "--dimension gauge_length_mm=25", "25 mm was used")),
        ("diameter_mm=4", ("'Cross-section (mm2) 20.0'", "20 mm2", "--dimension diameter_mm=4", "12.5664 mm2 was used")),
    ],
)
def test_a_size_that_contradicts_the_file_is_said_with_both_values(put, stated, words):
    recording = import_file(pulled(put), make_options(dimensions=[stated], kind="elastomer"))
    (said,) = (check for check in checks(recording) if "--dimension" in check)
    assert all(word in said for word in words), said


def test_a_size_that_repeats_the_file_is_no_contradiction(put):
    options = make_options(dimensions=["area_mm2=20", "gauge_length_mm=50"], kind="elastomer")
    assert not checks(import_file(pulled(put), options))


def test_a_size_that_repeats_the_file_in_another_unit_is_no_contradiction(put):
    path = pulled(put, "Gauge length: 0.98425 in\nWidth: 0.23622 in\nThickness: 3 mm\n\n")
    assert not checks(import_file(path, make_options(dimensions=["gauge_length_mm=25", "area_mm2=18"], kind="elastomer")))


def test_one_side_of_a_section_that_contradicts_the_file_is_said(put):
    path = pulled(put, "Width (mm),6\nThickness (mm),3\nGauge length (mm),50\n\n")
    (said,) = checks(import_file(path, make_options(dimensions=["width_mm=5"], kind="elastomer")))
    assert "6 mm" in said and "--dimension width_mm=5" in said and "thickness" not in said


def test_a_length_that_may_be_the_gauge_length_is_compared_too(put):
    path = pulled(put, "Specimen length (mm),50\nArea (mm2),20\n\n")
    (said,) = checks(import_file(path, make_options(dimensions=["gauge_length_mm=25"], kind="elastomer")))
    assert "50 mm" in said and "--dimension gauge_length_mm=25" in said


def test_the_wire_of_a_spring_that_contradicts_the_file_is_said(put):
    x = np.linspace(0.0, 40.0, 41)
    head = "Wire diameter (mm),0.3\n\n"
    path = put("spring.csv", head + table("Time (s),Elongation (mm),Force (N),Resistance (ohm)", x, x, 0.01 * x, 4.0 + 0.001 * x))
    options = make_options(kind="spring", dimensions=["wire_diameter_mm=0.25"])
    said = [check for check in checks(import_file(path, options)) if "--dimension wire_diameter_mm=0.25" in check]
    assert len(said) == 1 and "'Wire diameter (mm) 0.3'" in said[0] and "0.25 mm was used" in said[0]


@pytest.mark.parametrize(("line", "stated"), [("Length (mm),75", "length_mm=80"), ("Diameter (mm),14", "outer_diameter_mm=12"), ("Thickness (mm),2", "wall_thickness_mm=3")])
def test_a_size_of_a_tube_that_contradicts_the_file_is_said(put, line, stated):
    k = np.arange(41.0)
    path = put("a.csv", f"{line}\n\n" + table("Time (s),Pressure (kPa),Length (mm)", k, k, 80.0 + 0.1 * k))
    (said,) = (check for check in checks(import_file(path, make_options(kind="tube", dimensions=[stated]))) if f"--dimension {stated}" in check)
    assert repr(line.replace(",", " ")) in said


# Two units in one heading.

TEMPERATURE = np.linspace(90.0, 30.0, 41)


@pytest.mark.parametrize(
    ("heading", "units"),
    [("Temperature_F (°C)", ("degF", "degC")), ("Temperature (°F) [°C]", ("degF", "degC")), ("Temperature F (K)", ("degF", "K"))],
)
def test_two_units_in_one_heading_are_asked_about(put, heading, units):
    """The unit in brackets was taken without a word."""
    path = put("a.csv", table(f"Time [s],{heading},Strain [-],Stress [MPa]", np.arange(41.0), TEMPERATURE, 0.05 * STRAIN, 200.0 + 0.0 * STRAIN))
    said = refusal(path)
    assert repr(heading) in said and all(f"--unit temperature={unit}" in said for unit in units)
    recording = import_file(path, make_options(units=["temperature=degC"]))
    np.testing.assert_allclose(recording.columns["temperature_degC"], TEMPERATURE, rtol=1e-6)


@pytest.mark.parametrize(
    ("heading", "values", "refused"),
    [("Temp K [°C]", TEMPERATURE, False), ("Temp K [°C]", TEMPERATURE + 273.15, True)],
)
def test_a_k_beside_degrees_is_a_thermocouple_unless_the_values_may_be_kelvin(put, heading, values, refused):
    path = put("a.csv", table(f"Time [s],{heading},Strain [-],Stress [MPa]", np.arange(41.0), values, 0.05 * STRAIN, 200.0 + 0.0 * STRAIN))
    named = {"columns": [f"temperature={heading}"]}
    if refused:
        assert "--unit temperature=K or --unit temperature=degC" in refusal(path, **named)
        return
    recording = import_file(path, make_options(**named))
    np.testing.assert_allclose(recording.columns["temperature_degC"], values, rtol=1e-6)
    assert [note for note in checks(recording) if "type of thermocouple" in note]


def test_a_thermocouple_of_type_k_is_told_by_its_name():
    warm = np.linspace(280.0, 330.0, 5)
    assert is_type_k("Thermocouple K (°C)", ("K", "degC"), warm)
    assert not is_type_k("Specimen K (°C)", ("K", "degC"), warm)


@pytest.mark.parametrize("heading", ["Force N (mN)", "Force_N (mN)", "Force (N) [mN]"])
def test_units_that_differ_in_a_prefix_are_asked_about_only(put, heading):
    """`Current_A (mA)` is a current in mA."""
    path = put("a.csv", table(f"Time (s),{heading},Elongation (mm),Resistance (ohm)", np.arange(41.0), STRESS, 20.0 * STRAIN, 3.0 + 0.1 * STRAIN))
    recording = import_file(path, make_options(kind="spring"))
    np.testing.assert_allclose(recording.columns["force_N"], 1e-3 * STRESS, rtol=1e-6)
    assert [note for note in checks(recording) if "mN was taken" in note]


def test_two_units_of_a_column_that_is_not_needed_are_no_question(put):
    path = put("a.csv", table("Strain (-),Stress (kPa),Oven temperature_F (°C)", STRAIN, STRESS, TEMPERATURE))
    assert len(import_file(path)) == 41


@pytest.mark.parametrize("heading", ["Temperature C (°C)", "Temperature_C (degC)", "Temperature 1 (°C)", "Temperature (°C) (degC)"])
def test_one_unit_that_is_written_twice_is_no_contradiction(put, heading):
    path = put("a.csv", table(f"Time [s],{heading},Strain [-],Stress [MPa]", np.arange(41.0), TEMPERATURE, 0.05 * STRAIN, 200.0 * STRAIN))
    np.testing.assert_allclose(import_file(path).columns["temperature_degC"], TEMPERATURE, rtol=1e-6)


@pytest.mark.parametrize(("letter", "unit"), [("A", "%"), ("B", "%"), ("h", "%"), ("F", "%")])
def test_a_letter_that_is_no_unit_of_that_dimension_names_a_specimen(put, letter, unit):
    path = put("a.csv", table(f"Strain {letter} ({unit}),Stress {letter} (kPa)", 100 * STRAIN, STRESS))
    np.testing.assert_allclose(import_file(path).columns["strain"], STRAIN, rtol=1e-6)


@pytest.mark.parametrize("line", ["Gauge length,0.05", "Gauge length (mm),0.05", "Gauge length,50,um"])
def test_a_size_that_no_specimen_has_is_asked_about(put, line):
    """0.05 m without a unit was taken as 0.05 mm."""
    said = refusal(pulled(put, f"Cross-section (mm2),20.0\n{line}\n\n"), kind="elastomer")
    assert "cannot be, gauge_length lies in" in said and "--dimension gauge_length_mm=..." in said
    recording = import_file(pulled(put, f"Cross-section (mm2),20.0\n{line}\n\n"), make_options(kind="elastomer", dimensions=["gauge_length_mm=50"]))
    np.testing.assert_allclose(recording.columns["strain"], STRAIN, atol=1e-6)
