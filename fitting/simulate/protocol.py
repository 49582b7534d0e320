"""A protocol applied to a specimen: inputs and the model's response as columns of a table."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import pneusma_jax as pj
from fitting.data.protocols.reading import Protocol
from fitting.data.recordings import Recording, resistance_range
from fitting.data.recordings.kinds import PHASE
from fitting.specimens import ACTUATOR, Specimen, specimen_of
from fitting.specimens.actuator import BendingActuator
from fitting.specimens.cautions import (
    actuator_cautions,
    chain_touching_cautions,
    silicone_cautions,
    spring_cautions,
    touching_angle,
)
from fitting.specimens.model_objects import (
    BASE,
    actuator_of,
    full_geometry,
    geometry_of,
    gravity_of,
    law_of,
    spring_of,
)
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.spring import SpringOnStand
from fitting.specimens.tube import Tube
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol.thermal import duty_cycle_current
from pneusma_jax.simulate.tube import make_tube, simulate_tube
from pneusma_jax.units import from_si

from .unmodelled import marked

UNITS = {
    "pressure": "kPa", "resistance": "ohm", "current": "A", "temperature": "degC", "ambient": "degC",
    "elongation": "mm",
}  # fmt: skip


@dataclass
class ProtocolResponse:
    """Response of the model to a protocol.

    Attributes:
        title: names of protocol and specimen.
        inputs: inputs by column, in that column's unit, `time_s` first; shape (rows,).
        outputs: predicted outputs by column, `model_...`; shape (rows,).
        states: further states of each row by column.
        notices: warnings in words.
        chain: chain and its history, where there is one.
    """

    title: str
    inputs: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]
    states: dict[str, np.ndarray]
    notices: list[str]
    chain: tuple[pj.SegmentChain, pj.ChainHistory] | None = None
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """All columns, as in `model.csv`."""
        return self.inputs | self.outputs | self.states


def run_protocol(protocol: Protocol, specimen: Recording, model: AugmentedModel = BASE) -> ProtocolResponse:
    """Apply a protocol to a specimen.

    Args:
        protocol: protocol of the specimen's kind.
        specimen: recording that describes the specimen.
        model: model in place of the base model.

    Raises:
        InputError: for a channel of a missing spring, or an impossible specimen.
    """
    check_resistances(protocol, specimen)
    response = _run(specimen_of(protocol.kind), protocol, specimen, model)
    response.inputs = _inputs(protocol)
    return response


def check_resistances(protocol: Protocol, specimen: Recording) -> None:
    """Refuse resistances that the specimen's springs cannot have.

    Raises:
        InputError: for one outside half to twice the alloy's range; names the channel.
    """
    bounds = resistance_range(specimen)
    for name, values in protocol.channels.items():
        if bounds is None or not name.rpartition(".")[2].startswith("resistance"):
            continue
        wrong = values[(values < bounds[0]) | (values > bounds[1])]
        if wrong.size:
            raise InputError(
                f"{protocol.path}: channel {name!r}: {wrong[0]:g} ohm cannot be: half to twice the range of"
                f" alloy {specimen.full_geometry()['alloy']!r} on this spring is {bounds[0]:.3g} to"
                f" {bounds[1]:.3g} ohm"
            )


def _inputs(protocol: Protocol) -> dict[str, np.ndarray]:
    """Channels of a protocol as columns of a recording."""
    columns = {"time_s": protocol.time}
    for name, values in protocol.channels.items():
        segment, _, rest = name.rpartition(".")
        unit = UNITS.get(rest.partition("_")[0])
        column = f"{rest}_{unit}" if unit else rest
        columns[f"segment_{segment}_{column}" if segment else column] = (
            from_si(values, unit) if unit else values
        )
    return columns


@functools.singledispatch
def _run(kind: Specimen, protocol: Protocol, specimen: Recording, model: AugmentedModel) -> ProtocolResponse:
    """Response of the specimen to a protocol.

    Raises:
        InputError: for a kind of specimen that no protocol is for.
    """
    raise InputError(f"{protocol.path}: no protocol can be done to a {kind.kind}")


@_run.register
def _(
    kind: BendingActuator, protocol: Protocol, specimen: Recording, model: AugmentedModel
) -> ProtocolResponse:
    actuator = actuator_of(specimen, model)
    _check_springs(protocol, [actuator])
    prestrain = full_geometry(specimen, model)["prestrain"] if actuator.springs else 0.0
    states = tuple(pj.SpringState.fresh(prestrain) for _ in actuator.springs)
    driven = drives(protocol, actuator)
    history = pj.simulate_history(
        actuator, protocol.channels["pressure"], driven, states, time=protocol.time, effects=model.effects,
        currents=tuple(drive.current if isinstance(drive, pj.Heating) else None for drive in driven),
        ambient=protocol.channels.get("ambient"), gravity=gravity_of(specimen),
    )  # fmt: skip
    outputs, known = _described(actuator, history)
    notices = actuator_cautions(actuator, history.rows, touching_angle(specimen.geometry, model))
    title = f"{protocol.name}: {_short(specimen.full_geometry()['design'])}"
    bent = () if actuator.planar else ("curvature", "bend_angle")
    marks, more = marked(model, history.seen, "actuator", bent)
    return ProtocolResponse(title, {}, outputs, known | marks, [*specimen.notices, *notices, *more])


def _short(name: str) -> str:
    return str(name).rpartition("/")[2].removesuffix(".toml")


def drives(protocol: Protocol, actuator: pj.Actuator, segment: int | None = None) -> tuple[Any, ...]:
    """Drive of each spring of an actuator, or of one segment of a chain; cold where none is prescribed."""
    return tuple(_drive(protocol, spring, n, segment) for spring, n in zip(
        actuator.springs, actuator.spring_numbers, strict=True
    ))  # fmt: skip


def _drive(protocol: Protocol, spring: pj.Spring, number: int, segment: int | None) -> Any:
    own = [f"{segment}.{stem}_{number}" for stem in PHASE] if segment is not None else []
    names = [*own, *(f"{stem}_{number}" for stem in PHASE)]
    name = next((name for name in names if name in protocol.channels), None)
    if name is None:
        return pj.MartensiteFraction(np.ones(len(protocol)))
    values = protocol.channels[name]
    stem = name.rpartition(".")[2].partition("_")[0]
    if stem == "xi0":
        return pj.MartensiteFraction(values)
    if stem == "resistance":
        return pj.Resistance(values)
    if stem == "temperature":
        return pj.MartensiteFraction(np.asarray(spring.alloy.martensite_fraction_at(values)))
    current = values if stem == "current" else _pulsed(protocol, values)
    return pj.Heating(current, protocol.channels.get("ambient", np.full(len(protocol), 22.0)))


def _pulsed(protocol: Protocol, duty: np.ndarray) -> np.ndarray:
    """Current of a pulse-width modulated supply [A]: its pulses, or their root mean square."""
    if "current" not in protocol.supply:
        raise InputError(
            f"{protocol.path}: a duty cycle needs [supply] current_A, the current while it is on"
        )
    full, period = protocol.supply["current"], protocol.supply.get("period", 0.0)
    if not period:
        return np.asarray(duty_cycle_current(duty, full))
    # the current of a row is that of the interval before it
    since = np.mod(protocol.time - 0.5 * (protocol.time[1] - protocol.time[0]), period) / period
    return np.where(since < duty, full, 0.0)


def _check_springs(protocol: Protocol, actuators: Sequence[pj.Actuator]) -> None:
    """Refuse channels of springs and segments that do not exist."""
    for name in protocol.channels:
        segment, _, rest = name.rpartition(".")
        stem, _, number = rest.partition("_")
        if segment and int(segment) > len(actuators):
            available = f"there are {len(actuators)} segments" if len(actuators) > 1 else "this is no chain"
            raise InputError(f"{protocol.path}: channel {name!r}, but {available}")
        bodies = [actuators[int(segment) - 1]] if segment else list(actuators)
        available = sorted({n for body in bodies for n in body.spring_numbers})
        if stem in PHASE and int(number) not in available:
            listed = ", ".join(map(str, available)) or "none"
            raise InputError(
                f"{protocol.path}: channel {name!r}, but the springs that are there are: {listed}"
            )


def _described(actuator: pj.Actuator, history: pj.History, before: str = "") -> tuple[dict, dict]:
    """Columns of outputs and states of an actuator's history."""
    rows, seen = history.rows, history.seen
    planar = actuator.planar
    bend = seen["bend_angle"] if planar else rows.bend_magnitude
    curvature = seen["curvature"] if planar else bend / rows.length
    outputs = {"curvature_1pm": curvature, "bend_angle_deg": from_si(bend, "deg")}
    if not planar:
        outputs["bend_direction_deg"] = from_si(np.asarray(rows.bend_direction), "deg") % 360.0
    outputs["length_mm"] = from_si(seen["length"], "mm")
    states: dict[str, Any] = {"status": [pj.Status(int(code)).name for code in np.asarray(rows.status)]}
    temperatures = np.asarray(history.temperatures)
    for k, (n, response) in enumerate(zip(actuator.spring_numbers, rows.springs, strict=True)):
        states |= {
            f"model_xi0_{n}": response.xi0, f"model_gamma_R_{n}": response.gamma_R,
            f"model_force_{n}_N": response.force, f"model_resistance_{n}_ohm": response.resistance,
        }  # fmt: skip
        if np.isfinite(temperatures[:, k]).any():
            states[f"model_temperature_{n}_degC"] = temperatures[:, k]
    named = {f"{before}model_{name}": np.asarray(values) for name, values in outputs.items()}
    return named, {f"{before}{name}": np.asarray(values) for name, values in states.items()}


