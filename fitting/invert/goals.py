"""Goals for a state, and the distance from each that counts as one."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Array

from fitting.design.bodies import Solved
from pneusma_jax.numerics.safe import as_array, safe_norm

DEGREE = 0.017453292519943295


@dataclass(frozen=True)
class Goal:
    """One thing that can be wanted.

    Attributes:
        columns: columns of a table of targets; their suffix is the unit.
        function: values of a solved state, shape (columns,), in SI.
        size: miss that counts as one, in SI; by these misses of different kinds are weighed.
        tolerance: miss up to which a target counts as met, in SI.
        chain: true if a chain can have it; single: true if one actuator can.
    """

    columns: tuple[str, ...]
    function: Callable[[Solved], Array]
    size: float
    tolerance: float
    chain: bool
    single: bool = True


def _direction(solved: Solved) -> Array:
    return solved.end_pose[:3, 2]


GOALS: dict[str, Goal] = {
    "curvature": Goal(("curvature_1pm",), lambda s: s.only.curvature[None], 1.0, 0.1, False),
    "bend_angle": Goal(("bend_angle_deg",), lambda s: s.only.bend_angle[None], DEGREE, 0.5 * DEGREE, False),
    "length": Goal(("length_mm",), lambda s: s.only.length[None], 1e-3, 0.1e-3, False),
    "bend": Goal(
        ("bend_x_deg", "bend_y_deg"), lambda s: s.only.bend, DEGREE, 0.5 * DEGREE, False
    ),
    "tip": Goal(("tip_x_mm", "tip_y_mm", "tip_z_mm"), lambda s: s.end_pose[:3, 3], 1e-3, 0.5e-3, True),
    "direction": Goal(("direction_x", "direction_y", "direction_z"), _direction, 2.0 * DEGREE, DEGREE, True),
}  # fmt: skip
"""Goals by name. `bend` is the bend angle vector of an actuator that bends in any direction, `direction` the
unit vector along the tip."""


def misses(goals: tuple[str, ...], found: Array, wanted: Array) -> dict[str, Array]:
    """Distance from each goal, in SI; NaN where a state has no equilibrium, so that no goal is met there.

    Args:
        goals: names.
        found, wanted: actual and desired values, shape (..., columns).
    """
    misses, at = {}, 0
    for name in goals:
        width = len(GOALS[name].columns)
        misses[name] = safe_norm(found[..., at : at + width] - wanted[..., at : at + width])
        at += width
    return misses


def sizes(goals: tuple[str, ...]) -> Array:
    """Size of every column, shape (columns,)."""
    return as_array(np.array([GOALS[name].size for name in goals for _ in GOALS[name].columns]))
