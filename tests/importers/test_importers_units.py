"""Units that stand row by row, sizes that are stated twice, strains that no specimen reaches, and which kind it is."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options

STRAIN = np.linspace(0.0, 0.8, 41)
STRESS = 130.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)  # kPa


def table(head, *columns, mark=","):
    return head + "\n" + "".join(mark.join(str(x) for x in row) + "\n" for row in zip(*columns, strict=True))


# Units row by row.


def ranged(values, edge, small, large, factor):
    """Numbers of an instrument that changes its range: small units below an edge."""
    units = [small if value < edge else large for value in values]
    return [f"{value * (factor if unit == small else 1.0):.8g}" for value, unit in zip(values, units, strict=True)], units


@pytest.mark.parametrize(
    ("head", "mark", "small", "factor"),
    [("Strain (-),Stress,Unit", ",", "Pa", 1e3), ("Strain (-);Stress;Stress unit", ";", "mbar", 10.0), ("Strain (-)\tStress\tEinheit", "\t", "[hPa]", 10.0), ("Strain (-),Stress,", ",", "N/m2", 1e3)],
)
def test_units_that_change_during_a_test_are_converted_and_that_is_said(put, head, mark, small, factor):
    numbers, units = ranged(STRESS, 40.0, small, "kPa", factor)
    path = put("a.csv", table(head, STRAIN, numbers, units, mark=mark))
    recording = import_file(path)
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-6)
    assert any("row by row" in check and "converted to kPa" in check for check in checks(recording))
    assert not any("left out" in note and "nit" in note for note in recording.notices)
    assert "row by row" in refusal(path, units=["stress=MPa"])


def test_one_unit_in_every_row_is_the_unit_of_the_column(put):
    recording = import_file(put("a.csv", table("Strain (-),Stress,Unit", STRAIN, STRESS / 1e3, ["MPa"] * 41)))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS)
    assert not checks(recording) and any("says in every row" in note for note in recording.notices)


def test_masses_and_forces_row_by_row_are_both_forces(put):
    newton = 0.02 * STRESS
    numbers, units = ranged(newton, 1.0, "g", "N", 1.0 / 9.80665e-3)
    path = put("a.csv", table("Extension (mm),Load,Unit", 10 * STRAIN, numbers, units))
    recording = import_file(path, make_options(kind="elastomer", dimensions=["gauge_length_mm=10", "area_mm2=20"]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-6)


@pytest.mark.parametrize(("units", "words"), [(["kPa"] * 20 + ["mm"] * 21, "units of several kinds, kPa, mm"), (["kPa"] * 20 + [""] * 21, "has no unit in row 22")])
def test_units_that_cannot_be_converted_are_refused(put, units, words):
    assert words in refusal(put("a.csv", table("Strain (-),Stress,Unit", STRAIN, STRESS, units)), kind="elastomer")


def test_a_column_of_words_is_no_column_of_units(put):
    recording = import_file(put("a.csv", table("Strain (-),Stress (kPa),Phase", STRAIN, STRESS, ["A"] * 41)))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, rtol=1e-12)


# Which kind.

WARM = 22.0 + 0.02 * np.arange(41)


@pytest.mark.parametrize(
    ("head", "columns", "named"),
    [
        ("Strain (%),Stress (kPa),Temperature (degC)", (100 * STRAIN, STRESS, WARM), {}),
        ("Strain (-),Stress (MPa),Chamber temperature (K),Resistance (ohm)", (STRAIN, STRESS / 1e3, WARM + 273.15, WARM), {}),
        ("Stretch,Stress (kPa),Temperature (degC)", (1 + STRAIN, STRESS, WARM), {}),
        ("Extension (mm),Load (N),Temperature (degC)", (25 * STRAIN, 0.02 * STRESS, WARM), {"dimensions": ["gauge_length_mm=25", "area_mm2=20"]}),
        ("Strain (%),Stress (kPa),Temperature (degC)", (40 * STRAIN, STRESS, WARM), {}),
    ],
)
def test_a_rubber_with_a_temperature_beside_it_is_no_wire(put, head, columns, named):
    recording = import_file(put("a.csv", table(head, *columns)), make_options(**named))
    assert recording.kind == "elastomer" and recording.columns["stress_kPa"].max() == pytest.approx(STRESS.max())


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("Strain (%),Stress (MPa),Temperature (degC)", (5 * STRAIN, 500 * STRAIN, WARM)), ("Strain (%),Stress (kPa),Temperature (degC)", (5 * STRAIN, 7e3 + 0 * STRAIN, 20 + 100 * STRAIN)),
        ("Strain (%),Stress (MPa),Temperature (degC)", (22 * STRAIN, 700 * STRAIN, WARM)), ("Strain,Stress (MPa),Temperature (degC)", (0.05 * STRAIN, 200 + 0 * STRAIN, 20 + 100 * STRAIN)),
    ],
)  # fmt: skip
def test_a_wire_stays_a_wire(put, head, columns):
    assert import_file(put("a.csv", table(head, *columns))).kind == "wire"


def test_advice_about_a_wire_that_strains_too_far_works(put, follow):
    path = put("a.csv", table("Strain (%),Stress (kPa),Temperature (degC)", 100 * STRAIN, STRESS, WARM))
    message, _ = follow(path, "--kind", "wire")
    assert follow.options_in(message) == ["--kind", "elastomer"]
    _, (recording,) = follow(path, *follow.options_in(message))
    assert recording.kind == "elastomer"


# Strains that no specimen reaches.


@pytest.mark.parametrize("unit", ["mm/mm", "-", "m/m", "in/in"])
def test_percent_under_the_heading_of_a_fraction_is_asked_about(put, follow, unit):
    path = put("a.csv", table(f"Strain ({unit}),Stress (kPa)", 100 * STRAIN, STRESS))
    message, _ = follow(path)
    assert "stretch of 81" in message and follow.options_in(message) == ["--unit", "strain=percent", "--unit", "strain=1"]
    _, (mended,) = follow(path, "--unit", "strain=percent")
    assert mended.columns["strain"].max() == pytest.approx(0.8)
    _, (kept,) = follow(path, "--unit", "strain=1")
    assert kept.columns["strain"].max() == pytest.approx(80.0)


def test_a_strain_in_percent_of_percent_is_asked_about(put):
    assert "--unit strain=1" in refusal(put("a.csv", table("Strain (%),Stress (kPa)", 1e4 * STRAIN, STRESS)))


@pytest.mark.parametrize(
    ("head", "column", "named"),
    [("Stretch (-),Stress (kPa)", 1 + 30 * STRAIN, {}), ("Extension (mm),Stress (kPa)", 100 * STRAIN, {"dimensions": ["gauge_length_mm=2.5"]}), ("True strain (-),Stress (kPa)", 5 * STRAIN, {})],
)
def test_a_made_strain_that_no_rubber_reaches_is_a_warning(put, head, column, named):
    recording = import_file(put("a.csv", table(head, column, STRESS)), make_options(kind="elastomer", **named))
    assert any("further than any rubber stretches" in check for check in checks(recording))
    far = import_file(put("b.csv", table("Stretch (-),Stress (kPa)", 1 + 15 * STRAIN, STRESS)))
    assert not any("further than" in check for check in checks(far))


# Sizes that a file states twice.

PRESS = table("Extension (mm),Load (N)", 25 * STRAIN, 0.018 * STRESS)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("Gauge length: 25 mm\nGrip separation: 40 mm\nArea: 18 mm2\n", ["'Grip separation: 40 mm'"]), ("Gauge length,25,mm\nArea,18,mm2\nGauge length (in),2\n", ["'Gauge length (in) 2'"]),
        ("Gauge length: 25 mm\nArea: 18 mm2\nDiameter: 5 mm\n", ["19.635 mm2 by its diameter"]), ("Gauge length: 25 mm\nDiameter: 5 mm\nWidth: 6 mm\nThickness: 2 mm\n", ["12 mm2 by its width and thickness"]),
        ("Gauge length: 25 mm\nWidth: 6 mm\nThickness: 3 mm\nWidth: 8 mm\n", ["'Width: 8 mm'"]),
    ],
)  # fmt: skip
def test_two_sizes_that_contradict_each_other_are_said(put, lines, words):
    recording = import_file(put("a.csv", lines + "\n" + PRESS), make_options(kind="elastomer"))
    assert len(checks(recording)) == len(words) and all(any(word in check for check in checks(recording)) for word in words)


def test_two_sizes_that_agree_are_no_matter_and_a_stated_one_decides(put):
    lines = "Gauge length: 25 mm\nGauge length: 25.1 mm\nArea: 18 mm2\nWidth: 6 mm\nThickness: 3 mm\n\n"
    assert not checks(import_file(put("a.csv", lines + PRESS), make_options(kind="elastomer")))
    lines = "Gauge length: 25 mm\nGauge length: 50 mm\nArea: 18 mm2\n\n"
    stated = make_options(kind="elastomer", dimensions=["gauge_length_mm=25"])
    assert not checks(import_file(put("b.csv", lines + PRESS), stated))


@pytest.mark.parametrize(
    ("head", "far", "named"),
    [("Position (mm),Load (N),Temperature (degC)", 110.0, {"dimensions": ["gauge_length_mm=25", "diameter_mm=0.5"]}), ("Strain (-),Stress (MPa),Temperature (degC)", 3.0, {}), ("Strain (%),Stress (MPa),Temperature (degC)", 120.0, {})],
)  # fmt: skip
def test_a_wire_whose_strain_is_counted_from_elsewhere_is_one_and_asked_about(put, follow, head, far, named):
    scale = {"Position (mm)": 25.0, "Strain (-)": 1.0, "Strain (%)": 100.0}[head.split(",")[0]]
    path = put("a.csv", table(head, far + scale * 0.04 * STRAIN, 80 * STRAIN if named else 400 * STRAIN, WARM))
    args = [arg for size in named.get("dimensions", ()) for arg in ("--dimension", size)]
    message, _ = follow(path, *args)
    assert "was it counted from another zero" in message
    _, (mended,) = follow(path, *args, *follow.options_in(message))
    assert mended.kind == "wire" and mended.columns["strain"].max() == pytest.approx(0.032, rel=1e-3)


@pytest.mark.parametrize("mark", [-987654.3, 2.5e8 + 0.25, 1234567.5])  # whole numbers so far away are missing
def test_a_stress_that_no_rubber_bears_is_asked_about(put, mark):
    stress = STRESS.copy()
    stress[3] = mark
    recording = import_file(put("a.csv", table("Strain (%),Stress (kPa)", 100 * STRAIN, stress)))
    assert any("more than any rubber bears" in check and "mark for a missing reading" in check for check in checks(recording))
    wrong = import_file(put("b.csv", table("Strain (%),Stress (MPa)", 100 * STRAIN, STRESS)))
    assert any("more than any rubber bears" in check and "mark" not in check for check in checks(wrong))
