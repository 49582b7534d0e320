"""Segments of equal structure are handled together: groups, stacks, and results in the order of segments."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp

from ..numerics.safe import as_array, numpy_if_known


def groups_of_equal_structure(rows: list[tuple]) -> list[list[int]]:
    """Groups of rows with equal structure and shapes."""
    groups: dict[tuple, list[int]] = {}
    for k, row in enumerate(rows):
        leaves, structure = jax.tree.flatten(jax.tree.map(jnp.asarray, row))
        groups.setdefault((structure, *((leaf.shape, leaf.dtype) for leaf in leaves)), []).append(k)
    return list(groups.values())


def stack_rows(rows: list[tuple], members: Sequence[int]) -> tuple:
    """Some rows along a leading axis."""
    chosen = [rows[k] for k in members]
    xp = numpy_if_known(chosen)
    return jax.tree.map(lambda *leaves: as_array(xp.stack(leaves)), *chosen)


def by_segment(results: Sequence, members: Sequence[Sequence[int]]) -> list:
    """Stacked results, segment by segment from base to tip."""
    ordered: list = [None] * sum(map(len, members))
    for result, group in zip(results, members, strict=True):
        for at, k in enumerate(group):
            ordered[k] = jax.tree.map(lambda leaf, at=at: leaf[at], result)
    return ordered


def map_by_structure(function: Callable, rows: list[tuple]) -> list:
    """Results of a function for every row; rows of equal structure and shapes share one vmapped call."""
    groups = groups_of_equal_structure(rows)
    if all(len(members) == 1 for members in groups):
        return [function(*row) for row in rows]
    return by_segment([jax.vmap(function)(*stack_rows(rows, members)) for members in groups], groups)
