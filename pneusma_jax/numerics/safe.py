"""Functions that stay finite, in value and in gradient, where the plain formula is singular.

Each uses the double-`where`: the argument is made harmless first, and the result is chosen afterwards. So the
branch that is not taken cannot leak a NaN into a gradient.
"""

import contextlib
from collections.abc import Mapping
from types import ModuleType
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, PyTree

TINY = 1e-12


def chord_power(base: Array, exponent: Array, knee: float = 1e-6) -> Array:
    """`base**exponent` for base >= 0, replaced below `knee` by its chord to the origin.

    For an exponent below 1 the power has an infinite slope at 0; the chord's slope is finite. A negative
    base counts as 0.
    """
    xp = namespace_of(base, exponent)
    base = xp.maximum(base, 0.0)
    small = base < knee
    safe = xp.where(small, knee, base)
    return xp.where(small, base * knee ** (exponent - 1.0), safe**exponent)


def unit_power(base: Array, exponent: Array) -> Array:
    """`base**exponent` for base in [0, 1], with zero value and zero slope at a base of exactly 0."""
    xp = namespace_of(base, exponent)
    positive = base > 0.0
    safe = xp.where(positive, base, 1.0)
    return xp.where(positive, safe**exponent, 0.0)


def complement_power(base: Array, exponent: Array) -> Array:
    """`1 - (1 - base)**exponent` for base in [0, 1]; at an exponent of exactly 1 the base itself, bit by bit.

    An exponent below 1 has an infinite slope at a base of 1; the slope here ends at that of a remainder of
    `TINY`.
    """
    xp = namespace_of(base, exponent)
    remainder = 1.0 - base
    return base - remainder * xp.expm1((exponent - 1.0) * xp.log(xp.maximum(remainder, TINY)))


def safe_divide(numerator: Array, denominator: Array, floor: float) -> Array:
    """Quotient whose denominator keeps its sign but never comes closer to zero than `floor`."""
    xp = namespace_of(denominator)
    sign = xp.where(denominator < 0.0, -1.0, 1.0)
    close = xp.abs(denominator) < floor
    return numerator / xp.where(close, sign * floor, denominator)


def safe_norm(vector: Array, axis: int = -1) -> Array:
    """Euclidean norm with zero gradient at the zero vector; NaN where the vector has one."""
    xp = namespace_of(vector)
    square = xp.sum(vector**2, axis=axis)
    zero = square == 0.0
    return xp.where(zero, 0.0, xp.sqrt(xp.where(zero, 1.0, square)))


def smoothstep(u: Array) -> Array:
    """Quintic step: 0 below 0, 1 above 1, with two continuous derivatives."""
    u = namespace_of(u).clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def begun_as(values: PyTree, varying: PyTree) -> PyTree:
    """`values` unchanged, but batched and differentiated from the start by what the floating-point arrays of
    `varying` are.

    For the start of a scan. If a constant start soon depends on the arguments, JAX transforms the scan's body
    once to find that out, and then again for good. It does so at every level of `vmap` and `jvp`.
    """
    leaves = [jnp.asarray(leaf) for leaf in jax.tree.leaves(varying)]
    firsts = [x.ravel()[:1] for x in leaves if jnp.issubdtype(x.dtype, jnp.inexact) and x.size]
    if not firsts:
        return values
    any_of_them = jnp.sum(jnp.concatenate(firsts))

    def begun(value: Array) -> Array:
        value = jnp.asarray(value)
        return jnp.where(np.zeros(value.shape, bool), any_of_them.astype(value.dtype), value)

    return jax.tree.map(begun, values)


def zero_unless(good: Array, tree: PyTree) -> PyTree:
    """The same numbers, or zeros in their place; integers stay.

    Memory laws see this instead of a failed row, whose NaN would reach every reverse gradient.

    Args:
        good: true for the numbers, shape ().
        tree: pytree of arrays.
    """
    return jax.tree.map(lambda x: jnp.where(good, x, 0.0) if eqx.is_inexact_array(x) else x, tree)


def frozen(tree: PyTree) -> PyTree:
    """The same numbers without derivatives."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, tree)


def is_concrete(*values: object) -> bool:
    """True if none of the values is being traced, so that a check may look at them."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values))


def namespace_of(*arrays: Any) -> ModuleType:
    """`numpy` if all are NumPy arrays and Python's numbers, at least one the former; else `jax.numpy`.

    A law that computes with it compiles nothing where its numbers are NumPy's.
    """
    found = False
    for array in arrays:
        if isinstance(array, np.ndarray | np.generic):
            found = True
        elif not isinstance(array, int | float):
            return jnp
    return np if found else jnp


def numpy_if_known(*values: object) -> ModuleType:
    """`numpy` if none of the values is being traced, `jax.numpy` otherwise.

    Structures that are put together with it compile nothing where their numbers are known. Whoever passes
    them on as arrays of JAX calls `as_array` on the result, which leaves traced ones as they are.
    """
    return np if is_concrete(*values) else jnp


M = TypeVar("M")


def as_numpy(module: M) -> M:
    """A module, or a tree of them, with NumPy arrays for its known numbers. Its methods compile nothing."""
    return jax.tree.map(np.asarray, module)


def as_array(value: ArrayLike) -> Array:
    """A value as an array of JAX. `jnp.asarray` compiles a program for every new shape of known numbers; this
    does not, and leaves an array of JAX as it is."""
    if isinstance(value, jax.Array):
        return value
    plain = all(isinstance(x, np.ndarray | np.generic | bool | int | float) for x in jax.tree.leaves(value))
    return jax.device_put(np.asarray(value)) if plain else jnp.asarray(value)


def as_arrays(values: Mapping[str, float]) -> dict[str, Array]:
    """Numbers by name as arrays, so that a compiled program takes other numbers without compiling anew."""
    return {name: jnp.asarray(float(value)) for name, value in values.items()}


def evaluated() -> contextlib.AbstractContextManager:
    """A context in which operations on known numbers are carried out, also inside of a traced function.

    `jax.ensure_compile_time_eval` does so, but where nothing is traced it makes compiling slow. Constants
    within a program are then computed one by one, by some hundred programs of their own.
    """
    staged = not is_concrete(jax.device_put(np.zeros(())))  # which compiles nothing
    return jax.ensure_compile_time_eval() if staged else contextlib.nullcontext()


def check_number(name: str, given: Any) -> None:
    """Refuse texts and None in the place of numbers; `numpy.asarray(..., float)` takes both.

    Args:
        name: name of the argument, for the message.
        given: a number, an array or a list of numbers.

    Raises:
        TypeError: if it is none of them.
    """
    for leaf in jax.tree.leaves(given, is_leaf=lambda x: x is None):
        if leaf is None or np.dtype(leaf.dtype if hasattr(leaf, "dtype") else type(leaf)).kind in "USO":
            raise TypeError(f"Argument `{name}` must be numbers, but it is {given!r}.")
