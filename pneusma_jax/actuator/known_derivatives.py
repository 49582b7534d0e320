"""Derivatives of rows of known numbers, outside of `jax.jit`: no program depends on the number of rows.

`jax.grad` takes the linear map from tangents of the inputs to tangents of the results, and transposes it.
That map is one operation here, with rules of its own. Where numbers are known, these take `CHUNK` rows at a
time, as the solves in `batches`, and NumPy cuts and joins. Otherwise JAX differentiates `finished_rows`:
under `jax.vmap`, for derivatives of derivatives, and inside of a transformation.
"""

import contextlib
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, PyTree

from ..numerics.rows import filled
from ..numerics.safe import evaluated, is_concrete
from ..program_cache import stored_jit
from . import Actuator
from .balance import Problem
from .batches import BLOCK, CHUNK, put, taken
from .implicit import attached
from .result import Equilibrium, equilibrium_of, solved
from .traced_batch import finished_rows


def with_derivatives(
    actuator: Actuator, each: tuple, known: tuple, roots: np.ndarray, result: Equilibrium
) -> Equilibrium:
    """The result of solved rows, with derivatives by all numbers that are traced.

    Args:
        actuator, each: of the rows, with tracers.
        known: both without.
        roots: joint unknowns of the rows.
        result: of the rows, without derivatives.
    """
    leaves = jax.tree.leaves((actuator, each))
    moving = tuple(k for k, leaf in enumerate(leaves) if isinstance(leaf, jax.core.Tracer))
    floats, rest = eqx.partition(result, eqx.is_inexact_array)
    shown, shape = jax.tree.flatten(floats)
    at = _Rows(known, moving, np.asarray(roots), result)

    @jax.custom_jvp
    def found(*numbers: Array) -> list[Array]:
        return shown

    @found.defjvp
    def tangent(primals: tuple, tangents: tuple) -> tuple[list, list]:
        if is_concrete(primals):
            return shown, _TANGENT.bind(*tangents, at=at)
        return jax.jvp(at.finished, primals, tangents)

    return eqx.combine(jax.tree.unflatten(shape, found(*[leaves[k] for k in moving])), rest)


class _Rows:
    """Solved rows about which derivatives are taken. Two are the same only if they are one object.

    Attributes:
        known: actuator, and pressures, activations and states of rows.
        moving: which of their numbers derivatives are taken by, in the order of leaves.
        roots: joint unknowns of the rows.
        result: of the rows.
        good: true for rows that have one.
        shared: number of the actuator's numbers, which come before those of rows.
    """

    def __init__(self, known: tuple, moving: tuple[int, ...], roots: np.ndarray, result: Equilibrium) -> None:
        actuator, each = known
        self.known = actuator, jax.tree.map(np.asarray, each)
        self.moving, self.roots, self.result = moving, roots, result
        self.good = solved(np.asarray(result.status))
        self.shared = len(jax.tree.leaves(actuator))

    def finished(self, *numbers: Array) -> list[Array]:
        """Numbers of the result as a function of those that derivatives are taken by; to be traced."""
        told = self.result.steps, self.result.equilibria, self.result.stable
        given = _replaced(self.known, self.moving, numbers)
        return _floats(finished_rows(*jax.tree.map(jnp.asarray, (*given, self.roots, *told))))

    def tangents(self, *tangents: Array) -> list[Array]:
        """Their tangents; to be traced."""
        leaves = jax.tree.leaves(self.known)
        return jax.jvp(self.finished, tuple(leaves[k] for k in self.moving), tangents)[1]

    def chunks(self, *of_rows: list) -> Any:
        """Chunks of rows, each as a slice, the arguments of a program for them, and the number of rows."""
        actuator, each = self.known
        for first in range(0, len(self.roots), CHUNK):
            where = slice(first, min(first + CHUNK, len(self.roots)))
            part = filled(taken((each, self.roots, self.good, *of_rows), where), CHUNK)
            count = where.stop - where.start
            yield where, (actuator, *part, np.asarray(count), self.moving), count


