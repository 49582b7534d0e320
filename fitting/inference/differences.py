"""Derivatives by finite differences, for laws whose programs take long to compile.

A derivative along a direction is a second evaluation beside the first. So a program holds the law as it is,
and no tangent of each of its operations.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
from jaxtyping import Array

STEP = 1e-6
"""Step of a difference along a direction, as part of it. Rounding then changes a slope by a part in 1e9, and
curvature by a millionth of the change of the slope along the whole direction."""


@eqx.filter_custom_jvp
def differenced(function: Callable[[Any], Array], given: Any, here: Array) -> Array:
    """`function(given)`, whose derivatives along directions are forward differences. It has no reverse ones.

    Args:
        function: function of `given` alone.
        given: any tree of arrays.
        here: `function(given)`, which is known.
    """
    return here


@differenced.def_jvp
def _(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    (function, given, here), (_, direction, _) = primals, tangents
    along = lambda x, t: x if t is None else x + STEP * t  # noqa: E731
    moved = jax.tree.map(along, given, direction, is_leaf=lambda x: x is None)
    return here, (function(moved) - here) / STEP
