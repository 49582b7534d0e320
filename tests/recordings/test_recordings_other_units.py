"""Numbers that fit another unit of their dimension far better: the unit is asked for, and nothing else is."""

from pathlib import Path

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.recordings import read_campaign, read_recording, write_recording

SHIPPED = Path(__file__).resolve().parents[2] / "calibration_data" / "examples"
TUBE = ["outer_diameter_mm=10", "wall_thickness_mm=1", "length_mm=56"]
T = np.arange(0.0, 121.0, 1.0)
RAMP = 1.0 - np.abs(np.linspace(-1.0, 1.0, T.size))
STRETCH = 1.0 + 2.0 * RAMP


def questions(path, **options):
    recording = import_file(path, make_options(**options))
    return [text for text in recording.notices if text.startswith("check") and "--unit" in text]


@pytest.fixture
def table(tmp_path):
    def write(**columns):
        rows = zip(*columns.values(), strict=True)
        lines = [",".join(f"{x:.9g}" for x in row) for row in rows]
        path = tmp_path / "raw.csv"
        path.write_text("\n".join([",".join(columns), *lines]) + "\n")
        return path

    return write


def tube(table, unit, factor):
    pressure = {f"Pressure [{unit}]": factor * 40.0 * RAMP}
    return table(**{"Time [s]": T}, **pressure, **{"Length [mm]": 56.0 * (1.0 + 0.4 * RAMP)})


@pytest.mark.parametrize(
    ("unit", "factor", "meant"),
    [
        ("bar", 1.0 / 6.894757, "psi under a heading of bar"),
        ("kPa", 1.0 / 6.894757, "psi under a heading of kPa"),
        ("psi", 1.0, "kPa under a heading of psi"),
        ("psi", 0.01, "bar under a heading of psi"),
        ("kPa", 10.0, "mbar under a heading of kPa"),
    ],
)
def test_a_tubes_pressure_in_another_unit_is_asked_about(table, unit, factor, meant):
    """Psi under [bar] made a silicone 14 times as stiff, and nothing was asked."""
    (asked,) = questions(tube(table, unit, factor), kind="tube", dimensions=TUBE)
    assert meant in asked and "dragon_skin_10_fast has 0.26 MPa" in asked


@pytest.mark.parametrize(("unit", "factor"), [("kPa", 1.0), ("bar", 0.01), ("psi", 1.0 / 6.894757)])
def test_a_tubes_pressure_in_its_unit_is_not_asked_about(table, unit, factor):
    assert not questions(tube(table, unit, factor), kind="tube", dimensions=TUBE)


def test_a_length_that_lags_behind_its_pressure_is_not_asked_about(table):
    """The first rows after a step had hardly stretched, and were taken for a silicone of 1.1 MPa."""
    pressure = np.where(T > 30.0, 20.0, 0.0)
    length = 56.0 * (1.0 + 0.1 * np.where(T > 30.0, -np.expm1(-(T - 30.0) / 2.5), 0.0))
    path = table(**{"Time [s]": T, "Pressure [kPa]": pressure, "Length [mm]": length})
    assert not questions(path, kind="tube", dimensions=TUBE)


def balloon(table, factor):
    """A tube of 0.26 MPa that grows to four times its length while its bore widens, too."""
    stretch = 1.0 + 1.5 * RAMP * 2.0
    pressure = 85.0 * (stretch - stretch**-2) * (10.0**2 - 8.0**2) / 8.0**2 / stretch
    return table(**{"Time [s]": T, "Pressure [kPa]": factor * pressure, "Length [mm]": 56.0 * stretch})


def test_a_tube_that_balloons_is_not_asked_about(table):
    """Where it is longest its stress over its strain is a ninth of its modulus, which would fit as psi."""
    assert not questions(balloon(table, 1.0), kind="tube", dimensions=TUBE)
    (asked,) = questions(balloon(table, 1.0 / 6.894757), kind="tube", dimensions=TUBE)
    assert "psi under a heading of kPa" in asked


