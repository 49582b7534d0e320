"""Recordings that the tests of the commands use."""

import json
from pathlib import Path
from typing import Any

import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording

EXAMPLE = Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "elastomer" / "pull_1.csv"


def heated_recording(rows: int = 60, noise: bool = True) -> Recording:
    """A PneuSMA2 whose spring 2 is heated and cooled at constant pressure, made by the model."""
    rng = np.random.default_rng(7)
    time = 0.5 * np.arange(rows)
    xi0 = 1.0 - 0.5 * np.clip((time - 3.0) / 10.0, 0.0, 1.0) + 0.3 * np.clip((time - 18.0) / 8.0, 0.0, 1.0)
    body = pj.make_actuator("pneusma2")
    given = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(xi0))
    found = pj.simulate_history(body, np.full(rows, 15e3), given).rows
    sigma = {"pressure_kPa": 0.05, "resistance_2_ohm": 1.5e-4, "curvature_1pm": 0.25}
    columns = {
        "time_s": time,
        "pressure_kPa": np.full(rows, 15.0),
        "resistance_2_ohm": np.asarray(found.springs[1].resistance),
        "curvature_1pm": np.asarray(found.curvature),
        "length_mm": 1e3 * np.asarray(found.length),
    }
    if noise:
        columns |= {name: columns[name] + s * rng.standard_normal(rows) for name, s in sigma.items()}
    return Recording(
        "heated", None, "actuator", specimen="A", real=False, noise=sigma if noise else {},
        geometry={"design": "pneusma2"}, columns=columns,
    )  # fmt: skip


def simulated(run, *arguments) -> dict[str, Any]:
    """What `pneusma simulate --json` prints, by the fixture `run`."""
    result = run("simulate", *arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)
