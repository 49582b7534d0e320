"""Nitinol laws of the published model: spring geometry, phases, resistivity, stress and the residual-strain
rule.

`q` maps names of constants (numbers.py) to arrays that broadcast with the strain. Moduli come in GPa, and
stresses leave in Pa.
"""

import numpy as np
from scipy.special import erf

POISSON = 0.33
GIGA = 1e9


def coil_diameter(q):
    """Mean coil diameter D [m]."""
    return 1e-3 * (q["mandrel_diameter_mm"] + q["wire_diameter_mm"])


def shear_strain(q, strain):
    """Shear strain of the wire at a spring strain, Eq. 2.14, in angles."""
    twice = 2e3 * coil_diameter(q)
    before = np.arctan2(q["initial_pitch_mm"], twice)
    now = np.arctan2(q["initial_pitch_mm"] * (1.0 + strain), twice)
    index = coil_diameter(q) / (1e-3 * q["wire_diameter_mm"])
    stiffening = np.cos(now) ** 2 + np.sin(now) ** 2 / (1.0 + POISSON)
    return np.cos(before) ** 2 * (np.sin(now) - np.sin(before)) / (index * np.cos(now) ** 2 * stiffening)


def wire_length(q):
    """Length [m] of the wire in the active coils, Eqs. 2.1-2.2."""
    return q["active_coils"] * np.hypot(np.pi * coil_diameter(q), 1e-3 * q["initial_pitch_mm"])


def force_per_stress(q, diameter=None):
    """Spring force per shear stress [N/Pa], Eq. 2.9, for a coil diameter (the mandrel's by default)."""
    wire = 1e-3 * q["wire_diameter_mm"]
    index = (coil_diameter(q) if diameter is None else diameter) / wire
    wahl = (4.0 * index - 1.0) / (4.0 * index - 4.0) + 0.615 / index
    return np.pi * wire**2 / (8.0 * index * wahl)


def _algebraic(x, sharpness):
    return x / (1.0 + np.abs(x) ** sharpness) ** (1.0 / sharpness)


def detwinned(q, gamma):
    """Detwinned fraction of the martensite."""
    return np.exp(-q["beta_3"] * np.logaddexp(0.0, -q["beta_1"] * gamma - q["beta_2"]))


def stress_induced(q, gamma):
    """Fraction of the austenite that strain has turned into martensite."""
    return 0.5 * (1.0 + _algebraic(q["ka_1"] * gamma + q["ka_2"], q["ka_3"]))


def rho_martensite(q, fraction):
    """Resistance per metre of martensitic wire at a detwinned fraction [ohm/m]."""
    return q["rho_mean"] + 0.5 * q["rho_span"] * _algebraic(q["km_1"] * fraction + q["km_2"], q["km_3"])


def rho_austenite(q, fraction):
    """Resistance per metre of austenitic wire at a stress-induced fraction [ohm/m]."""
    return q["alpha_1"] + q["alpha_2"] * fraction


def _exponent(q, gamma):
    u = np.maximum(gamma, 0.0) / q["gamma_max"]
    small = 1e-6
    power = np.where(u > small, np.maximum(u, small) ** q["b"], u * small ** (q["b"] - 1.0))
    return q["a"] + (1.0 - q["a"]) * power


def resistivity(q, xi0, gamma, rho_m=None):
    """Resistance per metre of wire, Eqs. 2.40-2.41; `rho_m` replaces the martensite's own."""
    high = rho_martensite(q, detwinned(q, gamma)) if rho_m is None else rho_m
    low = rho_austenite(q, stress_induced(q, gamma))
    share = np.maximum(xi0, 0.0) ** _exponent(q, gamma)
    return low + share * (high - low)


def fraction_from_resistivity(q, rho, gamma):
    """Zero-stress martensite fraction, Eq. 2.48, its base clipped to [0, 1]."""
    high = rho_martensite(q, detwinned(q, gamma))
    low = rho_austenite(q, stress_induced(q, gamma))
    share = np.clip((rho - low) / (high - low), 0.0, 1.0)
    return share ** (1.0 / _exponent(q, gamma))


def residual_bound(q, prestrain, length):
    """Residual strain after an earlier strain in full martensite: Eq. 3.1, at most the strain that detwinning
    allows."""
    printed = q["gR_amplitude"] * (1.0 + erf(q["gR_slope"] * prestrain - q["gR_shift"]))
    return np.minimum(printed, length * detwinned(q, prestrain))


class Memory:
    """Memory of the metal: its largest strain and its lowest martensite fraction since then.

    `source` is the row of this fraction, -1 before any.
    """

    def __init__(self, q, shape, prestrain, *, modulus=("G_m", "G_a"), length="gamma_L"):
        self.q, self.names, self.length = q, modulus, length
        self.largest = np.full(shape, float(prestrain))
        self.lowest = np.ones(shape)
        self.source, self.closed = np.full(shape, -1), 0

    def residual(self, xi0):
        """Residual strain with a trial fraction of this row."""
        lowest = np.minimum(self.lowest, xi0)
        bound = residual_bound(self.q, self.largest, self.q[self.length])
        return bound * np.exp(self.q["gR_decay"] * (lowest - 1.0))

    def stress(self, gamma, xi0, fractions=None):
        """Stress [Pa]: elastic, less the larger of transformation and residual strain."""
        return self._branches(gamma, xi0, fractions)[0]

    def _branches(self, gamma, xi0, fractions=None):
        cold, hot = (GIGA * self.q[name] for name in self.names)
        modulus = xi0 * cold + (1.0 - xi0) * hot
        soft, stiff = fractions or (detwinned(self.q, gamma), stress_induced(self.q, gamma))
        changing = self.q[self.length] * (xi0 * cold * soft + (1.0 - xi0) * hot * stiff)
        residual = self.residual(xi0)
        return modulus * gamma - np.maximum(changing, modulus * residual), changing, modulus, residual

    def commit(self, gamma, xi0):
        """Close a row with its converged values."""
        _, changing, modulus, residual = self._branches(gamma, xi0)
        lower = xi0 < self.lowest
        self.lowest = np.minimum(self.lowest, xi0)
        renewed = residual_bound(self.q, gamma, self.q[self.length]) * np.exp(self.q["gR_decay"] * (xi0 - 1.0))
        renew = (changing > modulus * residual) & (renewed > residual)
        self.largest = np.where(renew, gamma, self.largest)
        self.lowest = np.where(renew, xi0, self.lowest)
        self.source = np.where(renew | lower, self.closed, self.source)
        self.closed += 1

    def follow(self, member, other):
        """Copy one parameter set's memory to another."""
        self.largest[member], self.lowest[member] = self.largest[other], self.lowest[other]


def fraction_from_temperature(q, temperature):
    """Zero-stress martensite fraction of the one reversible curve."""
    return 1.0 / (1.0 + np.exp(np.clip((temperature - q["T_mid"]) / q["T_width"], -60.0, 60.0)))
