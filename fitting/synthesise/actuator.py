"""A simulated campaign on one actuator: thermal cycles under pressure, pressure sweeps under heating."""

import dataclasses
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings.nominal import nominal_geometry
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.units import from_si

from .instruments import Instruments
from .spring import CONSTANTS, possible_spring
from .truth import Truth
from .wishes import Synthetic, Wishes

INTERVAL_S = 0.5
SPAN_S = 90.0
AMBIENT_DEGC = 22.0
NOISE = {
    "pressure_kPa": 0.05, "curvature_1pm": 0.25, "bend_angle_deg": 0.8, "bend_direction_deg": 1.0,
    "length_mm": 0.1, **{f"resistance_{k}_ohm": 0.00015 for k in (1, 2, 3)},
}  # fmt: skip
TOLERANCE = {"wall_thickness_mm": 0.03, "G_m": 0.05, "G_a": 0.05, "silicone_stiffness": 0.05}
HEATED = 2  # Number of the spring with the current


@dataclass(frozen=True)
class Run:
    """One run of `SPAN_S` seconds. Inputs are (seconds, value) points joined by straight lines.

    Attributes:
        name: name of the recording.
        pressure: gauge pressure [kPa].
        current: share of the full current [1].
        heat: temperature that the full current reaches, in widths above the middle of the transformation [1].
        role: `fit` or `validation`.
    """

    name: str
    pressure: tuple[tuple[float, float], ...]
    current: tuple[tuple[float, float], ...]
    heat: float = 0.0
    role: str = "fit"


PULSE = ((0.0, 0.0), (8.0, 0.0), (10.0, 1.0), (40.0, 1.0), (41.0, 0.0), (SPAN_S, 0.0))
STEADY = ((0.0, 0.0), (1.0, 1.0), (SPAN_S, 1.0))
OFF = ((0.0, 0.0), (SPAN_S, 0.0))


def _held(pressure: float) -> tuple[tuple[float, float], ...]:
    return ((0.0, pressure), (SPAN_S, pressure))


def _sweep(low: float, high: float) -> tuple[tuple[float, float], ...]:
    """Pressure that is held while the spring warms up, then rises and falls."""
    return ((0.0, low), (25.0, low), (57.0, high), (SPAN_S, low))


RUNS = (
    Run("cycle_1", _held(15.0), PULSE, 0.0),
    Run("sweep_1", _sweep(8.0, 40.0), STEADY, -0.5),
    Run("cycle_2", _held(30.0), PULSE, 2.0),
    Run("sweep_2", _sweep(8.0, 40.0), OFF),
    Run("sweep_3", _sweep(8.0, 30.0), STEADY, 1.0),
    Run("cycle_3", _held(22.0), PULSE, 1.0),
)
CHECK = Run("sweep_check", _sweep(10.0, 35.0), STEADY, 0.5, "validation")
RUNS_ASKED = 4


def synthesise_actuator(wishes: Wishes) -> Synthetic:
    """Simulate the campaign. As in the source, only the heated spring's resistance is measured.

    Raises:
        InputError: for an unknown design or alloy, impossible wishes, or a specimen without equilibrium.
    """
    design = wishes.design or "pneusma2"
    stated = {"design": design, **({"alloy": wishes.alloy} if wishes.alloy else {})}
    arrangement = pj.layout(design)
    nominal = {**nominal_geometry("actuator", {"design": design}), **stated}
    nominal.pop("cycles_before")
    springs = arrangement.spring_numbers
    tolerance = TOLERANCE if springs else {k: v for k, v in TOLERANCE.items() if not k.startswith("G_")}
    drawn = Truth(wishes, tolerance)
    alloy = None
    if springs:
        table = load_calibration(nominal["alloy"], "alloy")
        constants = drawn.alloy(table, list(table.require(CONSTANTS)), possible_spring)
        alloy = pj.Alloy(**constants, name=table.name)
        nominal["alloy"] = "fit" if wishes.spread == "prior" else nominal["alloy"]
    true = drawn.geometry(nominal)
    law = _silicone(nominal["material"], drawn.factor("silicone_stiffness"))
    drawn.finish()
    geometry = _geometry(true)
    body = pj.round_actuator(arrangement, geometry, alloy, law)
    bench = Instruments.of("actuator", wishes, NOISE)
    ambient = AMBIENT_DEGC if wishes.ambient_degC is None else wishes.ambient_degC
    runs = [*RUNS[: RUNS_ASKED if wishes.tests is None else wishes.tests], CHECK]
    time = np.arange(0.0, SPAN_S, wishes.interval_s or INTERVAL_S)
    recordings = []
    for run in runs:
        columns = _simulate(body, geometry, run, time, ambient)
        recordings.append(
            bench.recording(run.name, run.role, "A", time, columns, nominal, drawn.tolerance)
        )
    title = f"Simulated runs of a {design} actuator"
    return Synthetic(title, recordings, {**drawn.record, "ambient_degC": ambient})


