"""Numbers that are far from any that such a specimen has: their unit is asked for, with the one that is meant."""

from pathlib import Path

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.recordings import read_recording
from pneusma_jax.calibration import available, examples, load_calibration, unknown
from pneusma_jax.calibration.plausible import LIMITS, implausible, questions
from pneusma_jax.calibration.toml import parse_calibration
from pneusma_jax.errors import InputError

WIRE = "time_s,strain,stress_MPa,temperature_degC\n"
STAND = "time_s,elongation_mm,force_N,resistance_ohm\n"


@pytest.mark.parametrize(
    ("name", "dimension", "written", "unit", "said"),
    [
        ("E_a", "pressure", 85.0, "Pa", "85 Pa cannot be, E_a lies in 1 to 500 GPa; did you mean 85 GPa?"),
        ("E_a", "pressure", 85.0, "MPa", "did you mean 85 GPa?"),
        ("G_m", "pressure", 20.0, "MPa", "did you mean 20 GPa?"),
        ("E_m", "pressure", 30.0, "MPa", "did you mean 30 GPa?"),
        ("G_m", "pressure", 3.0, "kPa", "did you mean 3 GPa?"),
        ("mu", "pressure", 0.085, "Pa", "did you mean 0.085 MPa?"),
        ("mu", "pressure", 85.0, "GPa", "did you mean 85 kPa?"),
        ("wire_diameter", "length", 0.00025, "mm", "did you mean 0.00025 m?"),
        ("wire_diameter", "length", 0.25, "m", "did you mean 0.25 mm?"),
        ("outer_diameter", "length", 10.0, "m", "did you mean 10 mm?"),
        ("T_ambient", "temperature", 298.0, "degC", "T_ambient lies in -100 to 200 degC; did you mean 298 K?"),
        ("poisson_ratio", "number", 45.0, "1", "poisson_ratio lies in 0 to 0.5; did you mean 45 percent?"),
        ("density", "density", 1.07, "kg/m3", "did you mean 1.07 g/cm3?"),
        ("gamma_L", "number", 10.0, "1", "did you mean 10 percent?"),
        ("standard_tension.strain_max", "number", 150.0, "1", "did you mean 150 percent?"),
    ],
)  # fmt: skip
def test_a_magnitude_of_another_unit_is_told_with_the_unit_that_is_meant(name, dimension, written, unit, said):
    assert said in implausible(name, dimension, written, unit)


@pytest.mark.parametrize(
    ("name", "dimension", "written", "unit"),
    [
        ("thickness", "length", 0.005, "mm"), ("outer_diameter", "length", 0.3, "mm"), ("gauge_length", "length", 0.3, "mm"),
        ("gamma_L", "number", 0.0, "1"), ("eps_L", "number", 0.0, "percent"), ("mu", "pressure", 0.05, "kPa"), ("mu", "pressure", 85.0, "Pa"),
        ("p_1", "pressure", 2.5, "GPa"), ("c_30", "pressure", 3.0, "GPa"), ("T_mid", "temperature", 420.0, "degC"), ("wire_diameter", "length", 4.0, "um"),
    ],
)  # fmt: skip
def test_an_unusual_magnitude_is_not_refused(name, dimension, written, unit):
    """A film of 5 um was refused: did you mean 0.005 m?"""
    assert not implausible(name, dimension, written, unit)


def test_an_unusual_dimension_is_asked_about(put):
    read = read_recording(put(STAND + "0,0,0,3.7\n1,1,0.01,3.6\n", 'kind = "spring"\n[geometry]\nwire_diameter_um = 4\n'))
    (said,) = [note for note in read.notices if "unusual" in note]
    assert said == "check: [geometry] wire_diameter_mm: 0.004 mm is unusual, wire_diameter lies in 0.005 to 20 mm mostly; is the unit right?"
    read = read_recording(put(STAND + "0,0,0,3.7\n1,1,0.01,3.6\n", 'kind = "spring"\n[geometry]\nwire_diameter_um = 250\n'))
    assert not [note for note in read.notices if "unusual" in note]


