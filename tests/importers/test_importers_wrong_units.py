"""Headings whose marks or words look like a unit and are none, and units in the spelling of loggers."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options

N = 40
TIME = 0.5 * np.arange(N)
STRAIN = 0.6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N)))
STRESS = 90.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
SIZES = {"dimensions": ["gauge_length_mm=25", "area_mm2=20"]}


def table(head, *columns):
    rows = zip(TIME, *columns, strict=True)
    return f"Time (s),{head}\n" + "".join(",".join(f"{x:.6f}" for x in row) + "\n" for row in rows)


@pytest.mark.parametrize("heading", ["Load (N/kg)", "Load [N/mm]", "Load (N, kg)", "Load (N : g)"])
def test_a_mark_within_brackets_divides_no_unit_from_a_name(put, heading):
    """`Load (N/kg)` was read in kilograms."""
    head = f'Extension (mm),"{heading}"'
    try:
        import_file(put("a.csv", table(head, 25 * STRAIN, STRESS)), make_options(**SIZES))
    except Exception as error:
        assert heading in str(error) and "\n" not in str(error)
    else:
        pytest.fail("read")


@pytest.mark.parametrize("word", ["min", "std"])
def test_a_statistic_of_a_load_is_no_load_in_a_unit_of_time(put, word):
    text = table(f"Extension (mm),Load {word} (N)", 25 * STRAIN, 0.02 * STRESS)
    assert f"Load {word} (N)" in refusal(put("a.csv", text), kind="elastomer", **SIZES)


def test_a_load_beside_its_standard_deviation_is_one_test(put):
    text = table("Extension (mm),Load (N),Load std (N)", 25 * STRAIN, 0.02 * STRESS, 0.001 * STRESS)
    recording = import_file(put("a.csv", text), make_options(**SIZES))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=1e-3)
    assert any("left aside: 'Load std (N)'" in note for note in recording.notices)


@pytest.mark.parametrize(("unit", "scale"), [("µe", 1e6), ("µm/m", 1e6), ("um/m", 1e6), ("mm/m", 1e3), ("µin/in", 1e6)])
def test_strain_in_parts_of_a_length_is_read(put, unit, scale):
    recording = import_file(put("a.csv", table(f"Strain ({unit}),Stress (kPa)", scale * STRAIN, STRESS)))
    np.testing.assert_allclose(recording.columns["strain"], STRAIN, atol=1e-6)


@pytest.mark.parametrize(
    ("unit", "factor", "zero"),
    [("bar(g)", 0.01, 0.0), ("bar (g)", 0.01, 0.0), ("bar(a)", 0.01, 1.01325), ("kPa(abs)", 1.0, 101.325), ("mbar (abs.)", 10.0, 1013.25)],
)
@pytest.mark.parametrize("form", ["Pressure ({})", "Pressure [{}]"])
def test_the_zero_of_a_pressure_may_stand_in_brackets_of_its_own(put, form, unit, factor, zero):
    pressure = np.linspace(0.0, 60.0, N)
    text = table(f"{form.format(unit)},Bend angle (deg)", factor * pressure + zero, 1.5 * pressure)
    recording = import_file(put("a.csv", text))
    np.testing.assert_allclose(recording.columns["pressure_kPa"], pressure, atol=1e-3)
    assert not checks(recording)


@pytest.mark.parametrize("channel", ["101 <RES> (OHM)", "203 <FRES> (OHM)", "1 <RES> (ohm)"])
def test_a_channel_of_a_data_logger_has_its_quantity_in_angle_brackets(put, channel):
    columns = np.linspace(0.0, 60.0, N), np.linspace(0.0, 3.0, N), np.linspace(2.0, 2.3, N)
    recording = import_file(put("a.csv", table(f"Elongation (mm),Force (N),{channel}", *columns)), make_options(kind="spring"))
    np.testing.assert_allclose(recording.columns["resistance_ohm"], columns[2], atol=1e-6)


def test_a_corrected_strain_beside_the_strain_is_to_be_looked_at(put):
    text = table("Strain (%),Corrected strain (%),Stress (kPa)", 110 * STRAIN, 100 * STRAIN, STRESS)
    said = checks(import_file(put("a.csv", text)))
    assert any(note.startswith("check: 'Corrected strain (%)'") and "--map strain=3" in note for note in said)


@pytest.mark.parametrize(("second", "scale"), [("Extension (mm),Load (mN)", 1e3), ("Load (N),Extension (mm)", None)])
def test_a_page_with_other_headings_whose_clock_goes_on_is_to_be_looked_at(put, second, scale):
    from fitting.data.importers import import_tests

    columns = np.array([25 * STRAIN, 0.02 * STRESS])
    first = table("Extension (mm),Load (N)", *columns).splitlines()[: 1 + N // 2]
    columns = columns[::-1] if scale is None else columns * [[1.0], [scale]]
    rest = table(second, *columns).splitlines()
    text = "\n".join([*first, rest[0], *rest[1 + N // 2 :]]) + "\n"
    one, two = import_tests(put("a.csv", text), make_options(**SIZES))
    assert not any("the clock goes on" in note for note in checks(one))
    assert any("the clock goes on from the table above to row 23, but a heading is" in note for note in checks(two))
    np.testing.assert_allclose(two.columns["stress_kPa"], STRESS[N // 2 :], atol=1e-3)


def test_a_last_number_that_is_whole_is_no_cut_where_decimals_vary(put):
    temperature = np.linspace(22.0, 95.0, N)
    rows = "".join(f"{t:g},{e:g},{s:g},{k:g}\n" for t, e, s, k in zip(TIME, 10 * STRAIN, STRESS, temperature + 0.1 * (TIME == 0), strict=True))
    text = f"Time (s),Strain (%),Stress (MPa),Temperature (degC)\n{rows}"
    recording = import_file(put("a.csv", text))
    assert len(recording.columns["time_s"]) == N and not any("cut off" in note for note in recording.notices)


@pytest.mark.parametrize("heading", ["log Load (N)", "Load*10 (N)", "Load/1000 (N)", "Load x10 (N)", "Load^2 (N)", "sqrt Force (N)"])
def test_a_function_of_a_load_is_no_load(put, heading):
    text = table(f"Extension (mm),{heading}", 25 * STRAIN, 0.02 * STRESS)
    assert heading in refusal(put("a.csv", text), kind="elastomer", **SIZES)


@pytest.mark.parametrize("unit", ["N", "mN"])
def test_a_row_of_units_among_the_numbers_counts(put, unit):
    """The second page was read in the unit of the first one."""
    lines = [f"{t:.1f},{25 * e:.6f},{0.02 * s:.6f}\n" for t, e, s in zip(TIME, STRAIN, STRESS, strict=True)]
    text = "Time,Extension,Load\ns,mm,N\n" + "".join(lines[:20]) + f"s,mm,{unit}\n" + "".join(lines[20:])
    if unit == "N":
        assert len(import_file(put("a.csv", text), make_options(**SIZES)).columns["strain"]) == N
    else:
        assert "row 23 among the numbers states the unit 'mN', and the heading 'Load (N)'" in refusal(put("a.csv", text), **SIZES)


@pytest.mark.parametrize(("line", "told"), [("Load cell tared", True), ("range changed to mN", True), ("door opened", False)])
def test_a_remark_after_which_numbers_may_count_otherwise_is_to_be_looked_at(put, line, told):
    lines = table("Extension (mm),Load (N)", 25 * STRAIN, 0.02 * STRESS).splitlines()
    recording = import_file(put("a.csv", "\n".join([*lines[:21], line, *lines[21:]]) + "\n"), make_options(**SIZES))
    assert any(repr(line) in note for note in checks(recording)) == told
    assert any(repr(line) in note for note in recording.notices)


def test_a_heading_with_a_minus_is_asked_about(put, follow):
    path = put("a.csv", table("Extension (mm),-Load (N)", 25 * STRAIN, -0.02 * STRESS))
    assert "--scale force=-1" in refusal(path, **SIZES)
    path = put("b.csv", table("Extension (mm),-Load (N)", 25 * STRAIN, 0.02 * STRESS))
    assert any("'-Load (N)' begins with a minus" in note for note in checks(import_file(path, make_options(**SIZES))))


def test_a_springs_position_is_asked_about_and_the_advice_works(put):
    elongation = np.linspace(0.0, 60.0, N)
    text = table("Position (mm),Force (N),Resistance (ohm)", elongation + 142.3, 0.05 * elongation, 2.0 + 0.005 * elongation)
    note, = [n for n in checks(import_file(put("a.csv", text), make_options(kind="spring"))) if "another zero" in n]
    assert "elongation begins at 142.3 mm with a force of 0 N" in note and "--subtract elongation_mm=142.3" in note
    recording = import_file(put("a.csv", text), make_options(kind="spring", subtracted=["elongation_mm=142.3"]))
    np.testing.assert_allclose(recording.columns["elongation_mm"], elongation, atol=1e-5)
    assert not any("another zero" in n for n in checks(recording))


ACTUATOR = "Time (s),Pressure (kPa),Curvature (1/m),R1 (ohm)"
HEATED = (np.linspace(0.0, 60.0, N), 5.0 + 0.1 * TIME, 3.0 + 0.01 * TIME, 3.2 + 0.01 * TIME)


@pytest.mark.parametrize(
    ("heading", "quantity", "why"),
    [
        ("R2 [mV]", "resistance_2", "mV is a unit of voltage"),
        ("R2 [foo]", "resistance_2", "foo is not a known unit"),
        ("R2", "resistance_2", "it states no unit"),
        ("I2 (V)", "current_2", "V is a unit of voltage"),
        ("Spring resistance (mV)", "resistance", "mV is a unit of voltage"),
        ("Pull force (mV)", "force", "mV is a unit of voltage"),
        ("Pos (deg)", "elongation", "deg is a unit of angle"),
    ],
)
def test_a_column_named_like_a_quantity_in_a_unit_of_another_is_asked_about(put, heading, quantity, why):
    """It was left aside without a `check:`, so that a heated spring was taken as cold."""
    path = put("a.csv", table(f"{ACTUATOR.partition(',')[2]},{heading}", *HEATED))
    (asked,) = [note for note in checks(import_file(path, make_options())) if repr(heading) in note]
    assert f"{heading!r} reads like {quantity}, but {why}: it was left aside." in asked
    assert f"--map {quantity}=" in asked and f"--unit {quantity}=..." in asked


def test_a_quantity_in_two_dimensions_is_told_which_was_taken(put):
    path = put("a.csv", table("Extension (mm),Load (N),Load (mV)", 25 * STRAIN, 0.02 * STRESS, STRESS))
    (asked,) = [note for note in checks(import_file(path, make_options(**SIZES))) if "mV" in note]
    assert "'Load (mV)' reads like force, but mV is a unit of voltage: it was left aside, and 'Load (N)' taken" in asked


@pytest.mark.parametrize(("unit", "factor"), [("(mohm)", 1e3), ("[Ω]", 1.0), ("[Ohm]", 1.0), ("(kΩ)", 1e-3)])
def test_resistances_of_springs_in_their_own_units_are_read(put, unit, factor):
    path = put("a.csv", table(f"{ACTUATOR.partition(',')[2]},R2 {unit}", *HEATED[:3], factor * HEATED[3]))
    recording = import_file(path, make_options())
    np.testing.assert_allclose(recording.columns["resistance_2_ohm"], HEATED[3], atol=1e-3)
    assert not any("reads like" in note for note in recording.notices)


@pytest.mark.parametrize("heading", [
    "P (W)", "P (N)", "f (Hz)", "r (mm)", "R2 (-)", "T (N m)", "T (mV)", "Load rate (N/s)", "Colour (mm)",
])
def test_other_quantities_of_the_same_letter_are_not_asked_about(put, heading):
    path = put("a.csv", table(f"{ACTUATOR.partition(',')[2]},{heading}", *HEATED))
    assert not any(repr(heading) in note for note in checks(import_file(path, make_options())))


def test_a_strain_of_many_thousand_percent_is_asked_about_even_where_the_user_states_it(put):
    path = put("a.csv", table("Strain,Stress (kPa)", 127.0 * STRAIN, STRESS))
    recording = import_file(path, make_options(kind="elastomer", units=["strain=1"]))
    assert any("further than any rubber stretches" in check and "--unit strain=1" in check for check in checks(recording))
    recording = import_file(path, make_options(kind="elastomer", units=["strain=percent"]))
    assert not any("further than any rubber" in check for check in checks(recording))


def test_a_pressure_beside_a_stretch_may_be_the_stress(put):
    path = put("a.csv", table("lambda,P_MPa", 1.0 + STRAIN, 1e-3 * STRESS))
    assert "--map stress=P_MPa" in refusal(path)
    recording = import_file(path, make_options(columns=["stress=P_MPa"]))
    assert recording.kind == "elastomer" and abs(recording.columns["stress_kPa"].max() - STRESS.max()) < 1e-3


@pytest.mark.parametrize("heading", ["P (MPa)", "P_MPa"])
def test_a_pressure_beside_a_strain_may_be_the_stress_too(put, heading):
    path = put("a.csv", table(f"Time (s),Strain (%),{heading}", np.arange(len(STRAIN)), 100.0 * STRAIN, 1e-3 * STRESS))
    said = refusal(path)
    option = f"stress={heading}"
    assert f"--map stress={heading!r}" in said or f"--map {option}" in said
    recording = import_file(path, make_options(columns=[option]))
    assert recording.kind == "elastomer" and abs(recording.columns["stress_kPa"].max() - STRESS.max()) < 1e-3
