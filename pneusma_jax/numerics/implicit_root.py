"""Derivatives of a root of one unknown, by the implicit function theorem.

Optimistix's own adjoint checks its linear solve, and the check calls back into Python. JAX keeps no compiled
program that calls back, and none can be stored traced. Thus every diagnosis of an elastomer or a spring
compiled its program anew. For an elastomer that takes 3 s, and 0.5 s from disk.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree


class OneUnknown(eqx.Module):
    """Adjoint of `optimistix.root_find` for a function of one number, shape () or (1,).

    Derivatives are of every order. Where the function's slope at the root vanishes, they are infinite or NaN,
    and nothing is raised. The method is that of `optimistix.AbstractAdjoint`, which is no base class because
    optimistix is loaded late.
    """

    def apply(
        self, primal_fn: Callable, rewrite_fn: Callable, inputs: tuple, tags: Any
    ) -> tuple[Array, PyTree]:
        """See optimistix."""
        root, rest = _solved(primal_fn, rewrite_fn, (*inputs, partial(eqxi.while_loop, kind="lax")))
        return root, jax.tree.map(eqxi.nondifferentiable_backward, rest)


@eqx.filter_custom_jvp
def _solved(primal_fn: Callable, rewrite_fn: Callable, inputs: tuple) -> tuple[Array, PyTree]:
    """Root and all else that the method returns."""
    return jax.tree.map(jnp.asarray, primal_fn(inputs))


@_solved.def_jvp
def _tangent(primals: tuple, tangents: tuple) -> tuple[tuple, tuple]:
    """Both and their tangents; only the root has one."""
    primal_fn, rewrite_fn, inputs = primals
    constant = jax.tree.map(_is_none, tangents[2], is_leaf=_is_none)
    still, moving = eqx.partition(inputs, constant, is_leaf=_is_none)
    root, rest = _solved(primal_fn, rewrite_fn, inputs)
    missed = lambda root, moving: rewrite_fn(root, rest, eqx.combine(moving, still))  # noqa: E731
    _, slope = jax.jvp(lambda root: missed(root, moving), (root,), (jnp.ones_like(root),))
    _, change = jax.jvp(lambda moving: missed(root, moving), (moving,), (tangents[2],))
    nothing = jax.custom_derivatives.zero_from_primal(rest, symbolic_zeros=True)
    return (root, rest), (-change / slope, nothing)


def _is_none(value: Any) -> bool:
    return value is None