def test_a_film_of_five_micrometres_is_imported_and_asked_about(tmp_path):
    rows = "".join(f"{t},{0.1 * t},{0.001 * t}\n" for t in range(20))
    (tmp_path / "a.csv").write_text(f"Time (s),Displacement (mm),Force (N)\n{rows}")
    sizes = ["thickness_mm=0.005", "width_mm=2", "gauge_length_mm=10"]
    recording = import_file(tmp_path / "a.csv", make_options(kind="elastomer", dimensions=sizes))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 100.0 * np.arange(20), rtol=1e-9)
    (said,) = [note for note in recording.notices if "unusual" in note]
    assert said.startswith("check: --dimension thickness_mm: 0.005 mm is unusual")


def test_every_shipped_number_is_possible_and_usual_ones_are():
    for name in (*available(), *unknown(), *examples()):
        load_calibration(name)
    for dimension, of in LIMITS.items():
        for name, limits in of.items():
            assert limits.least <= limits.usual[0] < limits.usual[1] <= limits.most, (dimension, name)


def changed(name, old, new):
    from importlib import resources

    text = (resources.files("calibration_data") / f"{name}.toml").read_text()
    assert old in text
    return text.replace(old, new)


def test_a_table_with_a_modulus_in_pascal_is_refused_in_one_line(tmp_path):
    """85 Pa for a nitinol wire was taken."""
    text = changed("niti_wire", 'E_a = {value = 70.0, unit = "GPa"', 'E_a = {value = 85.0, unit = "Pa"')
    text = text.replace("prior = {mean = 70.0, sd = 12.0, min = 25.0, max = 120.0}", "prior = {mean = 85.0, sd = 12.0}")
    with pytest.raises(InputError, match=r"a\.toml: key 'E_a': 85 Pa cannot be, .* did you mean 85 GPa\?") as caught:
        parse_calibration(text, tmp_path / "a.toml")
    assert "\n" not in str(caught.value)
    fitted = text.replace('unit = "Pa", status = "assumed"', 'unit = "Pa", status = "fitted"')
    assert parse_calibration(fitted, tmp_path / "a.toml").values()["E_a"] == 85.0


def test_an_unusual_constant_of_a_named_table_is_asked_about(put, tmp_path):
    """A modulus a thousand times off passed without a word."""
    text = changed("krl35", 'G_a = {value = 8.25, unit = "GPa"', 'G_a = {value = 0.00825, unit = "GPa"')
    (tmp_path / "ours.toml").write_text(text.replace(", prior = {mean = 8.25, sd = 2.475, min = 1.5, max = 18.15}", ""))
    sidecar = 'kind = "spring"\n[geometry]\nalloy = "{}"\n'
    rows = STAND + "0,0,0,3.7\n1,1,0.1,3.6\n"
    (said,) = [note for note in read_recording(put(rows, sidecar.format("ours.toml"))).notices if "unusual" in note]
    assert "ours.toml: G_a: 0.00825 GPa is unusual, G_a lies in 0.15 to 200 GPa mostly; is the unit right?" in said
    assert not [note for note in read_recording(put(rows, sidecar.format("krl35"))).notices if "unusual" in note]


