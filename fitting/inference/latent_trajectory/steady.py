"""A steady course behind noisy readings: one whose rate changes as little as the readings allow.

The rate is a random walk, and its variance follows by maximum likelihood. So the mean is a cubic smoothing
spline (G. Wahba, Spline Models for Observational Data, 1990).

A course that is itself a random walk keeps most of every reading's noise where it moves at all. Decisions
along it, such as which row is the hottest so far, would be those of the noise.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from pneusma_jax.numerics.linear import solve_small

RATES = tuple(10.0**k for k in range(-14, 2))
"""Candidate variances of the change of the rate per second, over the squared spread of the course [1/s3].
They range from a course that is straight for hours to one that turns within a row."""
LEAST = 1e-30
"""Least variance of a change within a row, over the squared spread, so that no covariance is singular."""


def steady_course(
    time: Float[Array, " rows"], read: Float[Array, " rows"], precision: Float[Array, " rows"], spread: float
) -> Float[Array, " rows"]:
    """Mean of a course that changes steadily, given readings of it.

    Args:
        time: time [s], ascending.
        read: readings, in any unit.
        precision: inverse variance of each reading; zero where there is none.
        spread: standard deviation of the first value about zero, and of its change in the first second.
    """
    steps = jnp.maximum(jnp.diff(time, prepend=time[:1]), 0.0)
    rates = jnp.asarray(RATES)
    scaled = steps, read / spread, precision * spread**2
    evidence = jax.vmap(lambda rate: _filtered(*scaled, rate)[1])(rates)
    rate = rates[jnp.argmax(evidence)]
    (means, variances), _ = _filtered(*scaled, rate)

    def back(later: Array, row: tuple) -> tuple[Array, Array]:
        mean, variance, step = row
        ahead, grown = _predicted(mean, variance, step, rate)
        smooth = mean + variance @ _moved(step).T @ solve_small(grown, later - ahead)
        return smooth, smooth

    _, smooth = jax.lax.scan(back, means[-1], (means[:-1], variances[:-1], steps[1:]), reverse=True)
    return spread * jnp.append(smooth[:, 0], means[-1, 0])


def _moved(step: Array) -> Float[Array, "2 2"]:
    """Matrix that moves value and rate by a time step [s]."""
    return jnp.eye(2).at[0, 1].set(step)


def _predicted(mean: Array, variance: Array, step: Array, rate: Array) -> tuple[Array, Array]:
    """Mean and covariance of value and rate after a time step [s]."""
    moved = _moved(step)
    added = rate * jnp.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]])
    return moved @ mean, moved @ variance @ moved.T + added + LEAST * jnp.eye(2)


def _filtered(steps: Array, read: Array, precision: Array, rate: Array) -> tuple[tuple[Array, Array], Array]:
    """Filtered means and covariances, shapes (rows, 2) and (rows, 2, 2), and the log-likelihood."""

    def row(carry: tuple, now: tuple) -> tuple[tuple, tuple]:
        mean, variance, evidence = carry
        step, value, precision = now
        mean, variance = _predicted(mean, variance, step, rate)
        spread = 1.0 + precision * variance[0, 0]
        surprise = value - mean[0]
        gain = precision * variance[:, 0] / spread
        mean, variance = mean + gain * surprise, variance - jnp.outer(gain, variance[0])
        evidence = evidence - 0.5 * (jnp.log(spread) + precision * surprise**2 / spread)
        return (mean, variance, evidence), (mean, variance)

    first = jnp.zeros(2), jnp.eye(2), jnp.zeros(())
    (_, _, evidence), found = jax.lax.scan(row, first, (steps, read, precision))
    return found, evidence
