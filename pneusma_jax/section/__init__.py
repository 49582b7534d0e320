"""Cross-sections of the tube, integrated along the bending direction.

Axial strain varies only along the direction in which the tube bends (Eq. 3.26). So the area integrals of Eqs.
3.29 and 3.33 are one-dimensional: stress times chord. A section is a signed sum of simple shapes: an annulus
is a disc minus a disc, a rectangular tube a rectangle minus a rectangle. Each shape maps Gauss nodes to
places and chord weights such that the integrand is smooth. The rule is split where the strain crosses a cut
of the material law. The cuts carry no gradient, because the integrand is continuous there.

Coordinates are in metres: x, y across the tube, with the origin on the centre line, whose length and
curvature are reported. Side 1 is the section's extreme point in the direction of the bending plane (+y unless
the actuator is turned), side 2 the opposite one. The origin need not be the centroid.
"""

import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..numerics.alike import map_alike
from ..numerics.safe import as_array, as_numpy, is_concrete, namespace_of, safe_norm
from .shapes import Disc, Rule, Shape, across

__all__ = ["NODES", "Disc", "Rule", "Section", "Shape", "annulus"]

NODES = 14
"""Number of Gauss nodes a panel; relative error of force and moment about 1e-10 (12: 1e-8, 8: 2e-4)."""