def test_no_shipped_number_is_asked_about():
    for name in (*available(), *unknown(), *examples()):
        assert questions(load_calibration(name).quantities) == [], name


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("wire_diameter_mm = 0.00025", "[geometry] wire_diameter_mm: 0.00025 mm cannot be"),
        ("wire_diameter_m = 0.25", "did you mean 0.25 mm?"),
        ("mandrel_diameter_mm = 0.0009", "did you mean 0.0009 m?"),
        ("initial_pitch_um = 0.269", "did you mean 0.269 mm?"),
    ],
)
def test_a_dimension_in_another_unit_is_refused_in_one_line(put, key, said):
    with pytest.raises(InputError) as caught:
        read_recording(put(STAND + "0,0,0,3.7\n1,1,0.1,3.6\n", f'kind = "spring"\n[geometry]\n{key}\n'))
    assert said in str(caught.value) and "run_1.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_a_dimension_of_an_import_in_another_unit_is_refused():
    with pytest.raises(InputError, match=r"--dimension gauge_length_mm: 0.025 mm cannot be, .* did you mean 0.025 m\?"):
        make_options(dimensions=["gauge_length_mm=0.025"])
    assert make_options(dimensions=["gauge_length_mm=25", "area_mm2=18"]).dimensions["area_mm2"] == 18.0


@pytest.mark.parametrize(
    ("text", "kind"),
    [("[geometry]\nG_m = 85\n", "alloy"), ("[alloy]\nE_a = 85\n", "alloy"), ("[geometry]\nE_a_GPa = 85\n", "alloy"), ("[material]\nmu_kPa = 85\n", "material"), ("c_10 = 3\n", "material")],
)
def test_a_modulus_beside_the_recordings_is_told_where_it_stands(put, text, kind):
    with pytest.raises(InputError) as caught:
        read_recording(put(STAND + "0,0,0,3.7\n1,1,0.1,3.6\n", f'{text}\n'))
    assert f'{kind} = "FILE.toml" under [geometry]' in str(caught.value) and "\n" not in str(caught.value)


def test_the_table_that_the_page_on_files_shows_is_read(tmp_path):
    page = (Path(__file__).resolve().parents[2] / "docs" / "files.md").read_text()
    (shown,) = (block for block in page.split("```") if block.startswith("toml\nschema"))
    assert parse_calibration(shown.removeprefix("toml\n"), tmp_path / "ours.toml").values()["mu"] == 85e3


@pytest.mark.parametrize("alloy", ["", '[geometry]\nalloy = "fit"\n'])
def test_temperatures_that_are_rather_kelvin_are_asked_about(put, alloy):
    rows = "".join(f"{t},{0.001 * t},200,{360 - 5 * t}\n" for t in range(13))
    (said,) = [note for note in read_recording(put(WIRE + rows, f'kind = "wire"\n{alloy}')).notices if "kelvin" in note]
    assert said.startswith("check: temperatures of 300 to 360 degC in every row of temperature_degC") and "temperature_K" in said
    read = read_recording(put(WIRE.replace("degC", "K") + rows, f'kind = "wire"\n{alloy}'))
    np.testing.assert_allclose(read.columns["temperature_degC"][[0, -1]], [86.85, 26.85])


def test_temperatures_of_an_alloy_that_transforms_lower_are_refused_as_kelvin(put):
    rows = "".join(f"{t},{0.001 * t},200,{360 - 5 * t}\n" for t in range(13))
    with pytest.raises(InputError, match=r"run_1\.csv, column temperature_degC: temperatures of 300 to 360 degC .* temperature_K"):
        read_recording(put(WIRE + rows, 'kind = "wire"\n[geometry]\nalloy = "niti_wire"\n'))


def test_temperatures_in_degC_that_begin_at_room_temperature_are_none(put):
    rows = "".join(f"{t},{0.001 * t},200,{20 + 20 * t}\n" for t in range(13))
    assert read_recording(put(WIRE + rows, 'kind = "wire"\n')).columns["temperature_degC"].max() == 260.0


