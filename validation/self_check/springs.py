"""Claims about the nitinol spring: geometry, phases, resistivity, stress, memory.

Laws are evaluated in NumPy, which compiles nothing. One claim compares them with the compiled ones.
"""

import math
from collections.abc import Iterator

import jax
import numpy as np

import pneusma_jax as pj
from pneusma_jax.nitinol import detwinning, geometry
from pneusma_jax.numerics.safe import as_numpy

from .claims import Claim

D, WIRE, PITCH, NU = 1.15e-3, 0.25e-3, 0.269e-3, 0.33
"""Dimensions of the source's spring [m] and Poisson's ratio [1]."""


def claims() -> Iterator[Claim]:
    """All claims about springs."""
    yield from _geometry()
    for name in ("krl35", "krl45"):
        yield from _phases(name)
        yield from _stress(name)


def _geometry() -> Iterator[Claim]:
    group = "spring geometry"
    yield Claim(
        group,
        "wire of 2 coils whose turn unrolls to the triangle 3, 4, 5 mm [m]",
        lambda: (geometry.wire_length(np.asarray(2.0), 3e-3 / math.pi, 4e-3), 2 * 5e-3),
    )
    yield Claim(
        group,
        "Wahl's factor at a spring index of 4: 15/12 + 0.615/4",
        lambda: (geometry.wahl_factor(4.0), 1.25 + 0.15375),
    )
    yield Claim(
        group,
        "stress of the force of a stress of 100 MPa [Pa]",
        lambda: (geometry.shear_stress_of_force(geometry.spring_force(1e8, D, WIRE), D, WIRE), 1e8),
    )
    yield Claim(group, "shear strain at rest", lambda: (_shear(np.asarray(0.0)), 0.0))
    yield Claim(group, "slope of shear strain over spring strain at rest, by the chain rule", _slope_at_rest)
    yield Claim(group, "shear strain of coils opened from 30 to 45 degrees", _opened_to_45)


def _shear(strain: np.ndarray, pitch: float = PITCH) -> np.ndarray:
    return geometry.shear_strain(strain, pitch, D, WIRE, NU)


def _slope_at_rest() -> tuple:
    # d sin(phi) / d eps = cos(phi) dphi/deps, and tan(phi) grows in proportion to 1 + eps
    phi = math.atan(PITCH / (2.0 * D))
    opening = math.cos(phi) * math.sin(phi) * math.cos(phi)
    expected = opening / (D / WIRE * (math.cos(phi) ** 2 + math.sin(phi) ** 2 / (1.0 + NU)))
    return jax.jit(jax.grad(_shear))(0.0), expected


def _opened_to_45() -> tuple:
    half, pitch = 0.5, 2.0 * D / math.sqrt(3.0)  # the printed helix: tan(phi) = p / (2 D)
    opening = 0.75 * (math.sqrt(half) - half)
    expected = opening / (D / WIRE * half * (half + half / (1.0 + NU)))
    return _shear(np.asarray(math.sqrt(3.0) - 1.0), pitch), expected


def _phases(name: str) -> Iterator[Claim]:
    group, alloy = f"phases of {name}", as_numpy(pj.load_alloy(name))
    a = jax.tree.map(float, alloy)
    middle = -a.beta_2 / a.beta_1
    yield Claim(
        group,
        "detwinned fraction where its exponent is 0: 2^-b3",
        lambda: (alloy.xi_sm(middle), 2.0**-a.beta_3),
    )
    yield Claim(group, "detwinned fraction at endless strain", lambda: (alloy.xi_sm(1e3), 1.0))
    yield Claim(
        group,
        "stress-induced fraction where its argument is 0",
        lambda: (alloy.xi_sa(-a.ka_2 / a.ka_1), 0.5),
    )
    yield Claim(
        group,
        "algebraic sigmoid of sharpness 2 at 1: (1 + 1/sqrt 2) / 2",
        lambda: (detwinning.algebraic_sigmoid(np.asarray(1.0), 1.0, 0.0, 2.0), 0.5 + math.sqrt(0.125)),
    )
    yield Claim(
        group,
        "resistivity of cold wire is the martensite's",
        lambda: (alloy.resistivity(1.0, 0.05), alloy.rho_m(0.05)),
    )
    yield Claim(
        group,
        "resistivity of hot wire is the austenite's",
        lambda: (alloy.resistivity(0.0, 0.05), alloy.rho_a(0.05)),
    )
    at = a.gamma_max
    yield Claim(
        group,
        "rule of mixtures at gamma_max, where the exponent is 1 [ohm/m]",
        lambda: (alloy.resistivity(0.3, at), 0.3 * float(alloy.rho_m(at)) + 0.7 * float(alloy.rho_a(at))),
    )
    for xi0, gamma in ((0.6, 0.05), (0.95, 0.12), (0.3, 0.0)):
        yield Claim(
            group,
            f"martensite fraction read back from its own resistivity, xi0 = {xi0}, gamma = {gamma}",
            lambda x=xi0, g=gamma: (alloy.martensite_fraction(alloy.resistivity(x, g), g).xi0, x),
            1e-9,
        )


