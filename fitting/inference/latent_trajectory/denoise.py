"""Denoising: the martensite fraction from a measured resistance, without the noise of single samples.

The residual strain keeps the running minimum of the martensite fraction. Noise in the fraction therefore
accumulates instead of averaging out. The resistance determines the phase well for a cold, unstrained wire and
poorly for a hot one. Where both phases conduct alike it says nothing.

So the fraction is modelled as a random walk behind the resistance. A Kalman smoother weights each sample by
its information. The variances of the walk and of the noise follow by maximum likelihood, without tuning. They
do so anew in every round, so that no least squares replaces the rounds (`specimens/actuator_phase.py`).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj

ROUNDS = 20  # Maximum number of linearisations of the resistance about the last estimate
LONGEST = 0.1  # Maximum step of a fraction in a round; near full heat the tangent is too flat for a full step
SETTLED = 1e-3  # Maximum step at which the rounds end
PROCESS_NOISES = np.geomspace(1e-8, 1e4, 49)
"""Candidate variances of the walk per second, over that of the most precise reading."""
KNOWN_NOISE = np.geomspace(1e-8, 1e12, 81)
"""The same where the noise of readings is known within a factor. A fraction that falls by 0.5 in 3 s, read to
1e-4, has a ratio of 1e7."""
OUTLIER = 10.0  # Minimum deviation of an outlier from the walk, in units of the resistance's noise
MOST_OUTLIERS = 0.05  # Maximum share of outliers
LEAST_SLOPE = 1e-6
"""Minimum slope of the resistance over xi0, relative to the wire's; keeps uninformative samples finite."""


def martensite_fraction(
    spring: pj.Spring, time: np.ndarray, resistance: np.ndarray, gamma: np.ndarray
) -> np.ndarray:
    """Martensite fraction of a spring over time, in [0, 1].

    Args:
        spring: spring element.
        time: time [s], ascending, shape (rows,).
        resistance: measured resistance [ohm], NaN where missing.
        gamma: shear strain [1], NaN where unknown.

    Returns:
        Martensite fraction, shape (rows,); interpolated where a sample is missing. The resistance may jump
        faster than a heated wire can, so that the walk does not follow it. Then the readings of single
        samples are returned.
    """
    finite = np.isfinite(resistance) & np.isfinite(gamma)
    t, ohms, strain = time[finite], resistance[finite], gamma[finite]
    if not finite.any():
        return np.full(time.shape, np.nan)
    single = xi0 = np.asarray(_fraction(spring, ohms, strain))
    scale = float(spring.alloy.rho_mean * spring.geometry.wire_length)
    for _ in range(ROUNDS if finite.sum() > 3 else 0):
        expected, slope = (np.asarray(x) / scale for x in resistance_and_slope(spring, xi0, strain))
        slope = np.where(np.abs(slope) < LEAST_SLOPE, LEAST_SLOPE, slope)
        step = np.clip((ohms / scale - expected) / slope, -LONGEST, LONGEST)
        before, xi0 = xi0, np.clip(smooth_walk(t, xi0 + step, slope**2), 0.0, 1.0)
        if np.max(np.abs(xi0 - before)) < SETTLED:
            break
    misfit = np.abs(ohms - np.asarray(resistance_and_slope(spring, xi0, strain)[0]))
    noise = max(np.median(np.abs(np.diff(ohms, append=ohms[-1]))), np.median(misfit))
    outliers = misfit > OUTLIER * noise
    return np.interp(time, t, single if outliers.mean() > MOST_OUTLIERS else xi0)


@eqx.filter_jit
def _fraction(spring: pj.Spring, resistance: jax.Array, gamma: jax.Array) -> jax.Array:
    """Martensite fraction that a spring's law reads from every resistance alone, shape (rows,)."""
    return pj.Resistance(resistance).read(spring.alloy, jnp.asarray(gamma), spring.geometry.wire_length).xi0


