"""The raw files of other laboratories: each becomes a recording with the published numbers, or says why it cannot."""

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.recordings import read_recording, recordings_folder, write_recording
from pneusma_jax.errors import InputError


def said(recording, words):
    return any(words in text for text in recording.notices)


def refusal(path, options=None):
    with pytest.raises(InputError) as caught:
        import_file(path, options)
    message = str(caught.value)
    assert "\n" not in message and path.name in message
    return message


def ranges(recording):
    return {name: (values.min(), values.max()) for name, values in recording.columns.items()}


@pytest.mark.parametrize(
    ("file", "rows", "strain", "stress_kPa", "specimen"),
    [
        ("Dragon Skin 10 MEDIUM.csv", 457, (0.0445783731527225, 10.4090853668586), (1.98801196097173, 1843.79103221798), "DragonSkin10"),
        ("Dragon Skin 30.csv", 311, (0.0446, 7.09091), (17.36, 4154.91), "DragonSkin30"),
        ("Ecoflex 00-30.csv", 705, (0.06795, 16.06818), (1.49, 1359.49), "EcoFlex30"),
    ],
)
def test_tensile_database(measured, tmp_path, file, rows, strain, stress_kPa, specimen):
    recording = import_file(measured(f"soft_robotics_materials/{file}"))
    assert (recording.kind, len(recording), recording.specimen, recording.real) == ("elastomer", rows, specimen, True)
    assert ranges(recording)["strain"] == pytest.approx(strain, rel=1e-12)
    assert ranges(recording)["stress_kPa"] == pytest.approx(stress_kPa, rel=1e-12)
    assert "10.1089/soro.2019.0115" in recording.source["citation"] and "ODbL" in recording.source["licence"]
    assert said(recording, "Speed (mm/min) 450") and said(recording, "crosshead") and said(recording, "'True Strain'")
    again = read_recording(write_recording(recording, tmp_path))
    np.testing.assert_array_equal(again.columns["stress_kPa"], recording.columns["stress_kPa"])
    assert again.source["raw_file"] == file and len(again.source["raw_sha256"]) == 64
    assert again.source["notes"] == recording.notices


def test_a_clock_that_was_reset_is_set_aside(measured, tmp_path):
    recording = import_file(measured("soft_robotics_materials/Ecoflex 00-30.csv"))
    assert not recording.has("time") and "clock_as_logged" in recording.columns
    assert said(recording, "the clock goes back 2 times (row 426, 516)")
    again = read_recording(write_recording(recording, tmp_path))
    assert again.known_columns == ["strain", "stress_kPa"]
    smooth = import_file(measured("soft_robotics_materials/Dragon Skin 10 MEDIUM.csv"))
    assert ranges(smooth)["time_s"] == pytest.approx((0.2, 45.8))


def test_tensile_database_gives_the_published_moduli(measured):
    # The provenance note's neo-Hookean moduli of Dragon Skin 10 as the range grows to stretch 2 and 3: 56, 79 kPa.
    recording = import_file(measured("soft_robotics_materials/Dragon Skin 10 MEDIUM.csv"))
    stretch, stress = 1.0 + recording.si("strain"), recording.si("stress")
    for limit, modulus in ((2.0, 56e3), (3.0, 79e3)):
        part = stretch <= limit
        shape = stretch[part] - stretch[part] ** -2
        assert shape @ stress[part] / (shape @ shape) == pytest.approx(modulus, rel=0.02)


def test_compression(measured):
    at_half = []
    for repeat in range(1, 6):
        recording = import_file(measured(f"tissue_phantoms/EF30_0T/EF30_0T_A{repeat}.csv"))
        assert (recording.kind, len(recording), recording.specimen) == ("elastomer", 1202, "EF30_0T_A")
        assert ranges(recording)["strain"] == pytest.approx((-0.666669, 0.0), abs=1e-6)
        assert recording.columns["time_s"][-1] == pytest.approx(120.021)
        at_half.append(np.interp(0.5, -recording.columns["strain"], -recording.columns["stress_kPa"]))
    noted = [106.0, 106.8, 107.4, 108.3, 108.6]  # kPa at -50 %, in the provenance note, last digit cut
    np.testing.assert_array_equal(np.floor(10 * np.array(at_half)) / 10, noted)
    assert recording.source["licence"] == "CC BY 4.0" and "Dawood" in recording.source["citation"]
    other = import_file(measured("tissue_phantoms/EF30_0T/EF30_0T_B5.csv"))
    assert other.specimen == "EF30_0T_B" and len(other) == 1202


