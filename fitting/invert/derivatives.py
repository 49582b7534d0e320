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
"""Pressure [Pa] and martensite fractions [1] at a place in the box, shape (drives,) to (drives,)."""
SegmentShapes = Callable[[Array], tuple[tuple[Array, Array], Array]]
"""Bends [rad], shape (segments, 2), and lengths [m], shape (segments,), at a place in the box. Beside
them stand the segments' scaled unknowns, shape (segments, freedoms)."""


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

    Returns:
        Shapes (values,), (values, drives) and (segments, freedoms). Where there is no equilibrium they are
        NaN.
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


def _of_chain(
    body: Body, goals: tuple[str, ...], drives: Drives, place: Array, memories: Memories, guess: Array
) -> tuple[Array, Array, Array]:
    """`values_with_slope` of a chain without loads: one equilibrium for each segment."""

    def shapes(place: Array) -> tuple[tuple[Array, Array], Array]:
        x = drives(place)
        found = segments_of(body, x[0], x[1:], memories, guess)
        both = jnp.stack([s.bend for s in found]), jnp.stack([s.length for s in found])
        return both, jnp.stack([s.unknowns for s in found])

    return _through_kinematics(body, goals, shapes, place)


def values_of_tables(
    body: Body, tables: tuple[Table, ...], goals: tuple[str, ...], drives: Drives, place: Array
) -> tuple[Array, Array, Array]:
    """The same as `values_with_slope` of a chain without loads and memory, from tables of its segments.

    A table has no unknowns of Newton's method. So one zero for each segment stands in their place.
    """

    def shapes(place: Array) -> tuple[tuple[Array, Array], Array]:
        found = looked_up(tables, drives(place))
        return (found[:, :2], found[:, 2]), jnp.zeros((len(tables), 1))

    return _through_kinematics(body, goals, shapes, place)


def _through_kinematics(
    body: Body, goals: tuple[str, ...], shapes: SegmentShapes, place: Array
) -> tuple[Array, Array, Array]:
    """Derivatives of the segments' shapes, taken to the tip by the chain's kinematics.

    The first direction is the pressure. Each next one moves the spring of the same rank in every segment.
    """
    springs = springs_of(body)
    rank = [sum(s == segment for s, _ in springs[:k]) for k, (segment, _) in enumerate(springs)]
    directions = np.zeros((2 + max(rank, default=-1), place.size))
    directions[0, 0] = 1.0
    for k, own in enumerate(rank):
        directions[1 + own, 1 + k] = 1.0

    push = lambda tangent: jax.jvp(shapes, (place,), (tangent,), has_aux=True)  # noqa: E731
    (bends, lengths), pushed, unknowns = jax.vmap(push, out_axes=(None, 0, None))(jnp.asarray(directions))
    count = len(body.segments)
    direction_of = np.array([0, *(1 + own for own in rank)])  # by drive, shape (drives,)
    moves = np.array([np.ones(count), *(np.arange(1, count + 1) == segment for segment, _ in springs)])
    by_drive = pushed[0][direction_of] * moves[..., None], pushed[1][direction_of] * moves

    def values(bends: Array, lengths: Array) -> Array:
        gaps = jnp.append(body.chain.connectors, 0.0)
        placed = place_segments(bends, lengths, body.chain.angles, gaps, jnp.zeros(count))
        return _goals(goals, Solved(body, jnp.zeros(()), (), placed.end_pose, None))

    to_tip = lambda bend, length: jax.jvp(values, (bends, lengths), (bend, length))  # noqa: E731
    found, slope = jax.vmap(to_tip, out_axes=(None, 1))(*by_drive)
    return found, slope, unknowns
