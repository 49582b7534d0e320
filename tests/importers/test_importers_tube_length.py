"""A tube whose change of length was recorded is refused with what would be right, and that is right."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options

HEADINGS = [
    "Length change (mm)", "Change in length (mm)", "Delta L (mm)", "ΔL (mm)", "Elongation (mm)", "Displacement (mm)",
    "Axial elongation [mm]", "Length variation (mm)", "Längenänderung (mm)",
]  # fmt: skip


def table(heading):
    return f"Time (s),Pressure (kPa),{heading}\n" + "".join(f"{k},{k}.0,{0.1 * k:.2f}\n" for k in range(20))


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("kind", [None, "tube"])
def test_the_advice_for_a_change_of_length_works(put, heading, kind):
    path = put("a.csv", table(heading))
    said = refusal(path, **({} if kind is None else {"kind": kind}))
    assert "--dimension length_mm=..." in said and (kind or "--kind tube" in said)
    recording = import_file(path, make_options(kind="tube", dimensions=["length_mm=56"]))
    np.testing.assert_allclose(recording.columns["length_mm"], 56.0 + 0.1 * np.arange(20))
    (said,) = [note for note in checks(recording) if "was taken as" in note]
    assert f"{heading!r} was taken as the elongation of the tube, and added to its length at rest of 56 mm" in said
    named = import_file(path, make_options(kind="tube", dimensions=["length_mm=56"], columns=[f"elongation={heading}"]))
    assert f"--map elongation='{heading}'" in said and not any("taken as" in note for note in checks(named))


@pytest.mark.parametrize("heading", ["Position (mm)", "Stroke (mm)", "Tip displacement (mm)", "Crosshead position (mm)", "Tip_displacement_mm"])
def test_a_displacement_of_something_else_than_the_end_of_a_tube_is_taken_only_if_the_user_says_so(put, heading):
    path = put("a.csv", table(heading))
    said = refusal(path, kind="tube", dimensions=["length_mm=56"])
    assert "needs length_mm" in said and f"If {heading!r} is the change of the tube's length: --map elongation=" in said
    recording = import_file(path, make_options(kind="tube", dimensions=["length_mm=56"], columns=[f"elongation={heading}"]))
    np.testing.assert_allclose(recording.columns["length_mm"], 56.0 + 0.1 * np.arange(20))


@pytest.mark.parametrize("heading", ["Displacement (mm)", "Elongation (mm)", "Tip displacement (mm)"])
def test_a_displacement_of_an_actuator_is_its_elongation_only_if_the_user_says_so(put, heading):
    path, options = put("a.csv", table(heading)), {"kind": "actuator", "dimensions": ["length_mm=120"]}
    said = refusal(path, **options)
    assert "needs one of curvature_1pm, bend_angle_deg, length_mm" in said and "--dimension length_mm=... (at rest)" in said
    assert f"--map elongation='{heading}'" in said
    recording = import_file(path, make_options(columns=[f"elongation={heading}"], **options))
    np.testing.assert_allclose(recording.columns["length_mm"], 120.0 + 0.1 * np.arange(20))


def elongated(put, reading, pressure=None, **more):
    """Notices of a tube under a pressure [kPa] with the elongation `reading` [mm] in each row."""
    pressure = np.arange(20.0) if pressure is None else pressure
    text = "".join(f"{k},{p:.3f},{x:.3f}\n" for k, (p, x) in enumerate(zip(pressure, reading, strict=True)))
    path = put("a.csv", f"Time (s),Pressure (kPa),Displacement (mm)\n{text}")
    options = make_options(kind="tube", dimensions=["length_mm=56"], columns=["elongation=Displacement (mm)"], **more)
    return [note for note in checks(import_file(path, options)) if "'Displacement (mm)'" in note]


def test_an_elongation_that_is_not_zero_without_pressure_is_asked_about(put):
    (said,) = elongated(put, 37.0 + 0.1 * np.arange(20))
    assert "is 37 mm at the least pressure" in said and "--subtract elongation_mm=37" in said
    assert not elongated(put, 37.0 + 0.1 * np.arange(20), subtracted=["elongation_mm=37"])
    begun = np.linspace(5.0, 20.0, 20)
    assert not elongated(put, 0.1 * begun, begun)  # the first pressure stretches it, too


def test_an_elongation_that_falls_as_pressure_rises_is_asked_about(put):
    (said,) = elongated(put, -0.1 * np.arange(20))
    assert "falls as pressure rises" in said and "--scale elongation=-1" in said
    assert not elongated(put, -0.1 * np.arange(20), scales=["elongation=-1"])
    there_and_back = 10.0 - np.abs(np.linspace(-10.0, 10.0, 20))
    assert not elongated(put, 0.1 * there_and_back, there_and_back)


def test_a_change_of_length_below_the_heading_of_a_length_is_told_the_same(put):
    path = put("a.csv", table("Length (mm)"))
    assert "to a change of length add that at rest (on import, for 56 mm: --subtract length_mm=-56)" in refusal(path)
    recording = import_file(path, make_options(subtracted=["length_mm=-56"]))
    np.testing.assert_allclose(recording.columns["length_mm"], 56.0 + 0.1 * np.arange(20))


def test_a_strain_of_a_tube_is_refused_with_what_to_write(put):
    assert "write its length in mm into the file: that at rest, times 1 + strain" in refusal(put("a.csv", table("Strain (%)")))


def test_a_size_that_nobody_states_is_asked_about_beside_others(put):
    """A tube of 60 mm was taken as one of 56 mm without a word, since its diameter was stated."""
    path = put("a.csv", "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{k},{k}.0,{60 + 0.1 * k:.2f}\n" for k in range(20)))
    stated = ["outer_diameter_mm=10", "wall_thickness_mm=1"]
    (said,) = [note for note in checks(import_file(path, make_options(dimensions=stated))) if "the source's" in note]
    assert "length_mm = 56 (the first row has 60 mm at 0 kPa)" in said and "--dimension length_mm=..." in said
    assert not any("the source's" in note for note in checks(import_file(path, make_options(dimensions=[*stated, "length_mm=60"]))))


@pytest.mark.parametrize(("headings", "asked"), [("Druck [mbar];Schlauchlänge [mm]", True), ("Schlauchlänge [mm];Druck [mbar]", False)])
def test_swapped_columns_of_a_tube_are_asked_about(put, headings, asked):
    """A tube of 80 mm was read as 0.6 to 500 mm long, and nothing asked."""
    rows = "".join(f"{k};{80 + 3 * k};{0.6 + 50 * k}\n" for k in range(11))
    read = import_file(put("a.csv", f"Ruhelänge;80;mm\n\nZeit [s];{headings}\n{rows}"), make_options())
    said = [note for note in checks(read) if "swapped" in note]
    assert len(said) == asked
    assert not asked or "row 4 and 6 other rows: length_mm = 0.6, though 80 is the length at rest" in said[0]


def test_the_silicone_that_is_assumed_of_a_tube_is_named(put):
    """Only the verdict of a diagnosis had said so, after a wall had been fitted to another silicone."""
    sizes = "Outer diameter: 12 mm\nWall thickness: 1.2 mm\nRest length: 80 mm\n\n"
    read = import_file(put("a.csv", sizes + table("Length (mm)").replace(",0.", ",80.").replace(",1.", ",81.")), make_options())
    (said,) = [note for note in read.notices if "material" in note]
    assert 'material = "dragon_skin_10_fast" is assumed' in said and 'material = "fit"' in said and "material" not in read.geometry


def test_no_length_at_rest_is_asked_for_that_the_file_states(put):
    said = refusal(put("a.csv", "Rest length;80;mm\n\n" + table("Elongation (mm)").replace(",", ";")))
    assert said.endswith("Of a tube: --kind tube")
    options = make_options(kind="tube")
    assert import_file(put("a.csv", "Rest length;80;mm\n\n" + table("Elongation (mm)").replace(",", ";")), options).columns["length_mm"][0] == 80.0