@pytest.mark.parametrize(
    ("load", "rows", "strain", "temperature"),
    [
        (7, 351, (0.00062137, 0.00771524), (-69.9, 29.7)),
        (50, 283, (0.00097444, 0.01907187), (-70.2, 19.7)),
        (150, 314, (0.0028250, 0.0347844), (-70.04, 30.0)),
        (200, 278, (0.0056031, 0.0399500), (-60.1, 29.8)),
    ],
)
def test_thermal_cycles_of_a_shape_memory_alloy(measured, load, rows, strain, temperature):
    recording = import_file(measured(f"sma_react/cal_sample_1/{load} MPa.txt"))
    assert (recording.kind, len(recording), recording.name) == ("wire", rows, f"{load}_MPa")
    assert ranges(recording)["strain"] == pytest.approx(strain, rel=1e-4)
    assert ranges(recording)["temperature_degC"] == pytest.approx(temperature)
    assert np.median(recording.columns["stress_MPa"]) == pytest.approx(load, rel=0.01)
    assert said(recording, "taken as a fraction") and said(recording, "no clock") and recording.specimen == "cal_sample_1"
    assert "BSD" in recording.source["licence"] and "10.1177/00219983221144499" in recording.source["citation"]
    assert recording.geometry == {"alloy": "fit"}
    slower = import_file(recording.path, make_options(interval_s=2.0, units=["strain=percent"], specimen="N1"))
    assert slower.columns["time_s"][-1] == 2.0 * (rows - 1) and slower.specimen == "N1"
    np.testing.assert_allclose(slower.columns["strain"], recording.columns["strain"] / 100)


def test_a_log_of_many_cycles_needs_the_specimens_sizes(measured):
    path = measured("sma_react/preprocessor_samples/isobaric_7cycle.txt")
    message = refusal(path)
    assert "gauge_length_mm" in message and "area_mm2" in message and "2431 MPa" in message
    assert "area_mm2" in refusal(path, make_options(dimensions=["gauge_length_mm=100"]))
    recording = import_file(path, make_options(dimensions=["gauge_length_mm=100", "diameter_mm=2"]))
    assert (recording.kind, len(recording)) == ("wire", 1176)
    assert ranges(recording)["temperature_degC"] == (-30.3, 50.7)
    assert ranges(recording)["strain"] == pytest.approx((-0.00176, 0.26373))
    assert recording.columns["stress_MPa"].max() == pytest.approx(1108.436 / np.pi, rel=1e-9)
    time = recording.columns["time_s"]
    assert time[0] == pytest.approx(3.6) and time[-1] == pytest.approx(5.589 * 3600, abs=3.6)
    assert (np.diff(time) > 0).all() and said(recording, "407 rows repeat the time")
    assert said(recording, "chamber's temperature") and said(recording, "its own would be 0.456 mm2")