@eqx.filter_jit
def resistance_and_slope(
    spring: pj.Spring, xi0: jax.Array, gamma: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Resistance of a spring, and its slope over the martensite fraction at a fixed strain [ohm].

    Args:
        spring: spring element.
        xi0: martensite fraction, shape (rows,).
        gamma: shear strain [1], shape (rows,).
    """
    law = lambda x: spring.alloy.resistivity(x, jnp.asarray(gamma)) * spring.geometry.wire_length  # noqa: E731
    return jax.jvp(law, (jnp.asarray(xi0),), (jnp.ones_like(xi0),))


def denoised(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A measured input, smoothed as far as its trend and its noise can be separated; NaN where missing.

    Args:
        time: time [s], ascending, shape (rows,).
        values: equally noisy readings, shape (rows,).
    """
    finite = np.isfinite(values)
    result = np.full(values.shape, np.nan)
    if finite.sum() > 3 and np.ptp(values[finite]) > 0.0:
        result[finite] = smooth_walk(time[finite], values[finite], np.ones(int(finite.sum())))
    else:
        result[finite] = values[finite]
    return result


def smooth_walk(
    time: np.ndarray,
    values: np.ndarray,
    precision: np.ndarray,
    within: tuple[float, float] = (0.0, np.inf),
) -> np.ndarray:
    """Random walk behind noisy readings, by Kalman filter and Rauch-Tung-Striebel smoother.

    A walk with few large steps looks like noise about a constant to a model that must estimate its noise. If
    the noise is known within a factor, it cannot.

    Args:
        time: time, ascending, shape (n,).
        values: readings, shape (n,).
        precision: precision of each reading; positive, shape (n,).
        within: least and largest factor on the noise that the roots of the precisions state. A common factor
            is estimated in this range. By default only the ratios of the precisions are known.

    Returns:
        Mean of the walk at each reading, shape (n,).
    """
    steps = np.diff(time, prepend=time[0])
    best = precision.max()
    precision, candidates = precision / best, KNOWN_NOISE if np.isfinite(within[1]) else PROCESS_NOISES
    sizes = (within[0] ** 2 / best, within[1] ** 2 / best)
    _, _, likelihood = _filter(steps, values, precision, candidates, sizes)
    process_noise = candidates[[np.argmax(likelihood)]]
    mean, variance, _ = (x[..., 0] for x in _filter(steps, values, precision, process_noise, sizes))
    for k in range(len(values) - 2, -1, -1):
        gain = variance[k] / (variance[k] + process_noise[0] * steps[k + 1])
        mean[k] += gain * (mean[k + 1] - mean[k])
    return mean


def _filter(
    steps: np.ndarray,
    values: np.ndarray,
    precision: np.ndarray,
    process_noise: np.ndarray,
    sizes: tuple[float, float],
) -> tuple:
    """Filtered mean and variance, shape (n, candidates), and the log-likelihood of each candidate.

    Variances are in units of that of a reading of precision 1. It is profiled out of the likelihood, between
    the two `sizes`.
    """
    count = len(values)
    means, variances = np.empty((2, count, len(process_noise)))
    mean = np.full(len(process_noise), values[0])
    variance = np.full(len(process_noise), 1.0 / precision[0])  # the first reading starts the walk
    means[0], variances[0] = mean, variance
    squares, logs = np.zeros((2, len(process_noise)))
    for k in range(1, count):
        variance = variance + process_noise * steps[k]
        spread = variance + 1.0 / precision[k]
        surprise = values[k] - mean
        mean = mean + variance / spread * surprise
        variance = variance / (1.0 + variance * precision[k])
        squares += surprise**2 / spread
        logs += np.log(spread)
        means[k], variances[k] = mean, variance
    size = np.clip(squares / max(count - 1, 1), *sizes)
    size = np.maximum(size, np.finfo(float).tiny)
    return means, variances, -0.5 * (logs + (count - 1) * np.log(size) + squares / size)