def test_a_tube_of_an_unknown_silicone_may_be_as_hard_as_a_coupon(tmp_path):
    """A tube of 4 MPa was asked about, and a coupon was not."""
    stretch = 1.0 + 0.1 * RAMP
    pressure = 4000.0 / 3.0 * (stretch - stretch**-2) * (10.0**2 - 8.0**2) / 8.0**2
    rows = [f"{t:g},{p:.6f},{56 * x:.6f}" for t, p, x in zip(T, pressure, stretch, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,pressure_kPa,length_mm", *rows]) + "\n")
    sizes = 'length_mm = 56\nouter_diameter_mm = 10\nwall_thickness_mm = 1\nmaterial = "fit"\n'
    (tmp_path / "a.toml").write_text(f'kind = "tube"\n[geometry]\n{sizes}')
    assert not [text for text in read_recording(tmp_path / "a.csv").notices if "--unit" in text]


def test_a_unit_that_the_user_states_is_not_asked_about(table):
    path = tube(table, "bar", 1.0 / 6.894757)
    assert not questions(path, kind="tube", dimensions=TUBE, units=["pressure=bar"])


def actuator(table, pressure, angle):
    return table(**{"Time [s]": T}, **pressure, **{"Resistance 2 [ohm]": 3.6 + 0.05 * RAMP}, **angle)


def test_an_actuators_pressure_that_silicone_does_not_bear_is_asked_about(table):
    path = actuator(table, {"Pressure [bar]": 45.0 * RAMP / 6.894757}, {"Bend angle [deg]": 60.0 * RAMP})
    (asked,) = questions(path, kind="actuator", dimensions=TUBE)
    assert "psi under a heading of bar" in asked and "more than silicone bears" in asked


@pytest.mark.parametrize(("unit", "factor"), [("kPa", 0.01), ("bar", 1e-3 / 6.894757)])
def test_an_actuators_pressure_that_does_hardly_anything_is_asked_about(table, unit, factor):
    """Bar under [kPa] passed as 0.45 kPa."""
    path = actuator(table, {f"Pressure [{unit}]": factor * 45.0 * RAMP}, {"Bend angle [deg]": 60.0 * RAMP})
    (asked,) = questions(path, kind="actuator", dimensions=TUBE)
    assert "so that it hardly does anything" in asked and f"under a heading of {unit}" in asked
    if unit == "kPa":
        assert "bar under a heading of kPa" in asked


@pytest.mark.parametrize(
    "pressure",
    [
        0.45 + 0.0 * RAMP,
        0.3 + 0.1 * RAMP,
        0.4 * T / T[-1] + 0.03 * np.random.default_rng(1).normal(size=T.size),
        np.round(0.4 * T / T[-1], 1),
        3.0 * RAMP,
    ],
)
def test_the_zero_of_a_vented_actuators_sensor_is_not_asked_about(table, pressure):
    """An actuator that is only heated is held, drifts slowly, or steps by the resolution of its sensor."""
    path = actuator(table, {"Pressure [kPa]": pressure}, {"Bend angle [deg]": 60.0 * RAMP})
    assert not questions(path, kind="actuator", dimensions=TUBE)


HEAT = np.abs(np.sin(T / 10.0))


@pytest.mark.parametrize(
    ("springs", "asks"),
    [
        ({"Resistance 2 [ohm]": 3.6 - 0.2 * HEAT}, 0),
        ({"Current 2 [A]": 0.5 * HEAT}, 0),
        ({"Resistance 2 [ohm]": 3.6 - 0.05 * HEAT}, 1),
        ({"Resistance 2 [ohm]": 3.6 - 0.4 * np.abs(np.sin(T / 3.0))}, 1),
        ({"Current 2 [A]": 0.0 * T}, 1),
    ],
)
def test_the_pressure_of_a_sealed_tube_that_warms_is_not_asked_about(table, springs, asks):
    """It follows heat. A strain alone changes a resistance less, and a pump does not follow the heat."""
    columns = {"Pressure [kPa]": 0.4 * HEAT, "Bend angle [deg]": 60.0 * HEAT}
    assert len(questions(table(**{"Time [s]": T}, **columns, **springs), kind="actuator", dimensions=TUBE)) == asks


@pytest.mark.parametrize(
    ("unit", "most", "said"),
    [
        ("deg", np.radians(90.0), "Then they reach 90 degrees (on import: --unit bend_angle=rad)"),
        ("rad", 90.0, "Are these degrees under a heading of radian? (on import: --unit bend_angle=deg)"),
    ],
)
def test_an_angle_in_the_other_unit_is_asked_about(table, unit, most, said):
    """90 degrees in radian under [deg] passed as a bend of 1.57 degrees."""
    path = actuator(table, {"Pressure [kPa]": 30.0 * RAMP}, {f"Bend angle [{unit}]": most * RAMP})
    (asked,) = questions(path, kind="actuator", dimensions=TUBE)
    assert said in asked


@pytest.mark.parametrize(("unit", "factor", "asks"), [("deg", 1.0, 0), ("deg", np.pi / 180.0, 1), ("rad", 1.0, 1)])
def test_an_angle_beside_a_curvature_is_compared_with_it(table, unit, factor, asks):
    """Ten degrees are few, yet curvature times length says so as well."""
    curvature = np.radians(10.0) / 0.056 * RAMP
    angle = {f"Bend angle [{unit}]": factor * 10.0 * RAMP, "Curvature [1/m]": curvature}
    path = actuator(table, {"Pressure [kPa]": 30.0 * RAMP}, angle)
    assert len(questions(path, kind="actuator", dimensions=TUBE)) == asks


def coupon(table, factor, unit="%", time=T, heading="Time [s]"):
    stress = 90.0 * (STRETCH - STRETCH**-2)
    return table(**{heading: time, f"Strain [{unit}]": factor * (STRETCH - 1.0), "Stress [kPa]": stress})


def test_a_coupons_strain_as_a_fraction_under_percent_is_asked_about(table):
    (asked,) = questions(coupon(table, 1.0), kind="elastomer")
    assert "strain reaches 0.02" in asked and "Then they reach 2 (on import: --unit strain=1)" in asked
    assert not questions(coupon(table, 100.0), kind="elastomer")
    assert not questions(coupon(table, 1.0, "mm/mm"), kind="elastomer")


def test_a_wires_strain_as_a_fraction_under_percent_is_asked_about(table):
    strain = {"Strain [%]": 0.06 * RAMP + 0.001}
    rest = {"Stress [MPa]": 400.0 * RAMP, "Temperature [degC]": 60.0 + 0.0 * RAMP}
    (asked,) = questions(table(**{"Time [s]": T}, **strain, **rest), kind="wire")
    assert "a modulus of 667 GPa; nitinol has 20 to 90 GPa" in asked and "--unit strain=1" in asked
    strain = {"Strain [%]": 6.0 * RAMP + 0.1}
    assert not questions(table(**{"Time [s]": T}, **strain, **rest), kind="wire")


def test_a_clock_that_counts_milliseconds_under_seconds_is_asked_about(table):
    (asked,) = questions(coupon(table, 100.0, time=1e3 * T), kind="elastomer")
    assert "lasts 33.3 h, with a row every 1000 s" in asked and "Then it lasts 120 s" in asked
    assert "--unit time=ms" in asked
    assert not questions(coupon(table, 100.0, time=1e3 * T), kind="elastomer", units=["time=s"])


@pytest.mark.parametrize("time", [T, 60.0 * T, 1e3 * T + 0.25])
def test_a_slow_clock_that_does_not_look_like_milliseconds_is_not_asked_about(table, time):
    """Two hours with a row every minute, and fractions of seconds, are no milliseconds."""
    assert not questions(coupon(table, 100.0, time=time), kind="elastomer")


def cycle(table, step, hours):
    """A cycle of a coupon with a row every `step` seconds."""
    time = np.round(np.arange(0.0, hours * 3600.0 + 1.0, step))
    strain = 80.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, time.size)))
    return table(**{"Time [s]": time, "Strain [%]": strain, "Stress [kPa]": strain})


