"""Figures bounded by straight edges and circular arcs: polygons, half discs, rounded corners.

Green's theorem turns the integral of f(s) u^k over the area into one along the boundary, `integral f(s)
u^(k+1) / (k+1) ds`. It is taken edge by edge in the edge's own parameter. The integrand is smooth there for
any figure, convex or not, and any direction. This includes edges across the direction: they contribute
nothing, but their derivatives do.
"""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..numerics.lines import check_line, check_vertices, cross
from ..numerics.safe import as_array, as_numpy, is_concrete, namespace_of
from .shapes import Rule, Shape, across, frozen, panels

_ARC_POINTS = 33  # Number of points of an arc as a polyline, in checks of concrete numbers only
_TOUCH = 1e-9  # Tolerance of an edge's parameter: a ray through a vertex hits both of its edges


class Outline(Shape):
    """A figure inside one closed line, which must not cross itself.

    Attributes:
        vertices: vertices in counter-clockwise order [m], shape (n, 2); the last is joined to the first.
        bulges: bulges of the curved edges, in the order of `curved`, shape (len(curved),). A bulge is the
            tangent of a quarter of the arc's angle, as in DXF polylines. 1 is a half circle; positive bulges
            outwards.
        curved: static; indices of the edges that are arcs, edge i going from vertex i to the next.

    Raises:
        ValueError: when built from concrete numbers, for too few or repeated vertices or a clockwise order.
            Also for an arc of more than half a circle, or a line that crosses itself.
    """

    vertices: Float[Array, "n 2"] = eqx.field(converter=as_array)
    bulges: Float[Array, "arcs"] = eqx.field(converter=as_array, default=())
    curved: tuple[int, ...] = eqx.field(static=True, default=())

    def __check_init__(self) -> None:
        count = np.shape(self.vertices)[0] if np.ndim(self.vertices) == 2 else 0
        if np.shape(self.vertices) != (count, 2) or count < (2 if self.curved else 3):
            raise ValueError(
                "An outline must have at least three vertices (x, y), or two and an arc, "
                f"but its vertices have shape {np.shape(self.vertices)}."
            )
        if np.shape(self.bulges) != (len(self.curved),) or any(not 0 <= i < count for i in self.curved):
            raise ValueError(
                f"An outline must have one bulge per curved edge and {count} edges at most, "
                f"but edges {self.curved} have {np.size(self.bulges)} bulges."
            )
        if is_concrete(self.vertices, self.bulges):
            check_vertices(np.asarray(self.vertices), np.asarray(self.bulges))
            check_line(self.polyline())

    def rule(self, direction: Array, cuts: Array, nodes: int) -> Rule:
        """See `Shape.rule`."""
        xp = namespace_of(direction, self.vertices)
        parts = [self._straight_rule(direction, cuts, nodes)] if len(self._straight) else []
        parts += [self._curved_rule(direction, cuts, nodes)] if self.curved else []
        s, u, ds = (xp.concatenate(part) for part in zip(*parts, strict=True))
        area = u * ds
        return Rule(
            s=s, area=area, first=u * area / 2.0, second=u**2 * area / 3.0, third=u**3 * area / 4.0,
            fourth=u**4 * area / 5.0,
        )  # fmt: skip

    def moments(self) -> tuple[Array, Array, Array]:
        """See `Shape.moments`: triangles from the origin to each edge, and the segments that arcs add."""
        xp = namespace_of(self.vertices)
        start, end = self._ends(range(self.vertices.shape[0]))
        twice = cross(start, end)
        both = start + end
        area, first = twice.sum() / 2.0, (twice[:, None] * both).sum(0) / 6.0
        outer = lambda p: p[:, :, None] * p[:, None, :]  # noqa: E731
        second = (twice[:, None, None] * (outer(start) + outer(end) + outer(both))).sum(0) / 24.0
        if not self.curved:
            return area, first, second
        centre, radius, middle, half = self._arcs()
        extra = radius**2 * (half - xp.sin(half) * xp.cos(half))
        along = middle * (2.0 / 3.0 * radius**3 * xp.sin(half) ** 3)[:, None]
        i_m = radius**4 * (4.0 * half - xp.sin(4.0 * half)) / 16.0
        i_t = radius**4 * (12.0 * half - 8.0 * xp.sin(2.0 * half) + xp.sin(4.0 * half)) / 48.0
        tangent = xp.stack([-middle[:, 1], middle[:, 0]], axis=-1)
        mixed = centre[:, :, None] * along[:, None, :]
        parts = i_m[:, None, None] * outer(middle) + i_t[:, None, None] * outer(tangent)
        parts = parts + mixed + xp.swapaxes(mixed, 1, 2) + extra[:, None, None] * outer(centre)
        first = first + (extra[:, None] * centre + along).sum(0)
        return area + extra.sum(), first, second + parts.sum(0)

    def reach(self, direction: Array) -> Array:
        """See `Shape.reach`."""
        xp = namespace_of(direction, self.vertices)
        farthest = xp.max(self.vertices @ direction)
        if not self.curved:
            return farthest
        centre, radius, middle, half = self._arcs()
        # the arc's own farthest point counts where the arc bulges outwards and spans the direction
        spans = (half > 0.0) & (middle @ direction > xp.cos(half))
        return xp.maximum(farthest, xp.max(xp.where(spans, centre @ direction + radius, -np.inf)))

    def exit(self, direction: Array) -> Array:
        """See `Shape.exit`; of several crossings the farthest."""
        xp = namespace_of(direction, self.vertices)
        found = []
        if len(self._straight):
            start, end = self._ends(self._straight)
            slope = cross(direction, end - start)
            crossed = slope != 0.0
            slope = xp.where(crossed, slope, 1.0)
            part, away = cross(start, direction) / slope, cross(start, end - start) / slope
            on = crossed & (part >= -_TOUCH) & (part <= 1.0 + _TOUCH) & (away > 0.0)
            found.append(xp.where(on, away, -np.inf))
        if self.curved:
            centre, radius, middle, half = self._arcs()
            s_c, inside = centre @ direction, radius**2 - (centre @ across(direction)) ** 2
            hit = inside > 0.0
            root = xp.sqrt(xp.where(hit, inside, 1.0))
            for away in (s_c - root, s_c + root):
                towards = (away[:, None] * direction - centre) / radius[:, None]
                on = hit & (away > 0.0) & ((towards * middle).sum(-1) >= xp.cos(half) - _TOUCH)
                found.append(xp.where(on, away, -np.inf))
        return xp.max(xp.concatenate(found))

    def polyline(self) -> Float[np.ndarray, "m 2"]:
        """See `Shape.polyline`."""
        plain = as_numpy(self)
        pieces = [vertex[None, :] for vertex in plain.vertices]
        if self.curved:
            centre, radius, middle, half = plain._arcs()
            turn = half[:, None] * np.linspace(-1.0, 1.0, _ARC_POINTS)[:-1]
            aside = np.stack([-middle[:, 1], middle[:, 0]], axis=-1)
            towards = np.cos(turn)[..., None] * middle[:, None] + np.sin(turn)[..., None] * aside[:, None]
            for k, edge in enumerate(self.curved):
                pieces[edge] = centre[k] + radius[k] * towards[k]
        return np.concatenate(pieces)

    @property
    def _straight(self) -> list[int]:
        return [i for i in range(self.vertices.shape[0]) if i not in self.curved]

    def _ends(self, edges: range | list[int] | tuple[int, ...]) -> tuple[Array, Array]:
        """First and last points of some edges [m], shape (edges, 2)."""
        first = np.asarray(edges)
        return self.vertices[first], self.vertices[(first + 1) % self.vertices.shape[0]]

    def _arcs(self) -> tuple[Array, Array, Array, Array]:
        """Centre and radius of each arc [m], unit vector from there to its middle, half its angle [rad].

        The angle is negative, and the radius positive, where the arc bulges inwards.
        """
        xp = namespace_of(self.vertices)
        start, end = self._ends(self.curved)
        chord = end - start
        length = xp.sqrt((chord**2).sum(-1))
        outwards = xp.stack([chord[:, 1], -chord[:, 0]], axis=-1) / length[:, None]
        sign = xp.where(self.bulges < 0.0, -1.0, 1.0)
        radius = length * (1.0 + self.bulges**2) / (4.0 * xp.abs(self.bulges))
        top = 0.5 * (start + end) + outwards * (0.5 * length * self.bulges)[:, None]
        middle = outwards * sign[:, None]
        return top - middle * radius[:, None], radius, middle, 2.0 * xp.arctan(self.bulges)

    def _straight_rule(self, direction: Array, cuts: Array, nodes: int) -> tuple[Array, Array, Array]:
        """Nodes s, u and weights ds on the straight edges, each of shape (n,)."""
        xp = namespace_of(direction, self.vertices)
        start, end = self._ends(self._straight)
        side = across(direction)
        s_0, u_0, d_s, d_u = start @ direction, start @ side, (end - start) @ direction, (end - start) @ side
        level = d_s == 0.0
        places = (cuts - s_0[:, None]) / xp.where(level, 1.0, d_s)[:, None]
        places = xp.where((d_s < 0.0)[:, None], places[:, ::-1], places)
        t, weight = panels(_between(xp.where(level[:, None], 1.0, places)), nodes)
        s, u = s_0[:, None] + d_s[:, None] * t, u_0[:, None] + d_u[:, None] * t
        return s.reshape(-1), u.reshape(-1), (d_s[:, None] * weight).reshape(-1)

    def _curved_rule(self, direction: Array, cuts: Array, nodes: int) -> tuple[Array, Array, Array]:
        """Nodes s, u and weights ds on the arcs; an arc meets a cut up to twice."""
        xp = namespace_of(direction, self.vertices)
        centre, radius, middle, half = self._arcs()
        s_c, u_c = (centre @ direction)[:, None], (centre @ across(direction))[:, None]
        # angle psi from u towards s; it runs from `first` over `whole`
        radius, half = radius[:, None], half[:, None]
        first = xp.arctan2(middle @ direction, middle @ across(direction))[:, None] - half
        whole = 2.0 * half
        rise = xp.arcsin(xp.clip((cuts - s_c) / radius, -1.0, 1.0))
        turns = xp.concatenate([rise, np.pi - rise], axis=1)
        places = xp.mod((turns - first) / whole, 2.0 * np.pi / xp.abs(whole))
        t, weight = panels(_between(xp.sort(frozen(places), axis=1)), nodes)
        psi = first + whole * t
        s, u = s_c + radius * xp.sin(psi), u_c + radius * xp.cos(psi)
        return s.reshape(-1), u.reshape(-1), (radius * xp.cos(psi) * whole * weight).reshape(-1)


def _between(places: Array) -> Array:
    """Edges of panels on [0, 1] of every edge, from ascending places along it; they carry no derivative."""
    xp = namespace_of(places)
    inner = xp.clip(frozen(places), 0.0, 1.0)
    one = xp.ones((places.shape[0], 1))
    return xp.concatenate([0.0 * one, inner, one], axis=1)
