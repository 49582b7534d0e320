"""Equilibrium of rows whose phases are given and that lie near a configuration that is known.

`actuator.equilibrium.solve` also tries other ways where Newton's method fails. A fit solves the same rows
again and again, near their last configuration, and does not need those ways. Without them a program compiles
in a third of the time.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.safe import frozen
from .balance import Problem, residual
from .implicit import attached
from .root_find import BALANCED, newton

MOST_STEPS = 25


def nearby_root(problem: Problem, guess: Float[Array, " freedoms"]) -> tuple[Array, Array]:
    """Scaled unknowns at which force and moment balance, and whether they do.

    Derivatives come from the implicit function theorem; the guess has none.

    Args:
        problem: one row, its activations given fractions.
        guess: scaled unknowns of a neighbouring state.
    """
    unknowns = attached(problem, newton(problem, guess, MOST_STEPS).unknowns)
    return unknowns, jnp.max(jnp.abs(residual(*frozen((unknowns, problem)), 1))) < BALANCED
