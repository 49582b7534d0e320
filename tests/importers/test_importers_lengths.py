"""A coupon's strain from its length, and coupons beside the temperature of a room."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options

ROWS = np.arange(30.0)
GAP = 9800.0 - 120.0 * ROWS
SQUEEZED = GAP / 9800.0 - 1.0
FORCE = 0.05 * ROWS


def table(heads, *columns):
    return heads + "\n" + "".join(",".join(f"{x:.8g}" for x in row) + "\n" for row in np.transpose(columns))


RHEOMETER = table("Step time (s),Temperature (°C),Axial force (N),Gap (um)", ROWS, 25 + 0 * ROWS, FORCE, GAP)


def test_the_gap_of_a_rheometer_is_advised_and_makes_the_strain_of_a_pressed_coupon(put, follow):
    message = refusal(put("a.csv", RHEOMETER), dimensions=["diameter_mm=8"])
    assert "by their units perhaps --map length='Gap (um)'" in message
    options = {"columns": ["length=Gap (um)"], "dimensions": ["diameter_mm=8"], "scales": ["force=-1"]}
    recording = import_file(put("a.csv", RHEOMETER), make_options(**options))
    assert recording.kind == "elastomer"
    np.testing.assert_allclose(recording.columns["strain"], SQUEEZED, atol=1e-12)
    np.testing.assert_allclose(recording.columns["stress_kPa"], -1e3 * FORCE / (np.pi * 16), atol=1e-9)
    assert "check: strain is the change of 'Gap (um)' over its first value, 9.8 mm. If the specimen was not at rest" in "\n".join(checks(recording))


def test_a_length_without_a_number_is_refused_as_such(put):
    """It was refused as 0 mm, which stands nowhere."""
    empty = "Time (s),Gap (mm),Stress (kPa)\n" + "".join(f"{row:g},,{row:g}\n" for row in ROWS)
    message = refusal(put("a.csv", empty), columns=["length=Gap (mm)"], kind="elastomer")
    assert "no number stands in 'Gap (mm)', of which strain is made" in message


def test_a_stated_length_at_rest_is_taken_without_a_question(put):
    options = make_options(columns=["length=Gap (um)"], dimensions=["diameter_mm=8", "gauge_length_mm=10"], scales=["force=-1"])
    recording = import_file(put("a.csv", RHEOMETER), options)
    np.testing.assert_allclose(recording.columns["strain"], GAP / 1e4 - 1.0, atol=1e-12)
    assert not [note for note in checks(recording) if "first value" in note]


def test_a_length_that_nobody_names_makes_no_strain(put):
    assert "--map" in refusal(put("a.csv", table("Time (s),Length (mm),Load (N)", ROWS, 20 + ROWS, FORCE)), dimensions=["area_mm2=4"])


@pytest.mark.parametrize(("swing", "kind"), [(0.3, "elastomer"), (40.0, "wire")])
def test_a_coupon_beside_the_temperature_of_a_room_is_no_wire(put, swing, kind):
    temperature = 23.0 + swing * ROWS / 30.0
    recording = import_file(put("a.csv", table("Time (s),Strain (%),Stress (kPa),Temperature (°C)", ROWS, ROWS / 3, 10 * ROWS, temperature)), make_options())
    assert recording.kind == kind


def test_a_wire_pulled_at_one_temperature_stays_a_wire(put):
    recording = import_file(put("a.csv", table("Time (s),Strain (%),Stress (MPa),Temperature (°C)", ROWS, ROWS / 8, 1.9 * ROWS, 25 + 0 * ROWS)), make_options())
    assert recording.kind == "wire"


def test_a_force_over_time_lacks_an_elongation(put):
    assert "the strain or the elongation is missing" in refusal(put("a.csv", table("Time (s),Force (N)", ROWS, FORCE)))


def test_a_stated_unit_tells_a_metal_from_a_rubber(put):
    path = put("a.csv", table("Time (s),Strain (%),Stress", ROWS, ROWS / 8, 19.0 * ROWS))
    assert import_file(path, make_options(units=["stress=MPa"])).kind == "wire"
    assert import_file(path, make_options(units=["stress=kPa"])).kind == "elastomer"