@pytest.mark.parametrize(("factor", "refused"), [(1.0, False), (5.0, False), (0.2, False), (1e3, True), (1e-3, True)])
def test_resistances_in_another_unit_are_refused_though_the_alloy_is_unknown(put, factor, refused):
    sidecar = 'kind = "spring"\n[geometry]\nalloy = "fit"\nwire_diameter_mm = 0.25\nmandrel_diameter_mm = 0.9\ninitial_pitch_mm = 0.269\nactive_coils = 52\n'
    path = put(STAND + f"0,0,0,{3.7 * factor}\n1,1,0.1,{3.6 * factor}\n", sidecar)
    if not refused:
        assert read_recording(path).columns["resistance_ohm"][0] == pytest.approx(3.7 * factor)
        return
    unit = "mohm" if factor > 1.0 else "kohm"
    with pytest.raises(InputError, match=rf"row 2, column resistance_ohm: .* 52 coils .*resistance_{unit} heads the column, or on import --unit resistance={unit}"):
        read_recording(path)


def pressures(tmp_path, scale, unit="Pa"):
    """A pressed tube whose pressures are written in a unit; ordinary ones are 0 to 60 kPa."""
    kilopascal = [60.0 * (1 - abs(t - 20) / 20) for t in range(41)]
    rows = "".join(f"{t},{scale * p:.6g},{60 + 0.05 * p:.6g}\n" for t, p in enumerate(kilopascal))
    (tmp_path / "tube.csv").write_text(f"Time (s),Pressure ({unit}),Length (mm)\n{rows}")
    return [note for note in import_file(tmp_path / "tube.csv", make_options()).notices if "mostly it is" in note]


def test_pressures_of_a_few_pascal_are_asked_about_with_the_largest_in_kilopascal(tmp_path):
    """A tube with 60 kPa under the heading Pa was imported without a word."""
    (said,) = pressures(tmp_path, 1.0)
    assert said == (
        "check: pressure_kPa: the largest pressure is 0.06 kPa, and mostly it is 0.2 kPa or more; is its unit right?"
        " Usual would be 1000 times as much, 60 kPa (on import: --unit pressure=...)"
    )
    assert not pressures(tmp_path, 1000.0) and not pressures(tmp_path, 1.0, "kPa") and not pressures(tmp_path, 0.06, "kPa")


SLOW = np.sin(np.linspace(0.0, 3.0, 40)) ** 2
HEADS = {
    "spring": ("time_s,elongation_mm,force_N,resistance_ohm,current_A", (40.0, 2.0, 3.5, 0.8)),
    "tube": ("time_s,pressure_kPa,length_mm", (60.0, 62.0)),
    "actuator": ("time_s,pressure_kPa,curvature_1pm,resistance_1_ohm,current_1_A", (40.0, 50.0, 3.5, 0.8)),
    "elastomer": ("time_s,strain,stress_kPa", (0.9, 90.0)),
}
COLUMNS = [(kind, k + 1) for kind, (_, largest) in HEADS.items() for k in range(len(largest)) if (kind, k) != ("elastomer", 0)]


def magnitudes_asked(put, kind, scale, sidecar="", shape=SLOW):
    """Questions about magnitudes of a recording whose columns are those of an ordinary specimen, times factors."""
    head, largest = HEADS[kind]
    rows = [",".join([str(t), *(f"{most * scale.get(k, 1.0) * max(x, 0.01):.9g}" for k, most in enumerate(largest, 1))]) for t, x in enumerate(shape)]
    notices = read_recording(put(head + "\n" + "\n".join(rows) + "\n", f'kind = "{kind}"\n{sidecar}')).notices
    return [note for note in notices if "mostly it is" in note]


FIT = '[geometry]\nalloy = "fit"\n'


@pytest.mark.parametrize(("kind", "column"), COLUMNS)
@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_a_reading_a_thousand_times_off_is_asked_about_or_refused(put, kind, column, factor):
    name = HEADS[kind][0].split(",")[column]
    sidecar = FIT if kind in ("spring", "actuator") else ""
    try:
        asked = magnitudes_asked(put, kind, {column: factor}, sidecar)
    except InputError as error:
        assert factor > 1.0 and (name == "pressure_kPa" or name.startswith("current"))
        assert "is the unit right" in str(error) or "is its unit right (such as mA" in str(error)
        return
    if factor == 1.0 or (name == "stress_kPa" and factor > 1.0):
        assert asked == []  # an import asks about a stress that no rubber bears
        return
    (said,) = asked
    assert said.startswith(f"check: {name}: the largest ") and "Usual would be " in said