def test_a_bent_beam_is_no_wire_unless_its_surface_is_asked_for(measured):
    path = measured("sma_react/preprocessor_samples/mts_3cycle.txt")
    message = refusal(path)
    assert "three-point bending" in message and "span_mm" in message and "depth_mm" in message
    recording = import_file(path, make_options(dimensions=["span_mm=40", "depth_mm=3"]))
    assert len(recording) == 2882 and ranges(recording)["temperature_degC"] == (-31.2, 105.7)
    assert recording.columns["stress_MPa"].max() == pytest.approx(204.556)
    assert recording.columns["strain"].max() == pytest.approx(6 * 3 * 4.129 / 40**2)
    assert said(recording, "'FlexureStrain (mm/mm)' is blank in every row") and said(recording, "bent beam")


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("sma_react/preprocessor_samples/fluke_3cycle.csv", "multimeter's temperature log"),
        ("sma_react/preprocessor_samples/DSC.txt", "calorimeter scan (DSC)"),
        ("viscoelastic/shear_relaxation_1.xlsx", "simple shear"),
        ("viscoelastic/shear_relaxation_2.xlsx", "simple shear"),
        ("bending_actuators/experiment.csv", "marker angles of bending actuators"),
        ("bending_actuators/simulation_by_the_authors.csv", "marker angles of bending actuators"),
        ("hyperelastic/Treloar_1944/ET/stress_stretch.txt", "equibiaxial tension; an elastomer recording is uniaxial"),
        ("hyperelastic/Meunier_2008/PS/stress_stretch.txt", "pure shear; an elastomer recording is uniaxial"),
        ("hyperelastic/micro_mechanical_model/James_1975/UT/stress.txt", "one column of numbers"),
        ("sma_react/cal_sample_1/Data Source.txt", "no table of numbers"),
        ("README.md", "no table of numbers"),
    ],
)
def test_files_that_are_recognised_and_refused(measured, file, words):
    assert words in refusal(measured(file))


@pytest.mark.parametrize(("rate", "rows", "peak"), [("01", 79, 36), ("03", 83, 47), ("05", 86, 53)])
def test_loading_and_unloading(measured, rate, rows, peak):
    recording = import_file(measured(f"viscoelastic/loading_2d0_unloading_0d{rate}.xlsx"))
    assert (recording.kind, len(recording), recording.specimen) == ("elastomer", rows, "viscoelastic")
    assert recording.columns["strain"][0] == 0.0 and recording.columns["strain"].max() == pytest.approx(1.0, abs=0.003)
    assert recording.columns["stress_kPa"].max() == pytest.approx(peak, abs=0.5)
    loading = slice(0, int(np.argmax(recording.columns["strain"])) + 1)
    speed = np.polyfit(recording.columns["time_s"][loading], recording.columns["strain"][loading], 1)[0]
    assert speed == pytest.approx(int(rate) / 100, rel=0.02)
    assert said(recording, "taken as kPa") and recording.source["licence"].startswith("MIT")
    stiff = import_file(recording.path, make_options(units=["stress=MPa"]))
    np.testing.assert_allclose(stiff.columns["stress_kPa"], 1e3 * recording.columns["stress_kPa"])


@pytest.mark.parametrize(
    ("author", "rows", "strain", "stress_kPa"),
    [
        ("Treloar_1944", 24, (0.02, 6.6), (25.5, 6317.6)),
        ("Kawabata_1981", 19, (0.0, 2.7), (0.0, 1117.0)),
        ("Meunier_2008", 33, (-0.51, 1.17), (-1387.8, 797.2)),
    ],
)
def test_tables_of_the_literature(measured, author, rows, strain, stress_kPa):
    recording = import_file(measured(f"hyperelastic/{author}/UT/stress_stretch.txt"))
    assert (recording.kind, len(recording), recording.specimen) == ("elastomer", rows, f"{author}_UT")
    assert ranges(recording)["strain"] == pytest.approx(strain)
    assert ranges(recording)["stress_kPa"] == pytest.approx(stress_kPa)
    assert said(recording, "taken as MPa") and not recording.has("time")


@pytest.mark.slow
def test_every_other_file_is_imported_or_refused_in_one_line():
    folder = recordings_folder()
    if folder is None:
        pytest.skip("measured recordings are not here (PNEUSMA_RECORDINGS, or ../shared/recordings)")
    outcomes = {"imported": 0, "refused": 0}
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in (".csv", ".txt", ".xlsx"):
            try:
                import_file(path)
                outcomes["imported"] += 1
            except InputError as error:
                assert "\n" not in str(error) and str(path) in str(error)
                outcomes["refused"] += 1
    assert outcomes["imported"] >= 23 and outcomes["refused"] >= 10
