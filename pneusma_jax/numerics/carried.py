"""A number whose derivatives follow from a rule, of any order, also in loops.

`jax.custom_jvp` says the same. But reverse derivatives of a `jax.lax.scan` split its body, and drop such a
rule there for derivatives of derivatives: the second derivative of the square root that a rule gives was zero
(jax 0.10.2). A primitive is never opened, so that its rule stays.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, PyTree

Rule = Callable[[Array, PyTree, PyTree], Array]


def carried(value: Array, rule: Rule, given: PyTree) -> Array:
    """The same value, with derivatives by the numbers that it follows from.

    Args:
        value: the number; its own derivatives are left out.
        rule: tangent of the value, from the value, `given` and the tangents of `given`, which are None for
            what does not vary. The value that it gets carries derivatives itself.
        given: numbers from which the value follows.
    """
    arrays, rest = eqx.partition(given, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)

    def of_leaves(value: Array, leaves: list, tangents: list) -> Array:
        known, by = (jax.tree.unflatten(structure, x) for x in (leaves, tangents))
        return rule(value, eqx.combine(known, rest), by)

    return _CARRIED.bind(value, *leaves, rule=of_leaves, axes=())


def _derivative(primals: list, tangents: list, *, rule: Callable, axes: tuple) -> tuple[Array, Any]:
    """Value and tangent. `axes` has a tuple of the batch axes of all arguments for each
    `jax.vmap`, the last one first."""
    value = _CARRIED.bind(*primals, rule=rule, axes=axes)
    moving = [k for k, tangent in enumerate(tangents[1:]) if not isinstance(tangent, ad.Zero)]
    if not moving:
        return value, ad.Zero(jax.typeof(value).to_tangent_aval())

    def tangent_of(value: Array, leaves: list, some: list) -> Array:
        by: list = [None] * len(leaves)
        for k, tangent in zip(moving, some, strict=True):
            by[k] = tangent
        return rule(value, leaves, by)

    for own, *others in reversed(axes):
        tangent_of = jax.vmap(tangent_of, (own, others, [others[k] for k in moving]), own)
    return value, tangent_of(value, list(primals[1:]), [tangents[1 + k] for k in moving])


def _side_by_side(arguments: tuple, places: tuple, *, rule: Callable, axes: tuple) -> tuple[Array, int]:
    """The primitive under `jax.vmap`; its value then has a leading axis."""
    size = next(x.shape[k] for x, k in zip(arguments, places, strict=True) if k is not None)
    value, *leaves = arguments
    first = places[0]
    value = jnp.broadcast_to(value, (size, *value.shape)) if first is None else jnp.moveaxis(value, first, 0)
    return _CARRIED.bind(value, *leaves, rule=rule, axes=((0, *places[1:]), *axes)), 0


_CARRIED = Primitive("carried")
_CARRIED.def_impl(lambda value, *_, **__: value)
_CARRIED.def_abstract_eval(lambda value, *_, **__: jax.core.ShapedArray(value.shape, value.dtype))
ad.primitive_jvps[_CARRIED] = _derivative
batching.primitive_batchers[_CARRIED] = _side_by_side
mlir.register_lowering(_CARRIED, lambda _, value, *__, **___: [value])
