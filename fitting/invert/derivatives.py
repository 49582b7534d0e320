"""Values of goals with their exact derivatives by the drives, along as few directions as tell them apart.

In a chain without loads a segment feels the pressure and its own springs alone. So one direction serves the
first springs of all segments, one the second springs, and one the pressure. The chain's kinematics then take
the segments' derivatives to the tip; they cost little.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.design.bodies import Body, Solved
from pneusma_jax.serial_chain.shape import place_segments

from .forward import Memories, segments_of, springs_of, state_of, unknowns_of
from .goals import GOALS
from .tables import Table, looked_up

Drives = Callable[[Array], Array]
"""Drives at a place in the box."""


def values_with_slope(
    body: Body, goals: tuple[str, ...], drives: Drives, place: Array, memories: Memories, guess: Array
) -> tuple[Array, Array, Array]:
    """Values of the goals in SI, their derivative by the place, and the scaled unknowns of every segment.

    Args:
        body: the body that is driven.
        goals: names of `GOALS`.
        drives: pressure and fractions at a place.
        place: place in the box, shape (drives,).
        memories: memories of the springs.
        guess: start of Newton's method, shape (segments, freedoms).
    """
    if body.chain is not None and not body.chain.loaded:
        return _of_chain(body, goals, drives, place, memories, guess)

    def values(place: Array) -> tuple[Array, Array]:
        x = drives(place)
        solved = state_of(body, x[0], x[1:], memories, guess)
        return _goals(goals, solved), unknowns_of(solved)

    push = lambda tangent: jax.jvp(values, (place,), (tangent,), has_aux=True)  # noqa: E731
    found, slope, unknowns = jax.vmap(push, out_axes=(None, 1, None))(jnp.eye(place.size))
    return found, slope, unknowns


def _goals(goals: tuple[str, ...], solved: Solved) -> Array:
    return jnp.concatenate([GOALS[name].function(solved) for name in goals])


Shape = Callable[[Array], tuple[tuple[Array, Array], Array]]
"""Bends and lengths of all segments at a place in the box, and their scaled unknowns."""


def _of_chain(
    body: Body, goals: tuple[str, ...], drives: Drives, place: Array, memories: Memories, guess: Array
) -> tuple[Array, Array, Array]:
    def shape(place: Array) -> tuple[tuple[Array, Array], Array]:
        x = drives(place)
        found = segments_of(body, x[0], x[1:], memories, guess)
        both = jnp.stack([s.bend for s in found]), jnp.stack([s.length for s in found])
        return both, jnp.stack([s.unknowns for s in found])

    return _carried(body, goals, shape, place)


def values_of_tables(
    body: Body, tables: tuple[Table, ...], goals: tuple[str, ...], drives: Drives, place: Array
) -> tuple[Array, Array, Array]:
    """The same as `values_with_slope` of a chain without loads and memory, from tables of its segments."""

    def shape(place: Array) -> tuple[tuple[Array, Array], Array]:
        found = looked_up(tables, drives(place))
        return (found[:, :2], found[:, 2]), jnp.zeros((len(tables), 1))

    return _carried(body, goals, shape, place)


def _carried(body: Body, goals: tuple[str, ...], shape: Shape, place: Array) -> tuple[Array, Array, Array]:
    """Derivatives of the segments' shapes, taken to the tip by the chain's kinematics."""
    springs = springs_of(body)
    order = [sum(s == segment for s, _ in springs[:k]) for k, (segment, _) in enumerate(springs)]
    directions = np.zeros((2 + max(order, default=-1), place.size))
    directions[0, 0] = 1.0
    for k, own in enumerate(order):
        directions[1 + own, 1 + k] = 1.0

    push = lambda tangent: jax.jvp(shape, (place,), (tangent,), has_aux=True)  # noqa: E731
    (bends, lengths), moved, unknowns = jax.vmap(push, out_axes=(None, 0, None))(jnp.asarray(directions))
    count = len(body.segments)
    # which direction tells of a drive, and of which segments
    told = np.array([0, *(1 + own for own in order)])
    whose = np.array([np.ones(count), *(np.arange(1, count + 1) == segment for segment, _ in springs)])
    own_bends, own_lengths = moved[0][told] * whose[..., None], moved[1][told] * whose

    def values(bends: Array, lengths: Array) -> Array:
        gaps = jnp.append(body.chain.connectors, 0.0)
        placed = place_segments(bends, lengths, body.chain.angles, gaps, jnp.zeros(count))
        return _goals(goals, Solved(body, jnp.zeros(()), (), placed.end_pose, None))

    carry = lambda b, n: jax.jvp(values, (bends, lengths), (b, n))  # noqa: E731
    found, slope = jax.vmap(carry, out_axes=(None, 1))(own_bends, own_lengths)
    return found, slope, unknowns
