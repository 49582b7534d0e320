"""Where a chain is nearest to a lumen's wall, and the ends of drives that keep it from more room."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Array

from fitting.design.log import Evaluation
from pneusma_jax.late import Late

from .lumen import progress

optimize = Late("scipy.optimize")

NEARLY = 1e-3
"""Difference from the largest violation up to which a point counts as tightest, too, in radii of the tube
[1]: 0.005 mm for a tube of 10 mm. The search of the least overlap ends within a hundredth of that."""
AT_END = 1e-6
"""Distance from an end of its range at which a drive counts as held there, as part of the range [1]."""


@dataclass(frozen=True)
class Touch:
    """Points of a chain in a lumen that come nearest to its wall.

    Attributes:
        along: distance along the lumen of the tightest point [m].
        segment: the segment that it lies on, from 1; a connector belongs to the segment before it.
        stretches: ends along the lumen of every stretch that comes nearer to the wall than is wanted [m],
            shape (stretches, 2).
    """

    along: float
    segment: int
    stretches: np.ndarray


def touch_of(points: np.ndarray, gaps: np.ndarray, line: Array, segments: int, wanted: float) -> Touch:
    """Where a chain comes nearest to the wall.

    Args:
        points: of the chain's centre line [m], shape (points, 3), as many on each segment, and the tip.
        gaps: distance of the walls at these points [m], shape (points,).
        line: points of the lumen's centre line [m].
        segments: number of segments.
        wanted: distance to keep [m].
    """
    along = np.array([float(progress(point, line)) for point in points])
    tightest = int(np.argmin(gaps))
    near = np.concatenate([[False], gaps < wanted, [False]])
    begins, ends = np.flatnonzero(near[1:] & ~near[:-1]), np.flatnonzero(near[:-1] & ~near[1:])
    stretches = [sorted((along[a], along[b - 1])) for a, b in zip(begins, ends, strict=True)]
    each = max(1, (len(points) - 1) // segments)
    return Touch(
        float(along[tightest]),
        min(tightest // each + 1, segments),
        np.array(stretches).reshape(-1, 2),
    )


def held_drives(one: Evaluation, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drives whose lowest or highest end keeps the least of the largest violations from being less.

    At that least, the gradients of the tightest rows and those of the ends weigh each other out, the rows
    with weights that sum to one. Non-negative least squares finds the weights. An end with none could be left
    without gain.

    Args:
        one: evaluation at the place of the least overlap.
        rows: its numbers that are to be small [1].

    Returns:
        Indices of the drives that are held at their lowest, and at their highest end.
    """
    excess = one.values[rows]
    tight = rows[excess >= excess.max() - NEARLY]
    low, high = np.flatnonzero(one.place <= AT_END), np.flatnonzero(one.place >= 1.0 - AT_END)
    steep, ends = one.jacobian[tight], np.eye(one.place.size)
    size = float(np.abs(steep).max()) or 1.0
    matrix = np.vstack([steep / size, -ends[low], ends[high]]).T
    sums = np.concatenate([np.ones(tight.size), np.zeros(low.size + high.size)])
    weights, _ = optimize.nnls(np.vstack([matrix, sums]), np.append(np.zeros(one.place.size), 1.0))
    below, above = np.split(weights[tight.size :], [low.size])
    return low[below > 0.0], high[above > 0.0]