@pytest.mark.parametrize("step", [5.0, 10.0, 50.0, 57.6, 60.0, 102.0, 240.0])
def test_a_cycle_of_eight_hours_is_not_asked_about(table, step):
    assert not questions(cycle(table, step, 8.0), kind="elastomer")


@pytest.mark.parametrize("step", [5.0, 10.0, 20.0, 30.0, 50.0, 100.0])
def test_a_minute_of_milliseconds_is_asked_about_at_every_rate(table, step):
    """Loggers of 200, 100, 50 and 33 Hz were not asked about: 60 s are a multiple of their steps in seconds."""
    (asked,) = questions(cycle(table, step, 60e3 / 3600.0), kind="elastomer")
    assert "Are these milliseconds? Then it lasts 60 s" in asked and "--unit time=ms" in asked


def test_a_test_of_creep_over_days_is_not_asked_about(table):
    strain = 0.2 * np.minimum(1.0, T) * (1.0 + 0.05 * np.log1p(T))
    path = table(**{"Time [s]": 600.0 * T, "Strain [mm/mm]": strain, "Stress [kPa]": 30.0 * np.minimum(1.0, T)})
    assert not questions(path, kind="elastomer")


def test_a_chamber_that_is_heated_for_hours_is_not_asked_about(table):
    rest = {"Strain [%]": 4.0 * (1.0 - RAMP) + 0.2, "Stress [MPa]": 100.0 + 0.0 * T, "Temperature [degC]": 20.0 + 80.0 * RAMP}
    assert not questions(table(**{"Time [s]": 150.0 * T}, **rest), kind="wire")
    (asked,) = questions(table(**{"Time [s]": 5e3 * T}, **rest), kind="wire")
    assert "milliseconds" in asked


