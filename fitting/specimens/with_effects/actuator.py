"""Actuators with effects: pressure in; curvature, bend angle, length and the measured resistances out.

Martensite fractions are latent trajectories (`courses`), or follow resistances where a model on disk is
fitted.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording
from fitting.inference.readings import measurements
from fitting.specimens import actuator
from fitting.specimens.actuator_followed import FollowedPhase, settled
from fitting.specimens.actuator_phase import BEGIN
from fitting.specimens.actuator_rows import body_of
from fitting.specimens.rows import Rows, numbers
from pneusma_jax.actuator.loads import gravity_vector
from pneusma_jax.nitinol import MartensiteFraction, SpringState
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.tracking import track_history

__all__ = ["OUTPUTS", "READINGS", "hidden_rows_for", "parameters_for", "predict", "rows_for", "settled"]

OUTPUTS = ("curvature", "bend_angle", "length")
READINGS = ("resistance_1", "resistance_2", "resistance_3")
"""Outputs of latent trajectories."""
FOLLOWING = ("gain", "ohms", "gamma", "sd")
"""Columns of phases that follow resistances."""
MOST_ROWS = 128
"""Rows of a recording: every one is an equilibrium."""
COMPILER_OPTIONS = {"xla_cpu_use_fusion_emitters": False}
"""A run is a long loop over small arrays; the older code generation takes a fifth less time for it."""
parameters_for = actuator.parameters_for


def rows_for(campaign: Campaign, **options: Any) -> list[Rows]:
    """Every recording as arrays, with what only effects ask for: currents, air temperature, gravity.

    Args:
        campaign: recordings of kind actuator, of one design.
        **options: of the base model's `rows_for`.
    """
    return _with_records(campaign, actuator.rows_for(campaign, **options))


def _with_records(campaign: Campaign, recordings: list[Rows]) -> list[Rows]:
    members = campaign.recordings
    shared = [
        q for q in ("current_1", "current_2", "current_3", "temperature") if any(r.has(q) for r in members)
    ]
    return [
        eqx.tree_at(lambda x: x.extra, rows, rows.extra | _recorded(recording, rows, shared))
        for recording, rows in zip(members, recordings, strict=True)
    ]


def _recorded(recording: Recording, rows: Rows, names: list[str]) -> dict[str, np.ndarray]:
    springs = len(rows.extra["xi0"])
    found = {"gamma": tuple(np.zeros(len(rows.mask)) for _ in range(springs))}
    found |= {
        "gravity": np.asarray(
            gravity_vector(recording.full_geometry().get("orientation", "vertical_base_down"))
        )
    }
    for name in names:
        nominal = 22.0 if name == "temperature" else 0.0
        column = np.full(len(rows.mask), nominal)
        if recording.has(name):
            values, time = recording.si(name), recording.si("time")
            held = np.isfinite(values) & np.isfinite(time)
            if held.any():
                column = np.interp(np.asarray(rows.time), time[held], values[held])
        found[f"recorded_{name}"] = column
    return found


def hidden_rows_for(campaign: Campaign) -> list[Rows]:
    """Recordings whose fractions are latent trajectories, and resistances outputs."""
    rows = _with_records(campaign, actuator.undecided_rows_for(campaign))
    return [_hidden(*pair) for pair in zip(rows, campaign.recordings, strict=True)]


def _hidden(rows: Rows, recording: Recording) -> Rows:
    extra = {name: x for name, x in rows.extra.items() if name not in FOLLOWING}
    numbers_ = extra["layout"].spring_numbers
    begin = {n: BEGIN if float(rows.extra.get(f"noise_resistance_{n}", 0.0)) > 0.0 else 1.0 for n in numbers_}
    extra["xi0"] = tuple(np.full(len(rows.mask), begin[n]) for n in numbers_)
    still = np.zeros(len(rows.mask))
    read = {name: np.asarray(x) for name, x in rows.inputs.items() if name in READINGS}
    noise = {name: float(rows.extra[f"noise_{name}"]) for name in read}
    weight = {name: _counted(rows, recording, name) / sd if sd > 0.0 else still for name, sd in noise.items()}
    own = extra.pop("clean", rows.weight)  # without what an uncertain phase adds
    return eqx.tree_at(
        lambda r: (r.extra, r.measured, r.weight), rows, (extra, rows.measured | read, dict(own) | weight)
    )


def _counted(rows: Rows, recording: Recording, name: str) -> np.ndarray:
    """One in rows whose resistance is a measurement, else zero."""
    there = np.isfinite(recording.si("time"))
    measured = np.isfinite(measurements(recording, name))
    return np.isin(np.asarray(rows.time), recording.si("time")[there & measured]).astype(float)


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `specimens.with_effects.Kind`."""
    known = numbers(values, rows)
    body = body_of(known, rows)
    extra = rows.extra
    if "gain" in extra:
        following = zip(extra["xi0"], extra["ohms"], extra["gain"], extra["gamma"], strict=True)
        phases = tuple(FollowedPhase(*one) for one in following)
    else:
        phases = tuple(MartensiteFraction(x) for x in extra["xi0"])
    one = jnp.ones(())
    states = tuple(SpringState(known["prestrain"], one) for _ in body.springs)
    pressure = rows.inputs["pressure"]
    known_rows = {"gravity": jnp.broadcast_to(extra["gravity"], (pressure.size, 3))}
    currents = {
        n: extra[f"recorded_current_{n}"] for n in body.spring_numbers if f"recorded_current_{n}" in extra
    }
    if currents:
        known_rows["currents"] = currents
    if "recorded_temperature" in extra:
        known_rows["temperature"] = extra["recorded_temperature"]
    guess = tuple(MartensiteFraction(x[0]) for x in extra["xi0"])
    track = track_history(body, pressure, phases, states, rows.time, effects, known_rows, guess)
    rate = jnp.gradient(pressure) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
    drivers = {"pressure": pressure, "pressure_rate": rate, "curvature": track.rows.curvature}
    drivers |= {f"current_{n}": values for n, values in currents.items()}
    for number, response in zip(body.spring_numbers, track.rows.springs, strict=True):
        drivers |= {f"xi0_{number}": response.xi0, f"gamma_{number}": response.gamma}
        drivers[f"ohms_{number}"] = response.resistance
    found = {name: track.seen[name] for name in OUTPUTS}
    found |= {name: drivers[f"ohms_{name[-1]}"] for name in READINGS if name in rows.measured}
    return found, drivers
