from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import Recording, recordings_folder

ROOT = Path(__file__).resolve().parents[2]

SPRING = "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0.0,3.7\n1,1,0.1,3.6\n2,2,0.2,3.5\n"
ELASTOMER = "time_s,strain,stress_kPa\n0,0,0\n1,0.1,5\n2,0.2,9\n"
TUBE = "time_s,pressure_kPa,length_mm\n0,0,56\n1,5,57\n"
WIRE = "time_s,strain,stress_MPa,temperature_degC\n0,0.001,50,90\n1,0.002,50,80\n"
ACTUATOR = "time_s,pressure_kPa,resistance_2_ohm,curvature_1pm\n0,10,3.7,0\n1,11,3.6,1\n"
TEXTS = {"spring": SPRING, "elastomer": ELASTOMER, "tube": TUBE, "wire": WIRE, "actuator": ACTUATOR}


@pytest.fixture
def put(tmp_path):
    """Writes a recording's two files and returns the CSV's path."""

    def write(text, sidecar=None, name="run_1"):
        path = tmp_path / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        if sidecar is not None:
            path.with_suffix(".toml").write_text(sidecar, encoding="utf-8")
        return path

    return write


@pytest.fixture
def examples():
    """The contract's example campaigns, beside the measured recordings."""
    folder = recordings_folder()
    found = None if folder is None else folder.parent / "contract" / "examples"
    if found is None or not found.is_dir():
        pytest.skip("the contract's examples are not here (../shared/contract/examples)")
    return found


@pytest.fixture
def make():
    """A valid recording in memory."""

    def build(**changes):
        columns = {"time_s": np.arange(3.0), "strain": np.array([0.0, 0.1, 0.2]), "stress_kPa": np.array([0.0, 5.0, 9.0])}
        base = dict(name="pull", path=None, kind="elastomer", specimen="E", real=False, columns=columns)
        return Recording(**(base | changes))

    return build
