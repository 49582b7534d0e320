"""Claims about the equilibrium of actuators."""

import functools
import math
from collections.abc import Iterator

import numpy as np

import pneusma_jax as pj
from pneusma_jax.numerics.safe import as_numpy

from .claims import Claim
from .silicone import AREA, INERTIA, OUTER, PUSHED, Linear

MODULUS, PRESSURE, LENGTH, RADIUS = 2e5, 20e3, 56e-3, OUTER / 2.0
FIBRE = 300.0  # Stiffness of the fibre [N/m], low enough to matter


def claims() -> Iterator[Claim]:
    """All claims about actuators."""
    yield from _linear()
    yield from _springs()


def _solved(*given: object) -> pj.Equilibrium:
    """Equilibrium in NumPy's numbers; the claim fails where there is none."""
    return as_numpy(pj.solve(*given, throw=False))


def _linear_actuator(arrangement: pj.Layout, inextensible: bool = True) -> pj.Actuator:
    geometry = pj.Geometry(fibre_stiffness=FIBRE)
    return pj.round_actuator(arrangement, geometry, None, Linear(np.asarray(MODULUS)), inextensible)


def _linear() -> Iterator[Claim]:
    group = "linear wall"

    @functools.cache
    def bare(pressure: float) -> pj.Equilibrium:
        return _solved(_linear_actuator(pj.Layout()), pressure)

    yield Claim(group, "no pressure, no elongation [m]", lambda: (bare(0.0).delta_centre, 0.0))
    yield Claim(
        group,
        "elongation without springs: P A_i L / (E A) [m]",
        lambda: (bare(PRESSURE).delta_centre, PRESSURE * PUSHED * LENGTH / (MODULUS * AREA)),
        1e-10,
    )
    yield Claim(group, "and it stays straight [rad]", lambda: (bare(PRESSURE).bend_angle, 0.0))

    def fibre() -> tuple:
        found = _solved(_linear_actuator(pj.layout("pneuflex_s")), PRESSURE)
        # about the fibre: P A_i R = E (I + A R^2) theta / L
        return found.bend_angle, PRESSURE * PUSHED * RADIUS * LENGTH / (
            MODULUS * (INERTIA + AREA * RADIUS**2)
        )

    yield Claim(group, "bend about an inextensible fibre: P A_i R L / (E (I + A R^2)) [rad]", fibre, 1e-9)

    @functools.cache
    def soft_fibre() -> pj.Equilibrium:
        return _solved(_linear_actuator(pj.layout("pneuflex_s"), inextensible=False), PRESSURE)

    # compliances in series: fibre, wall in tension, wall in bending
    pull = (PRESSURE * PUSHED * LENGTH / (MODULUS * AREA)) / (
        1.0 / FIBRE + LENGTH / (MODULUS * AREA) + RADIUS**2 * LENGTH / (MODULUS * INERTIA)
    )
    yield Claim(
        group,
        "bend by an elastic fibre on one side: T R L / (E I) [rad]",
        lambda: (soft_fibre().bend_angle, pull * RADIUS * LENGTH / (MODULUS * INERTIA)),
        1e-9,
    )
    yield Claim(
        group, "stretch of that fibre: T / k [m]", lambda: (soft_fibre().delta_2, pull / FIBRE), 1e-9
    )


def _springs() -> Iterator[Claim]:
    group = "springs and silicone"
    body = pj.make_actuator("pneusma2")

    @functools.cache
    def state(pressure: float, first: float, second: float) -> pj.Equilibrium:
        given = (pj.MartensiteFraction(first), pj.MartensiteFraction(second))
        return _solved(body, pressure, given)

    yield Claim(
        group,
        "cold PneuSMA2 stays straight at 30 kPa [1/m]",
        lambda: (state(30e3, 1.0, 1.0).curvature, 0.0),
        1e-9,
    )

    def straight_balance() -> tuple:
        found = state(30e3, 1.0, 1.0)
        pulls = sum(float(spring.force) for spring in found.springs)
        wall = float(as_numpy(body.silicone)(found.delta_centre / LENGTH)) * AREA
        return wall + pulls, 30e3 * PUSHED

    yield Claim(group, "and wall and springs carry P A_i [N]", straight_balance, 1e-8)
    yield Claim(
        group,
        "bent: sides pull back, pressure pushes (Eq. 3.35) [N]",
        lambda: _summed(body, state(30e3, 1.0, 0.3))[0],
        1e-6,
    )
    yield Claim(
        group,
        "bent: moment about side 2 (Eq. 3.36) [N m]",
        lambda: _summed(body, state(30e3, 1.0, 0.3))[1],
        1e-6,
    )
    yield Claim(
        group,
        "heating spring 1 mirrors heating spring 2 [1/m]",
        lambda: (-state(30e3, 0.3, 1.0).curvature, state(30e3, 1.0, 0.3).curvature),
        1e-8,
    )

    def resistance() -> tuple:
        found = state(30e3, 1.0, 0.3)
        given = (pj.MartensiteFraction(1.0), pj.Resistance(found.springs[1].resistance))
        return _solved(body, 30e3, given).curvature, found.curvature

    yield Claim(group, "the same state from its own resistance [1/m]", resistance, 1e-6)

    def triad() -> tuple:
        given = tuple(pj.MartensiteFraction(x) for x in (0.3, 1.0, 1.0))
        found = _solved(pj.make_actuator("triad"), 30e3, given)
        return math.degrees(float(found.bend_direction)), -90.0

    yield Claim(group, "triad with spring 1 hot bends straight towards it [deg]", triad, 1e-8)


def _summed(body: pj.Actuator, found: pj.Equilibrium) -> tuple[tuple, tuple]:
    """Both sides of Eqs. 3.35 and 3.36, the wall summed over a fine polar grid."""
    angles = 2.0 * math.pi * (np.arange(720) + 0.5) / 720
    nodes, weights = np.polynomial.legendre.leggauss(12)
    inner, outer = RADIUS - 1e-3, RADIUS
    r = 0.5 * (outer + inner) + 0.5 * (outer - inner) * nodes
    beta = RADIUS + r[:, None] * np.sin(angles)
    area = (0.5 * (outer - inner) * weights * r)[:, None] * np.full(720, 2.0 * math.pi / 720)
    strain = (float(found.delta_2) + float(found.bend_angle) * beta) / LENGTH
    pull = np.asarray(as_numpy(body.silicone)(strain)) * area
    first, second = (float(spring.force) for spring in found.springs)
    force = (pull.sum() + first + second, 30e3 * PUSHED)
    moment = ((pull * beta).sum() + first * OUTER, 30e3 * PUSHED * RADIUS)
    return force, moment
