"""Process-noise variance of each test's martensite fraction, found by evidence from the resistance alone."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.latent_trajectory.smoother import Local
from pneusma_jax.program_cache import stored_jit

from .rows import Rows
from .spring_law import Trajectory
from .spring_trajectory import FromResistance, from_resistance, undecided

CANDIDATES = tuple(float(x) for x in np.logspace(-12, -3, 10))
"""Candidate variances per second. The fraction then changes by 1e-6 to 0.03 in a second."""
FACTOR = 1e2
"""Factor of the process-noise variance of a fit over the one that the resistance implies.

A random walk of small variance is itself a measurement of the fraction's scale, which depends on `a` and `b`.
It biased them by two to three standard errors. With this factor the walk only bridges rows whose resistance
is uninformative. With a factor a hundred times larger, noise crosses the limits of the fraction. The
truth was then in 87 % of the 90 % intervals, instead of 89 to 90 %.
"""
TOLERANCE = 2.0
"""Maximum loss of log-evidence for which a smaller variance replaces the best one."""
DECISIVE = 3.0
"""Minimum difference of log-evidence for a test to determine its process noise."""
WALK = ("process_noise", "implied_process_noise")
"""Entries of a stack with the process-noise variances: that which a fit uses, and the implied one."""


@stored_jit(FromResistance, Trajectory, Local)
def from_resistances(values: Mapping[str, Array], plain: Rows, process_noise: Array) -> FromResistance:
    """Every recording of a stack by its resistance alone, see `from_resistance`.

    Args:
        values: free parameters by name, SI.
        plain: stack without decisions, so that one program serves stacks with and without.
        process_noise: variance of each recording, shape (recordings,).
    """
    return jax.vmap(lambda rows, walk: from_resistance(values, rows, walk))(plain, process_noise)


def with_process_noise(values: Mapping[str, Array], stacked: Rows) -> Rows:
    """A stack with the process-noise variances that its resistances imply at these parameters.

    Entry `implied_process_noise` is the implied variance, `process_noise` the one that a fit uses.

    A test whose resistance implies no variance, such as a short one, gets the median of the others. Where the
    fraction is held it stays held.

    Args:
        values: free parameters by name, SI.
        stacked: stack of recordings of kind spring.
    """
    values = {name: jnp.asarray(value, float) for name, value in values.items()}
    plain, ones = undecided(stacked), jnp.ones(len(stacked.mask))
    evidence = np.array([np.asarray(from_resistances(values, plain, w * ones).evidence) for w in CANDIDATES])
    fixed = np.asarray(stacked.extra["level_sd"]) == 0.0
    resolved = (np.ptp(evidence, axis=0) > DECISIVE) & ~fixed
    variances, near_best = np.asarray(CANDIDATES), evidence > evidence.max(axis=0) - TOLERANCE
    best, smallest = variances[np.argmax(evidence, axis=0)], variances[np.argmax(near_best, axis=0)]
    median = 10.0 ** np.median(np.log10(best[resolved])) if resolved.any() else variances[len(variances) // 2]
    process_noise = FACTOR * np.where(resolved, best, median)
    implied = np.where(resolved, smallest, median)
    return with_walks(stacked, (jnp.asarray(process_noise), jnp.asarray(implied)))


def walks_of(stacked: Rows) -> tuple[Array, Array]:
    """Process-noise variances of a stack: that which a fit uses, and the implied one, each (recordings,)."""
    return tuple(stacked.extra[name] for name in WALK)


def with_walks(stacked: Rows, walks: tuple[Array, Array]) -> Rows:
    """A stack with other process-noise variances, as `walks_of` gives them."""
    return eqx.tree_at(walks_of, stacked, walks)


def with_steady_walks(stacked: Rows, chosen: Array) -> Rows:
    """A stack, the fractions of chosen recordings as steady as any candidate has them.

    Args:
        stacked: stack of recordings of kind spring.
        chosen: numbers of the recordings.
    """
    least = FACTOR * CANDIDATES[0], CANDIDATES[0]
    pairs = zip(walks_of(stacked), least, strict=True)
    return with_walks(stacked, tuple(walk.at[chosen].set(variance) for walk, variance in pairs))