def _replaced(known: PyTree, moving: tuple[int, ...], numbers: Any) -> PyTree:
    """Known numbers with some of their leaves replaced."""
    leaves, structure = jax.tree.flatten(known)
    for k, number in zip(moving, numbers, strict=True):
        leaves[k] = number
    return jax.tree.unflatten(structure, leaves)


def _floats(result: Equilibrium) -> list[Array]:
    """Leaves of a result that have derivatives."""
    return jax.tree.leaves(eqx.filter(result, eqx.is_inexact_array))


def _of_block(
    k: Array, actuator: Actuator, each: tuple, roots: Array, good: Array, moving: tuple[int, ...]
) -> tuple[Any, list]:
    """Numbers of the results of a block as a function of those that derivatives are taken by, and these."""
    cut = lambda x: jax.lax.dynamic_slice_in_dim(x, k * BLOCK, BLOCK)  # noqa: E731
    each, roots, good = jax.tree.map(cut, (each, roots, good))
    leaves = jax.tree.leaves((actuator, each))

    def results(numbers: list) -> list[Array]:
        actuator_, each_ = _replaced((actuator, each), moving, numbers)

        def finish(row: tuple, root: Array, good: Array) -> Equilibrium:
            problem = Problem(actuator_, *row)
            return equilibrium_of(problem, attached(problem, root), jnp.asarray(0), good=good)

        return _floats(jax.vmap(finish)(each_, roots, good))

    return results, [leaves[i] for i in moving]


