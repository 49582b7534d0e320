"""Headings and sizes of a tube in several languages: its length is its length, whatever its name is made of."""

import numpy as np
import pytest
from answers import assumes_sizes, checks, refusal

from fitting.data.importers import import_file, make_options

LENGTHS = [
    "Schlauchlänge (mm)", "Probenlänge (mm)", "Longueur du tube (mm)", "Lunghezza tubo (mm)", "Longitud del tubo (mm)",
    "Specimen length (mm)", "Length of tube [mm]", "长度 (mm)",
]  # fmt: skip
PRESSURES = [
    "Luftdruck Kanal 3 (kPa)", "Luftdruck (kPa)", "Air pressure (kPa)", "Pression d'air (kPa)", "Druck Kanal 1 (kPa)",
    "Pressure ch 3 (kPa)", "P_in (kPa)", "Innendruck [kPa]",
]  # fmt: skip
AT_REST = ["Ruhelänge", "Rest length", "Longueur au repos", "Initial length", "Ausgangslänge", "Anfangslänge", "Length at rest"]
LENGTH = 56.0 + 0.5 * np.arange(12)


def table(pressure="Pressure (kPa)", length="Length (mm)", values=LENGTH):
    rows = "".join(f"{0.5 * k};{1 + 1.5 * k};{x}\n" for k, x in enumerate(values))
    return f"Zeit (s);{pressure};{length}\n{rows}"


@pytest.mark.parametrize("heading", LENGTHS)
def test_a_length_in_a_longer_heading_is_read_beside_a_pressure(read, heading):
    recording = read(table(length=heading))
    assert recording.kind == "tube"
    np.testing.assert_allclose(recording.columns["length_mm"], LENGTH)


@pytest.mark.parametrize("heading", PRESSURES)
def test_the_only_pressure_is_read_whatever_stands_around_its_word(read, heading):
    recording = read(table(pressure=heading))
    assert recording.kind == "tube" and recording.columns["pressure_kPa"][0] == 1.0


def test_the_pressure_of_the_room_does_not_hide_that_of_the_tube(read):
    rows = "".join(f"{k};{1 + k};101.3;{x}\n" for k, x in enumerate(LENGTH))
    recording = read(f"Zeit (s);Druck Kanal 1 (kPa);Luftdruck (kPa);Länge (mm)\n{rows}")
    assert recording.columns["pressure_kPa"][0] == 1.0


def test_a_power_that_goes_in_is_no_pressure(read):
    rows = "".join(f"{k};{k};{0.1 * k};{3 + 0.01 * k};{k / 7:.3f}\n" for k in range(12))
    recording = read(f"Time (s);Extension (mm);Force (N);Resistance (ohm);P_in (W)\n{rows}")
    assert recording.kind == "spring" and not any("P_in (W)" in text for text in checks(recording))


@pytest.mark.parametrize("heading", ["Anfangslänge (mm)", "Rest length (mm)", "Kabellänge (mm)", "Wavelength (mm)"])
def test_other_lengths_are_neither_read_nor_advised(put, heading):
    said = refusal(put("a.csv", table(length=heading)))
    assert "--map length" not in said and "--map elongation" not in said


def test_a_length_beside_a_force_stays_a_size(read):
    rows = "".join(f"{k};{k};{0.1 * k};{3 + 0.01 * k};56\n" for k in range(12))
    recording = read(f"Time (s);Extension (mm);Force (N);Resistance (ohm);Specimen length (mm)\n{rows}")
    assert recording.kind == "spring"


@pytest.mark.parametrize("kind", [None, "tube"])
@pytest.mark.parametrize("heading", ["Kanal 2 (mm)", "Umspannlänge (mm)", "管长度 (mm)"])
def test_unknown_headings_of_a_tube_are_advised_by_their_units(put, follow, heading, kind):
    path = put("a.csv", table("Kanal 3 (kPa)", heading))
    said = refusal(path, **({} if kind is None else {"kind": kind}))
    assert f"--map length='{heading}'" in said and "--map pressure='Kanal 3 (kPa)'" in said
    assert "--map elongation" not in said and "'Pressure (kPa)'" in said and "'Length (mm)'" in said
    told, recordings = follow(path, *follow.options_in(said.partition("perhaps")[2]))
    assert len(recordings) == 1, told
    recording = recordings[0]
    np.testing.assert_allclose(recording.columns["length_mm"], LENGTH)


