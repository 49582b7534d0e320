"""Sequential Monte Carlo from the prior to the posterior, for starting points and the evidence.

Points drawn from the prior are moved and resampled while the likelihood enters gradually (blackjax' adaptive
tempering). Each mode of a posterior gets points in proportion to its weight, whichever mode a fit has found.
Each ensemble of emcee starts from its own run, and all continue until they agree. R-hat thereby reveals a run
that has missed a mode.
"""

import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from pneusma_jax.errors import InputError
from pneusma_jax.late import Late

from .target import Target

resampling, random_walk = Late("blackjax.smc.resampling"), Late("blackjax.mcmc.random_walk")
adaptive_tempered, stats = Late("blackjax.smc.adaptive_tempered"), Late("scipy.stats")

PARTICLES = 512
"""Number of points of a run. The error of the log-evidence is then about 0.1 (measured: 0.1, two modes)."""
LEVEL = 0.5
"""Effective share of the points after a step of the temperature (the usual choice of adaptive tempering)."""
SCALE = 2.38
"""Factor of the random walk's steps on the points' spread, divided by the root of the dimension (A. Gelman,
G. Roberts and W. Gilks, 1996)."""
MOVES = 8
"""Number of moves after each resampling, times the dimension, plus ten."""
BATCH = 64
"""Number of points that the model evaluates at once; it bounds the memory."""
MOST_LEVELS = 400
"""Maximum number of temperatures before a run is given up."""


class Tempered(NamedTuple):
    """Result of a run.

    Attributes:
        points: coordinates of equal weight, shape (particles, n).
        log_evidence: logarithm of the prior mean of the likelihood, up to the target's constant.
        levels: number of temperatures.
        evaluations: number of evaluations of the model.
    """

    points: Float[np.ndarray, "particles n"]
    log_evidence: float
    levels: int
    evaluations: int


def draw_prior(target: Target, count: int, seed: Any) -> Float[np.ndarray, "count n"]:
    """Coordinates drawn from the priors of the free parameters.

    Args:
        target: target whose free parameters have the priors; those of tied parameters count as data.
        count: number of draws.
        seed: seed of NumPy's generator.

    Raises:
        InputError: if a parameter has neither a prior nor two bounds.
    """
    random = np.random.default_rng(seed)
    columns = []
    for i, name in enumerate(target.names):
        lower, upper = float(target.lower[i]), float(target.upper[i])
        logarithmic = bool(target.layout.logarithmic[i])
        if name in target.prior_names:
            k = target.prior_names.index(name)
            mean, sd = float(target.prior_mean[k]), float(target.prior_sd[k])
            low, high = (np.exp(lower), np.exp(upper)) if logarithmic else (lower, upper)
            values = stats.truncnorm.rvs(
                (low - mean) / sd, (high - mean) / sd, mean, sd, size=count, random_state=random
            )
            columns.append(np.clip(np.log(values) if logarithmic else values, lower, upper))
        elif np.isfinite(lower) and np.isfinite(upper):
            columns.append(random.uniform(lower, upper, count))
        else:
            raise InputError(
                f"parameter {name!r}: sampling from the prior needs a prior or two bounds, and it has neither"
            )
    return np.stack(columns, axis=1)


def temper(target: Target, seed: int, run: int, particles: int = PARTICLES) -> Tempered:
    """Move points from the prior to the posterior.

    Args:
        target: target to sample.
        seed: seed of everything random.
        run: number of the run, which makes it independent of the others of this seed.
        particles: number of points, a multiple of the batch.

    Raises:
        InputError: if the prior cannot be drawn from, the model never has an answer, or the temperature does
            not rise.
    """
    particles = max(particles // BATCH, 1) * BATCH
    arrays, fixed = eqx.partition(target, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    functions, static = jax.tree.flatten(fixed)
    step, likelihoods = _program(tuple(functions), static, structure, target.dimension)
    points = draw_prior(target, particles, np.random.SeedSequence([seed, run]))
    if not np.isfinite(np.asarray(likelihoods(leaves, points))).any():
        raise InputError("the model has an answer nowhere in the prior; tighten priors and bounds")
    state = adaptive_tempered.init(jnp.asarray(points))
    key, evidence = jax.random.fold_in(jax.random.key(seed), run), 0.0
    moves = MOVES * target.dimension + 10
    for level in range(1, MOST_LEVELS + 1):
        state, gain = step(leaves, jax.random.fold_in(key, level), state)
        evidence += float(gain)
        if float(state.tempering_param) >= 1.0:
            return Tempered(np.asarray(state.particles), evidence, level, level * particles * (moves + 1))
    raise InputError(
        f"the way from the prior to the posterior took more than {MOST_LEVELS} temperatures; "
        "tighten the priors"
    )


@functools.lru_cache(maxsize=16)
def _program(functions: tuple, static: Any, structure: Any, dimension: int) -> tuple:
    """Compiled programs: one temperature step, and the likelihoods of points."""

    def whole(leaves: list[Array]) -> Target:
        return eqx.combine(jax.tree.unflatten(structure, leaves), jax.tree.unflatten(static, functions))

    def likelihood(target: Target, point: Array) -> Array:
        """Log-likelihood of data and priors of tied parameters, -inf where the model has no answer."""
        nearest = jnp.clip(point, target.lower, target.upper)
        tied = jnp.asarray([name not in target.names for name in target.prior_names], bool)
        rows = jnp.where(tied, target.prior_rows(nearest), 0.0)
        found = target.likelihood(target.values(nearest), target.data) - 0.5 * jnp.sum(rows**2)
        return jnp.where(jnp.isfinite(found), found, -jnp.inf)

    def prior(target: Target, point: Array) -> Array:
        tied = jnp.asarray([name not in target.names for name in target.prior_names], bool)
        rows = jnp.where(tied, target.prior_rows(jnp.clip(point, target.lower, target.upper)), 0.0)
        return target.log_prior(point) + 0.5 * jnp.sum(rows**2)

    @jax.jit
    def step(leaves: list[Array], key: Array, state: Any) -> tuple:
        target = whole(leaves)
        kernel = adaptive_tempered.build_kernel(
            lambda p: prior(target, p),
            lambda p: likelihood(target, p),
            lambda key, state, density, root: random_walk.build_additive_step()(
                key, state, density, random_walk.normal(root)
            ),
            random_walk.init,
            resampling.systematic,
            LEVEL,
            batch_size=BATCH,
        )
        root = SCALE / jnp.sqrt(dimension) * _root(state.particles)
        state, info = kernel(key, state, MOVES * dimension + 10, {"root": root[None]})
        return state, info.log_likelihood_increment

    @jax.jit
    def likelihoods(leaves: list[Array], points: Array) -> Array:
        target = whole(leaves)
        return jax.lax.map(lambda p: likelihood(target, p), points, batch_size=BATCH)

    return step, likelihoods


def _root(points: Float[Array, "particles n"]) -> Float[Array, "n n"]:
    """A root of the points' covariance, scaled so that moduli in pascals leave room for thicknesses."""
    sd = jnp.maximum(jnp.std(points, axis=0), jnp.finfo(points.dtype).tiny)
    around = (points - jnp.mean(points, axis=0)) / sd
    values, axes = jnp.linalg.eigh(around.T @ around / len(points))
    return sd[:, None] * axes * jnp.sqrt(jnp.maximum(values, 0.0))
