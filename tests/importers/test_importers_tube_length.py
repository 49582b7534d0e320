"""A tube whose change of length was recorded is refused with what would be right, and that is right."""

import numpy as np
import pytest
from answers import refusal

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


def test_a_change_of_length_below_the_heading_of_a_length_is_told_the_same(put):
    path = put("a.csv", table("Length (mm)"))
    assert "to a change of length add that at rest (on import, for 56 mm: --subtract length_mm=-56)" in refusal(path)
    recording = import_file(path, make_options(subtracted=["length_mm=-56"]))
    np.testing.assert_allclose(recording.columns["length_mm"], 56.0 + 0.1 * np.arange(20))


def test_a_strain_of_a_tube_is_refused_with_what_to_write(put):
    assert "write its length in mm into the file: that at rest, times 1 + strain" in refusal(put("a.csv", table("Strain (%)")))
