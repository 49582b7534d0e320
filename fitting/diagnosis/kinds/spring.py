"""Springs on a test stand in a diagnosis: elongation in; force and resistance out, from one hidden phase.

The martensite fraction behind a resistance is read with every candidate's own sensors and strains,
smoothed, and must then reproduce the resistance: what bends a resistance cannot hide in the phase.
"""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

import pneusma_jax as pj
from fitting.models import spring
from fitting.models.latent import solve_tridiagonal
from fitting.models.rows import Rows, numbers
from fitting.models.wander import with_wander
from pneusma_jax.chain import Effect

OUTPUTS = ("force", "resistance")
DRIFT = 1e-9
"""Variance per second of the walk behind a resistance, where its own course does not tell it."""
rows_for = spring.rows_for
parameters_for = spring.parameters_for


def prepared(values: Mapping[str, Array], stacked: Rows) -> Rows:
    """Rows whose walks are as fast as their resistances say at these base constants."""
    return with_wander(values, stacked)


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `kinds.Kind`."""
    known = numbers(values, rows)
    element = spring.spring_of(known)
    state = pj.SpringState(known["prestrain"], jnp.ones(()))
    elongation, time = rows.inputs["elongation"], rows.time

    def course(activation: Any) -> pj.SpringHistory:
        return pj.simulate_spring(element, elongation, activation, state, time=time, effects=effects)

    first = course(pj.Resistance(rows.inputs["resistance"]))
    xi0 = _smoothed(element, first, rows)
    found = course(pj.MartensiteFraction(xi0))
    rate = jnp.gradient(found.rows.gamma) / jnp.maximum(jnp.gradient(time), 1e-9)
    drivers = {
        "xi0": xi0,
        "strain": found.rows.gamma,
        "strain_rate": rate,
        "max_strain": jax.lax.cummax(found.rows.gamma),
        "force": found.rows.force,
    }
    return {name: found.seen[name] for name in OUTPUTS}, drivers


def _smoothed(element: pj.Spring, read: pj.SpringHistory, rows: Rows) -> Array:
    """Martensite fraction as a slow walk behind single readings, each weighed by what it tells."""
    xi0, gamma = jnp.clip(read.rows.xi0, 0.0, 1.0), read.rows.gamma
    law = lambda x: element.alloy.resistivity(x, gamma) * element.geometry.wire_length  # noqa: E731
    _, slope = jax.jvp(law, (xi0,), (jnp.ones_like(xi0),))
    weight = rows.weight["resistance"]
    measured = rows.measured["resistance"]
    missing = jnp.where(weight > 0.0, measured - read.seen["resistance"], 0.0)
    step = jnp.maximum(jnp.diff(rows.time, prepend=rows.time[:1]), 1e-6)
    wander = jnp.maximum(rows.extra["wander"], DRIFT)
    coupling = jnp.where(jnp.arange(step.size) > 0, 1.0 / (wander * step), 0.0)
    after = jnp.concatenate([coupling[1:], jnp.zeros(1)])
    information = (slope * weight) ** 2
    diagonal = information + coupling + after + 1e-6
    right = information * xi0 + slope * weight**2 * missing + 1e-6 * xi0
    return jnp.clip(solve_tridiagonal(diagonal, -after, right), 0.0, 1.0)