def test_times_of_day_are_no_milliseconds(tmp_path):
    stamps = [f"2024-03-{1 + h // 24:02d} {h % 24:02d}:00:00" for h in range(T.size)]
    stress = 90.0 * (STRETCH - STRETCH**-2)
    rows = [f"{at},{100 * (x - 1):.6f},{y:.6f}" for at, x, y in zip(stamps, STRETCH, stress, strict=True)]
    (tmp_path / "raw.csv").write_text("\n".join(["Date time,Strain [%],Stress [kPa]", *rows]) + "\n")
    assert not questions(tmp_path / "raw.csv", kind="elastomer")


def test_seconds_under_milliseconds_are_asked_about(table):
    (asked,) = questions(coupon(table, 100.0, heading="Time [ms]"), kind="elastomer")
    assert "121 rows last 0.12 s together" in asked


@pytest.mark.parametrize("units", [[], ["pressure=bar"]])
def test_a_question_of_import_is_asked_in_its_words_until_it_is_settled(table, tmp_path, units):
    """A folder that was written asked of a column that is in kPa by then, also where the user had settled it."""
    path = tube(table, "bar", 1.0 / 6.894757)
    made = import_file(path, make_options(kind="tube", dimensions=TUBE, units=units))
    written = write_recording(made, tmp_path / "made")
    again = [text for text in read_recording(written).notices if "--unit" in text]
    assert len(again) == (0 if units else 1) and all("psi under a heading of bar" in text for text in again)


@pytest.mark.parametrize("modulus_kpa", [10.0, 250.0])
def test_a_soft_coupon_that_is_strained_by_four_percent_is_not_asked_about(table, modulus_kpa):
    stress = {"Stress [kPa]": 0.04 * modulus_kpa * RAMP}
    assert not questions(table(**{"Time [s]": T, "Strain [%]": 4.0 * RAMP}, **stress), kind="elastomer")


@pytest.mark.parametrize("held", ["Strain [%]", "Stress [kPa]"])
def test_hours_of_creep_or_relaxation_after_a_ramp_are_not_asked_about(table, held):
    ramp = np.minimum(1.0, T / 18.0)
    free = ramp * (1.0 + 0.1 * np.log1p(T))
    shapes = {"Strain [%]": 50.0 * free, "Stress [kPa]": 60.0 * free} | {held: 50.0 * ramp}
    assert not questions(table(**{"Time [s]": 180.0 * T}, **shapes), kind="elastomer")


def test_a_burst_under_seconds_is_not_asked_about(table):
    assert not questions(coupon(table, 100.0, time=T / 300.0), kind="elastomer")


