"""The same physics in NumPy and SciPy, written on its own, as a laboratory without JAX would: the other side
of the race.

Only the published constants are read from the package's tables. Everything is vectorised over quadrature
nodes or rows where NumPy allows it; equilibria are solved by MINPACK's hybrid Powell method, row by row, each
from its neighbour.
"""

import numpy as np
from scipy.optimize import root
from scipy.special import erf

from pneusma_jax.calibration import load_calibration

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
HALF_WIDTH, LOWER, UPPER, LEAST = 0.02, -0.54, 1.5, 50e3
CUTS = np.array([LOWER, -HALF_WIDTH, HALF_WIDTH, UPPER])
OUTER, LENGTH, ATTACHED, FREE = 5e-3, 56e-3, 56e-3, 14e-3
FIRST_BEND = 10.0 / 56.0  # sides at +5 and -5 mm of 56 mm: the source's first trial
WIRE, MANDREL, PITCH, POISSON, PRESTRAIN = 0.25e-3, 0.9e-3, 0.269e-3, 0.33, 0.1924


def _coefficients(test: str) -> np.ndarray:
    table = load_calibration("dragon_skin_10_fast").table(test)
    p = [table[f"p_{k}"] for k in range(1, 9) if f"p_{k}" in table]
    return np.array([*p[:-1], 0.0])


TENSION, COMPRESSION = _coefficients("standard_tension"), _coefficients("needle_buckling")
ALLOY = load_calibration("krl35").values()


def _continued(strain, p):
    inside = np.clip(strain, LOWER, UPPER)
    slopes = np.maximum(np.polyval(np.polyder(p), [LOWER, UPPER]), LEAST)
    return np.polyval(p, inside) + np.where(strain > UPPER, slopes[1], slopes[0]) * (strain - inside)


def silicone(strain):
    """Engineering stress of the tube's wall [Pa]."""
    u = np.clip((strain + HALF_WIDTH) / (2.0 * HALF_WIDTH), 0.0, 1.0)
    w = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return w * _continued(strain, TENSION) + (1.0 - w) * _continued(strain, COMPRESSION)


def _disc(radius, strain, gradient):
    """Force and moment of a full disc's axial stress about its centre."""
    places = (CUTS - strain) / gradient if abs(gradient) * radius > 1e-14 else np.full(4, 1e3)
    inner = np.arcsin(np.clip(np.sort(places) / radius, -1.0, 1.0))
    edges = np.concatenate([[-np.pi / 2], inner, [np.pi / 2]])
    half = 0.5 * np.diff(edges)[:, None]
    phi = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * NODES
    s = radius * np.sin(phi)
    pull = silicone(strain + gradient * s) * 2.0 * (radius * np.cos(phi)) ** 2 * half * WEIGHTS
    return pull.sum(), (pull * s).sum()


def _coil(pitch):
    return np.arctan(pitch / (2.0 * (MANDREL + WIRE)))


def shear_strain(eps):
    """Shear strain of the wire over the spring's strain, Eq. 2.17."""
    first, angle = _coil(PITCH), _coil(PITCH * (1.0 + eps))
    opening = np.cos(first) ** 2 * (np.sin(angle) - np.sin(first))
    cos2, sin2 = np.cos(angle) ** 2, np.sin(angle) ** 2
    return opening / ((MANDREL + WIRE) / WIRE * cos2 * (cos2 + sin2 / (1.0 + POISSON)))


def spring_force(gamma, xi0, prestrain, constants):
    """Pull of a spring that was stretched cold to `prestrain`, heated no further than `xi0` since."""
    c = {**ALLOY, **constants}
    xi_sm = np.exp(-c["beta_3"] * np.logaddexp(0.0, -c["beta_1"] * gamma - c["beta_2"]))
    x = c["ka_1"] * gamma + c["ka_2"]
    xi_sa = 0.5 * (1.0 + x * np.exp(-np.logaddexp(0.0, c["ka_3"] * np.log(np.abs(x))) / c["ka_3"]))
    limit = np.exp(-c["beta_3"] * np.logaddexp(0.0, -c["beta_1"] * prestrain - c["beta_2"]))
    limit = min(
        c["gR_amplitude"] * (1.0 + erf(c["gR_slope"] * prestrain - c["gR_shift"])), c["gamma_L"] * limit
    )
    residual = limit * np.exp(c["gR_decay"] * (xi0 - 1.0))
    modulus = xi0 * c["G_m"] + (1.0 - xi0) * c["G_a"]
    detwinning = c["gamma_L"] * (xi0 * c["G_m"] * xi_sm + (1.0 - xi0) * c["G_a"] * xi_sa)
    stress = modulus * gamma - np.maximum(detwinning, modulus * residual)
    index = (MANDREL + WIRE) / WIRE
    wahl = (4.0 * index - 1.0) / (4.0 * index - 4.0) + 0.615 / index
    return np.pi * WIRE**2 * stress / (8.0 * index * wahl)


def balance(z, stiffness, wall, constants, pressure, xi0_1, xi0_2):
    """Scaled force and moment on the end cap of PneuSMA2; z is elongation over length and bend times radius
    over it."""
    strain, gradient = z[0], z[1] / OUTER
    bore = OUTER - wall
    outer, inner = _disc(OUTER, strain, gradient), _disc(bore, strain, gradient)
    force, moment = (stiffness * (a - b) for a, b in zip(outer, inner, strict=True))
    elongation = LENGTH * np.array([z[0] + z[1], z[0] - z[1]])
    gamma = shear_strain((ATTACHED + elongation - FREE) / FREE)
    pulls = [spring_force(g, x, PRESTRAIN, constants) for g, x in zip(gamma, (xi0_1, xi0_2), strict=True)]
    force = force + pulls[0] + pulls[1] - pressure * np.pi * bore**2
    moment = moment + OUTER * (pulls[0] - pulls[1])
    area = np.pi * (OUTER**2 - bore**2)
    return np.array([force, moment / OUTER]) / (1e5 * area)


def curvatures(values, rows):
    """Curvature of the centre line [1/m] of every row, solved one after the other."""
    stiffness, wall, constants = values[0], values[1], {"G_m": values[2], "G_a": values[3]}
    found, guess = np.empty(len(rows["pressure"])), np.array([0.0, 0.5 * FIRST_BEND])
    for k, row in enumerate(zip(rows["pressure"], rows["xi0_1"], rows["xi0_2"], strict=True)):
        solution = root(balance, guess, (stiffness, wall, constants, *row), method="hybr", tol=1e-10)
        if not solution.success:
            return np.full(len(found), np.nan)
        guess = solution.x
        found[k] = guess[1] / OUTER / (1.0 + guess[0])
    return found


def spring_forces(values, rows):
    """Pull of a fresh spring on a test stand [N], all rows at once."""
    constants = dict(zip(("G_m", "G_a", "gamma_L", "beta_1"), values, strict=True))
    return spring_force(shear_strain(rows["strain"]), rows["xi0"], 0.0, constants)