@stored_jit()
def _pulled(
    actuator: Actuator, each: tuple, roots: Array, good: Array, cotangents: list, count: Array,
    moving: tuple[int, ...], wanted: tuple[int, ...],
) -> tuple[list, list]:
    """Reverse derivatives of the first `count` of `CHUNK` rows, by the actuator's numbers and by the rows'.

    Args:
        actuator, each, roots, good: rows, their joint unknowns, and which have a result.
        cotangents: of those numbers of the results that are `wanted`, by rows.
        count: number of rows.
        moving, wanted: which numbers, in the order of leaves.
    """
    shared = sum(k < len(jax.tree.leaves(actuator)) for k in moving)

    def block(k: Array, cotangents: list) -> tuple[list, list]:
        results, numbers = _of_block(k, actuator, each, roots, good, moving)

        def only_wanted(numbers: list) -> list[Array]:
            found = results(numbers)
            return [found[i] for i in wanted]

        _, back = jax.vjp(only_wanted, numbers)
        there = k * BLOCK + jnp.arange(BLOCK) < count
        cut = lambda x: jax.lax.dynamic_slice_in_dim(x, k * BLOCK, BLOCK)  # noqa: E731
        only = lambda x: jnp.where(there.reshape(-1, *[1] * (x.ndim - 1)), cut(x), 0.0)  # noqa: E731
        (gradient,) = back([only(x) for x in cotangents])
        return gradient[:shared], gradient[shared:]

    def advance(k: Array, so_far: tuple[list, list]) -> tuple[list, list]:
        of_all, of_rows = block(k, cotangents)
        place = lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, k * BLOCK, 0)  # noqa: E731
        return jax.tree.map(jnp.add, so_far[0], of_all), jax.tree.map(place, so_far[1], of_rows)

    leaves = jax.tree.leaves((actuator, each))
    blank = [jnp.zeros(jnp.shape(leaves[k])) for k in moving]
    return jax.lax.fori_loop(0, -(-count // BLOCK), advance, (blank[:shared], blank[shared:]))


@stored_jit()
def _pushed(
    actuator: Actuator, each: tuple, roots: Array, good: Array, tangents: list, count: Array,
    moving: tuple[int, ...], of_all: list,
) -> list[Array]:
    """Tangents of the results of the first `count` of `CHUNK` rows; those of the actuator's numbers are
    `of_all`. Otherwise as `_pulled`."""

    @jax.jit  # traced once for its shapes and for the loop
    def block(k: Array) -> list[Array]:
        results, numbers = _of_block(k, actuator, each, roots, good, moving)
        own = [jax.lax.dynamic_slice_in_dim(x, k * BLOCK, BLOCK) for x in tangents]
        return jax.jvp(results, (numbers,), ([*of_all, *own],))[1]

    def advance(k: Array, so_far: list) -> list:
        place = lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, k * BLOCK, 0)  # noqa: E731
        return jax.tree.map(place, so_far, block(k))

    shapes = jax.eval_shape(block, jnp.asarray(0))
    blank = [jnp.zeros((CHUNK, *x.shape[1:]), x.dtype) for x in shapes]
    return jax.lax.fori_loop(0, -(-count // BLOCK), advance, blank)


def _tangents(*tangents: Array, at: _Rows) -> list[Array]:
    """Tangents of the results of rows of known numbers."""
    numbers = [np.asarray(x) for x in tangents]
    shared = sum(k < at.shared for k in at.moving)
    found = [np.empty(x.shape, x.dtype) for x in _floats(at.result)]
    with evaluated():
        for where, arguments, count in at.chunks(numbers[shared:]):
            for whole, part in zip(found, _pushed(*arguments, numbers[:shared]), strict=True):
                put(whole, where, np.asarray(part)[:count])
        return jax.device_put(found)


def _cotangents(cotangents: list, *tangents: Any, at: _Rows) -> list[Array]:
    """Reverse derivatives of rows."""
    wanted = tuple(k for k, x in enumerate(cotangents) if not isinstance(x, ad.Zero))
    given = [cotangents[k] for k in wanted]
    shapes = [jnp.zeros_like(x) if isinstance(x, np.ndarray) else x.aval for x in tangents]
    if not is_concrete(given):
        back = jax.linear_transpose(at.tangents, *[jax.ShapeDtypeStruct(x.shape, x.dtype) for x in shapes])
        return list(back([ad.instantiate_zeros(x) for x in cotangents]))
    numbers = [np.asarray(x) for x in given]
    sums = [np.zeros(x.shape) for x in shapes]
    shared = sum(k < at.shared for k in at.moving)
    with evaluated():
        for where, arguments, count in at.chunks(numbers):
            of_all, of_rows = _pulled(*arguments, wanted)
            for whole, part in zip(sums[:shared], of_all, strict=True):
                whole += np.asarray(part)
            for whole, part in zip(sums[shared:], of_rows, strict=True):
                put(whole, where, np.asarray(part)[:count])
        return jax.device_put(sums)


def _side_by_side(tangents: tuple, places: tuple, at: _Rows) -> tuple[list, list]:
    """Tangents under `jax.vmap`."""
    found = jax.vmap(at.tangents, places)(*tangents)
    return found, [0] * len(found)


# JAX keeps the shapes of up to 2048 operations by their parameters, and rows in a parameter as long: 0.3 kB
# each. Of a type that is registered it keeps weak references. There is no public way to register one.
with contextlib.suppress(ImportError, AttributeError):
    from jax._src.util import weakref_cache_key_types

    weakref_cache_key_types.add(_Rows)

_TANGENT = Primitive("tangents_of_rows")
_TANGENT.multiple_results = True
_TANGENT.def_impl(_tangents)
_TANGENT.def_abstract_eval(lambda *_, at: list(map(jax.typeof, _floats(at.result))))
ad.deflinear2(_TANGENT, _cotangents)
batching.primitive_batchers[_TANGENT] = _side_by_side
mlir.register_lowering(
    _TANGENT, mlir.lower_fun(lambda *tangents, at: at.tangents(*tangents), multiple_results=True)
)