def test_a_recording_is_asked_too_as_it_is_read(tmp_path):
    rows = [f"{t:g},{40 * r / 6.894757:.6f},{56 * (1 + 0.4 * r):.6f}" for t, r in zip(T, RAMP, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,pressure_bar,length_mm", *rows]) + "\n")
    (tmp_path / "a.toml").write_text('kind = "tube"\n[geometry]\nlength_mm = 56\n')
    asked = [text for text in read_recording(tmp_path / "a.csv").notices if "psi under a heading of bar" in text]
    assert len(asked) == 1


@pytest.mark.parametrize("kind", ["actuator", "elastomer", "pulled_silicone", "spring", "tube", "wire"])
def test_nothing_is_asked_of_the_shipped_recordings(kind):
    notices = [text for one in read_campaign(SHIPPED / kind).recordings for text in one.notices]
    assert not [text for text in notices if "--unit" in text]


STIFF = {"Strain [%]": 0.53 * RAMP, "Stress [MPa]": 3.1 * RAMP}


@pytest.mark.parametrize("units", [[], ["strain=percent"], ["strain=percent", "stress=MPa"]])
def test_a_coupon_far_stiffer_than_any_rubber_is_asked_about_whatever_is_stated(table, units):
    (asked,) = questions(table(**{"Time [s]": T}, **STIFF), kind="elastomer", units=units)
    assert "strain reaches 0.0053 under 3100 kPa, a modulus of 585 MPa; silicones have 0.05 to 5 MPa, hard rubbers up to 50" in asked
    assert "Then they reach 0.53 (on import: --unit strain=1)" in asked
    assert "Then the modulus is 0.58 MPa (on import: --unit stress=kPa)" in asked


@pytest.mark.parametrize("mend", ["strain=1", "stress=kPa"])
def test_each_unit_that_the_question_names_answers_it(table, mend):
    asked = questions(table(**{"Time [s]": T}, **STIFF), kind="elastomer", units=[mend])
    assert not [text for text in asked if "modulus" in text]


def test_a_strain_in_fractions_is_no_percent_and_a_stress_that_is_made_has_no_unit_to_state(table):
    coupon = {"Strain [mm/mm]": 0.0053 * RAMP, "Stress [MPa]": 3.1 * RAMP}
    (asked,) = questions(table(**{"Time [s]": T}, **coupon), kind="elastomer")
    assert "percent" not in asked and "--unit stress=kPa" in asked
    machine = {"Extension [mm]": 0.0053 * 25.0 * RAMP, "Load [N]": 3.1 * 12.0 * RAMP}
    sizes = ["gauge_length_mm=25", "area_mm2=12"]
    (asked,) = questions(table(**{"Time [s]": T}, **machine), kind="elastomer", dimensions=sizes)
    assert "stress=kPa" not in asked and asked.endswith("Are its units and sizes right? (on import: --unit, --dimension)")


@pytest.mark.parametrize(("modulus_mpa", "most"), [(50.0, 0.3), (45.0, 1.0), (20.0, 4.0), (6.0, 0.25)])
def test_a_hard_rubber_is_not_asked_about(table, modulus_mpa, most):
    coupon = {"Strain [mm/mm]": most * RAMP, "Stress [MPa]": 0.99 * modulus_mpa * most * RAMP}
    assert not questions(table(**{"Time [s]": T}, **coupon), kind="elastomer")


@pytest.mark.parametrize("curvature", [{}, {"Curvature [1/m]": 8.0 * RAMP}])
@pytest.mark.parametrize(("most", "turns"), [(-15743.0, "43.7 turns, with more than 540 in 115 rows"), (650.0, "1.81 turns, with more than 540 in 21 rows")])
def test_an_angle_beyond_a_turn_and_a_half_is_asked_about(table, curvature, most, turns):
    path = actuator(table, {"Pressure [kPa]": 30.0 * RAMP}, {"Bend angle [deg]": most * RAMP, **curvature})
    (asked,) = questions(path)
    assert turns in asked and asked.endswith("Few actuators bend so far: are these readings right, and their unit (on import: --unit bend_angle=...)?")


def test_one_reading_beyond_a_turn_and_a_half_is_asked_about_and_a_curl_is_not(table):
    angle = np.where(T == 60.0, 650.0, 80.0 * RAMP)
    (asked,) = questions(actuator(table, {"Pressure [kPa]": 30.0 * RAMP}, {"Bend angle [deg]": angle}))
    assert "with more than 540 in 1 row." in asked
    assert not questions(actuator(table, {"Pressure [kPa]": 30.0 * RAMP}, {"Bend angle [deg]": 500.0 * RAMP}))
