"""Forward model of actuators with effects: pressure in; curvature, bend angle, length and measured
resistances out.

In a diagnosis the martensite fractions are latent trajectories. Where a model on disk is fitted, they follow
the resistances.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import Channel
from fitting.inference.readings import measurements
from pneusma_jax.model_discrepancy import CHANNELS
from pneusma_jax.nitinol import MartensiteFraction, SpringState
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.tracking import track_history

from .actuator_data import undecided_rows_for
from .actuator_followed import FollowedPhase, settled
from .actuator_phase import BEGIN, UNSETTLED
from .actuator_rows import body_of
from .latent import Drivers, LatentStates
from .rows import Rows, numbers

EXPLAINED = ("curvature", "bend_angle", "length")
"""Outputs that effects change: all but the direction of the bend."""
READINGS = ("resistance_1", "resistance_2", "resistance_3")
"""Outputs that are measured to find the latent trajectories."""
FOLLOWING = ("xi0", "ohms", "gain", "gamma", "coupled_gain")
"""Columns of martensite fractions that follow resistances, as `FollowedPhase` takes them."""


def hidden_rows_for(campaign: Campaign, **tables: Any) -> list[Rows]:
    """Recordings whose martensite fractions are latent trajectories and whose resistances are outputs."""
    rows = undecided_rows_for(campaign, **tables)
    return [_hidden(*pair) for pair in zip(rows, campaign.recordings, strict=True)]


def _hidden(rows: Rows, recording: Recording) -> Rows:
    extra = {name: x for name, x in rows.extra.items() if name not in (*FOLLOWING, UNSETTLED, "sd")}
    numbers_ = extra["layout"].spring_numbers
    begin = {n: BEGIN if float(rows.extra.get(f"noise_resistance_{n}", 0.0)) > 0.0 else 1.0 for n in numbers_}
    extra["xi0"] = tuple(np.full(len(rows.mask), begin[n]) for n in numbers_)
    still = np.zeros(len(rows.mask))
    read = {name: np.asarray(x) for name, x in rows.inputs.items() if name in READINGS}
    noise = {name: float(rows.extra[f"noise_{name}"]) for name in read}
    weight = {name: _counted(rows, recording, name) / sd if sd > 0.0 else still for name, sd in noise.items()}
    own = extra.pop("clean", rows.weight)  # without the variance of an uncertain phase
    return eqx.tree_at(
        lambda r: (r.extra, r.measured, r.weight), rows, (extra, rows.measured | read, dict(own) | weight)
    )


def _counted(rows: Rows, recording: Recording, name: str) -> np.ndarray:
    """One in rows whose resistance is a measurement, zero in the others."""
    finite = np.isfinite(recording.si("time"))
    measured = np.isfinite(measurements(recording, name))
    return np.isin(np.asarray(rows.time), recording.si("time")[finite & measured]).astype(float)


def with_effects(
    values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...]
) -> tuple[dict[str, Array], dict[str, Any]]:
    """All outputs under effects; see `Specimen.answer`."""
    parameters = numbers(values, rows)
    body = body_of(parameters, rows)
    extra = rows.extra
    if "gain" in extra:
        following = zip(*(extra[name] for name in FOLLOWING), strict=True)
        phases = tuple(FollowedPhase(*one) for one in following)
    else:
        phases = tuple(MartensiteFraction(x) for x in extra["xi0"])
    one = jnp.ones(())
    states = tuple(SpringState(parameters["prestrain"], one) for _ in body.springs)
    pressure = rows.inputs["pressure"]
    known_rows = {"gravity": jnp.broadcast_to(extra["gravity"], (pressure.size, 3))}
    currents = {
        n: extra[f"recorded_current_{n}"] for n in body.spring_numbers if f"recorded_current_{n}" in extra
    }
    if currents:
        known_rows["currents"] = currents
        known_rows["has_currents"] = {n: extra[f"has_current_{n}"] for n in currents}
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
    found = {name: x for name, x in track.seen.items() if name in EXPLAINED or name.startswith(CHANNELS)}
    found |= {name: drivers[f"ohms_{name[-1]}"] for name in READINGS if name in rows.measured}
    return found, drivers


class SpringPhases(LatentStates):
    """Martensite fractions of an actuator's springs, solved for outside of `answer`."""

    readings = READINGS

    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Recordings as arrays; see `hidden_rows_for`."""
        return hidden_rows_for(campaign, **tables)

    def count(self, stacked: Rows) -> int:
        """Number of latent trajectories: one for each spring."""
        return len(stacked.extra["xi0"])

    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]]
    ) -> Rows:
        """The same stack. The process-noise variance is found by the code that solves for the
        trajectories."""
        return stacked

    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """The same stack, which already holds the trajectories."""
        return stacked

    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """Recordings with fractions read anew under a model with effects; see `actuator_followed`."""
        return settled(recordings, drivers)
