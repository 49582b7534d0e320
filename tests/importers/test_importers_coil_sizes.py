"""Sizes of a coil or a tube in the lines above a table: read, said, and asked about where they contradict."""

import pytest
from answers import SPRING, checks

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

COIL = "# wire diameter: 0.25 mm\n# mean coil diameter: 1.15 mm\n# active coils: 52\n# pitch: 0.269 mm\n"


def imported(put, head, table=SPRING, *dimensions):
    return import_file(put("a.csv", head + table), make_options(dimensions=list(dimensions)))


def test_sizes_of_a_coil_are_read_from_its_header(put):
    """They were left aside, and the source's spring was assumed."""
    recording = imported(put, COIL)
    assert recording.kind == "spring"
    sizes = {key: recording.geometry[key] for key in ("wire_diameter_mm", "mandrel_diameter_mm", "active_coils", "initial_pitch_mm")}
    assert sizes == pytest.approx(
        {"wire_diameter_mm": 0.25, "mandrel_diameter_mm": 0.9, "active_coils": 52.0, "initial_pitch_mm": 0.269}
    )
    told = " ".join(recording.notices)
    assert "wire diameter is 0.25 mm, as the file states" in told and "active coils are 52" in told
    assert not checks(recording) and "has no [geometry]" not in told


@pytest.mark.parametrize(
    ("line", "mandrel"),
    [
        ("coil outer diameter;1.4;mm", 0.9), ("Mandrel diameter (mm);0.8", 0.8), ("Dorndurchmesser = 0,8 mm", 0.8),
        ("Mittlerer Windungsdurchmesser: 1,15 mm", 0.9),
    ],
)  # fmt: skip
def test_other_words_for_the_same_sizes(put, line, mandrel):
    head = f"Drahtdurchmesser;0,25;mm\nWindungszahl;52\n{line}\n"
    recording = imported(put, head, SPRING.replace(",", ";"))
    assert recording.geometry["mandrel_diameter_mm"] == pytest.approx(mandrel)
    assert recording.geometry["wire_diameter_mm"] == 0.25 and recording.geometry["active_coils"] == 52.0


def test_a_coil_diameter_that_may_be_the_outer_one_is_asked_about(put):
    recording = imported(put, COIL.replace("mean ", ""))
    (asked,) = checks(recording)
    assert "0.9 mm" in asked and "0.65 mm if it is the outer one" in asked
    assert recording.geometry["mandrel_diameter_mm"] == pytest.approx(0.9)


def test_sizes_that_contradict_are_asked_about(put):
    twice = imported(put, COIL + "# wire diameter: 0.3 mm\n")
    assert any("0.25 mm" in note and "it also states '# wire diameter: 0.3 mm'" in note for note in checks(twice))
    both = imported(put, COIL + "# mandrel diameter: 1.1 mm\n")
    assert any("a mandrel of 0.9 mm, but also a mandrel of 1.1 mm" in note for note in checks(both))
    assert both.geometry["mandrel_diameter_mm"] == 1.1


def test_the_users_size_comes_first_and_is_compared(put):
    recording = imported(put, COIL, SPRING, "wire_diameter_mm=0.3")
    assert recording.geometry["wire_diameter_mm"] == 0.3
    assert recording.geometry["mandrel_diameter_mm"] == pytest.approx(0.85)
    assert any("0.25 mm" in note and "0.3 mm was used" in note for note in checks(recording))


def test_a_wire_that_does_not_fit_into_its_coil_is_refused(put):
    with pytest.raises(InputError, match="does not fit into"):
        imported(put, COIL.replace("1.15", "0.2"))


def test_a_coil_diameter_without_its_wire_is_asked_about(put):
    recording = imported(put, "# coil diameter: 1.15 mm\n")
    assert "mandrel_diameter_mm" not in recording.geometry
    assert any("no mandrel follows" in note for note in checks(recording))


def test_a_straight_wire_still_has_the_cross_section_of_its_wire_diameter(put):
    table = "Time (s),Temp (°C),Displacement (mm),Load (N)\n" + "".join(
        f"{8 * k},{90 - 2 * k},{0.03 + 0.01 * k:.3f},9.817\n" for k in range(8)
    )
    recording = imported(put, "Wire diameter: 0.5 mm\nGauge length: 40 mm\n", table)
    assert recording.kind == "wire" and recording.columns["stress_MPa"][0] == pytest.approx(50.0, rel=1e-3)


def test_sizes_of_a_tube_are_read_from_its_header(put):
    table = "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{k},{k}.0,{56 + 0.1 * k:.2f}\n" for k in range(8))
    recording = imported(put, "Outer diameter: 9.5 mm\nWall thickness: 0.8 mm\n", table)
    assert recording.kind == "tube"
    assert (recording.geometry["outer_diameter_mm"], recording.geometry["wall_thickness_mm"]) == (9.5, 0.8)


def test_one_size_is_told_in_the_singular(put):
    head = "# gauge length: 50 mm\n# width: 6 mm\n# thickness: 2 mm\n"
    recording = imported(put, head, "Time [s],Extension [mm],Force [N]\n" + "".join(f"{k},{k / 2},{k / 9:.3f}\n" for k in range(9)))
    assert any(note.startswith("the thickness is 2 mm") for note in recording.notices)
