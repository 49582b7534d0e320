"""The model's prediction of a recording: its inputs drive the model, its outputs are predicted."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording, heated_unseen, schema
from fitting.inference.latent_trajectory.denoise import denoised, martensite_fraction
from fitting.inference.noise import robust_noise
from fitting.specimens import Specimen, specimen_of
from fitting.specimens.actuator import BendingActuator
from fitting.specimens.cautions import actuator_cautions, spring_cautions, statuses, touching_angle
from fitting.specimens.model_objects import BASE, actuator_of, full_geometry, gravity_of, place, spring_of
from fitting.specimens.row_builders import interpolated
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.simulation import simulated
from fitting.specimens.spring import SpringOnStand
from pneusma_jax.units import from_si

from .phases import fractions_behind
from .spring_phase import fraction_throughout
from .unmodelled import marked

LONGEST_GAP = 3
"""Maximum number of neighbouring rows without a resistance that is interpolated."""


@dataclass
class Prediction:
    """Predicted rows of a recording.

    Attributes:
        outputs: outputs by canonical column (`curvature_1pm`, ...) in that column's unit, shape (rows,); NaN
            where a row could not be computed.
        states: further states of each row: `xi0_2`, `gamma_R_2` (no unit), `status` (its name).
        notices: warnings in words.
        marks: contribution of a model discrepancy to the outputs, and its range flag, by column; see
            `unmodelled.marked`.
    """

    outputs: dict[str, np.ndarray]
    states: dict[str, np.ndarray] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)
    marks: dict[str, np.ndarray] = field(default_factory=dict)


def predict(recording: Recording, denoise: bool = True, model: AugmentedModel = BASE) -> Prediction:
    """Predict the outputs that a recording holds.

    Args:
        recording: checked recording of any kind.
        denoise: true to find the martensite fraction from the whole history of a resistance. False takes each
            sample alone, noise included. Of an actuator with effects the resistance itself is smoothed.
        model: model in place of the base model; outputs are instrument readings.

    Raises:
        InputError: if the recording leaves its alloy or material open, a wire has no temperature, or no row
            has all drivers.
    """
    specimen = specimen_of(recording.kind)
    drivers = [name for name in ("time", *specimen.drivers(recording)) if recording.has(name)]
    recording, bridged = _bridged(recording, drivers) if denoise else (recording, [])
    complete = ~np.any([recording.missing(name) for name in drivers], axis=0)
    if not complete.any():
        raise pj.InputError(f"{place(recording)}: no row has all of {', '.join(drivers)}")
    prediction = _predicted(specimen, recording, complete, denoise, model)
    outputs = {name: prediction.outputs[name] for name in recording.outputs if name in prediction.outputs}
    prediction.outputs = {name: _at_all_rows(values, complete) for name, values in outputs.items()}
    prediction.states = {name: _at_all_rows(values, complete) for name, values in prediction.states.items()}
    prediction.marks = {name: _at_all_rows(values, complete) for name, values in prediction.marks.items()}
    prediction.notices += bridged
    if not complete.all():
        gaps = f"{int(np.sum(~complete))} of {len(complete)} rows lack one of {', '.join(drivers)}"
        prediction.notices.append(f"{gaps}: they are passed over")
    return prediction


def _bridged(recording: Recording, drivers: Sequence[str]) -> tuple[Recording, list[str]]:
    """The recording with resistances interpolated between readings, in rows that have all other drivers.

    What drives the specimen acts in such a row, too: a pull that turns there is as long as it says. Longer
    gaps stay: nobody knows what the phase did there.
    """
    read = [name for name in drivers if name.startswith("resistance")]
    others = [recording.missing(name) for name in drivers if name not in read]
    driven = ~np.any(others, axis=0) if others else np.zeros(0, bool)
    columns, notices = dict(recording.columns), []
    for name in read:
        missing, time = recording.missing(name), recording.si("time")
        known = np.flatnonzero(~missing & np.isfinite(time))
        between = missing & driven
        for first, last in zip([-1, *known], [*known, len(missing)], strict=True):
            inside = first >= 0 and last < len(missing) and last - first - 1 <= LONGEST_GAP
            between[first + 1 : last] &= inside
        if between.any():
            column = recording.column(name)
            values = np.array(columns[column], float)
            values[between] = np.interp(time[between], time[known], values[known])
            columns[column] = values
            rows = f"{int(between.sum())} of {len(between)} rows"
            notices.append(f"{column} is missing in {rows} that are driven: it was interpolated")
    return replace(recording, columns=columns), notices


@functools.singledispatch
def _predicted(
    specimen: Specimen, recording: Recording, complete: np.ndarray, denoise: bool, model: AugmentedModel
) -> Prediction:
    """Prediction in the complete rows of a recording, by the forward model of its kind.

    Springs and actuators have predictions of their own below. A fit takes their martensite fractions from all
    columns together, but a prediction must not use the columns that it predicts.
    """
    found = simulated(specimen, recording, model, denoise)
    outputs = {}
    for name in recording.outputs:
        quantity, unit = schema.quantity_and_unit(name)
        if quantity in found.outputs and quantity not in found.rows.inputs:
            outputs[name] = np.asarray(from_si(found.outputs[quantity], unit))
    marks, more = marked(model, found.outputs, specimen.kind)
    notices = specimen.cautions(recording, found.rows, found.outputs, found.drivers)
    return Prediction(outputs, specimen.states(found.rows, found.drivers), notices + more, marks)


def _inputs(recording: Recording, complete: np.ndarray, names: Sequence[str], model: AugmentedModel) -> dict:
    """Inputs of the complete rows, SI, by quantity; those that only effects use where the model has any."""
    inputs = {name: recording.si(name)[complete] for name in names if recording.has(name)}
    return inputs | (_read_by_effects(recording, complete, inputs) if model.added else {})


def _read_by_effects(
    recording: Recording, complete: np.ndarray, inputs: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Currents and temperature, which drive nothing in the base model; interpolated where missing."""
    names = [name for name in ("temperature", *(f"current_{k}" for k in (1, 2, 3))) if recording.has(name)]
    found = {}
    for name in names:
        values = recording.si(name)[complete]
        if name not in inputs and np.isfinite(values).any():
            found[name] = interpolated(inputs["time"], inputs["time"], values)
    return found


