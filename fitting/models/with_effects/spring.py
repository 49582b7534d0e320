"""Springs on a test stand with effects: elongation in; force and resistance out, from one hidden phase.

The martensite fraction is no input: it is a hidden course that has to explain force and resistance together,
under every candidate anew. A resistance says much about a cold wire and nothing about a hot one; read row by
row, it would turn small errors of a constant into phases that no force fits, and a fit would stall there.
"""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.models import spring
from fitting.models.channels import Channel
from fitting.models.latent import solve_tridiagonal, variances
from fitting.models.rows import Rows, numbers
from fitting.models.wander import with_wander
from pneusma_jax.chain import Effect

OUTPUTS = ("force", "resistance")
WANDERS = tuple(10.0**k for k in range(-16, -2))
"""Variances per second of the walk that are tried. The smallest hold a cold wire in one phase, whose limit
then either binds or does not: noise that crossed it row by row would look like an offset."""
HELD = 1e-6
"""Weight of the course so far in every row, which keeps rows that say nothing where they are."""
LOOSE = 10.0
"""Factor on the variance of the walk that a resistance shows."""
ROUNDS = 5
LONGEST = 0.3
"""Longest step of the fraction in one round."""
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
    element = spring.spring_of(known)
    state = pj.SpringState(known["prestrain"], jnp.ones(()))
    elongation, time = rows.inputs["elongation"], rows.time

    def course(activation: Any) -> pj.SpringHistory:
        return pj.simulate_spring(element, elongation, activation, state, time=time, effects=effects)

    def outputs(xi0: Array) -> Array:
        seen = course(pj.MartensiteFraction(xi0)).seen
        return jnp.stack([seen[name] for name in OUTPUTS])

    xi0, told, slope = _course(outputs, course(pj.Resistance(rows.inputs["resistance"])).rows.xi0, rows)
    found = course(pj.MartensiteFraction(xi0))
    rate = jnp.gradient(found.rows.gamma) / jnp.maximum(jnp.gradient(time), 1e-9)
    drivers = {
        "xi0": xi0,
        "strain": found.rows.gamma,
        "strain_rate": rate,
        "max_strain": jax.lax.cummax(found.rows.gamma),
        "force": found.rows.force,
        "taken": told,
        **{f"slope_{name}": by_xi0 for name, by_xi0 in zip(OUTPUTS, slope, strict=True)},
    }
    return {name: found.seen[name] for name in OUTPUTS}, drivers


class _Noise(eqx.Module):
    """Inverse covariance of a channel's errors, tridiagonal: first-order noise, as `Channel.whitened` has it.

    Attributes:
        weight: one over the 1-sigma of every row, zero where nothing was measured.
        diagonal, upper: of the inverse covariance of errors of unit size, shape (rows,); the last of `upper`
            is zero.
    """

    weight: Array
    diagonal: Array
    upper: Array

    @classmethod
    def of(cls, rows: Rows, name: str) -> "_Noise":
        weight = rows.extra.get(f"weight_{name}", rows.weight[name])
        correlation = rows.extra.get(f"correlation_{name}", 0.0)
        there = weight > 0.0
        follows = jnp.concatenate([jnp.zeros(1, bool), there[1:] & there[:-1]])
        own = jnp.where(follows, 1.0 / (1.0 - correlation**2), there)
        before = jnp.where(follows, correlation / (1.0 - correlation**2), 0.0)
        shift = lambda column: jnp.concatenate([column[1:], jnp.zeros(1)])  # noqa: E731
        return cls(weight, own + shift(before) * correlation, -shift(before))

    def times(self, error: Array) -> Array:
        """Inverse covariance times errors of shape (rows,)."""
        scaled = self.weight * error
        above, below = self.upper * jnp.roll(scaled, -1), jnp.roll(self.upper * scaled, 1)
        return self.weight * (self.diagonal * scaled + above + below)

    def seen_through(self, slope: Array) -> tuple[Array, Array]:
        """Information on a course by which the channel changes by `slope`: diagonal and upper diagonal."""
        told = self.weight * slope
        return self.diagonal * told**2, self.upper * told * jnp.roll(told, -1)


def _course(
    outputs: Callable[[Array], Array], read: Array, rows: Rows
) -> tuple[Array, Array, Array]:
    """Martensite fraction that explains force and resistance best, as a walk, shape (rows,).

    Gauss-Newton from single readings of the resistance. What a row remembers counts as its own; so the course
    is nearly, not wholly, the best one. The rounds carry no tangents, one step after them does.

    Args:
        outputs: force and resistance, shape (2, rows), at a course.
        read: first trial, shape (rows,).
        rows: the recording.

    Returns:
        The course; how much of a measured value it takes up in every row, 0 to 1; and the derivative of force
        and resistance by the fraction of the same row, (2, rows).
    """
    frozen = lambda xi0: jax.lax.stop_gradient(jax.jvp(outputs, (xi0,), (jnp.ones_like(xi0),)))  # noqa: E731
    noise = [_Noise.of(rows, name) for name in OUTPUTS]
    measured = jnp.stack([rows.measured[name] for name in OUTPUTS])
    step = jnp.maximum(jnp.diff(rows.time, prepend=rows.time[:1]), 1e-6)
    coupling = jnp.where(jnp.arange(step.size) > 0, 1.0 / (rows.extra["wander"] * step), 0.0)
    after = jnp.concatenate([coupling[1:], jnp.zeros(1)])

    def system(slope: Array) -> tuple[Array, Array, Array]:
        told = [n.seen_through(s) for n, s in zip(noise, slope, strict=True)]
        information = sum(diagonal for diagonal, _ in told)
        return information, information + coupling + after + HELD, sum(upper for _, upper in told) - after

    def better(xi0: Array, predicted: Array, slope: Array) -> Array:
        _, diagonal, upper = system(slope)
        missing = measured - predicted
        pull = sum(s * n.times(e) for n, s, e in zip(noise, slope, missing, strict=True))
        rise = jnp.concatenate([jnp.zeros(1), coupling[1:] * jnp.diff(xi0)])
        pull = pull - rise + jnp.concatenate([rise[1:], jnp.zeros(1)])
        change = solve_tridiagonal(diagonal, upper, pull)
        return jnp.clip(xi0 + jnp.clip(change, -LONGEST, LONGEST), 0.0, 1.0)

    def round_(_: int, xi0: Array) -> Array:
        return jax.lax.stop_gradient(better(xi0, *frozen(xi0)))

    start = jax.lax.stop_gradient(jnp.clip(read, 0.0, 1.0))
    settled = jax.lax.fori_loop(0, ROUNDS, round_, start)
    slope = frozen(settled)[1]
    information, diagonal, upper = system(slope)
    inside = (settled > 0.0) & (settled < 1.0)
    taken = jnp.where(inside, jnp.clip(information * variances(diagonal, upper), 0.0, 1.0), 0.0)
    return better(settled, outputs(settled), slope), taken, slope