def run_chain_protocol(
    protocol: Protocol, name: str, chain: pj.SegmentChain, specimens: Sequence[Recording]
) -> ProtocolResponse:
    """Apply a protocol to a chain.

    Args:
        protocol: protocol of kind actuator.
        name: name of the chain.
        chain: solved chain of segments.
        specimens: recordings that describe the segments.

    Raises:
        InputError: for a channel of a missing spring or segment.
    """
    if specimen_of(protocol.kind) is not ACTUATOR:
        raise InputError(f"{protocol.path}: this protocol is for a {protocol.kind}, not for a chain")
    _check_springs(protocol, chain.segments)
    for specimen in specimens:
        check_resistances(protocol, specimen)
    prestrains = [specimen.full_geometry().get("prestrain", 0.0) for specimen in specimens]
    pressure = protocol.channels["pressure"]
    driven = [drives(protocol, body, k) for k, body in enumerate(chain.segments, 1)]
    rest = [
        tuple(pj.SpringState.fresh(prestrain) for _ in body.springs)
        for body, prestrain in zip(chain.segments, prestrains, strict=True)
    ]
    history = pj.simulate_chain_history(chain, pressure, driven, rest, time=protocol.time)
    tips = from_si(np.asarray(history.shape.end_pose)[:, :3, 3], "mm")
    outputs = {f"model_tip_{axis}_mm": tips[:, k] for k, axis in enumerate("xyz")}
    states: dict[str, np.ndarray] = {}
    notices = list(dict.fromkeys(said for specimen in specimens for said in specimen.notices))
    for k, (body, part) in enumerate(zip(chain.segments, history.segments, strict=True), 1):
        segment_outputs, segment_states = _described(body, part, f"segment_{k}_")
        outputs, states = outputs | segment_outputs, states | segment_states
        notices += [f"segment {k}: {sentence}" for sentence in actuator_cautions(body, part.rows)]
    notices += chain_touching_cautions(history.shape)
    title = f"{protocol.name}: {name}"
    return ProtocolResponse(title, _inputs(protocol), outputs, states, notices, (chain, history), pressure)


