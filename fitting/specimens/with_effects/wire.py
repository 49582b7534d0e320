"""Straight wires with effects: temperature and stress (or strain) in, strain (or stress) out."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from fitting.specimens import wire
from fitting.specimens.rows import Rows, numbers
from pneusma_jax.nitinol import SpringState, simulate_wire
from pneusma_jax.pipeline import Effect

OUTPUTS = ("strain", "stress")
rows_for = wire.rows_for
parameters_for = wire.parameters_for


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `specimens.with_effects.Kind`."""
    known = numbers(values, rows)
    element, state = wire.wire_of(known), SpringState(known["prestrain"], jnp.ones(()))
    temperature = rows.inputs["temperature"]
    drive = {"temperature": temperature, "state": state, "time": rows.time, "effects": effects}
    found, driven = {}, None
    for given, free in (("stress", "strain"), ("strain", "stress")):
        if given in rows.inputs:
            run = simulate_wire(element, **{given: rows.inputs[given]}, **drive)
            found[free], driven = run.seen[free], run.rows
    if len(found) == 2:
        by_stress = rows.extra["by_stress"] > 0.0
        found = {
            "strain": jnp.where(by_stress, found["strain"], rows.inputs["strain"]),
            "stress": jnp.where(by_stress, rows.inputs["stress"], found["stress"]),
        }
    drivers = {
        "temperature": temperature,
        "stress": driven.stress,
        "strain": driven.strain,
        "xi0": driven.xi0,
    }
    nothing = jnp.zeros_like(temperature)
    return {name: found.get(name, nothing) for name in OUTPUTS}, drivers
