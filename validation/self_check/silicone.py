"""Claims about the silicone: laws that coincide, slopes, energy, the tube, the section's moments."""

import math
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.calibration import load_calibration
from pneusma_jax.numerics.safe import as_numpy
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.silicone import Gent, NeoHookean, Ogden, SiliconeLaw, Yeoh, tube_strain

from .claims import Claim

MU = 85e3  # Shear modulus [Pa]
OUTER, WALL, BORE = 10e-3, 1e-3, 8e-3  # Outer diameter, wall and bore of the tube [m]
AREA = math.pi / 4.0 * (OUTER**2 - BORE**2)
PUSHED = math.pi / 4.0 * BORE**2
INERTIA = math.pi / 64.0 * (OUTER**4 - BORE**4)


class Linear(SiliconeLaw):
    """Hooke's law, for which everything has a closed form; modulus [Pa]."""

    modulus: jax.Array

    def __call__(self, strain: jax.Array) -> jax.Array:
        """Stress [Pa]."""
        return self.modulus * strain


class Cubic(SiliconeLaw):
    """Stress that grows with the cube of strain, to need higher moments of the section."""

    def __call__(self, strain: jax.Array) -> jax.Array:
        """Stress [Pa]."""
        return strain**3


class Kinked(SiliconeLaw):
    """Absolute value of the strain, to need the split of the quadrature at zero strain."""

    def __call__(self, strain: jax.Array) -> jax.Array:
        """Stress [Pa]."""
        return jnp.abs(strain)

    @property
    def cuts(self) -> jax.Array:
        """The kink at zero strain."""
        return jnp.zeros(1)


def claims() -> Iterator[Claim]:
    """All claims about silicone, tube and section."""
    yield from _laws()
    yield from _regularised()
    yield from _tube()
    yield from _section()


def _laws() -> Iterator[Claim]:
    group, neo = "elastomer laws", as_numpy(NeoHookean(MU))
    yield Claim(
        group,
        "neo-Hookean stress at twice the length: 7/4 mu [Pa]",
        lambda: (neo(np.asarray(1.0)), 1.75 * MU),
    )
    yield Claim(
        group, "its stiffness at rest is 3 mu [Pa]", lambda: (jax.jit(jax.grad(neo))(0.0), 3.0 * MU)
    )

    def work() -> tuple:
        x, w = np.polynomial.legendre.leggauss(40)
        # to twice the length: mu/2 (I1 - 3) with I1 = 4 + 2/2
        return 0.5 * np.sum(w * np.asarray(neo(0.5 * (x + 1.0)))), MU / 2.0 * (5.0 - 3.0)

    yield Claim(group, "work of stretching to twice the length: mu/2 (I1 - 3) [J/m3]", work, 1e-10)
    alike = {
        "Yeoh's with one term": lambda: Yeoh(MU / 2.0, 0.0, 0.0),
        "Gent's with endless chains": lambda: Gent(MU, 1e15),
        "Ogden's with exponent 2": lambda: Ogden(np.asarray([MU]), np.asarray([2.0])),
    }
    for name, make in alike.items():
        yield Claim(
            group,
            f"{name} is the neo-Hookean law [Pa]",
            lambda m=make: (as_numpy(m())(np.asarray(0.7)), MU * (1.7 - 1.7**-2)),
        )


def _regularised() -> Iterator[Claim]:
    group = "law of the actuator"
    numbers = load_calibration("dragon_skin_10_fast").values()
    tension = [numbers[f"standard_tension.p_{k}"] for k in range(1, 5)]
    buckling = [numbers[f"needle_buckling.p_{k}"] for k in range(1, 5)]

    def quartic(p: list[float], x: float) -> float:
        return p[0] * x**4 + p[1] * x**3 + p[2] * x**2 + p[3] * x

    law = as_numpy(pj.load_silicone("dragon_skin_10_fast"))
    yield Claim(group, "no stress without strain [Pa]", lambda: (law(np.asarray(0.0)), 0.0))
    yield Claim(
        group,
        "tension fit of Table 3.1 at strain 0.5 [Pa]",
        lambda: (law(np.asarray(0.5)), quartic(tension, 0.5)),
    )
    yield Claim(
        group,
        "buckling fit of Table 3.1 at strain -0.3 [Pa]",
        lambda: (law(np.asarray(-0.3)), quartic(buckling, -0.3)),
    )

    def beyond() -> tuple:
        end = numbers["clip_max"]
        slope = 4.0 * tension[0] * end**3 + 3.0 * tension[1] * end**2 + 2.0 * tension[2] * end + tension[3]
        return law(np.asarray(end + 0.5)), quartic(tension, end) + 0.5 * max(
            slope, numbers["minimum_slope"]
        )

    yield Claim(group, "straight line beyond the tested strains [Pa]", beyond)


