"""A few lengths for all courses, so that courses of many lengths run few compiled programs.

Tracing and compiling a history of an actuator takes seconds for every length; a further row of it takes
0.1 ms.
"""

import jax
import numpy as np
from jaxtyping import PyTree

SHORTEST = 64
"""Least length [rows]."""
STEPS = 2
"""Number of lengths from one length to twice as much. A course gets longer by a half at most."""


def fixed_length(rows: int) -> int:
    """The shortest of the fixed lengths that holds a course.

    Args:
        rows: number of rows.
    """
    step = max(SHORTEST, 1 << (max(rows - 1, 1).bit_length() - 1)) // STEPS
    return max(SHORTEST, -(-rows // step) * step)


def lengthened(courses: PyTree, length: int) -> PyTree:
    """Courses that go on with their first row up to a length: mostly a state of rest, which is solved soon.

    Args:
        courses: arrays of known values with a leading axis of rows, (rows, ...).
        length: number of rows afterwards.
    """

    def longer(course: jax.Array) -> np.ndarray:
        course = np.asarray(course)
        return np.concatenate([course, np.repeat(course[:1], length - len(course), axis=0)])

    return jax.tree.map(longer, courses)


def shortened(courses: PyTree, rows: int) -> PyTree:
    """The first rows of arrays. Of known values, it takes no program for every number of rows."""

    def shorter(course: jax.Array) -> jax.Array:
        if isinstance(course, jax.core.Tracer):  # of a program around this one
            return course[:rows]
        return jax.device_put(np.asarray(course)[:rows])  # which compiles nothing

    return jax.tree.map(shorter, courses)


def going_on(time: np.ndarray, length: int) -> np.ndarray:
    """A clock of known values that goes on at its last interval [s], shape (length,)."""
    time = np.asarray(time, float)
    last = time[-1] - time[-2] if len(time) > 1 else 0.0
    return np.concatenate([time, time[-1] + last * np.arange(1, length - len(time) + 1)])


def known(tree: PyTree) -> bool:
    """True if no number of a tree is traced, and all are on the only device."""
    alone = jax.config.jax_default_device is None and len(jax.devices()) == 1  # type: ignore[attr-defined]
    return alone and not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(tree))
