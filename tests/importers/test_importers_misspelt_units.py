"""Units that are misspelt, or of inches and gauge pressures: told with the unit of the right dimension, or read."""

import numpy as np
import pytest
from answers import refusal

from fitting.data.importers import import_file, make_options
from fitting.data.recordings import read_recording
from pneusma_jax.errors import InputError

T = np.arange(12.0)
LENGTHS = 56.0 + 0.5 * T


def tube(pressure, length="Length (mm)", values=LENGTHS, scale=1.0):
    rows = "".join(f"{t:g},{scale * t:.6f},{x:.6f}\n" for t, x in zip(T, values, strict=True))
    return f"Time (s),{pressure},{length}\n{rows}"


@pytest.mark.parametrize(("unit", "meant"), [("bra", "bar"), ("kap", "kPa"), ("psl", "psi")])
def test_a_misspelt_unit_is_told_with_one_of_its_dimension(put, unit, meant):
    """`bra` was offered as 'rad', which is no pressure."""
    assert f"did you mean '{meant}'" in refusal(put("a.csv", tube(f"Pressure ({unit})")), kind="tube")
    with pytest.raises(InputError, match=f"--unit pressure={unit}: .*did you mean '{meant}'"):
        make_options(units=[f"pressure={unit}"])


@pytest.mark.parametrize("unit", ["PSI", "Psi", "psig", "PSIG"])
def test_a_gauge_pressure_in_psi_is_read_however_it_is_spelt(put, unit):
    for name in (f"Pressure ({unit})", f"P_ch ({unit})", f"Pressure_{unit}", f"P_chamber [{unit}]"):
        recording = import_file(put("a.csv", tube(name)), make_options(kind="tube"))
        np.testing.assert_allclose(recording.columns["pressure_kPa"], 6.894757 * T, rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("heading", ["Pressure_psia", "Pressure_PSIA", "P_ch (psia)", "pressure_bara"])
def test_an_absolute_pressure_behind_an_underscore_is_no_gauge_pressure(put, heading):
    """`Pressure_psia` was read as a gauge pressure, and nothing was said."""
    recording = import_file(put("a.csv", tube(heading)), make_options(kind="tube"))
    assert recording.columns["pressure_kPa"][0] == pytest.approx(-101.325)
    assert any("because it is absolute" in note for note in recording.notices)


@pytest.mark.parametrize("unit", ["psia", "bara", "kPaa"])
def test_a_recording_refuses_an_absolute_pressure(tmp_path, unit):
    (tmp_path / "a.csv").write_text(f"time_s,pressure_{unit},length_mm\n0,0,56\n1,1,57\n")
    with pytest.raises(InputError, match=f"{unit}' counts from vacuum, and a recording has gauge pressures"):
        read_recording(tmp_path / "a.csv")


@pytest.mark.parametrize(
    "heading", ["Length centreline (in)", "Centerline length (in)", "Length of centreline [in]", "Arc length (inch)"]
)
def test_a_length_of_the_centreline_in_inches_is_a_length(put, heading):
    text = tube("Pressure (kPa)", heading, LENGTHS / 25.4)
    recording = import_file(put("a.csv", text), make_options(kind="tube"))
    np.testing.assert_allclose(recording.columns["length_mm"], LENGTHS, atol=1e-4)


@pytest.mark.parametrize("unit", ["1/in", "in^-1", "1/inch"])
def test_a_curvature_per_inch_is_read(put, unit):
    text = tube("P (kPa)", f"Curvature ({unit})", 0.1 * T)
    recording = import_file(put("a.csv", text), make_options(kind="actuator"))
    np.testing.assert_allclose(recording.columns["curvature_1pm"], 0.1 * T / 0.0254, rtol=1e-5)


@pytest.mark.parametrize(("heading", "asks"), [("Angle (grad)", 1), ("Biegewinkel [Grad]", 0), ("Angle (deg)", 0)])
def test_grad_is_a_degree_in_german_and_asked_about_elsewhere(put, heading, asks):
    """A hundred gon, which English calls grad, are ninety degrees."""
    path = put("a.csv", tube("P (kPa)", heading, 5.0 * T))
    recording = import_file(path, make_options(kind="actuator"))
    np.testing.assert_allclose(recording.columns["bend_angle_deg"], 5.0 * T, atol=1e-6)
    assert sum("400 make a turn" in note for note in recording.notices) == asks