class Section(eqx.Module):
    """Wall of the tube as a signed sum of shapes, and the area under pressure.

    Attributes:
        shapes: plane figures.
        signs: static; +1 for material, -1 for a hole.
        enclosed_area: area under pressure [m2].
        enclosed_centroid: point of action of the pressure's resultant [m], shape (2,).
        radius: half the distance between side 1 and side 2 [m], the lever of Eq. 3.19.
        nodes: static; number of Gauss nodes per panel.

    Raises:
        ValueError: when built from concrete numbers, if there is no wall or nothing enclosed. Also if the
            rule does not reproduce the section's own area, first and second moments.
    """

    shapes: tuple[Shape, ...]
    signs: tuple[int, ...] = eqx.field(static=True)
    enclosed_area: Array
    enclosed_centroid: Array
    radius: Array
    nodes: int = eqx.field(static=True, default=NODES)

    def __check_init__(self) -> None:
        if not is_concrete(self):
            return
        single = any(np.asarray(leaf).dtype == np.float32 for leaf in jax.tree.leaves(self))
        area, own, exact = _own_and_exact_moments(as_numpy(self))
        if not float(area) > 0.0:
            raise ValueError("A section must have wall material, but its wall area is not positive.")
        if not float(self.enclosed_area) > 0.0:
            raise ValueError("A section must enclose an area for the pressure, but it encloses nothing.")
        limit = 1e-4 if single else 1e-9
        if not np.allclose(own, exact, rtol=limit, atol=limit * float(area)):
            raise ValueError("The quadrature of a section must reproduce its own moments, but it does not.")

    def moments(self) -> tuple[Array, Array, Array]:
        """Exact area [m2], first moments [m3] and second moments [m4] of the wall about the centre."""
        parts = [shape.moments() for shape in self.shapes]
        return tuple(sum(s * p[i] for s, p in zip(self.signs, parts, strict=True)) for i in range(3))

    def rule(self, direction: Array, cuts: Array, between: bool = False) -> Rule:
        """Joint rule of all shapes along a unit vector, holes with negative weights.

        Args:
            direction: unit vector.
            cuts: coordinates at which the rule is split, ascending [m].
            between: static; true for the part of the section between two cuts. Discs only.
        """
        xp = namespace_of(direction, *jax.tree.leaves(self.shapes))
        of = lambda shape: (shape.rule_between if between else shape.rule)(direction, cuts, self.nodes)  # noqa: E731
        if xp is np:
            rules = [of(shape) for shape in self.shapes]
        else:
            rules = map_alike(of, [(shape,) for shape in self.shapes])
        signed = [
            Rule(r.s, *(sign * weights for weights in r.across))
            for r, sign in zip(rules, self.signs, strict=True)
        ]
        return jax.tree.map(lambda *parts: xp.concatenate(parts), *signed)

    def sides(self, direction: Array) -> tuple[Array, Array]:
        """Coordinates of side 1 and side 2, the extreme points along a unit vector and against it [m]."""
        solid = [shape for shape, sign in zip(self.shapes, self.signs, strict=True) if sign > 0]
        xp = namespace_of(direction, *jax.tree.leaves(solid))
        farthest = lambda n: xp.max(xp.stack([shape.reach(n) for shape in solid]))  # noqa: E731
        return farthest(direction), -farthest(-direction)

    def boundary(self, direction: Array) -> Array:
        """Distance from the origin to the point where a ray along a unit vector leaves the section [m].

        Returns:
            The distance to the outermost crossing; -inf where the ray meets no wall.
        """
        solid = [shape for shape, sign in zip(self.shapes, self.signs, strict=True) if sign > 0]
        xp = namespace_of(direction, *jax.tree.leaves(solid))
        return xp.max(xp.stack([shape.exit(direction) for shape in solid]))

    def distance_to_wall(self, place: Float[np.ndarray, "2"]) -> float:
        """Distance of a place from the wall's material, negative inside it; for concrete numbers only [m]."""
        signed = [
            sign * shape.signed_distance(place) for shape, sign in zip(self.shapes, self.signs, strict=True)
        ]
        solid = min(d for d, sign in zip(signed, self.signs, strict=True) if sign > 0)
        return max([solid, *(d for d, sign in zip(signed, self.signs, strict=True) if sign < 0)])

    def fibres(self, direction: Array | None = None) -> tuple[Array, Array]:
        """Fixed places in the wall, for memories of single fibres.

        There are two per chord across the direction of sides 1 and 2, which keep the chord's area, first and
        second moment. For bending that is held along a direction there is one per chord, at its middle.
        Unlike `rule` they do not follow the strain. They serve for the contribution of an effect, not for the
        wall's stress itself.

        Args:
            direction: unit vector in the bending plane, if bending is held there.

        Returns:
            Places [m], shape (fibres, 2), and their areas [m2], negative in holes, shape (fibres,).
        """
        in_plane = direction is not None
        direction = jnp.asarray(direction if in_plane else [0.0, 1.0])
        rule = self.rule(direction, jnp.zeros(0))
        middle, aside = rule.first / rule.area, across(direction)
        if in_plane:
            return rule.s[:, None] * direction + middle[:, None] * aside, rule.area
        half = jnp.sqrt(jnp.maximum(rule.second / rule.area - middle**2, 1e-30))
        u = jnp.concatenate([middle - half, middle + half])
        return jnp.tile(rule.s, 2)[:, None] * direction + u[:, None] * aside, 0.5 * jnp.tile(rule.area, 2)

    def integrate(
        self, law: Callable[[Array], Array], strain: Array, gradient: Array, orders: int = 3
    ) -> tuple[Array, Array]:
        """Force and moment of the wall's axial stress, Eqs. 3.29 and 3.33.

        Args:
            law: engineering stress [Pa] over engineering strain, with ascending `cuts`.
            strain: axial strain at the centre [1].
            gradient: gradient of the strain over the section [1/m], shape (2,).
            orders: static; highest order of exact derivatives by the gradient, 1 to 3. An iteration needs 1.

        Returns:
            Force [N] and the stress's first moments about the centre `integral sigma (x, y) dA` [N m], shape
            (2,).

        The direction of bending is frozen, and the strain across it enters as a Taylor series about zero, its
        value. So derivatives are exact everywhere, the straight tube included, where the direction is
        undefined. They are one-sided where a derivative of the law jumps at one of its cuts.
        """
        frozen = jax.lax.stop_gradient(gradient)
        slope = safe_norm(frozen)
        bent = slope > 0.0
        n = jnp.where(bent, frozen / jnp.where(bent, slope, 1.0), jnp.asarray([0.0, 1.0]))
        along, aside = gradient @ n, gradient @ across(n)  # `aside` is zero; only its derivatives are not
        rule = self.rule(n, places_of(law.cuts, strain, along, self.radius))
        sums = jnp.zeros(3)
        for k, sigma in enumerate(_derivatives(law, strain + along * rule.s, orders)):
            factor = aside**k / math.factorial(k)
            weights = jnp.stack([rule.across[k], rule.across[k] * rule.s, rule.across[k + 1]])
            sums = sums + factor * (weights @ sigma)
        force, moment_n, moment_t = sums
        return force, moment_n * n + moment_t * across(n)

    def integrate_in_plane(
        self, law: Callable[[Array], Array], strain: Array, gradient: Array, direction: Array = (0.0, 1.0)
    ) -> tuple[Array, Array]:
        """`integrate` for bending that is held in a plane: cheaper.

        Args:
            law, strain: law and strain as for `integrate`.
            gradient: gradient of the strain along the direction [1/m], scalar.
            direction: unit vector in the bending plane, y by default; carries no gradient.

        Returns:
            Force [N] and both first moments of the stress `integral sigma (x, y) dA` [N m], shape (2,).
        """
        direction = jnp.asarray(direction)
        force, moment_n, moment_t = _in_plane(self, law, strain, gradient, direction)
        return force, moment_n * direction + moment_t * across(direction)


