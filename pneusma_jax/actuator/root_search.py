"""Search for all equilibria of one row by resistance: from a grid of fractions, then near those found."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..numerics.safe import frozen
from .balance import Problem, first_trial, freedoms, measured
from .root_find import FEW_STEPS, Ended, newton
from .starts import beside_cold, in_between, trial_fractions

DISTINCT = 1e-5
"""Minimum difference of two equilibria in a scaled unknown [1]; Newton's method ends at 1e-8."""
MOST_ROOTS = 8
"""Maximum of equilibria that are told apart; three is the most that was seen."""
STAGES = 5
"""Number of stages of `all_roots`: with the fractions of a grid held, from there, between the equilibria
found, beside them with one fraction held, and from there."""


class Roots(eqx.Module):
    """Equilibria of one row, the least heated first.

    Attributes:
        unknowns: joint unknowns of each equilibrium, shape (MOST_ROOTS, freedoms + measured).
        real: true for entries that are roots, shape (MOST_ROOTS,).
        signs: sign of the stiffness at the measured resistances, shape (MOST_ROOTS,).
        steps: number of Newton steps in all.
    """

    unknowns: Float[Array, "roots n"]
    real: Bool[Array, "roots"]
    signs: Float[Array, "roots"]
    steps: Array

    @property
    def count(self) -> Array:
        """Number of equilibria."""
        return jnp.sum(self.real)

    def joined(self, found: Ended, counted: Array, count: int) -> "Roots":
        """These roots and those of many attempts.

        Args:
            found: ends of the attempts, arrays of shape (attempts, ...).
            counted: true if their roots are equilibria; with fractions held they are not.
            count: number of unknowns before the fractions.
        """
        every = jnp.concatenate([self.unknowns, found.unknowns])
        best, real = distinct(every, jnp.concatenate([self.real, found.good & counted]), count)
        signs = jnp.concatenate([self.signs, found.signs[:, 1]])[best]
        return Roots(every[best], real, signs, self.steps + jnp.sum(found.steps))


def no_roots(unknowns: int) -> Roots:
    """None yet."""
    none = jnp.zeros((MOST_ROOTS, unknowns))
    return Roots(none, jnp.zeros(MOST_ROOTS, bool), jnp.zeros(MOST_ROOTS), jnp.asarray(0))


def all_roots(problem: Problem) -> Roots:
    """All equilibria of a row with measured springs, ordered by the phase of the hottest one.

    At given phases there is one equilibrium, so it is found for a grid of fractions. Newton's method for
    configuration and fractions together starts from each of these. Then it starts between the equilibria, and
    at last beside them, see `beside_cold`.
    """
    problem = frozen(problem)
    grid = jnp.asarray(trial_fractions(len(measured(problem))))
    count = freedoms(problem)
    first = jnp.broadcast_to(first_trial(problem.actuator), (len(grid), count))

    def search(carry: tuple) -> tuple:
        # one loop for all, so that Newton's method is compiled once
        stage, (begin, fixed), known = carry
        attempt = lambda y, fixed: newton(problem, y, held=(fixed, y[count:]), few=FEW_STEPS)  # noqa: E731
        found = jax.vmap(attempt)(begin, fixed)
        known = known.joined(found, ~holds_fractions(stage), count)
        return stage + 1, next_starts(stage, begin, found, known, count), known

    begun = jnp.concatenate([first, grid], axis=1), jnp.ones(grid.shape, bool)
    carry = (jnp.asarray(0), begun, no_roots(count + grid.shape[1]))
    return jax.lax.while_loop(lambda c: c[0] < STAGES, search, carry)[2]


def holds_fractions(stage: Array) -> Array:
    """True if fractions are held in a stage of `all_roots`."""
    return (stage == 0) | (stage == 3)


def next_starts(stage: Array, begin: Array, found: Ended, known: Roots, count: int) -> tuple[Array, Array]:
    """Joint unknowns from which the stage after one of `all_roots` starts, and which fractions are held.

    Args:
        stage: number of the stage that ended.
        begin, found: its starts, shape (starts, unknowns), and how its attempts ended.
        known: equilibria so far.
        count: number of unknowns before the fractions.
    """
    width = np.arange(len(begin))
    from_there = jnp.where(found.good[:, None], found.unknowns, begin)
    between = in_between(known.unknowns, known.real, count)
    beside, held = beside_cold(known.unknowns, known.real, count)
    between, beside, held = (x[width % len(x)] for x in (between, beside, held))
    later = jnp.where(stage == 1, between, beside)
    return jnp.where(holds_fractions(stage), from_there, later), jnp.asarray(held) & (stage == 2)


def distinct(found: Array, good: Array, count: int) -> tuple[Array, Array]:
    """Different ones among roots, the least heated first: by the hottest spring, then by all.

    For NumPy and JAX, with any leading axes.

    Args:
        found: candidates, shape (..., candidates, unknowns); columns from `count` on are fractions.
        good: true for candidates that are roots, shape (..., candidates).
        count: number of unknowns before the fractions.

    Returns:
        Which candidates they are, `MOST_ROOTS` at most, and which of these are roots.
    """
    xp = np if isinstance(found, np.ndarray) else jnp
    heats = xp.sum(1.0 - found[..., count:], axis=-1)
    hottest = xp.round((1.0 - xp.min(found[..., count:], axis=-1, initial=1.0)) / DISTINCT)
    order = xp.lexsort((heats, xp.where(good, hottest, np.inf)), axis=-1)
    found = xp.take_along_axis(found, order[..., None], axis=-2)
    good = xp.take_along_axis(good, order, axis=-1)
    apart = xp.max(xp.abs(found[..., :, None, :] - found[..., None, :, :]), axis=-1) > DISTINCT
    earlier = np.tril(np.ones((good.shape[-1],) * 2, bool), -1)
    new = good & ~xp.any(earlier & good[..., None, :] & ~apart, axis=-1)
    first = xp.argsort(~new, axis=-1, stable=True)[..., :MOST_ROOTS]
    return xp.take_along_axis(order, first, axis=-1), xp.take_along_axis(new, first, axis=-1)