def _tube() -> Iterator[Claim]:
    group = "tube under pressure"
    yield Claim(
        group,
        "linear law: strain = P A_i / (E A)",
        lambda: (_strain_of_tube(20e3, Linear(np.asarray(2e5))), 20e3 * PUSHED / (2e5 * AREA)),
    )
    # the pressure that stretches a neo-Hookean wall to 1.5 follows from its law
    pressure = MU * (1.5 - 1.5**-2) * AREA / PUSHED
    yield Claim(
        group,
        "neo-Hookean law: length at the pressure of stretch 1.5 [m]",
        lambda: (_length_of_tube(pressure, NeoHookean(MU)), 84e-3),
    )


@eqx.filter_jit
def _strain_of_tube(pressure: Array, law: SiliconeLaw) -> Array:
    """Strain of a tube under pressure; NaN where there is none."""
    return tube_strain(pressure, OUTER, WALL, law, throw=False)


@eqx.filter_jit
def _length_of_tube(pressure: Array, law: SiliconeLaw) -> Array:
    """Length [m] of a tube of 56 mm under pressure; NaN where there is none."""
    return pj.tube_length(pressure, 56e-3, OUTER, WALL, law, throw=False)


@stored_jit()
def _quadrature(section: pj.Section, direction: Array, cuts: Array) -> tuple[Array, Array]:
    """Areas [m2] and places [m] of the nodes of a section."""
    rule = section.rule(direction, cuts)
    return rule.area, rule.s


@stored_jit()
def _integral(section: pj.Section, law: SiliconeLaw, strain: Array, curvature: Array) -> tuple[Array, Array]:
    """Force [N] and moment [N m] of a strained and bent wall."""
    return section.integrate(law, strain, curvature)


def _section() -> Iterator[Claim]:
    group, section = "section", pj.annulus(OUTER, WALL)
    straight = np.asarray([0.0, 1.0])
    cuts = np.asarray([-0.5, 0.2]) * np.asarray(section.radius)
    area, place = (np.asarray(x) for x in _quadrature(section, straight, cuts))
    yield Claim(group, "quadrature: area of the wall [m2]", lambda: (np.sum(area), AREA))
    yield Claim(
        group,
        "quadrature: first moment over area and diameter",
        lambda: (np.sum(area * place) / (AREA * OUTER), 0.0),
    )
    yield Claim(group, "quadrature: second moment [m4]", lambda: (np.sum(area * place**2), INERTIA))
    kappa = 40.0

    def integral(law: SiliconeLaw, strain: float = 0.0, angle: float = 90.0) -> tuple:
        direction = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
        found = _integral(section, law, np.asarray(strain), kappa * direction)
        force, moment = (np.asarray(x) for x in found)
        return force, moment @ direction

    linear = Linear(np.asarray(2e5))
    yield Claim(
        group,
        "force of a uniformly strained linear wall [N]",
        lambda: (integral(linear, 0.3)[0], 2e5 * AREA * 0.3),
        1e-10,
    )
    yield Claim(
        group,
        "couple of a bent linear wall: E I kappa [N m]",
        lambda: (integral(linear, 0.3)[1], 2e5 * INERTIA * kappa),
        1e-10,
    )
    yield Claim(
        group,
        "the same, bent about 37 degrees [N m]",
        lambda: (integral(linear, 0.3, 37.0)[1], 2e5 * INERTIA * kappa),
        1e-10,
    )
    sixth = math.pi / 8.0 * ((OUTER / 2.0) ** 6 - (BORE / 2.0) ** 6)
    yield Claim(
        group,
        "couple of a cubic wall: pi/8 (R^6 - r^6) kappa^3",
        lambda: (integral(Cubic())[1], sixth * kappa**3),
        1e-9,
    )
    third = 4.0 / 3.0 * ((OUTER / 2.0) ** 3 - (BORE / 2.0) ** 3)
    yield Claim(
        group,
        "force of a wall of stress |strain|: 4/3 (R^3 - r^3) kappa",
        lambda: (integral(Kinked())[0], third * kappa),
        1e-9,
    )
