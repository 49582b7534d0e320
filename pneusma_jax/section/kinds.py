"""Hollow cross-sections that are not round: rectangle, half disc, polygon. Each is an outline minus a bore.

All of them are differentiable in every dimension. The origin lies midway between the extreme points of
rectangle and half disc; a polygon keeps the origin of its data.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics.lines import first_crossing
from ..numerics.safe import as_numpy, is_concrete
from . import NODES, Section
from .outline import Outline
from .shapes import Shape

STRAIGHT_NODES = 8
"""Number of Gauss nodes a panel of straight edges; exact for the default law, a blend of polynomials."""


def hollow(outer: Shape, bore: Shape, nodes: int = NODES) -> Section:
    """Section between an outer figure and a bore, which the pressure fills.

    Raises:
        ValueError: if the bore does not lie inside.
    """
    concrete = is_concrete(outer, bore)
    if concrete:
        outline, inner = outer.polyline(), bore.polyline()
        if first_crossing(outline, inner) is not None or outer.signed_distance(inner[0]) >= 0.0:
            raise ValueError("The bore of a section must lie inside its outer line, but it does not.")
    area, first, _ = (as_numpy(bore) if concrete else bore).moments()
    solid = as_numpy(outer) if concrete else outer
    up = np.array([0.0, 1.0])
    return Section(
        shapes=(outer, bore),
        signs=(1, -1),
        enclosed_area=jnp.asarray(area),
        enclosed_centroid=jnp.asarray(first / area),
        radius=jnp.asarray(0.5 * (solid.reach(up) + solid.reach(-up))),
        nodes=nodes,
    )


def rectangle(width: Array, height: Array, wall_thickness: Array, nodes: int = STRAIGHT_NODES) -> Section:
    """Rectangular tube; `width` along x, `height` along y, sides 1 and 2 being its upper and lower faces [m].

    Raises:
        ValueError: if a dimension is not positive or the wall leaves no bore.
    """
    _check_wall(wall_thickness, {"width": width, "height": height})
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    size = _stacked(width, height)
    return hollow(Outline(corners * size), Outline(corners * (size - 2.0 * _stacked(wall_thickness))), nodes)


def semicircle(outer_diameter: Array, wall_thickness: Array, nodes: int = NODES) -> Section:
    """Half of a round tube, closed by a flat wall of the same thickness; the flat face is side 2 [m].

    The origin is midway between the flat and the top of the arc, a quarter of the diameter from each.

    Raises:
        ValueError: if a dimension is not positive or the wall leaves no bore.
    """
    _check_wall(wall_thickness, {"outer_diameter / 2": _stacked(outer_diameter) / 2.0})
    radius, wall = 0.5 * _stacked(outer_diameter), _stacked(wall_thickness)
    xp = np if isinstance(radius, np.ndarray) and isinstance(wall, np.ndarray) else jnp
    floor = -0.5 * radius
    outer = _half_disc(xp, radius, floor)
    # the bore's arc has the same centre; it ends at the inner face of the flat wall
    half_width = xp.sqrt((radius - wall) ** 2 - wall**2)
    bulge = (radius - 2.0 * wall) / half_width
    return hollow(outer, _half_disc(xp, half_width, floor + wall, bulge), nodes)


def polygon(
    vertices: Float[Array, "n 2"],
    wall_thickness: Array | None = None,
    bore: Float[Array, "m 2"] | None = None,
    nodes: int = STRAIGHT_NODES,
) -> Section:
    """Tube with any simple polygon as its outer line, convex or not.

    Args:
        vertices: vertices of the outer line, counter-clockwise, in the axes of the section [m].
        wall_thickness: uniform thickness of the wall [m].
        bore: vertices of the bore, counter-clockwise, instead of a wall thickness [m].
        nodes: number of Gauss nodes per panel of an edge.

    Raises:
        ValueError: for a line that bounds no figure, a wall without a bore, or a bore that is not inside.
    """
    if (wall_thickness is None) == (bore is None):
        raise ValueError("A polygonal section must have either a `wall_thickness` or a `bore`, and not both.")
    outer = Outline(vertices)
    inner = Outline(bore) if bore is not None else Outline(inset(vertices, wall_thickness))
    return hollow(outer, inner, nodes)


def inset(vertices: Float[Array, "n 2"], distance: Array) -> Float[Array, "n 2"]:
    """Vertices of a polygon whose edges are moved inwards [m].

    Raises:
        ValueError: when given concrete numbers, if the distance is not positive or an edge vanishes.
    """
    concrete = is_concrete(vertices, distance)
    xp = np if concrete else jnp
    vertices, distance = xp.asarray(vertices), xp.asarray(distance)
    step = xp.roll(vertices, -1, axis=0) - vertices
    along = step / xp.sqrt((step**2).sum(-1, keepdims=True))
    inwards = xp.stack([-along[:, 1], along[:, 0]], axis=-1)
    before = xp.roll(inwards, 1, axis=0)
    mitre = (inwards + before) / (1.0 + (inwards * before).sum(-1, keepdims=True))
    inner = vertices + distance * mitre
    if concrete:
        remaining = ((np.roll(inner, -1, axis=0) - inner) * along).sum(-1)
        if not float(distance) > 0.0 or np.any(remaining <= 0.0) or first_crossing(inner) is not None:
            raise ValueError(
                "Argument `wall_thickness` must be positive and leave a bore, "
                f"but it is {float(distance) * 1e3:g} mm in an outline whose shortest edge is "
                f"{np.linalg.norm(step, axis=1).min() * 1e3:g} mm."
            )
    return inner


def _half_disc(xp: Any, half_width: Array, floor: Array, bulge: Array = 1.0) -> Outline:
    """Figure between a level line and an arc over it."""
    left, right = xp.stack([-half_width, floor]), xp.stack([half_width, floor])
    return Outline(xp.stack([left, right]), xp.reshape(xp.asarray(bulge), (1,)), curved=(1,))


def _stacked(*values: Array) -> Array:
    """One number, or a vector of several; NumPy where nothing is traced, so that nothing is compiled."""
    if is_concrete(*values):
        numbers = values[0] if len(values) == 1 else [np.asarray(v) for v in values]
        return np.asarray(numbers, dtype=float)  # type: ignore[return-value]
    return values[0] if len(values) == 1 else jnp.stack([jnp.asarray(v) for v in values])


def _check_wall(wall_thickness: Array, across: dict[str, Array]) -> None:
    """Refuse a wall of impossible thickness between faces at this distance [m]."""
    for name, size in across.items():
        if is_concrete(wall_thickness, size) and not 0.0 < 2.0 * float(wall_thickness) < float(size):
            raise ValueError(
                "Argument `wall_thickness` must be positive and leave a bore, "
                f"but it is {float(wall_thickness) * 1e3:g} mm where `{name}` is {float(size) * 1e3:g} mm."
            )
