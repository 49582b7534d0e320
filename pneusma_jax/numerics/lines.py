"""Closed polylines of plain numbers: whether one bounds a figure, and how far a place is from it."""

import numpy as np
from jaxtyping import Array, Float


def cross(a: Array, b: Array) -> Array:
    """z component of the cross product of plane vectors along the last axis."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def signed_distance(line: Float[np.ndarray, "m 2"], place: Float[np.ndarray, "2"]) -> float:
    """Distance of a place from a closed polyline, negative inside [m]."""
    step = np.roll(line, -1, axis=0) - line
    part = np.clip(((place - line) * step).sum(1) / (step**2).sum(1), 0.0, 1.0)
    distance = np.min(np.linalg.norm(line + part[:, None] * step - place, axis=1))
    end = line + step
    spans = (line[:, 1] > place[1]) != (end[:, 1] > place[1])
    rise = np.where(spans, step[:, 1], 1.0)
    x = line[:, 0] + (place[1] - line[:, 1]) / rise * step[:, 0]
    inside = np.sum(spans & (x > place[0])) % 2 == 1
    return float(-distance if inside else distance)


def check_vertices(vertices: Float[np.ndarray, "n 2"], bulges: Float[np.ndarray, "arcs"]) -> None:
    """Refuse numbers that make no closed line, in one sentence.

    Raises:
        ValueError: for a number that is not finite, neighbours in one place, or an arc that cannot be.
    """
    if not (np.all(np.isfinite(vertices)) and np.all(np.isfinite(bulges))):
        raise ValueError("The vertices of an outline must be finite numbers, but one is not.")
    if np.any(np.abs(bulges) > 1.0) or np.any(bulges == 0.0):
        raise ValueError("An arc of an outline must be at most half a circle and not straight (bulge to 1).")
    step = np.roll(vertices, -1, axis=0) - vertices
    short = np.flatnonzero(np.linalg.norm(step, axis=1) <= 1e-9 * np.ptp(vertices, axis=0).max())
    if short.size:
        raise ValueError(
            "The vertices of an outline must differ, "
            f"but two that follow each other are at {in_mm(vertices[short[0]])}."
        )


def check_line(line: Float[np.ndarray, "m 2"]) -> None:
    """Refuse a closed polyline that bounds no figure, in one sentence.

    Raises:
        ValueError: if it crosses itself or runs clockwise.
    """
    crossing = first_crossing(line)
    if crossing is not None:
        raise ValueError(f"An outline must not cross itself, but it does near {in_mm(crossing)}.")
    if cross(line, np.roll(line, -1, axis=0)).sum() <= 0.0:
        raise ValueError(
            "The vertices of an outline must run counter-clockwise, but they run clockwise: reverse them."
        )


def first_crossing(
    line: Float[np.ndarray, "m 2"], other: Float[np.ndarray, "k 2"] | None = None
) -> Float[np.ndarray, "2"] | None:
    """A point where a closed polyline meets itself, or another one; None if there is none [m]."""
    own, second = line, line if other is None else other
    step_i, step_j = (np.roll(points, -1, axis=0) - points for points in (own, second))
    i, j = (index.ravel() for index in np.indices((len(own), len(second))))
    if other is None:
        apart = (j - i >= 2) & (j - i != len(own) - 1)
        i, j = i[apart], j[apart]
        after = np.roll(step_i, -1, axis=0)
        back = np.flatnonzero((cross(step_i, after) == 0.0) & ((step_i * after).sum(1) < 0.0))
        if back.size:  # an edge that runs back over the one before
            return np.roll(own, -1, axis=0)[back[0]]
    gap, slope = second[j] - own[i], cross(step_i[i], step_j[j])
    crossed = slope != 0.0
    slope = np.where(crossed, slope, 1.0)
    t, w = cross(gap, step_j[j]) / slope, cross(gap, step_i[i]) / slope
    hits = np.flatnonzero(crossed & (t >= 0.0) & (t <= 1.0) & (w >= 0.0) & (w <= 1.0))
    return own[i[hits[0]]] + t[hits[0]] * step_i[i[hits[0]]] if hits.size else None


def in_mm(place: np.ndarray) -> str:
    """A place as a person writes it; adding zero turns -0 into 0."""
    x, y = np.round(place * 1e3, 3) + 0.0
    return f"({x:g}, {y:g}) mm"
