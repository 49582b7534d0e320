"""Load steps from rest, by which equilibria at given phases are reached where Newton's method fails."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol.spring import MartensiteFraction
from ..numerics.safe import frozen
from .balance import Problem, all_finite, first_trial
from .root_find import Ended, newton

LOAD_STEPS = 16
"""Number of steps in which pressure, heat and loads are brought on from rest, where Newton fails from the
start."""


def at_rest(problem: Problem) -> Problem:
    """The row without pressure and loads, springs cold."""
    cold = tuple(
        MartensiteFraction(jnp.ones_like(a.value)) if isinstance(a, MartensiteFraction) else a
        for a in problem.activations
    )
    unloaded = problem.actuator.with_loads(*jax.tree.map(jnp.zeros_like, problem.actuator.loads))
    return Problem(unloaded, jnp.zeros_like(problem.pressure), cold, problem.states, problem.pipeline)


def loaded_by(share: Array, rest: Problem, problem: Problem) -> Problem:
    """The row with a share of its pressure, heat and loads."""
    return jax.tree.map(
        lambda a, b: jnp.where(share == 1.0, b, a + share * (b - a)) if eqx.is_inexact_array(a) else a,
        rest, problem,
    )  # fmt: skip


def at_given_phases(problem: Problem, guess: Array) -> Ended:
    """Root of a problem without measured springs: from the guess, else in `LOAD_STEPS` steps from rest."""
    problem, guess = frozen((problem, guess))
    rest, finite = at_rest(problem), all_finite(problem)

    def attempt(carry: tuple) -> tuple:
        # one loop for both ways, so that Newton's method is compiled once
        stage, begin, before = carry
        at_once = stage == 0
        share = jnp.where(at_once, 1.0, stage / LOAD_STEPS)
        found = newton(loaded_by(share, rest, problem), begin)
        found = eqx.tree_at(lambda f: f.steps, found, found.steps + before.steps)
        nearer = jnp.where(found.good, found.unknowns, begin)
        begin = jnp.where(at_once, first_trial(problem.actuator), nearer)
        ended = at_once & (found.good | ~finite)
        return jnp.where(ended, LOAD_STEPS + 1, stage + 1), begin, found

    no = jnp.asarray(False)
    nothing = Ended(
        guess, jnp.asarray(0), no, no, jnp.zeros(2), jnp.ones(()), jnp.eye(guess.size)
    )
    return jax.lax.while_loop(lambda c: c[0] <= LOAD_STEPS, attempt, (jnp.asarray(0), guess, nothing))[2]
