"""Springs on a test stand with effects: elongation in; force and resistance out, from one hidden phase.

The martensite fraction is no input: it is a latent trajectory that has to explain force and resistance
together, under every candidate anew. A resistance says much about a cold wire and nothing about a hot one;
read row by row, it would turn small errors of a constant into phases that no force fits, and a fit would
stall there.
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
from fitting.inference.channels import Channel
from fitting.specimens import spring
from fitting.specimens.process_noise import with_process_noise
from fitting.specimens.rows import Rows, numbers
from pneusma_jax.nitinol import SpringResponse
from pneusma_jax.pipeline import Effect

from .spring_course import best_course

OUTPUTS = ("force", "resistance")
WANDERS = tuple(10.0**k for k in range(-16, -2))
"""Variances per second of the walk that are tried. The smallest hold a cold wire in one phase, whose limit
then either binds or does not: noise that crossed it row by row would look like an offset."""
BEGUN = "course"
"""Where rows keep the fraction that the search for their latent trajectory begins with; each resistance by
itself where they keep none."""
LOOSE = 10.0
"""Factor on the variance of the walk that a resistance shows."""
ADDED = ("weight_", "correlation_")
"""How columns are named that say how a diagnosis weighs a channel."""
rows_for = spring.rows_for
parameters_for = spring.parameters_for


def prepared(
    values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]] | None = None
) -> Rows:
    """Rows whose walks are as fast as their resistances say at these base constants, with the noise of every
    channel as a diagnosis weighs it, and a course to begin with; as the rows do, if there are no channels."""
    own = {name: x for name, x in stacked.extra.items() if not name.startswith((*ADDED, BEGUN))}
    plain = eqx.tree_at(lambda rows: rows.extra, stacked, own)  # so that one program serves both
    found = with_process_noise(values, plain, LOOSE, WANDERS, pooled=True)
    if channels is None:
        return found
    extra = {**stacked.extra, **found.extra}
    for name in OUTPUTS:
        weight, correlation = np.zeros((2, *stacked.mask.shape))
        for k, members in enumerate(channels):
            for channel in members:
                if channel.quantity == name:
                    weight[k], correlation[k] = 1.0 / channel.sigma, channel.correlation
        names = [f"{what}{name}" for what in ADDED]
        extra |= zip(names, map(jnp.asarray, (weight, correlation)), strict=True)
    if BEGUN not in extra:
        read = lambda rows: spring.fraction_read(spring.spring_of(numbers(values, rows)), rows)  # noqa: E731
        extra[BEGUN] = jax.vmap(read)(stacked)
    return eqx.tree_at(lambda rows: rows.extra, found, extra)


def begun(stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
    """A stack whose searches for latent trajectories begin where that of an evaluation ended, by its
    drivers."""
    course = jnp.clip(jnp.asarray(drivers["xi0"]), 0.0, 1.0)
    return eqx.tree_at(lambda rows: rows.extra[BEGUN], stacked, course)


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `specimens.with_effects.Kind`."""
    known = numbers(values, rows)
    stand = spring.spring_of(known), effects, pj.SpringState(known["prestrain"], jnp.ones(()))
    elongation, time = rows.inputs["elongation"], rows.time

    def follow(stand: tuple, activation: Any) -> tuple[Array, SpringResponse]:
        element, effects, state = stand
        found = pj.simulate_spring(element, elongation, activation, state, time=time, effects=effects)
        return jnp.stack([found.seen[name] for name in OUTPUTS]), found.rows

    def at(stand: tuple, xi0: Array) -> tuple[Array, SpringResponse]:
        return follow(stand, pj.MartensiteFraction(xi0))

    frozen = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, stand)
    start = rows.extra.get(BEGUN)
    if start is None:
        start = follow(frozen, pj.Resistance(rows.inputs["resistance"]))[1].xi0
    found = best_course(partial(at, stand), partial(at, frozen), start, OUTPUTS, rows)
    gamma = found.known.gamma
    rate = jnp.gradient(gamma) / jnp.maximum(jnp.gradient(time), 1e-9)
    drivers = {
        "xi0": found.course,
        "strain": gamma,
        "strain_rate": rate,
        "max_strain": jax.lax.cummax(gamma),
        "force": found.known.force,
        "taken": found.taken,
        **{f"slope_{name}": by_own for name, by_own in zip(OUTPUTS, found.local.slope, strict=True)},
        **{f"memory_{name}": more for name, more in zip(OUTPUTS, found.local.remembered, strict=True)},
    }
    return dict(zip(OUTPUTS, found.predicted, strict=True)), drivers
