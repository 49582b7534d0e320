"""Process-noise variance of each test's martensite fraction, found by evidence from the resistance alone."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.program_cache import cached_program

from .rows import Rows
from .spring_trajectory import process_noise_evidence, undecided

CANDIDATES = tuple(float(x) for x in np.logspace(-12, -3, 10))
"""Candidate variances per second. The fraction then changes by 1e-6 to 0.03 in a second."""
LOOSE = 1e2
"""Factor on the process-noise variance that the resistance implies.

A tight walk is itself a measurement of the fraction's scale, which depends on `a` and `b`. It biased them by
two to three standard errors. At this factor the walk only bridges rows whose resistance is uninformative.
With a factor a hundred times larger, noise crosses the limits of the fraction. 90 % intervals then held the
truth in 87 instead of 89 to 90 %.
"""
ALIKE = 2.0
"""Maximum loss of log-evidence for which a slower walk replaces the best one."""
DECISIVE = 3.0
"""Minimum difference of log-evidence for a test to determine its process noise."""


def _every(values: Mapping[str, Array], stacked: Rows, process_noise: Array) -> Array:
    return jax.vmap(lambda rows: process_noise_evidence(values, rows, process_noise))(stacked)


_evidence = cached_program(_every, "evidence of a process_noise")


def with_process_noise(
    values: Mapping[str, Array],
    stacked: Rows,
    loose: float = LOOSE,
    candidates: tuple[float, ...] = CANDIDATES,
    pooled: bool = False,
) -> Rows:
    """A stack with the process-noise variances that its resistances imply at these parameters.

    Entry `implied_process_noise` is the implied variance, `process_noise` the one that a fit uses.

    A test whose resistance says nothing at all (too short) gets the median of the others. A test whose phase
    is held stays held.

    Args:
        values: free parameters by name, SI.
        stacked: stack of recordings of kind spring.
        loose: factor on the variance that the resistance implies.
        candidates: candidate variances per second.
        pooled: treatment of a test whose resistance is uninformative and only excludes fast walks. True: it
            gets the variance of the others, as far as it allows that. False: it hardly walks. This suits a
            fully heated wire, whose fraction sits at a limit that noise would cross in one direction only.
    """
    values = {name: jnp.asarray(value, float) for name, value in values.items()}
    plain = undecided(stacked)  # one program, whatever was decided
    table = np.array([np.asarray(_evidence(values, plain, jnp.asarray(w))) for w in candidates])
    fixed = np.asarray(stacked.extra["level_sd"]) == 0.0
    informative = (np.ptp(table, axis=0) > DECISIVE) & ~fixed
    blind = informative & (table.max(axis=0) - table[0] <= DECISIVE) & pooled
    tried, alike = np.asarray(candidates), table > table.max(axis=0) - ALIKE
    best, slowest = tried[np.argmax(table, axis=0)], tried[np.argmax(alike, axis=0)]
    fastest = tried[len(tried) - 1 - np.argmax(alike[::-1], axis=0)]
    resolved = informative & ~blind
    usual = 10.0 ** np.median(np.log10(best[resolved])) if resolved.any() else tried[len(tried) // 2]
    allowed = np.where(blind, np.minimum(usual, fastest), usual)
    process_noise = loose * np.where(resolved, best, allowed)
    implied = np.where(resolved, slowest, allowed)
    return eqx.tree_at(
        lambda rows: (rows.extra["process_noise"], rows.extra["implied_process_noise"]),
        stacked,
        (jnp.asarray(process_noise), jnp.asarray(implied)),
    )
