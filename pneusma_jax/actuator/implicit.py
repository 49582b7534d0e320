"""Derivatives of an equilibrium by the implicit function theorem.

They follow from the root alone, whatever way led to it. So no search for equilibria carries derivatives.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.newton import solve_blocks
from ..numerics.safe import frozen
from .balance import Problem, calm, freedoms, joint_residual


def attached(problem: Problem, root: Array, stiffness: Array | None = None) -> Array:
    """The same root, with derivatives by the numbers of the problem: of any order in a plane, else three.

    Args:
        problem: one row.
        root: joint unknowns.
        stiffness: slope of the joint residual there, if it is known.
    """
    problem, root = calm(problem, root)
    if stiffness is not None:
        finite = jnp.all(jnp.isfinite(stiffness))
        stiffness = frozen(jnp.where(finite, stiffness, jnp.eye(len(stiffness))))
    return _attached(frozen(root), problem, stiffness)


@eqx.filter_custom_jvp
def _attached(root: Array, problem: Problem, stiffness: Array | None) -> Array:
    """See `attached`. Nothing of its derivatives is traced where none is asked for."""
    return root


@_attached.def_jvp
def _attached_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """Derivative by the implicit function theorem: one Jacobian, one linear system.

    The root within carries derivatives itself, so that this rule has derivatives of any order.
    """
    root, problem, stiffness = primals
    root = _attached(root, problem, stiffness)
    slope = _slope(root, problem, stiffness)
    _, missed = eqx.filter_jvp(lambda given: joint_residual(root, given), (problem,), (tangents[1],))
    return root, -solve_blocks(slope, missed, freedoms(problem))


@eqx.filter_custom_jvp
def _slope(root: Array, problem: Problem, stiffness: Array | None) -> Array:
    """Slope of the joint residual at a root; the last step of the root-find has left it, all but 1e-8."""
    return _slope_at(root, problem) if stiffness is None else stiffness


@_slope.def_jvp
def _slope_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    root, problem, stiffness = primals
    change = eqx.filter_jvp(_slope_at, (root, problem), tangents[:2])[1]
    return _slope(root, problem, stiffness), change


def _slope_at(root: Array, problem: Problem) -> Array:
    return jax.jacfwd(lambda y: joint_residual(y, problem))(root)