def _geometry(true: dict) -> pj.Geometry:
    names = [field.name for field in dataclasses.fields(pj.Geometry)]
    values = {name: true[name] for name in names if name in true}
    values |= {name: 1e-3 * true[f"{name}_mm"] for name in names if f"{name}_mm" in true}
    return pj.Geometry(**values)


def _simulate(
    body: pj.Actuator, geometry: pj.Geometry, run: Run, time: np.ndarray, ambient: float
) -> dict[str, np.ndarray]:
    """True columns of a run."""
    pressure = np.interp(time, *zip(*run.pressure, strict=True))
    drives, current = [], None
    for number, spring in zip(body.spring_numbers, body.springs, strict=True):
        if number == HEATED:
            full = _full_current(spring, run.heat, ambient)
            current = full * np.interp(time, *zip(*run.current, strict=True))
            drives.append(pj.Heating(jnp.asarray(current), jnp.asarray(ambient)))
        else:
            drives.append(pj.MartensiteFraction(jnp.asarray(1.0)))
    states, clock = pj.fresh_states(body, geometry), jnp.asarray(time)
    history = pj.simulate_history(body, jnp.asarray(1e3 * pressure), tuple(drives), states, time=clock)
    if not np.all(history.converged):
        row = int(np.argmin(np.asarray(history.converged)))
        raise InputError(
            f"{run.name}: this actuator has no equilibrium at {time[row]:g} s ({pressure[row]:g} kPa);"
            " ask for less --tolerance or other --truth"
        )
    columns = {"pressure_kPa": pressure}
    if current is not None:
        heated = history.rows.springs[body.spring_numbers.index(HEATED)]
        columns |= {f"resistance_{HEATED}_ohm": np.asarray(heated.resistance), f"current_{HEATED}_A": current}
    rows = history.rows
    if body.planar:
        columns["curvature_1pm"] = np.asarray(rows.curvature)
    else:
        columns["bend_angle_deg"] = from_si(np.asarray(rows.bend_magnitude), "deg")
        columns["bend_direction_deg"] = from_si(np.asarray(rows.bend_direction), "deg")
    columns["length_mm"] = from_si(np.asarray(rows.length), "mm")
    return columns


def _full_current(spring: pj.Spring, heat: float, ambient: float) -> float:
    """Current that heats a spring to `heat` widths above the middle of its transformation [A]."""
    alloy, g = spring.alloy, spring.geometry
    rise = float(alloy.T_mid + heat * alloy.T_width) - ambient
    resistance = float(alloy.resistivity(jnp.asarray(0.5), jnp.asarray(0.05)) * g.wire_length)
    loss = float(alloy.convection * jnp.pi * g.wire_diameter * g.wire_length)
    return round(float(np.sqrt(max(rise, 0.0) * loss / resistance)), 3)


def _silicone(material: str, stiffness: float) -> pj.silicone.SiliconeLaw:
    """A material's law with its stress multiplied by a batch's factor."""
    law = pj.load_silicone(material)
    return dataclasses.replace(law, stiffness=law.stiffness * stiffness)