def _sums(
    section: Section, law: Callable[[Array], Array], strain: Array, gradient: Array, direction: Array
) -> tuple[Array, Array, Array]:
    """Force [N] of the wall, and its moments along a direction and across it [N m].

    One matrix of weights times the stress: XLA turns single scalar products into windowed sums, which made a
    row of a history take 2.1 times as long (six recordings side by side, jaxlib 0.10.2).
    """
    rule = section.rule(direction, places_of(law.cuts, strain, gradient, section.radius))
    sigma = _stress(law, strain + gradient * rule.s)
    return tuple(_weights(rule) @ sigma)


def _weights(rule: Rule) -> Array:
    """Weights of force and of both moments at the nodes of a rule, shape (3, nodes)."""
    return jnp.stack([rule.area, rule.area * rule.s, rule.first])


@eqx.filter_custom_jvp
def _in_plane(
    section: Section, law: Callable[[Array], Array], strain: Array, gradient: Array, direction: Array
) -> tuple[Array, Array, Array]:
    """`_sums`, whose stiffness is integrated once for all directions of a derivative."""
    return _sums(section, law, strain, gradient, direction)


@_in_plane.def_jvp
def _in_plane_jvp(primals: tuple, tangents: tuple) -> tuple[tuple, tuple]:
    """Tangent by the stiffness of the wall; of the sums themselves where numbers of section or law vary."""
    section, law, strain, gradient, direction = primals
    by_section, by_law, by_strain, by_gradient, _ = tangents
    if jax.tree.leaves((by_section, by_law)):  # None is no leaf
        return eqx.filter_jvp(lambda *given: _sums(*given, direction), primals[:4], tangents[:4])
    rule = section.rule(direction, places_of(law.cuts, strain, gradient, section.radius))
    sigma, slope = _slope(law, strain + gradient * rule.s)
    weights, tangent = _weights(rule), jnp.zeros(3)
    for lever, by in ((weights, by_strain), (weights * rule.s, by_gradient)):
        if by is not None:
            tangent = tangent + (lever @ slope) * by
    return tuple(weights @ sigma), tuple(tangent)


@eqx.filter_custom_jvp
def _stress(law: Callable[[Array], Array], strain: Array) -> Array:
    """Stress of an elementwise law [Pa]; its slope is computed once for all directions of a derivative."""
    return law(strain)


