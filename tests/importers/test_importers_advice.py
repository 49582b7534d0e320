"""What a refusal advises of columns that were not recognised, and what is no longer asked of those that are."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, import_tests, make_options

ROWS = np.arange(12.0)


def table(heads, *columns, mark=","):
    return heads + "\n" + "".join(mark.join(f"{x:.6g}" for x in row) + "\n" for row in np.transpose(columns))


def test_an_angle_without_a_unit_is_advised_as_a_bend_angle(put):
    text = table("time;angle;pressure;set_point", ROWS, 3 * ROWS, ROWS, ROWS, mark=";")
    message = refusal(put("a.csv", text))
    assert "by their units or names perhaps --map bend_angle=angle, or head them 'Bend angle (deg)'" in message


@pytest.mark.parametrize(
    ("heads", "never"),
    [
        ("zz,Gauge Length (mm),yy", "elongation"), ("zz,Grain size (um),yy", "elongation"),
        ("zz,Gap (um),yy", "elongation"), ("zz,phase_deg,yy", "bend_angle"),
        ("zz,Post Treatment Temperature (C),yy", "temperature"), ("zz,Normal stress (Pa),yy", "stress"),
        ("zz,Yield Strength (MPa),yy", "stress"),
    ],
)  # fmt: skip
def test_no_size_and_no_phase_is_advised_as_a_measured_quantity(put, heads, never):
    message = refusal(put("a.csv", table(heads, ROWS, ROWS, ROWS)))
    assert f"--map {never}=" not in message


def test_the_one_column_in_mpa_is_advised_as_stress_and_the_one_in_percent_as_strain(put):
    heads = "LOAD (N),Time (s),AMT(degC),AMD (%),AMS（MPa）"
    message = refusal(put("a.csv", table(heads, 0 * ROWS + 2, ROWS, 20 + ROWS, ROWS, ROWS)))
    assert "--map stress=AMS（MPa） --map strain='AMD (%)'" in message.replace("'AMS（MPa）'", "AMS（MPa）")
    two = refusal(put("b.csv", table(heads + ",B (MPa)", ROWS, ROWS, ROWS, ROWS, ROWS, ROWS)))
    assert "--map stress=" not in two


@pytest.mark.parametrize("unit", ["unitless", "dimensionless", "-"])
def test_a_strain_without_a_dimension_is_a_fraction(read, unit):
    recording = read(table(f"Engineering Strain ({unit}),Stress (kPa)", ROWS / 20, 40 * ROWS))
    np.testing.assert_allclose(recording.columns["strain"], ROWS / 20)
    assert not checks(recording)


def test_a_unit_that_is_not_known_contradicts_no_stated_one(read):
    text = table("Time (s),Strain (%),Stress (MPa),tempg [stC]", ROWS, ROWS / 20, 30 * ROWS, 0 * ROWS + 25)
    recording = read(text, columns=["temperature=tempg [stC]"], units=["temperature=degC"])
    assert "'tempg [stC]' states stC, which is no known unit: --unit temperature=degC was used" in recording.notices
    known = read(text.replace("stC", "K"), columns=["temperature=tempg [K]"], units=["temperature=degC"])
    assert "check: 'tempg [K]' states K, and --unit temperature=degC another unit: degC was used" in known.notices


def test_two_columns_that_differ_by_their_rounding_are_not_asked_about(read):
    first = np.round(ROWS / 7, 3)
    other = first + 0.001 * (np.arange(12) % 3 == 1)
    heads = "Extension (mm),Load (N),Tensile extension (mm)"
    sizes = ["gauge_length_mm=10", "area_mm2=4"]
    recording = read(table(heads, first, 0.01 * ROWS, other), dimensions=sizes)
    said = "\n".join(recording.notices)
    assert "agrees with" in said and "to the last written digit, and was left aside" in said
    assert not [note for note in checks(recording) if "differs" in note]
    apart = read(table(heads, first, 0.01 * ROWS, other + 0.02 * (ROWS == 6)), dimensions=sizes)
    assert [note for note in checks(apart) if "from which it differs by up to 0.0" in note]


def test_first_rows_with_blanks_stay_below_headings_that_are_not_known(put):
    text = "zz,alpha,beta,creep\n1,0.1,,\n" + "".join(f"{k},{k / 10},{k},{k}\n" for k in range(2, 12))
    message = refusal(put("a.csv", text))
    assert "name its columns ('zz', 'alpha', 'beta', 'creep')" in message
    options = make_options(columns=["strain=alpha", "stress=beta"], units=["stress=kPa"])
    recording = import_file(put("a.csv", text), options)
    assert "11 rows of 4 columns, separated by commas" in recording.notices
    assert len(recording) == 11
    assert recording.columns["strain"][0] == 0.1
    assert np.isnan(recording.columns["stress_kPa"][0])


RESULTS = "Results Table 1\n,Maximum Force,Rate 1,Strain at break\n,(N),(mm/min),(%)\n1,30,50,2\n2,31,50,3\n3,29,50,3\n"
READINGS = (
    "\nResults Table 2\n1,Time,Displacement,Force,Tensile strain (Digital Strain 1),Tensile stress,Corrected displacement 1\n"
    ",(s),(mm),(N),(%),(MPa),(mm)\n"
)
ROWS_BELOW = "".join(f",{t},{0.03 * t:.4g},{4 * t},{0.01 * t:.4g},{0.5 * t},{0.02 * t:.4g}\n" for t in range(12))


def test_the_strain_of_a_video_extensometer_is_taken_before_one_of_the_crosshead(put):
    path = put("a.csv", RESULTS + READINGS + ROWS_BELOW)
    recording = import_file(path, make_options(kind="elastomer"))
    np.testing.assert_allclose(recording.columns["strain"], 1e-4 * ROWS)
    assert not [note for note in checks(recording) if "displacement" in note]  # strain needs none


def test_a_table_of_results_without_the_column_that_map_names_is_left_out_and_told(put):
    path = put("a.csv", RESULTS + READINGS.replace("Tensile strain (Digital Strain 1)", "Zug") + ROWS_BELOW)
    recording = import_file(path, make_options(kind="elastomer", columns=["strain=Zug (%)"]))
    np.testing.assert_allclose(recording.columns["strain"], 1e-4 * ROWS)
    assert "'test 1' was left out: it has no column 'Zug (%)', which --map names" in recording.notices
    assert "there is no such column; there are" in refusal(path, kind="elastomer", columns=["strain=Nix"])


def test_a_test_without_the_column_that_map_names_is_left_out_with_a_question(put_sheet):
    rows = [[k, 0.05 * k, 4.0 * k] for k in range(12)]
    path = put_sheet("a.xlsx", {
        "one": [["Time (s)", "Zug (%)", "Stress (kPa)"], *rows], "two": [["Time (s)", "Strain (%)", "Stress (kPa)"], *rows],
    })  # fmt: skip
    recording = import_file(path, make_options(columns=["strain=Zug (%)"]))
    assert "check: 'two' was left out: it has no column 'Zug (%)', which --map names" in recording.notices


def test_sizes_under_specimen_properties_are_read(put):
    head = "Specimen properties : Specimen label,a\nSpecimen properties : Diameter,10,mm\nSpecimen properties : Gauge length,20,mm\n\n"
    recording = import_file(put("a.csv", head + table("Extension (mm),Load (N)", ROWS, ROWS)), make_options())
    np.testing.assert_allclose(recording.columns["strain"], ROWS / 20)
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1000 * ROWS / (np.pi * 25), rtol=1e-6)


def test_a_strain_that_lengths_make_stands_under_no_heading_of_percent(put):
    strain, stress = ROWS / 250, 550.0 * ROWS / 11
    lengths = import_file(put("a.csv", table("Extension (mm),Stress (kPa)", 20 * strain, stress)), make_options(dimensions=["gauge_length_mm=20"]))
    assert not [note for note in checks(lengths) if "percent" in note]
    percent = import_file(put("b.csv", table("Strain (%),Stress (kPa)", 100 * strain, stress)), make_options())
    assert [note for note in checks(percent) if "Are these numbers fractions under a heading of percent?" in note]


def test_a_title_that_stands_anywhere_above_its_columns_names_the_test(put):
    head = ",along,,,across\nStrain (%),Stress (kPa),,Strain (%),Stress (kPa)\n"
    rows = "".join(f"{k},{3 * k},,{k},{4 * k}\n" for k in range(12))
    along, across = import_tests(put("a.csv", head + rows), make_options())
    assert (along.source["raw_part"], across.source["raw_part"]) == ("along", "across")
    np.testing.assert_allclose(across.columns["stress_kPa"], 4.0 * ROWS)