def _at_all_rows(values: np.ndarray, complete: np.ndarray) -> np.ndarray:
    """Values of the complete rows at their positions; NaN, or an empty word, in the others."""
    values = np.asarray(values)
    words = values.dtype.kind == "U"
    result = np.full(complete.shape, "", values.dtype) if words else np.full(complete.shape, np.nan)
    result[complete] = values
    return result


@_predicted.register
def _(
    specimen: BendingActuator,
    recording: Recording,
    complete: np.ndarray,
    denoise: bool,
    model: AugmentedModel,
) -> Prediction:
    inputs = _inputs(recording, complete, ("time", *specimen.drivers(recording)), model)
    actuator = actuator_of(recording, model)
    prestrain = full_geometry(recording, model)["prestrain"] if actuator.springs else 0.0
    states = tuple(pj.SpringState.fresh(prestrain) for _ in actuator.springs)
    notices, activations, heated = [], [], heated_unseen(recording)
    for n in actuator.spring_numbers:
        if f"resistance_{n}" in inputs:
            activations.append(pj.Resistance(_smoothed(inputs, f"resistance_{n}", denoise and model.added)))
        else:
            activations.append(pj.MartensiteFraction(1.0))
            said = f"the resistance of spring {n} was not recorded: it is taken as cold (xi0 = 1)"
            notices.append(next((asked for asked in heated if f" spring {n} " in asked), said))
    pressure = _smoothed(inputs, "pressure", denoise)
    if denoise and not model.added and any(isinstance(a, pj.Resistance) for a in activations):
        found, read = _denoised_history(actuator, inputs["time"], pressure, activations, states)
        seen = {"curvature": found.curvature, "bend_angle": found.bend_angle, "length": found.length}
    else:
        history = pj.simulate_history(
            actuator, pressure, tuple(activations), states, time=inputs["time"], effects=model.effects,
            currents=tuple(inputs.get(f"current_{n}") for n in actuator.spring_numbers),
            ambient=inputs.get("temperature"),
            gravity=gravity_of(recording),
        )  # fmt: skip
        read, found, seen = history.rows, history.rows, history.seen
    bend = seen["bend_angle"] if actuator.planar else found.bend_magnitude
    outputs = {
        "curvature_1pm": seen["curvature"] if actuator.planar else bend / found.length,
        "bend_angle_deg": from_si(bend, "deg"),
        "length_mm": from_si(seen["length"], "mm"),
        "bend_direction_deg": from_si(found.bend_direction, "deg"),
    }
    known = {"status": np.array([pj.Status(code).name for code in statuses(found, read)])}
    for n, response in zip(actuator.spring_numbers, found.springs, strict=True):
        known |= {f"xi0_{n}": response.xi0, f"gamma_R_{n}": response.gamma_R}
    notices += actuator_cautions(actuator, found, touching_angle(recording.geometry, model), read)
    marks, more = marked(model, seen, "actuator", () if actuator.planar else ("curvature", "bend_angle"))
    return Prediction(outputs, known, notices + more, marks)


