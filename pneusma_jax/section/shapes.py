"""Plane figures that can be integrated exactly along any direction: the interface, and the disc.

Coordinates are in metres in the axes of the section: x, y across the tube, side 1 towards +y. The formulas
are written for NumPy and JAX alike (`namespace_of`). So a figure made of plain numbers is checked when it is
built, without compiling anything.
"""

import abc
import math

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from ..numerics.lines import signed_distance
from ..numerics.safe import as_array, namespace_of


class Rule(eqx.Module):
    """Places along a direction and the chord's moments there.

    Attributes:
        s: coordinate along the direction [m], shape (n,).
        area, first, second, third, fourth: weights of the integrals of f(s) u^k over the area, [m^(2 + k)]
            for k from 0 to 4, shape (n,). Here u is the coordinate across the direction, 90 degrees clockwise
            from it.
    """

    s: Float[Array, "n"]
    area: Float[Array, "n"]
    first: Float[Array, "n"]
    second: Float[Array, "n"]
    third: Float[Array, "n"]
    fourth: Float[Array, "n"]

    @property
    def across(self) -> tuple[Array, ...]:
        """Weights of f(s) u^k by k."""
        return (self.area, self.first, self.second, self.third, self.fourth)


class Shape(eqx.Module):
    """A simple figure that can be integrated along any direction."""

    @abc.abstractmethod
    def rule(self, direction: Array, cuts: Array, nodes: int) -> Rule:
        """Quadrature along a unit vector, split at ascending coordinates `cuts` along it [m], shape (c,)."""

    @abc.abstractmethod
    def moments(self) -> tuple[Array, Array, Array]:
        """Exact area [m2], first moment vector [m3] and second moment matrix [m4] about the origin."""

    @abc.abstractmethod
    def reach(self, direction: Array) -> Array:
        """Largest coordinate along a unit vector [m]."""

    @abc.abstractmethod
    def exit(self, direction: Array) -> Array:
        """Distance from the origin along a unit vector to the farthest boundary [m]; -inf if none."""

    @abc.abstractmethod
    def polyline(self) -> Float[np.ndarray, "m 2"]:
        """The boundary as points, arcs divided; for concrete numbers only [m]."""

    def signed_distance(self, place: Float[np.ndarray, "2"]) -> float:
        """Distance of a place from the boundary, negative inside; for concrete numbers only [m]."""
        return signed_distance(self.polyline(), place)


def across(direction: Array) -> Array:
    """Unit vector 90 degrees clockwise from a direction."""
    return namespace_of(direction).stack([direction[1], -direction[0]])


def frozen(array: Array) -> Array:
    """The array without derivatives."""
    return array if isinstance(array, np.ndarray) else jax.lax.stop_gradient(array)


SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(11))
"""Coefficients of Taylor's polynomial of the sine; up to a quarter turn the rest is below 2e-18."""


def sine(angle: Array) -> Array:
    """Sine of angles of at most a quarter turn [rad] -> [1].

    A polynomial, which the compiler computes for several nodes at once. It calls a library for every single
    sine, and would do so again in each sum that the sine enters.
    """
    if isinstance(angle, np.ndarray):
        return np.sin(angle)
    square, found = angle * angle, SINE[-1]
    for coefficient in SINE[-2::-1]:
        found = found * square + coefficient
    return angle * found


def panels(edges: Array, nodes: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on consecutive panels between ascending edges along the last axis.

    Returns:
        Nodes and weights of shape (..., panels * nodes), panel after panel.
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * (edges[..., 1:] - edges[..., :-1])[..., None]
    middle = 0.5 * (edges[..., 1:] + edges[..., :-1])[..., None]
    flat = (*edges.shape[:-1], -1)
    return (middle + half * x).reshape(flat), (half * w).reshape(flat)


class Disc(Shape):
    """A full disc: radius [m], centre [m] of shape (2,)."""

    radius: Array = eqx.field(converter=as_array)
    centre: Array = eqx.field(converter=as_array, default=(0.0, 0.0))

    def rule(self, direction: Array, cuts: Array, nodes: int) -> Rule:
        """See `Shape.rule`; `s = s_c + R sin(phi)`, which removes the chord's square-root ends."""
        xp = namespace_of(direction, self.centre)
        ends = self.centre @ direction + self.radius * xp.asarray([-2.0, 2.0])
        return self.rule_between(direction, xp.concatenate([ends[:1], cuts, ends[1:]]), nodes)

    def rule_between(self, direction: Array, cuts: Array, nodes: int) -> Rule:
        """The part of `rule` between the first and the last cut."""
        xp = namespace_of(direction, self.centre)
        s_c, u_c = self.centre @ direction, self.centre @ across(direction)
        angles = xp.arcsin(xp.clip((cuts - s_c) / self.radius, -1.0, 1.0))
        phi, weight = panels(frozen(angles), nodes)
        height = sine(phi)
        half_chord_2 = self.radius**2 * (1.0 - height**2)
        area = 2.0 * half_chord_2 * weight
        return Rule(
            s=s_c + self.radius * height,
            area=area,
            first=area * u_c,
            second=area * (u_c**2 + half_chord_2 / 3.0),
            third=area * u_c * (u_c**2 + half_chord_2),
            fourth=area * (u_c**4 + 2.0 * u_c**2 * half_chord_2 + half_chord_2**2 / 5.0),
        )

    def moments(self) -> tuple[Array, Array, Array]:
        """See `Shape.moments`."""
        xp = namespace_of(self.centre)
        area = np.pi * self.radius**2
        own = xp.eye(2) * area * self.radius**2 / 4.0
        return area, area * self.centre, own + area * xp.outer(self.centre, self.centre)

    def reach(self, direction: Array) -> Array:
        """See `Shape.reach`."""
        return self.centre @ direction + self.radius

    def exit(self, direction: Array) -> Array:
        """See `Shape.exit`."""
        xp = namespace_of(direction, self.centre)
        s_c, u_c = self.centre @ direction, self.centre @ across(direction)
        inside = self.radius**2 - u_c**2
        hit = inside > 0.0
        return xp.where(hit, s_c + xp.sqrt(xp.where(hit, inside, 1.0)), -np.inf)

    def polyline(self) -> Float[np.ndarray, "m 2"]:
        """See `Shape.polyline`; 128 points."""
        angle = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return np.asarray(self.centre) + float(self.radius) * ring

    def signed_distance(self, place: Float[np.ndarray, "2"]) -> float:
        """See `Shape.signed_distance`."""
        return float(np.hypot(*(place - np.asarray(self.centre))) - float(self.radius))
