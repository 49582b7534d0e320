"""Influence of an effect on a typical recording: the same protocol simulated without it and with it."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

import pneusma_jax as pj
from fitting.specimens import Specimen
from fitting.specimens.actuator import BendingActuator
from fitting.specimens.elastomer import Coupon
from fitting.specimens.registry import by_letter, named_by
from fitting.specimens.spring import SpringOnStand
from fitting.specimens.tube import Tube
from fitting.specimens.wire import StraightWire
from pneusma_jax.effects import Effect, find_effect, specs_of
from pneusma_jax.units import from_si

ROWS = 241
"""Number of rows of every protocol."""
TIME = np.linspace(0.0, 240.0, ROWS)
"""Time of the rows [s]."""


@dataclass(frozen=True)
class Signature:
    """One effect on one protocol.

    Attributes:
        slug: slug of the effect.
        kind: name of the kind of recording.
        parameters: parameters of the effect, SI.
        drive: prescribed inputs by canonical column, shape (rows,); the first is the horizontal axis of a
            loop.
        without: outputs without the effect, by canonical column, shape (rows,).
        present: the same with the effect.
    """

    slug: str
    kind: str
    parameters: Mapping[str, float]
    drive: Mapping[str, np.ndarray]
    without: Mapping[str, np.ndarray]
    present: Mapping[str, np.ndarray]

    def largest(self) -> dict[str, float]:
        """Largest change of every output, in its unit."""
        changes = {name: self.present[name] - without for name, without in self.without.items()}
        return {name: float(np.nanmax(np.abs(change))) for name, change in changes.items()}


def chosen(slug: str, letter: str, values: Mapping[str, float]) -> dict[str, float]:
    """Parameters of an effect in a kind of recording: the given ones, the rest typical; SI.

    Args:
        slug: slug of the effect.
        letter: letter of the kind of recording, as `Specimen.letter`.
        values: the given ones, SI, by name.

    Raises:
        InputError: for a parameter that the effect does not have there, or one outside its physical bounds.
    """
    specs = specs_of(find_effect(slug), letter)
    for name, value in values.items():
        if name not in specs:
            where = f"{slug} on a recording of kind {by_letter(letter).kind}"
            raise pj.InputError(f"{where} has no parameter {name!r}, known: {', '.join(specs)}")
        spec = specs[name]
        if not spec.low <= value <= spec.high:
            bounds = f"{spec.low:g} to {spec.high:g} {spec.unit}"
            raise pj.InputError(f"{slug}: {name} must be {bounds}, not {value:g}")
    return {name: float(values.get(name, spec.typical)) for name, spec in specs.items()}


def signature(slug: str, letter: str | None = None, values: Mapping[str, float] | None = None) -> Signature:
    """Simulate the typical protocol of a kind without an effect and with it.

    Args:
        slug: slug of the effect.
        letter: letter of a kind of recording that can show it; the first such kind if None.
        values: parameter values that replace the typical ones, SI.

    Raises:
        InputError: for an unknown effect, a kind that it does not concern, or impossible parameters.
    """
    effect = find_effect(slug)
    letter = letter or effect.kinds[0]
    specimen = by_letter(letter)
    if letter not in effect.kinds:
        kinds_text = ", ".join(named_by(effect.kinds))
        raise pj.InputError(f"{slug} does not concern recordings of kind {specimen.kind}, only: {kinds_text}")
    parameters = chosen(slug, letter, values or {})
    drive, simulate = typical(specimen)
    plain, present = simulate(()), simulate((effect(**parameters),))
    return Signature(slug, specimen.kind, parameters, drive, plain, present)


Simulate = Callable[[tuple], dict[str, np.ndarray]]


def _ramps(*points: tuple[float, float]) -> np.ndarray:
    """Straight lines between points (time [s], value), at the times of the rows."""
    return np.interp(TIME, *np.array(points).T)


def _in_units(seen: Mapping[str, object], columns: Mapping[str, tuple[str, str]]) -> dict[str, np.ndarray]:
    """Outputs by canonical column; `columns` gives the name in the model and the unit."""
    return {column: np.asarray(from_si(seen[name], unit)) for column, (name, unit) in columns.items()}


Protocol = tuple[dict[str, np.ndarray], Simulate]
"""Prescribed inputs by canonical column, and a function that simulates them with effects."""


@functools.singledispatch
def typical(specimen: Specimen) -> Protocol:
    """The typical protocol of a kind of specimen.

    Raises:
        InputError: if none is registered.
    """
    raise pj.InputError(f"no typical protocol of recordings of kind {specimen.kind} is known")


@typical.register
def _(specimen: BendingActuator) -> Protocol:
    """PneuSMA2 lying on its side: two heat cycles at two pressures, then pressure alone."""
    pressure = _ramps(
        (0, 0), (10, 15e3), (100, 15e3), (110, 30e3), (190, 30e3), (200, 10e3), (220, 35e3), (240, 0)
    )
    xi0 = _ramps((20, 1), (50, 0.1), (60, 0.1), (90, 1), (115, 1), (145, 0.1), (155, 0.1), (185, 1), (240, 1))
    current = np.where(np.gradient(xi0) < 0.0, 0.7, 0.45) * (xi0 < 1.0)
    body, down = pj.make_actuator("pneusma2"), pj.gravity_vector("horizontal")
    columns = {"curvature_1pm": ("curvature", "1/m"), "length_mm": ("length", "mm")}

    def simulate(effects: tuple) -> dict[str, np.ndarray]:
        drive = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(xi0))
        history = pj.simulate_history(
            body, pressure, drive, time=TIME, effects=effects, currents=(None, current), gravity=down
        )
        ohms = {"resistance_2_ohm": np.asarray(history.rows.springs[1].resistance)}
        return _in_units(history.seen, columns) | ohms

    return {"time_s": TIME, "pressure_kPa": pressure / 1e3, "xi0_2": xi0}, simulate


@typical.register
def _(specimen: SpringOnStand) -> Protocol:
    """A spring is pushed a little and pulled: cold, half hot, hot, and cold again; quickly and slowly."""
    x = 1e-3 * _ramps((0, 0), (5, -1), (40, 40), (50, 0), (90, 40), (120, 5), (150, 30), (180, 0), (240, 45))
    xi0 = _ramps((0, 1), (50, 1), (60, 0.4), (120, 0.4), (130, 0.05), (180, 0.1), (210, 1), (240, 1))
    geometry = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    spring = pj.Spring(geometry, pj.load_alloy("krl35"), geometry.free_length)
    columns = {"force_N": ("force", "N"), "resistance_ohm": ("resistance", "ohm")}

    def simulate(effects: tuple) -> dict[str, np.ndarray]:
        history = pj.simulate_spring(spring, x, pj.MartensiteFraction(xi0), time=TIME, effects=effects)
        return _in_units(history.seen, columns)

    return {"elongation_mm": x * 1e3, "time_s": TIME, "xi0": xi0}, simulate


@typical.register
def _(specimen: StraightWire) -> Protocol:
    """A wire is cooled and heated under two stresses. Its resistance is read if an effect acts on it."""
    temperature = _ramps((0, 80), (60, 5), (120, 80), (180, 5), (240, 80))
    stress = np.where(TIME < 120.0, 100e6, 200e6)
    wire = pj.load_wire()
    ohms = pj.WireResistance(2.0 + np.asarray(wire.martensite_fraction_at(temperature)), 3.0, 2.0)

    def simulate(effects: tuple) -> dict[str, np.ndarray]:
        read = any(type(e).wire_resistance is not Effect.wire_resistance for e in effects)
        history = pj.simulate_wire(
            wire, stress=stress, temperature=temperature, resistance=ohms if read else None,
            time=TIME, effects=effects,
        )  # fmt: skip
        return _in_units(history.seen, {"strain": ("strain", "1")})

    return {"temperature_degC": temperature, "time_s": TIME, "stress_MPa": stress / 1e6}, simulate


@typical.register
def _(specimen: Coupon) -> Protocol:
    """A coupon is strained in two equal cycles, then further, and held."""
    strain = _ramps((0, 0), (30, 0.4), (60, 0), (90, 0.4), (120, 0), (170, 0.9), (200, 0.9), (240, 0))
    law = pj.load_silicone()

    def simulate(effects: tuple) -> dict[str, np.ndarray]:
        seen = pj.simulate_coupon(law, strain, time=TIME, effects=effects).seen
        return _in_units(seen, {"stress_kPa": ("stress", "kPa")})

    return {"strain": strain, "time_s": TIME}, simulate


@typical.register
def _(specimen: Tube) -> Protocol:
    """A tube is inflated twice, then further, and held."""
    pressure = _ramps((0, 0), (30, 20e3), (60, 0), (90, 20e3), (120, 0), (170, 40e3), (200, 40e3), (240, 0))
    tube = pj.make_tube(pj.Geometry(), pj.load_silicone())

    def simulate(effects: tuple) -> dict[str, np.ndarray]:
        seen = pj.simulate_tube(tube, pressure, time=TIME, effects=effects).seen
        return _in_units(seen, {"length_mm": ("length", "mm")})

    return {"pressure_kPa": pressure / 1e3, "time_s": TIME}, simulate