def _smoothed(inputs: dict[str, np.ndarray], name: str, wanted: object) -> np.ndarray:
    return denoised(inputs["time"], inputs[name]) if wanted else inputs[name]


def _denoised_history(
    actuator: pj.Actuator,
    time: np.ndarray,
    pressure: np.ndarray,
    activations: list,
    states: tuple[pj.SpringState, ...],
) -> tuple[pj.Equilibrium, pj.Equilibrium]:
    """History at the fractions behind the resistances, and the one at smoothed resistances."""
    measured = {k: np.asarray(a.value) for k, a in enumerate(activations) if isinstance(a, pj.Resistance)}
    smoothed = [
        pj.Resistance(denoised(time, measured[k]), np.full(len(time), robust_noise(time, measured[k])))
        if k in measured else a
        for k, a in enumerate(activations)
    ]  # fmt: skip
    read = pj.simulate_history(actuator, pressure, tuple(smoothed), states).rows
    begun = []
    for k, activation in enumerate(activations):
        xi0 = np.asarray(read.springs[k].xi0)
        finite = np.isfinite(xi0)
        if k in measured:
            rows = np.arange(len(xi0))
            xi0 = np.interp(rows, rows[finite], xi0[finite]) if finite.any() else np.ones(len(xi0))
            activation = pj.MartensiteFraction(xi0)
        begun.append(activation)
    fractions = fractions_behind(actuator, time, pressure, measured, begun, states)
    return pj.simulate_history(actuator, pressure, tuple(fractions), states).rows, read


@_predicted.register
def _(
    specimen: SpringOnStand,
    recording: Recording,
    complete: np.ndarray,
    denoise: bool,
    model: AugmentedModel,
) -> Prediction:
    inputs = _inputs(recording, complete, ("time", *specimen.drivers(recording)), model)
    spring = spring_of(recording, model)
    state = pj.SpringState.fresh(full_geometry(recording, model)["prestrain"])
    temperature = inputs.get("temperature") if model.added else None
    follow = partial(
        pj.simulate_spring, spring, inputs["elongation"], state=state, time=inputs["time"],
        effects=model.effects, temperature=temperature,
    )  # fmt: skip
    end = fraction_throughout(recording, complete, model, temperature, spring, state) if denoise else None
    notices = []
    if end is not None:
        phase = "cold" if end else "hot"
        notices.append(f"fully {phase} throughout (xi0 = {end:g}) explains every resistance within its noise")
        history = follow(pj.MartensiteFraction(end))
        read = history.rows
    else:
        history = follow(pj.Resistance(_smoothed(inputs, "resistance", denoise and model.added)))
        read = history.rows
        if denoise and not model.added:
            strain = np.asarray(read.gamma)
            fractions = martensite_fraction(spring, inputs["time"], inputs["resistance"], strain)
            history = follow(pj.MartensiteFraction(fractions))
    response = history.rows
    outputs = {"force_N": history.seen["force"]}
    notices += spring_cautions(spring, response, "the spring", read)
    if "temperature" in inputs:
        xi0 = spring.alloy.martensite_fraction_at(inputs["temperature"])
        rho = spring.alloy.resistivity(xi0, response.gamma)
        outputs["resistance_ohm"] = rho * spring.geometry.wire_length
        notices.append("force is predicted from resistance, and resistance from temperature on one curve")
    else:
        notices.append("resistance drives the spring, so it is not predicted; that takes temperature")
    marks, more = marked(model, history.seen, "spring", ("resistance",))
    return Prediction(outputs, {"xi0": response.xi0, "gamma_R": response.gamma_R}, notices + more, marks)