def _stress(name: str) -> Iterator[Claim]:
    group, alloy = f"stress of {name}", as_numpy(pj.load_alloy(name))
    a = jax.tree.map(float, alloy)
    gp = 0.1924
    fresh = as_numpy(pj.SpringState.fresh(gp))

    def logistic(g: float) -> float:
        return (1.0 + math.exp(-a.beta_1 * g - a.beta_2)) ** -a.beta_3

    def stress(gamma: float, xi0: float, gamma_R: float) -> np.ndarray:
        return alloy.shear_stress(*np.asarray([gamma, xi0, gamma_R]))

    yield Claim(
        group,
        "cold wire on loading: G_m (gamma - gamma_L xi_sm) [Pa]",
        lambda: (stress(0.12, 1.0, 0.0), a.G_m * (0.12 - a.gamma_L * logistic(0.12))),
    )
    yield Claim(
        group,
        "hot wire on loading: G_a (gamma - gamma_L xi_sa) [Pa]",
        lambda: (stress(0.05, 0.0, 0.0), a.G_a * (0.05 - a.gamma_L * float(alloy.xi_sa(0.05)))),
    )
    yield Claim(
        group,
        "stress of cold wire unloaded to its residual strain [Pa]",
        lambda: (stress(0.0938, 1.0, 0.0938), 0.0),
        1e-6,
    )
    printed = a.gR_amplitude * (1.0 + math.erf(a.gR_slope * gp - a.gR_shift))
    bound = min(printed, a.gamma_L * logistic(gp))
    yield Claim(
        group,
        "residual strain after the pre-strain 0.1924, Eq. 3.1",
        lambda: (alloy.residual_strain_limit(gp), bound),
        1e-10,
    )
    yield Claim(
        group,
        "residual strain after heating to xi0 = 0.4, Eq. 3.2",
        lambda: (alloy.residual_strain(fresh, 0.4), bound * math.exp(-0.6 * a.gR_decay)),
        1e-10,
    )

    def remembered(state: pj.SpringState, gamma: float, xi0: float) -> pj.SpringState:
        return as_numpy(alloy.remember(as_numpy(state), *np.asarray([gamma, xi0])))

    def heated_and_cooled() -> tuple:
        state = fresh
        for xi0 in (0.4, 1.0, 0.9):
            state = remembered(state, 0.0, xi0)
        return alloy.residual_strain(state, 1.0), bound * math.exp(-0.6 * a.gR_decay)

    def stretched_again() -> tuple:
        state = remembered(pj.SpringState(gp, 0.4), 0.08, 1.0)
        detwinned = a.gamma_L * logistic(0.08)
        limit = a.gR_amplitude * (1.0 + math.erf(a.gR_slope * 0.08 - a.gR_shift))
        return alloy.residual_strain(state, 1.0), min(limit, detwinned)

    yield Claim(group, "cooling alone does not bring residual strain back", heated_and_cooled, 1e-10)
    yield Claim(group, "stretching the cooled wire to 0.08 does, to Eq. 3.1 at 0.08", stretched_again, 1e-10)
    yield Claim(
        group,
        "compiled laws against these, largest relative difference",
        lambda: (max(map(_apart, _compiled(alloy, 0.08, 0.4), _laws(alloy, *np.asarray([0.08, 0.4])))), 0.0),
    )


def _laws(alloy: pj.Alloy, gamma: np.ndarray, xi0: np.ndarray) -> tuple[np.ndarray, ...]:
    """Every law of an alloy at a shear strain and a fraction."""
    rho, limit = alloy.resistivity(xi0, gamma), alloy.residual_strain_limit(gamma)
    return rho, limit, alloy.martensite_fraction(rho, gamma).xi0, alloy.shear_stress(gamma, xi0, 0.1 * limit)


_compiled = jax.jit(_laws)


def _apart(value: jax.Array, expected: np.ndarray) -> float:
    return abs(float(value) / float(expected) - 1.0)
