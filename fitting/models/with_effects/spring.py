"""Springs on a test stand with effects: elongation in; force and resistance out, from one hidden phase.

The martensite fraction is no input: it is a hidden course that has to explain force and resistance together,
under every candidate anew. A resistance says much about a cold wire and nothing about a hot one; read row by
row, it would turn small errors of a constant into phases that no force fits, and a fit would stall there.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.models import spring
from fitting.models.channels import Channel
from fitting.models.rows import Rows, numbers
from fitting.models.wander import with_wander
from pneusma_jax.chain import Effect

from .spring_course import best_course

OUTPUTS = ("force", "resistance")
WANDERS = tuple(10.0**k for k in range(-16, -2))
"""Variances per second of the walk that are tried. The smallest hold a cold wire in one phase, whose limit
then either binds or does not: noise that crossed it row by row would look like an offset."""
LOOSE = 10.0
"""Factor on the variance of the walk that a resistance shows."""
rows_for = spring.rows_for
parameters_for = spring.parameters_for


def prepared(
    values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]] | None = None
) -> Rows:
    """Rows whose walks are as fast as their resistances say at these base constants, with the noise of every
    channel as a diagnosis weighs it; as the rows do, if there are no channels."""
    found = with_wander(values, stacked, LOOSE, WANDERS, pooled=True)
    if channels is None:
        return found
    extra = dict(found.extra)
    for name in OUTPUTS:
        weight, correlation = np.zeros(stacked.mask.shape), np.zeros(len(stacked.mask))
        for k, members in enumerate(channels):
            for channel in members:
                if channel.quantity == name:
                    weight[k], correlation[k] = 1.0 / channel.sigma, channel.correlation
        extra[f"weight_{name}"], extra[f"correlation_{name}"] = jnp.asarray(weight), jnp.asarray(correlation)
    return eqx.tree_at(lambda rows: rows.extra, found, extra)


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `with_effects.Kind`."""
    known = numbers(values, rows)
    stand = spring.spring_of(known), effects, pj.SpringState(known["prestrain"], jnp.ones(()))
    elongation, time = rows.inputs["elongation"], rows.time

    def course(stand: tuple, activation: Any) -> pj.SpringHistory:
        element, effects, state = stand
        return pj.simulate_spring(element, elongation, activation, state, time=time, effects=effects)

    def outputs(stand: tuple, xi0: Array) -> Array:
        seen = course(stand, pj.MartensiteFraction(xi0)).seen
        return jnp.stack([seen[name] for name in OUTPUTS])

    frozen = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, stand)
    single = course(frozen, pj.Resistance(rows.inputs["resistance"])).rows.xi0
    xi0, told, local = best_course(partial(outputs, stand), partial(outputs, frozen), single, OUTPUTS, rows)
    found = course(stand, pj.MartensiteFraction(xi0))
    rate = jnp.gradient(found.rows.gamma) / jnp.maximum(jnp.gradient(time), 1e-9)
    drivers = {
        "xi0": xi0,
        "strain": found.rows.gamma,
        "strain_rate": rate,
        "max_strain": jax.lax.cummax(found.rows.gamma),
        "force": found.rows.force,
        "taken": told,
        **{f"slope_{name}": by_own for name, by_own in zip(OUTPUTS, local.slope, strict=True)},
        **{f"memory_{name}": by_memory for name, by_memory in zip(OUTPUTS, local.remembered, strict=True)},
    }
    return {name: found.seen[name] for name in OUTPUTS}, drivers
