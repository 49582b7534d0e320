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

RATE_VARIANCES = tuple(10.0**k for k in range(-14, 2))
"""Candidate variances of the change of the rate per second, over the squared spread of the course [1/s3].
They range from a course that is straight for hours to one that turns within a row."""
LEAST = 1e-30
"""Least variance of a change within a row, over the squared spread, so that no covariance is singular."""


def steady_course(
    time: Float[Array, " rows"], read: Float[Array, " rows"], precision: Float[Array, " rows"], spread: float
) -> Float[Array, " rows"]:
    """Mean of a course that changes steadily, given readings of it: Kalman filter and smoother.

    Args:
        time: time [s], ascending.
        read: readings, in any unit.
        precision: inverse variance of each reading; zero where there is none.
        spread: standard deviation of the first value about zero, in the unit of the readings. That of its
            rate is the same per second.

    Returns:
        Values of the course, in the unit of the readings.
    """
    steps = jnp.maximum(jnp.diff(time, prepend=time[:1]), 0.0)
    candidates = jnp.asarray(RATE_VARIANCES)
    scaled = steps, read / spread, precision * spread**2
    log_likelihoods = jax.vmap(lambda rate_variance: _filtered(*scaled, rate_variance)[1])(candidates)
    likeliest = candidates[jnp.argmax(log_likelihoods)]
    (means, covariances), _ = _filtered(*scaled, likeliest)

    def smoothed(later: Array, row: tuple) -> tuple[Array, Array]:
        mean, covariance, step = row
        predicted, predicted_covariance = _predicted(mean, covariance, step, likeliest)
        correction = solve_small(predicted_covariance, later - predicted)
        smooth = mean + covariance @ _transition(step).T @ correction
        return smooth, smooth

    _, smooth = jax.lax.scan(smoothed, means[-1], (means[:-1], covariances[:-1], steps[1:]), reverse=True)
    return spread * jnp.append(smooth[:, 0], means[-1, 0])


def _transition(step: Array) -> Float[Array, "2 2"]:
    """Matrix that moves value and rate by a time step [s]."""
    return jnp.eye(2).at[0, 1].set(step)


def _predicted(mean: Array, covariance: Array, step: Array, rate_variance: Array) -> tuple[Array, Array]:
    """Mean and covariance of value and rate after a time step [s], of a rate that is a random walk."""
    transition = _transition(step)
    added = rate_variance * jnp.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]])
    return transition @ mean, transition @ covariance @ transition.T + added + LEAST * jnp.eye(2)


def _filtered(
    steps: Array, read: Array, precision: Array, rate_variance: Array
) -> tuple[tuple[Array, Array], Array]:
    """Filtered means and covariances, shapes (rows, 2) and (rows, 2, 2), and the log-likelihood.

    Args:
        steps: time since the row before [s], shape (rows,).
        read: readings over the spread of the course, shape (rows,).
        precision: their inverse variances, shape (rows,).
        rate_variance: one of `RATE_VARIANCES`.
    """

    def row(carry: tuple, now: tuple) -> tuple[tuple, tuple]:
        mean, covariance, log_likelihood = carry
        step, value, precision = now
        mean, covariance = _predicted(mean, covariance, step, rate_variance)
        widening = 1.0 + precision * covariance[0, 0]  # variance of the reading, over that of its noise
        innovation = value - mean[0]
        gain = precision * covariance[:, 0] / widening
        mean, covariance = mean + gain * innovation, covariance - jnp.outer(gain, covariance[0])
        log_likelihood -= 0.5 * (jnp.log(widening) + precision * innovation**2 / widening)
        return (mean, covariance, log_likelihood), (mean, covariance)

    first = jnp.zeros(2), jnp.eye(2), jnp.zeros(())
    (_, _, log_likelihood), found = jax.lax.scan(row, first, (steps, read, precision))
    return found, log_likelihood
