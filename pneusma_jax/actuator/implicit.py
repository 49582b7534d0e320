"""Derivatives of an equilibrium by the implicit function theorem.

They follow from the root alone, whatever way led to it. So no search for equilibria carries derivatives.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.carried import carried
from ..numerics.newton import solve_blocks
from ..numerics.safe import frozen
from .balance import Problem, freedoms, joint_residual, zeros_for_nan


def attached(problem: Problem, root: Array, stiffness: Array | None = None) -> Array:
    """The same root, with derivatives by the numbers of the problem: of any order in a plane, else three.

    Args:
        problem: one row.
        root: joint unknowns.
        stiffness: slope of the joint residual there, if it is known.
    """
    problem, root = zeros_for_nan(problem, root)
    if stiffness is not None:
        finite = jnp.all(jnp.isfinite(stiffness))
        stiffness = frozen(jnp.where(finite, stiffness, jnp.eye(len(stiffness))))
    return carried(frozen(root), _tangent, (problem, stiffness))


def _tangent(root: Array, given: tuple, tangents: tuple) -> Array:
    """Derivative by the implicit function theorem: one Jacobian, one linear system.

    The root carries derivatives itself, so that this rule has derivatives of any order.
    """
    problem, stiffness = given
    if stiffness is None:
        slope = _slope_at(root, problem)
    else:  # the last step of the root-find has left it
        slope = carried(stiffness, _change_of_slope, (root, problem))
    _, missed = eqx.filter_jvp(lambda given: joint_residual(root, given), (problem,), (tangents[0],))
    return -solve_blocks(slope, missed, freedoms(problem))


def _change_of_slope(_: Array, given: tuple, tangents: tuple) -> Array:
    """Derivative of the slope of the joint residual, from root and problem."""
    return eqx.filter_jvp(_slope_at, given, tangents)[1]


def _slope_at(root: Array, problem: Problem) -> Array:
    """Slope of the joint residual at a root."""
    return jax.jacfwd(lambda y: joint_residual(y, problem))(root)
