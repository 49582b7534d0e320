"""Stability of an equilibrium: signs of the determinants of its stiffness, and how nearly it is singular."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.linear import determinant, solve_small
from ..numerics.safe import frozen
from .balance import Problem, freedoms, joint_residual


def stiffness_signs(problem: Problem, root: Array) -> Float[Array, "2"]:
    """Sign of the determinant of the stiffness at the phases, and of the one at the measured resistances.

    Args:
        problem: one row.
        root: joint unknowns of an equilibrium.

    Returns:
        Twice a sign, 1 or -1; 0 where it is singular.
    """
    problem, root = frozen((problem, root))
    return signs_of(jax.jacfwd(lambda y: joint_residual(y, problem, 1))(root), freedoms(problem))


def signs_of(slope: Float[Array, "n n"], count: int) -> Float[Array, "2"]:
    """`stiffness_signs` from the slope of the joint residual; `count` unknowns are the configuration."""
    own = determinant(slope[:count, :count])
    if len(slope) == count:
        return jnp.sign(jnp.stack([own, own]))
    return jnp.sign(jnp.stack([own, own * determinant(_reduced(slope, count))]))


def _reduced(slope: Float[Array, "n n"], count: int) -> Array:
    """Slope of what measured resistances miss over the fractions, while the configuration gives way."""
    first, rest = slope[:count], slope[count:]
    across = jax.vmap(solve_small, (None, 1), 1)(first[:, :count], first[:, count:])
    return rest[:, count:] - rest[:, :count] @ across


def least_slope(slope: Float[Array, "n n"], count: int) -> Array:
    """About the smallest singular value of `_reduced` [1]; 1 without measured resistances."""
    if len(slope) == count:
        return jnp.ones(())
    reduced = _reduced(slope, count)
    return jnp.abs(determinant(reduced)) / jnp.max(jnp.abs(reduced)) ** (len(reduced) - 1)
