"""Equilibrium of rows whose phases are given and that lie near a configuration that is known: plain Newton.

`actuator.equilibrium.solve` also tries other ways where Newton fails. A fit computes the same rows over and
over near where they were before and does not need those; without them a program compiles in a third of the
time.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.linear import solve_small
from .balance import Problem, residual
from .root_find import BALANCED

CLOSE = 1e-11
"""Newton step in scaled unknowns at which it ends."""
MOST_STEPS = 25
LONGEST = 0.3
"""Longest Newton step of a scaled unknown."""


def nearby_root(problem: Problem, guess: Float[Array, " freedoms"]) -> tuple[Array, Array]:
    """Scaled unknowns at which force and moment balance, and whether they do.

    Derivatives come from the implicit function theorem; the guess has none.

    Args:
        problem: one row, its activations given fractions.
        guess: scaled unknowns of a neighbouring state.
    """
    frozen = jax.lax.stop_gradient(problem)

    def search(_: object, guess: Array) -> Array:
        def go_on(carry: tuple) -> Array:
            return (carry[1] > CLOSE) & (carry[2] < MOST_STEPS)

        def advance(carry: tuple) -> tuple:
            unknowns, _, count = carry
            slope, excess = jax.jacfwd(residual)(unknowns, frozen), residual(unknowns, frozen)
            step = jnp.clip(solve_small(slope, excess), -LONGEST, LONGEST)
            return unknowns - step, jnp.max(jnp.abs(step)), count + 1

        return jax.lax.while_loop(go_on, advance, (guess, jnp.asarray(1.0), 0))[0]

    def tangent(linear: Callable[[Array], Array], vector: Array) -> Array:
        return solve_small(jax.jacfwd(linear)(vector), vector)

    start = jax.lax.stop_gradient(guess)
    unknowns = jax.lax.custom_root(lambda z: residual(z, problem), start, search, tangent)
    return unknowns, jnp.max(jnp.abs(residual(unknowns, frozen))) < BALANCED
