"""A simulated campaign on one straight wire: thermal cycles under constant stress."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Recording
from fitting.data.recordings.kinds import WIRE_ALLOY
from fitting.specimens import WIRE
from fitting.specimens.simulation import simulated
from pneusma_jax.calibration import load_calibration
from pneusma_jax.nitinol import WireAlloy

from .instruments import Instruments
from .truth import Truth
from .wishes import Synthetic, Wishes

STRESSES_MPA = (50.0, 100.0, 200.0, 150.0, 250.0, 300.0, 75.0)
"""Stresses in the order of use; the last one is for validation."""
STRESSES = 4
HOT_WIDTHS, COLD_WIDTHS = 9.0, 7.0  # Range of a cycle to either side of its middle, in widths of the table
COVERED = 5.0  # Minimum range of a cycle in widths of the wire's own; a laboratory would go on until then
RATE = 0.25  # Rate of the temperature [K/s]
INTERVAL_S = 2.0
NOISE = {"strain": 1e-4, "temperature_degC": 0.1}
TOLERANCE = {"E_m": 0.05, "E_a": 0.05, "eps_L": 0.05, "beta_2": 0.02, "T_mid": 0.05, "T_width": 0.05}
CONSTANTS = [field.name for field in dataclasses.fields(WireAlloy) if field.name != "name"]


def synthesise_wire(wishes: Wishes) -> Synthetic:
    """Simulate the campaign: from hot to cold and back at each stress.

    Raises:
        InputError: for an alloy without a wire's constants, or impossible wishes.
    """
    table = load_calibration(wishes.alloy or WIRE_ALLOY, "alloy")
    drawn = Truth(wishes, TOLERANCE)
    constants = drawn.alloy(table, list(table.require(CONSTANTS)), possible_wire)
    drawn.finish()
    wire = WireAlloy(**constants, name=table.name)
    bench = Instruments.of("wire", wishes, NOISE)
    interval = wishes.interval_s or INTERVAL_S
    middle, width = table.quantities["T_mid"].value, table.quantities["T_width"].value
    warm, cool = middle + HOT_WIDTHS * width, middle - COLD_WIDTHS * width
    around = COVERED * float(wire.T_width)
    warm, cool = max(warm, float(wire.T_mid) + around), min(cool, float(wire.T_mid) - around)
    half = max(2, round((warm - cool) / RATE / interval))
    temperature = np.interp(np.arange(2 * half + 1), [0, half, 2 * half], [warm, cool, warm])
    time = interval * np.arange(len(temperature))
    count = STRESSES if wishes.tests is None else wishes.tests
    recordings = []
    for k, stress in enumerate(STRESSES_MPA[: count + 1], start=1):
        columns = {"stress_MPa": np.full(len(time), stress), "temperature_degC": temperature}
        geometry = {"alloy": str(wishes.alloy or WIRE_ALLOY), "prestrain": 0.0}
        true = Recording("true", None, "wire", geometry=geometry, columns={"time_s": time, **columns})
        strain = simulated(WIRE, true, smooth=False, values=constants).outputs["strain"]
        columns = {"strain": strain, **columns}
        role, stated = "fit" if k <= count else "validation", {"alloy": "fit", "prestrain": 0.0}
        recordings.append(bench.recording(f"cycle_{k}", role, "W", time, columns, stated))
    title = "Simulated thermal cycles of a nitinol wire under constant stress"
    return Synthetic(title, recordings, dict(drawn.record))


def possible_wire(values: dict[str, float]) -> bool:
    """True if a wire with these constants (SI) can exist: stress rises with strain in both phases."""
    try:
        wire = WireAlloy(**values)
    except ValueError:
        return False
    strain = np.linspace(0.0, 3.0 * float(wire.eps_L), 300)
    return bool(np.all(np.diff(_stresses(wire, strain)) > 0.0))


@eqx.filter_jit
def _stresses(wire: WireAlloy, strain: Array) -> Array:
    """Stress of the hot and of the cold wire at axial strains [Pa], shape (2, strains)."""
    return jnp.stack([wire.axial_stress(strain, x, 0.0) for x in (0.0, 1.0)])
