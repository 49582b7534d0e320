"""Springs on a test stand in a diagnosis: elongation in; force and resistance out, from one hidden phase.

The martensite fraction is no input: it is a hidden course that has to explain force and resistance together,
under every candidate anew. A resistance says much about a cold wire and nothing about a hot one; read row by
row, it would turn small errors of a constant into phases that no force fits, and a fit would stall there.
"""

from collections.abc import Callable, Mapping
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
HELD = 1e-6
"""Weight of the course so far in every row, which keeps rows that say nothing where they are."""
ROUNDS = 5
LONGEST = 0.3
"""Longest step of the fraction in one round."""
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

    def outputs(xi0: Array) -> Array:
        seen = course(pj.MartensiteFraction(xi0)).seen
        return jnp.stack([seen[name] for name in OUTPUTS])

    xi0 = _course(outputs, course(pj.Resistance(rows.inputs["resistance"])).rows.xi0, rows)
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


def _course(outputs: Callable[[Array], Array], read: Array, rows: Rows) -> Array:
    """Martensite fraction that explains force and resistance best, as a loose walk, shape (rows,).

    Gauss-Newton from single readings of the resistance. What a row remembers counts as its own; so the course
    is nearly, not wholly, the best one. The rounds carry no tangents, one step after them does.

    Args:
        outputs: force and resistance, shape (2, rows), at a course.
        read: first trial, shape (rows,).
        rows: the recording.
    """
    frozen = lambda xi0: jax.lax.stop_gradient(jax.jvp(outputs, (xi0,), (jnp.ones_like(xi0),)))  # noqa: E731
    weight = jnp.stack([rows.weight[name] for name in OUTPUTS])
    measured = jnp.stack([rows.measured[name] for name in OUTPUTS])
    step = jnp.maximum(jnp.diff(rows.time, prepend=rows.time[:1]), 1e-6)
    wander = jnp.maximum(rows.extra["wander"], DRIFT)
    coupling = jnp.where(jnp.arange(step.size) > 0, 1.0 / (wander * step), 0.0)
    after = jnp.concatenate([coupling[1:], jnp.zeros(1)])

    def better(xi0: Array, predicted: Array, slope: Array) -> Array:
        information = jnp.sum((slope * weight) ** 2, axis=0)
        right = information * xi0 + jnp.sum(slope * weight**2 * (measured - predicted), axis=0)
        found = solve_tridiagonal(information + coupling + after + HELD, -after, right + HELD * xi0)
        return jnp.clip(xi0 + jnp.clip(found - xi0, -LONGEST, LONGEST), 0.0, 1.0)

    def round_(_: int, xi0: Array) -> Array:
        return jax.lax.stop_gradient(better(xi0, *frozen(xi0)))

    start = jax.lax.stop_gradient(jnp.clip(read, 0.0, 1.0))
    settled = jax.lax.fori_loop(0, ROUNDS, round_, start)
    return better(settled, outputs(settled), frozen(settled)[1])