@pytest.mark.parametrize("unit", ["N", "MPa"])
def test_lengths_beside_a_force_or_a_stress_are_advised_as_an_elongation(put, unit):
    said = refusal(put("a.csv", f"Kanal 1 ({unit});Kanal 2 (mm)\n" + "".join(f"{k};{k}\n" for k in range(12))))
    assert "--map elongation='Kanal 2 (mm)'" in said and "--map length" not in said


def test_a_length_that_is_named_an_elongation_is_asked_about_by_its_own_option(put, follow):
    path, heading = put("a.csv", table(length="Kanal 2 (mm)")), "Kanal 2 (mm)"
    options = {"kind": "tube", "dimensions": ["length_mm=56"], "columns": [f"elongation={heading}"]}
    (said,) = [text for text in checks(import_file(path, make_options(**options))) if "least pressure" in text]
    assert f"is it the length itself, 56 mm at rest? If so: --map length='{heading}'." in said
    _, (recording,) = follow(path, "--map", f"length={heading}")
    np.testing.assert_allclose(recording.columns["length_mm"], LENGTH)
    small = import_file(put("b.csv", table(length=heading, values=LENGTH - 53.0)), make_options(**options))
    (said,) = [text for text in checks(small) if "least pressure" in text]
    assert "--map length" not in said and "--subtract elongation_mm=3" in said


@pytest.mark.parametrize("name", AT_REST)
def test_a_length_at_rest_is_that_of_the_tube(read, name):
    recording = read(f"{name};56,0;mm\nPrüfer;Nu\n\n{table()}".replace(".", ","))
    assert recording.geometry["length_mm"] == 56.0
    assert not any("56,0" in text for text in checks(recording))
    longer = read(f"{name};56,0;mm\n\n{table()}".replace(".", ","), dimensions=["length_mm=57"])
    assert any("the file states 56 mm" in text and "57 mm was used" in text for text in checks(longer))


@pytest.mark.parametrize("line", [*(f"{name};56,0;mm" for name in AT_REST), "Außendurchmesser;10,0;mm"])
def test_a_size_that_an_option_repeats_is_not_asked_about(read, line):
    stated = ["outer_diameter_mm=10"] if line.startswith("Außen") else ["length_mm=56"]
    recording = read(f"{line}\n\n{table()}".replace(".", ","), dimensions=stated)
    quoted = line.replace(";", " ")
    assert not any(quoted in text for text in checks(recording))
    assert f"as --dimension states: {quoted!r}" in recording.notices


@pytest.mark.parametrize(("wall", "answered"), [("1.4", True), ("1,4", True), ("1.5", False), ("1.4 to 1.5", False)])
def test_prose_whose_every_size_an_option_states_is_not_asked_about(read, wall, answered):
    line = f"# Tube C3: wrapped tube with OD 11.0 mm and wall {wall} mm"
    sizes = ["outer_diameter_mm=11", "wall_thickness_mm=1.4", "length_mm=56"]
    recording = read(f"{line}\n{table()}", dimensions=sizes)
    assert any(line[2:40] in text and "may state a size" in text for text in checks(recording)) is not answered
    assert any(text.startswith("as --dimension states") for text in recording.notices) is answered


def test_a_length_at_rest_is_added_to_an_elongation(read):
    text = f"Ruhelänge;56;mm\n\n{table(length='Extension (mm)', values=LENGTH - 56.0)}"
    np.testing.assert_allclose(read(text, kind="tube").columns["length_mm"], LENGTH)


def test_a_length_at_rest_of_a_coupon_is_taken_between_the_grips_with_a_question(read):
    rows = "".join(f"{k};{k};{0.1 * k}\n" for k in range(12))
    text = f"Ruhelänge;50;mm\n\nTime (s);Extension (mm);Load (N)\n{rows}"
    recording = read(text, kind="elastomer", dimensions=["area_mm2=12"])
    np.testing.assert_allclose(recording.columns["strain"], np.arange(12) / 50.0)
    assert any("right if that is the length between the grips" in text for text in checks(recording))


@pytest.mark.parametrize("kind", ["tube", "actuator", "spring"])
def test_sizes_that_are_assumed_are_a_question(read, kind):
    rows = "".join(f"{k};{k};{56 + k};{k / 9};{k / 2};{3 + k / 99}\n" for k in range(12))
    text = f"Time (s);Pressure (kPa);Length (mm);Force (N);Extension (mm);Resistance (ohm)\n{rows}"
    named = read(text, kind=kind)
    assert assumes_sizes(named)
    stated = {"tube": "wall_thickness_mm=1", "actuator": "length_mm=120", "spring": "wire_diameter_mm=0.5"}[kind]
    assert not assumes_sizes(read(text, kind=kind, dimensions=[stated]))
