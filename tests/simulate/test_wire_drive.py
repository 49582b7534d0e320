"""Simulation and fits drive a wire by the same quantity."""

import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.inference.driven import by_stress
from fitting.simulate.recording import predict


def test_one_bad_reading_of_a_held_stress_does_not_change_what_drives_a_wire():
    celsius = np.concatenate([np.linspace(20.0, 110.0, 60), np.linspace(110.0, 20.0, 60)])
    made = pj.nitinol.simulate_wire(
        pj.nitinol.load_wire("niti_wire"), stress=np.full(120, 150e6), temperature=celsius
    )
    stress = np.full(120, 150.0)
    stress[30] = 15.0
    columns = {
        "time_s": np.arange(120.0), "temperature_degC": celsius, "stress_MPa": stress,
        "strain": np.asarray(made.rows.strain),
    }  # fmt: skip
    recording = Recording("w", None, "wire", specimen="W", geometry={}, columns=columns)
    assert by_stress(recording)
    found = predict(recording)
    assert set(found.outputs) == {"strain"} and found.notices[0].startswith("stress drives")
