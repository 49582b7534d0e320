"""A simulated campaign on wrapped silicone tubes without springs: slow inflation and deflation."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.data.recordings.nominal import nominal_geometry

from .instruments import Instruments
from .truth import Unknowns
from .wishes import Synthetic, Wishes

# specimen, largest pressure [kPa], role
RUNS = (
    ("A", 20.0, "fit"), ("A", 40.0, "fit"), ("B", 40.0, "fit"), ("C", 30.0, "fit"), ("D", 40.0, "fit"),
)  # fmt: skip
CHECK = ("A", 50.0, "validation")
RUNS_ASKED = 3
SIZES = ("length_mm", "outer_diameter_mm", "wall_thickness_mm")
RATE = 0.8  # kPa per second
INTERVAL_S = 1.0
NOISE = {"length_mm": 0.05, "pressure_kPa": 0.05}
TOLERANCE = {"wall_thickness_mm": 0.03, "silicone_stiffness": 0.05}


def synthesise_tube(wishes: Wishes) -> Synthetic:
    """Simulate the campaign; each specimen has its own wall and its own batch of silicone.

    Raises:
        InputError: for wishes that cannot be.
    """
    nominal = nominal_geometry("tube", {})
    nominal.pop("cycles_before")
    unknowns = Unknowns(wishes, TOLERANCE)
    bench = Instruments.of("tube", wishes, NOISE)
    interval = wishes.interval_s or INTERVAL_S
    runs = [*RUNS[: RUNS_ASKED if wishes.tests is None else wishes.tests], CHECK]
    lengths = {}
    for specimen in dict.fromkeys(name for name, _, _ in runs):
        true = unknowns.geometry(nominal, specimen)
        law = silicone(nominal["material"], unknowns.factor("silicone_stiffness", specimen))
        lengths[specimen] = (1e-3 * np.array([true[key] for key in SIZES]), law)
    unknowns.finish()
    halves = [max(2, round(peak / RATE / interval)) for _, peak, _ in runs]
    recordings = []
    for k, ((specimen, peak, role), half) in enumerate(zip(runs, halves, strict=True), start=1):
        pressure = np.interp(np.arange(2 * half + 1), [0, half, 2 * half], [0.0, peak, 0.0])
        padded = np.pad(pressure, (0, 2 * (max(halves) - half)))  # one shape: compiled once
        length = np.asarray(_lengths(1e3 * padded, *lengths[specimen]))[: len(pressure)]
        columns = {"pressure_kPa": pressure, "length_mm": 1e3 * length}
        recordings.append(
            Recording(
                name=f"inflation_{k}",
                path=None,
                kind="tube",
                role=role,
                specimen=specimen,
                real=False,
                noise=bench.stated(columns),
                geometry=dict(nominal),
                tolerance=dict(unknowns.tolerance),
                columns=bench.read(f"inflation_{k}", interval * np.arange(len(pressure)), columns),
            )
        )
    title = "Simulated inflations of wrapped silicone tubes"
    return Synthetic(title, recordings, dict(unknowns.record))


def silicone(material: str, stiffness: float) -> pj.silicone.SiliconeLaw:
    """A material's law with its stress multiplied by a batch's factor."""
    law = pj.load_silicone(material)
    return dataclasses.replace(law, stiffness=law.stiffness * stiffness)


@eqx.filter_jit
def _lengths(pressure: jax.Array, sizes: jax.Array, law: pj.silicone.SiliconeLaw) -> jax.Array:
    """Length [m] at gauge pressures [Pa] of a tube of length, outer diameter and wall `sizes` [m]."""
    return jax.vmap(lambda p: pj.tube_length(p, *sizes, law))(jnp.asarray(pressure))