@pytest.mark.parametrize("factor", [0.1, 10.0])
@pytest.mark.parametrize("kind", ["spring", "tube", "actuator", "elastomer"])
def test_readings_of_a_specimen_ten_times_smaller_or_larger_are_not_asked_about(put, kind, factor):
    sidecar = FIT if kind in ("spring", "actuator") else ""
    assert magnitudes_asked(put, kind, dict.fromkeys(range(1, 5), factor), sidecar) == []


def test_a_column_at_rest_is_not_asked_about(put):
    """A load cell without a load shows its noise, and a tube without pressure that of its sensor."""
    noise = np.abs(np.random.default_rng(0).standard_normal(40))
    assert magnitudes_asked(put, "tube", {1: 1e-5}, shape=0.3 + 0.7 * noise / noise.max()) == []
    assert magnitudes_asked(put, "tube", {1: 0.0}) == []


def test_resistances_of_a_stated_wire_are_bounded_by_its_sizes_alone(put):
    thin = '[geometry]\nalloy = "fit"\nwire_diameter_mm = 0.02\nmandrel_diameter_mm = 0.2\ninitial_pitch_mm = 0.03\nactive_coils = 800\n'
    scale = {1: 0.5, 2: 0.01, 3: 400.0}
    assert magnitudes_asked(put, "spring", scale, thin, 0.8 + 0.2 * SLOW) == []
    assert [note.split(":")[1] for note in magnitudes_asked(put, "spring", scale, FIT)] == [" resistance_ohm"]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("resistance_ohm", 1e-4, "76.8 ohm; is its unit right, are the sizes?"),  # a thousandth in mohm, and 0.1 in kohm
        ("resistance_ohm", 3e-3, "(such as kohm: resistance_kohm heads the column, or on import --unit resistance=kohm), are the"),
        ("resistance_ohm", 3e3, "(such as mohm: resistance_mohm heads the column, or on import --unit resistance=mohm), are the"),
        ("elongation_mm", 2e4, "(such as um: elongation_um heads the column"),
        ("force_N", 2e3, "(such as mN: force_mN heads the column"),
        ("current_A", 150.0, "melts below 100 A; is its unit right (such as mA: current_mA heads the column, or on import --unit current=mA)?"),
        ("current_A", -150.0, "-150 cannot be: the wire of a spring melts below 100 A"),
    ],
)
def test_a_unit_is_offered_only_where_the_number_could_be_in_it(put, name, value, said):
    """Every resistance was asked about in mohm, and a current of 150 A was taken."""
    rows = {"time_s": 1.0, "elongation_mm": 1.0, "force_N": 0.1, "resistance_ohm": 3.1, "current_A": 0.3, name: value}
    sizes = 'kind = "spring"\n[geometry]\nalloy = "fit"\nwire_diameter_mm = 0.25\nactive_coils = 52\nmandrel_diameter_mm = 0.9\n'
    text = ",".join(rows) + "\n" + ",".join(f"{x:g}" for x in rows.values()) + "\n"
    with pytest.raises(InputError) as caught:
        read_recording(put(text, sizes))
    assert said in str(caught.value) and f"row 2, column {name}" in str(caught.value)


def test_a_spring_of_an_actuator_is_asked_by_the_name_of_its_own_column(put):
    text = "time_s,pressure_kPa,curvature_1pm,current_2_A\n0,1,1,150\n1,2,2,150\n"
    with pytest.raises(InputError, match="current_2_mA heads the column, or on import --unit current_2=mA"):
        read_recording(put(text, 'kind = "actuator"\n'))
