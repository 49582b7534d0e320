"""Pressurised tubes with effects: pressure in, length out."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

import pneusma_jax as pj
from fitting.specimens import silicones, tube
from fitting.specimens.rows import Rows, numbers
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.tracking import track_history
from pneusma_jax.simulate.tube import make_tube

OUTPUTS = ("length",)
MOST_ROWS = 512
"""Rows of a recording: every one is an equilibrium."""
rows_for = tube.rows_for
parameters_for = tube.parameters_for


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `specimens.with_effects.Kind`."""
    known = numbers(values, rows)
    law = silicones.law_with(rows.extra["law"], known)
    geometry = pj.Geometry(**{name: known[name] for name in tube.GEOMETRY if name in GEOMETRY_KEYS})
    body = make_tube(geometry, law)
    pressure = rows.inputs["pressure"]
    track = track_history(body, pressure, (), (), rows.time, effects)
    rate = jnp.gradient(pressure) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
    strain = track.rows.length / body.length - 1.0
    drivers = {"pressure": pressure, "pressure_rate": rate, "strain": strain}
    return {"length": track.seen["length"]}, drivers
