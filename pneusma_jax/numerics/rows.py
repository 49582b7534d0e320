"""Rows of arrays in lots of one size: a program that is compiled for it serves any number of rows."""

import jax
import numpy as np
from jaxtyping import PyTree


def filled(tree: PyTree, size: int) -> PyTree:
    """Arrays with their last row repeated until there are `size` rows, as arrays of NumPy.

    Args:
        tree: arrays of the same number of rows, at least one and at most `size`.
        size: number of rows of the result.
    """

    def one(array: np.ndarray) -> np.ndarray:
        array = np.asarray(array)
        return np.concatenate([array, np.repeat(array[-1:], size - len(array), axis=0)])

    return jax.tree.map(one, tree)


def first_rows(tree: PyTree, count: int) -> PyTree:
    """The first rows of arrays, as arrays of NumPy; they undo `filled`."""
    return jax.tree.map(lambda x: np.asarray(x)[:count], tree)


def lots(tree: PyTree, size: int) -> list[PyTree]:
    """Arrays cut into lots of `size` rows, the last one filled up."""
    rows = len(jax.tree.leaves(tree)[0])
    cut = lambda first: jax.tree.map(lambda x: x[first : first + size], tree)  # noqa: E731
    return [filled(cut(first), size) for first in range(0, rows, size)]


def joined(parts: list[PyTree], count: int) -> PyTree:
    """Results of all lots behind each other, `count` rows, as arrays of NumPy; they undo `lots`."""
    return jax.tree.map(lambda *x: np.concatenate(x)[:count], *parts)