@_stress.def_jvp
def _stress_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """Tangent of `_stress` by its slope, and by the law's own numbers where these vary."""
    law, strain = primals
    by_law, by_strain = tangents
    stress, slope = _slope(law, strain)
    tangent = jnp.zeros_like(stress) if by_strain is None else slope * by_strain
    if any(leaf is not None for leaf in jax.tree.leaves(by_law, is_leaf=lambda leaf: leaf is None)):
        tangent = tangent + eqx.filter_jvp(lambda law: law(strain), (law,), (by_law,))[1]
    return stress, tangent


def _slope(law: Callable[[Array], Array], strain: Array) -> tuple[Array, Array]:
    """Stress and its slope over strain [Pa]."""
    return jax.jvp(law, (strain,), (jnp.ones_like(strain),))


def _derivatives(law: Callable[[Array], Array], strain: Array, orders: int) -> list[Array]:
    """Stress and its first derivatives over strain [Pa], `orders` of them."""
    laws = [law]
    for _ in range(orders):
        laws.append(lambda x, f=laws[-1]: _slope(f, x)[1])
    return [f(strain) for f in laws]


def _own_and_exact_moments(section: Section) -> tuple[float, np.ndarray, np.ndarray]:
    """Wall area, and its moments by the rule and exactly, as areas [m2], along two directions; shape (2, 6).

    Takes a section of NumPy arrays. The moments are those of 1, s, s^2, u, s u and u^2 (s along, u across).
    """
    area, first, second = section.moments()
    size = np.sqrt(np.abs(area))
    own, exact = [], []
    for angle in (0.3, 1.2):
        n = np.array([np.cos(angle), np.sin(angle)])
        t = across(n)
        rule = section.rule(n, np.array([0.0, 0.3]) * section.radius)
        s = rule.s / size
        along = [rule.area.sum(), rule.area @ s, rule.area @ s**2]
        own.append([*along, rule.first.sum() / size, rule.first @ s / size, rule.second.sum() / size**2])
        turned = [n @ second @ n, n @ second @ t, t @ second @ t] / size**2
        exact.append([area, n @ first / size, turned[0], t @ first / size, turned[1], turned[2]])
    return float(area), np.array(own), np.array(exact)


def places_of(cuts: Array, strain: Array, along: Array, radius: Array) -> Array:
    """Ascending coordinates at which the strain equals each cut, far outside where it never does [m]."""
    strain, along = jax.lax.stop_gradient(strain), jax.lax.stop_gradient(along)
    flat = jnp.abs(along) * radius < 1e-14
    place = (jax.lax.stop_gradient(cuts) - strain) / jnp.where(flat, 1.0, along)
    place = jnp.where(along < 0.0, place[::-1], place)
    return jnp.where(flat, 1e3 * radius, place)


def _bore(inner: Array, outer: Array) -> Array:
    """Area of the bore [m2]; NaN, which becomes a status, where a wall is not positive or leaves none."""
    xp = namespace_of(inner, outer)
    return xp.where((inner > 0.0) & (inner < outer), np.pi * inner**2, np.nan)


def annulus(outer_diameter: Array, wall_thickness: Array, nodes: int = NODES) -> Section:
    """Round tube; lengths in metres.

    Raises:
        ValueError: if the wall is not positive or leaves no bore.
    """
    if is_concrete(outer_diameter, wall_thickness):  # NumPy compiles nothing
        outer_diameter, wall_thickness = np.asarray(outer_diameter), np.asarray(wall_thickness)
    outer = 0.5 * outer_diameter
    if is_concrete(outer, wall_thickness) and not 0.0 < float(wall_thickness) < float(outer):
        raise ValueError(
            "Argument `wall_thickness` must be positive and leave a bore, "
            f"but it is {float(wall_thickness) * 1e3:g} mm in a tube of {float(outer) * 2e3:g} mm."
        )
    inner = outer - wall_thickness
    return Section(
        shapes=(Disc(outer), Disc(inner)),
        signs=(1, -1),
        enclosed_area=as_array(_bore(inner, outer)),
        enclosed_centroid=as_array(np.zeros(2)),
        radius=as_array(outer),
        nodes=nodes,
    )
