"""Positions of springs and fibres on a section, as data, and the check that they are possible."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..nitinol import SpringGeometry
from ..numerics.lines import in_mm
from ..numerics.safe import as_array, as_numpy, is_concrete, numpy_if_known
from . import Section

FIBRE_REACH = 0.1  # Maximum distance of a fibre from the wall, as part of the section's radius


def _number(angle: float | None) -> float | None:
    """A plain number, because a static field must hash."""
    return None if angle is None else float(angle)


class Layout(eqx.Module):
    """Places on the section: by angle on its outer line, or as explicit coordinates.

    Angles are in degrees from the x axis (side 1 at 90, side 2 at 270); they and the plane are static.

    Attributes:
        spring_numbers: number by which recordings name each spring.
        spring_angles: angle of each spring on the outer line [deg], None where `spring_places` has its place.
        fibre_angle: angle of a strain-limiting fibre [deg], or None.
        bending_plane: direction of side 1 in the plane to which bending is held [deg], or None for none.
        spring_places: explicit place of each spring [m], shape (2,), or None where its angle counts; may be
            left empty.
        fibre_place: explicit place of the fibre [m], shape (2,), or None.

    Raises:
        ValueError: if the numbers, angles and places do not fit each other.
    """

    spring_numbers: tuple[int, ...] = eqx.field(static=True, default=())
    spring_angles: tuple[float | None, ...] = eqx.field(
        static=True, converter=lambda angles: tuple(_number(a) for a in angles), default=()
    )
    fibre_angle: float | None = eqx.field(static=True, converter=_number, default=None)
    bending_plane: float | None = eqx.field(static=True, converter=_number, default=90.0)
    spring_places: tuple[Array | None, ...] = ()
    fibre_place: Array | None = None

    def __check_init__(self) -> None:
        count = len(self.spring_numbers)
        if len(self.spring_angles) != count or len(self.spring_places) not in (0, count):
            raise ValueError(
                f"A layout must have one angle or place per spring, {count} here, "
                f"but it has {len(self.spring_angles)} angles and {len(self.spring_places)} places."
            )
        for number, angle, place in zip(
            self.spring_numbers, self.spring_angles, self.explicit_places, strict=True
        ):
            if (angle is None) == (place is None):
                raise ValueError(f"Spring {number} must have either an angle or a place, and not both.")
        if self.fibre_angle is not None and self.fibre_place is not None:
            raise ValueError("The fibre must have either an angle or a place, and not both.")

    @property
    def explicit_places(self) -> tuple[Array | None, ...]:
        """One entry per spring: its explicit place [m], or None where its angle counts."""
        return self.spring_places or (None,) * len(self.spring_numbers)

    def turned(self, angle: float) -> "Layout":
        """The same arrangement turned counter-clockwise about the centre [deg], bending plane included."""
        turn = lambda a: None if a is None else (a + angle) % 360.0  # noqa: E731
        (c, s), (d, e) = unit_vectors((angle, angle + 90.0))
        move = lambda p: None if p is None else jnp.stack([c * p[0] + d * p[1], s * p[0] + e * p[1]])  # noqa: E731
        return dataclasses.replace(
            self,
            spring_angles=tuple(turn(a) for a in self.spring_angles),
            fibre_angle=turn(self.fibre_angle),
            bending_plane=turn(self.bending_plane),
            spring_places=tuple(move(p) for p in self.spring_places),
            fibre_place=move(self.fibre_place),
        )


def unit_vectors(angles: tuple[float, ...]) -> Float[np.ndarray, "n 2"]:
    """Unit vectors at angles in degrees, exact at multiples of 90."""
    turns = np.asarray(angles, dtype=float) % 360.0
    vectors = np.stack([np.cos(np.radians(turns)), np.sin(np.radians(turns))], axis=-1)
    return np.where(turns[:, None] % 90.0 == 0.0, np.round(vectors) + 0.0, vectors)


def place_on(section: Section, arrangement: Layout) -> tuple[Float[Array, "springs 2"], Array | None]:
    """Places of the springs [m] and of the fibre [m], which is None if there is none.

    An angle means the point where the ray from the origin leaves the section.

    Raises:
        ValueError: if a ray of a concrete section meets no wall.
    """
    plain = as_numpy(section) if is_concrete(section) else section
    explicit = arrangement.explicit_places
    springs = [
        _place(plain, angle, place) for angle, place in zip(arrangement.spring_angles, explicit, strict=True)
    ]
    fibre = None
    if arrangement.fibre_angle is not None or arrangement.fibre_place is not None:
        fibre = as_array(_place(plain, arrangement.fibre_angle, arrangement.fibre_place))
    xp = numpy_if_known(springs)
    return as_array(xp.stack(springs) if springs else np.zeros((0, 2))), fibre


def _place(section: Section, angle: float | None, place: Array | None) -> Array:
    """One place [m], NumPy if concrete."""
    if place is not None:
        return np.asarray(place, dtype=float) if is_concrete(place) else place  # type: ignore[return-value]
    towards = unit_vectors((angle,))[0]
    away = section.boundary(towards)
    if is_concrete(away) and not np.isfinite(away):
        raise ValueError(f"A spring or fibre at {angle:g} degrees needs a wall there, but there is none.")
    return away * towards


def check_places(
    section: Section,
    arrangement: Layout,
    springs: Float[Array, "springs 2"],
    fibre: Array | None,
    dimensions: SpringGeometry,
) -> None:
    """Refuse springs that overlap or enclose the body, and positions off the wall. Traced numbers are not
    examined.

    Raises:
        ValueError: in one sentence that names the spring.
    """
    if not is_concrete(section, springs, fibre, dimensions):
        return
    coil = float(as_numpy(dimensions).coil_diameter) + float(dimensions.wire_diameter)
    places, numbers = np.asarray(springs), arrangement.spring_numbers
    width = 2.0 * float(section.radius)
    if numbers and coil > width:
        raise ValueError(
            f"A spring's coil must be narrower than the body, whose width is {width * 1e3:.3g} mm, but it is "
            f"{coil * 1e3:.3g} mm wide."
        )
    for i in range(len(numbers)):
        for j in range(i):
            gap = float(np.linalg.norm(places[i] - places[j]))
            if gap < coil * (1.0 - 1e-9):
                raise ValueError(
                    f"Springs {numbers[j]} and {numbers[i]} overlap: their centres are {gap * 1e3:.3g} mm "
                    f"apart, but their coils are {coil * 1e3:.3g} mm wide."
                )
    named = [(f"Spring {n}", place, coil) for n, place in zip(numbers, places, strict=True)]
    if fibre is not None:
        named.append(("The fibre", np.asarray(fibre), FIBRE_REACH * float(section.radius)))
    for what, place, allowed in named:
        away = section.distance_to_wall(place)
        if not away <= allowed * (1.0 + 1e-9):
            raise ValueError(
                f"{what} must lie at the wall, at most {allowed * 1e3:.3g} mm away, "
                f"but {in_mm(place)} is {away * 1e3:.3g} mm from it."
            )