@_run.register
def _(
    kind: SpringOnStand, protocol: Protocol, specimen: Recording, model: AugmentedModel
) -> ProtocolResponse:
    spring = spring_of(specimen, model)
    channels = protocol.channels
    if "resistance" in channels:
        activation: Any = pj.Resistance(channels["resistance"])
    elif "temperature" in channels:
        fraction = spring.alloy.martensite_fraction_at(channels["temperature"])
        activation = pj.MartensiteFraction(np.asarray(fraction))
    else:
        activation = pj.MartensiteFraction(channels.get("xi0", np.ones(len(protocol))))
    state = pj.SpringState.fresh(full_geometry(specimen, model)["prestrain"])
    history = pj.simulate_spring(
        spring, channels["elongation"], activation, state, time=protocol.time, effects=model.effects
    )
    outputs = {"model_force_N": history.seen["force"], "model_resistance_ohm": history.seen["resistance"]}
    rows = history.rows
    states = {
        "model_xi0": rows.xi0, "model_gamma": rows.gamma, "model_gamma_R": rows.gamma_R,
        "model_stress_MPa": from_si(np.asarray(rows.stress), "MPa"),
    }  # fmt: skip
    title = f"{protocol.name}: spring of {_short(specimen.full_geometry()['alloy'])}"
    arrays = lambda table: {name: np.asarray(values) for name, values in table.items()}  # noqa: E731
    marks, more = marked(model, history.seen, "spring")
    cautions = spring_cautions(spring, rows, "the spring") + more
    return ProtocolResponse(title, {}, arrays(outputs), arrays(states) | marks, cautions)


@_run.register
def _(kind: Tube, protocol: Protocol, specimen: Recording, model: AugmentedModel) -> ProtocolResponse:
    geometry, law = geometry_of(specimen, model), law_of(specimen, model)
    try:
        tube = make_tube(geometry, law)
    except ValueError as error:
        raise InputError(f"{specimen.path or specimen.name}: {error}") from None
    history = simulate_tube(tube, protocol.channels["pressure"], time=protocol.time, effects=model.effects)
    length = np.asarray(history.seen["length"])
    strain = np.asarray(history.rows.length) / float(geometry.length) - 1.0
    status = np.array([pj.Status(int(code)).name for code in np.asarray(history.rows.status)])
    outputs = {"model_length_mm": from_si(length, "mm")}
    title = f"{protocol.name}: tube of {_short(specimen.full_geometry()['material'])}"
    marks, more = marked(model, history.seen, "tube")
    cautions = silicone_cautions(law, strain, strain) + more
    return ProtocolResponse(title, {}, outputs, {"status": status, "model_strain": strain} | marks, cautions)
