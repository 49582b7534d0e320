"""Force over time at a stated speed: the displacement is speed times time, and the import asks about it."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

TIME = np.arange(31.0)
FORCE = 0.1 * TIME
SIZES = ["gauge_length_mm=20", "area_mm2=8"]


def table(time=TIME, force=FORCE, head="Time (s),Load (N)"):
    return head + "\n" + "".join(f"{t:.10g},{f:g}\n" for t, f in zip(time, force, strict=True))


def options(**more):
    return make_options(**({"speed": "60 mm/min", "dimensions": SIZES} | more))


def test_displacement_is_speed_times_time_and_is_asked_about(put):
    recording = import_file(put("a.csv", table()), options())
    assert recording.kind == "elastomer"
    np.testing.assert_allclose(recording.columns["strain"], TIME / 20.0, atol=1e-12)
    (asked,) = [note for note in checks(recording) if "the elongation is 60 mm/min times the time, 0 to 30 mm" in note]
    assert "That holds for one ramp at constant speed" in asked and "'Load (N)' is largest in row 32 of 2 to 32" in asked
    assert any("strain is '--speed 60 mm/min' over the gauge length of 20 mm" in note for note in recording.source["notes"])


@pytest.mark.parametrize(("speed", "mm_per_s"), [("1mm/s", 1.0), ("2 in/min", 50.8 / 60.0), ("500um/s", 0.5), ("3.6 mm/h", 1e-3)])
def test_speeds_are_read_in_any_unit_of_length_over_time(put, speed, mm_per_s):
    """The clock counts from its first row, in its own unit."""
    path = put("a.csv", table(TIME / 60.0 + 5.0, head="Time (min),Load (N)"))
    recording = import_file(path, options(speed=speed, kind="elastomer"))
    np.testing.assert_allclose(recording.columns["strain"], mm_per_s * TIME / 20.0, rtol=1e-4, atol=1e-9)


def test_a_spring_has_the_displacement_as_its_elongation(put):
    text = table(head="Time (s),Load (N)").splitlines()
    text = "\n".join([f"{text[0]},Resistance (ohm)", *(f"{line},3.{k:02d}" for k, line in enumerate(text[1:]))])
    recording = import_file(put("a.csv", text), make_options(kind="spring", speed="1 mm/s"))
    np.testing.assert_allclose(recording.columns["elongation_mm"], TIME, atol=1e-12)


def test_a_clock_of_stated_intervals_makes_it_as_well(put):
    path = put("a.csv", "Load (N),Temperature (degC)\n" + "".join(f"{f:g},21\n" for f in FORCE))
    recording = import_file(path, options(kind="elastomer", interval_s=0.5))
    np.testing.assert_allclose(recording.columns["strain"], 0.5 * TIME / 20.0, atol=1e-12)


@pytest.mark.parametrize(("text", "said"), [
    (table(np.minimum(TIME, 20.0)), "row 23: the clock stands still or goes back, and --speed 60 mm/min makes one"),
    (table(head="Extension (mm),Load (N)"), "--speed 60 mm/min: the file has 'Extension (mm)' of its own; leave the option out"),
    (table(head="Load (N),Temperature (degC)"), "the file has no clock, which the displacement is made of"),
])  # fmt: skip
def test_what_makes_no_displacement_is_refused(put, text, said):
    assert said in refusal(put("a.csv", text), speed="60 mm/min", dimensions=SIZES)


@pytest.mark.parametrize("text", ["10", "-3 mm/min", "0mm/s", "10 mm", "10 min/mm", "10 kPa/s", "x mm/s", "1e999mm/s"])
def test_what_is_no_speed_is_refused(text):
    with pytest.raises(InputError, match="must be a positive number of a length over a time, e.g. 10mm/min"):
        make_options(speed=text)


def test_a_speed_beside_which_nothing_needs_a_displacement_is_refused(put):
    tube = "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{t:g},{t:g},{56 + 0.1 * t:g}\n" for t in TIME)
    assert "--speed" in refusal(put("a.csv", tube), speed="60 mm/min")


def test_a_file_without_a_displacement_is_advised(put):
    assert "of one ramp at constant speed: --speed 10mm/min" in refusal(put("a.csv", table()), dimensions=SIZES)


@pytest.mark.parametrize(("line", "speed", "asked"), [
    ("Crosshead speed,500 mm/min", "60 mm/min", True),
    ("Crosshead speed,500 mm/min", "8.333 mm/s", False),
    ("Speed [mm/min],60", "60 mm/min", False),
    ("Speed [mm/min],500", "60 mm/min", True),
    ("Preload 5 mm/min,Test speed 60 mm/min", "60 mm/min", False),
    ("Stiffness,500 N/mm", "60 mm/min", False),
    ("Recorded,03/05/2024", "60 mm/min", False),
])  # fmt: skip
def test_a_speed_that_the_file_contradicts_is_asked_about(put, line, speed, asked):
    recording = import_file(put("a.csv", f"{line}\n\n{table()}"), options(speed=speed, kind="elastomer"))
    found = [note for note in checks(recording) if "but the file states" in note and "Which one is right?" in note]
    assert len(found) == asked
    assert all("--speed 60 mm/min is taken" in note and "500" in note for note in found)


def test_the_speed_that_a_file_states_is_named_where_it_is_missing(put):
    text = refusal(put("a.csv", f"Prüfgeschwindigkeit;500,5 mm/min\n\n{table().replace(',', ';')}"), dimensions=SIZES)
    assert "--speed 500.5mm/min; the file states 'Prüfgeschwindigkeit 500,5 mm/min'" in text
