"""A simulated campaign on wrapped silicone tubes without springs: slow inflation and deflation."""

import numpy as np

from fitting.data.recordings import Recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.specimens import TUBE
from fitting.specimens.silicones import FACTOR
from fitting.specimens.simulation import simulated
from pneusma_jax.errors import InputError

from .instruments import Instruments
from .truth import Truth
from .wishes import Synthetic, Wishes

# specimen, largest pressure [kPa], role
RUNS = (
    ("A", 20.0, "fit"), ("A", 40.0, "fit"), ("B", 40.0, "fit"), ("C", 30.0, "fit"), ("D", 40.0, "fit"),
)  # fmt: skip
CHECK = ("A", 50.0, "validation")
RUNS_ASKED = 3
RATE = 0.8  # Rate of the pressure [kPa/s]
INTERVAL_S = 1.0
NOISE = {"length_mm": 0.05, "pressure_kPa": 0.05}
TOLERANCE = {"wall_thickness_mm": 0.03, FACTOR: 0.05}


def synthesise_tube(wishes: Wishes) -> Synthetic:
    """Simulate the campaign. Each specimen has its own wall and its own batch of silicone.

    Raises:
        InputError: for impossible wishes.
    """
    nominal = nominal_geometry("tube", {})
    nominal.pop("cycles_before")
    drawn = Truth(wishes, TOLERANCE)
    bench = Instruments.of("tube", wishes, NOISE)
    interval = wishes.interval_s or INTERVAL_S
    runs = [*RUNS[: RUNS_ASKED if wishes.tests is None else wishes.tests], CHECK]
    truth = {}
    for specimen in dict.fromkeys(name for name, _, _ in runs):
        geometry = drawn.geometry(nominal, specimen)
        truth[specimen] = geometry, drawn.factor(FACTOR, specimen)
    drawn.finish()
    halves = [max(2, round(peak / RATE / interval)) for _, peak, _ in runs]
    recordings = []
    for k, ((specimen, peak, role), half) in enumerate(zip(runs, halves, strict=True), start=1):
        pressure = np.interp(np.arange(2 * half + 1), [0, half, 2 * half], [0.0, peak, 0.0])
        (geometry, factor), time = truth[specimen], interval * np.arange(len(pressure))
        columns = {"pressure_kPa": pressure}
        true = Recording("true", None, "tube", geometry=geometry, columns={"time_s": time, **columns})
        columns["length_mm"] = 1e3 * simulated(TUBE, true, values={FACTOR: factor}).outputs["length"]
        if not np.all(np.isfinite(columns["length_mm"])):
            raise InputError(f"the wall of this tube cannot balance {peak:g} kPa; its silicone is too soft")
        recordings.append(
            bench.recording(f"inflation_{k}", role, specimen, time, columns, nominal, drawn.tolerance)
        )
    title = "Simulated inflations of wrapped silicone tubes"
    return Synthetic(title, recordings, dict(drawn.record))
