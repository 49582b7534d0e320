"""How fast the martensite fraction of each test wanders: found by evidence, from resistance alone."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.program_cache import cached_program

from .rows import Rows
from .spring_trajectory import process_noise_evidence

CANDIDATES = tuple(float(x) for x in np.logspace(-12, -3, 10))
"""Variances per second; the fraction then moves by 1e-6 to 0.03 in a second."""
LOOSE = 1e2
"""Factor on the variance that resistance shows. A walk as tight as it looks is itself a measurement of the
fraction's scale, which is a function of `a` and `b`: it pulled them off by two to three standard errors. As
loose as this it only bridges rows in which the resistance says nothing; a hundred times looser, noise crosses
the limits of the fraction, and 90 % intervals held the truth in 87 instead of 89 to 90 %."""
ALIKE = 2.0
"""Log-evidence within which a slower walk does as well as the best."""
DECISIVE = 3.0
"""Difference of log-evidence below which a test says nothing about its wander."""


def _every(values: Mapping[str, Array], stacked: Rows, wander: Array) -> Array:
    return jax.vmap(lambda rows: process_noise_evidence(values, rows, wander))(stacked)


_evidence = cached_program(_every, "evidence of a wander")


def with_process_noise(
    values: Mapping[str, Array],
    stacked: Rows,
    loose: float = LOOSE,
    candidates: tuple[float, ...] = CANDIDATES,
    pooled: bool = False,
) -> Rows:
    """A stack whose walks are as fast as their resistances say at these parameters: `pace`, and `wander`,
    which a fit takes.

    A test in which resistance says nothing at all (too short) is given the median of the others, and one
    whose phase is held stays held.

    Args:
        values: free parameters by name, SI.
        stacked: recordings of kind spring.
        loose: factor on the variance that resistance shows.
        candidates: variances per second to choose from.
        pooled: whether a test whose resistance is blind, so that it only forbids fast walks, walks as the
            others do as far as it allows. Else it hardly walks: right for a wire that is as hot as it gets,
            whose fraction ends at a limit that noise would only cross one way.
    """
    values = {name: jnp.asarray(value, float) for name, value in values.items()}
    table = np.array([np.asarray(_evidence(values, stacked, jnp.asarray(w))) for w in candidates])
    held = np.asarray(stacked.extra["level_sd"]) == 0.0
    told = (np.ptp(table, axis=0) > DECISIVE) & ~held
    blind = told & (table.max(axis=0) - table[0] <= DECISIVE) & pooled
    tried, alike = np.asarray(candidates), table > table.max(axis=0) - ALIKE
    best, slowest = tried[np.argmax(table, axis=0)], tried[np.argmax(alike, axis=0)]
    fastest = tried[len(tried) - 1 - np.argmax(alike[::-1], axis=0)]
    seen = told & ~blind
    usual = 10.0 ** np.median(np.log10(best[seen])) if seen.any() else tried[len(tried) // 2]
    allowed = np.where(blind, np.minimum(usual, fastest), usual)
    wander = loose * np.where(seen, best, allowed)
    pace = np.where(seen, slowest, allowed)
    return eqx.tree_at(
        lambda rows: (rows.extra["wander"], rows.extra["pace"]),
        stacked,
        (jnp.asarray(wander), jnp.asarray(pace)),
    )
