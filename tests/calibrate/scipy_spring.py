"""A campaign of springs refitted without the project's code: the published equations in NumPy, SciPy's solver.

Equation numbers are the source's. The martensite fraction of every row is one more unknown; from the project
come the readings, the noise, the walk's variance and which row of each test set the memory.
"""

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix
from scipy.special import erf

OVERSHOOT = 0.01


def sigmoid(x, k):
    return x / (1.0 + np.abs(x) ** k) ** (1.0 / k)


def detwinned(gamma, c):
    return (1.0 + np.exp(-c["beta_1"] * gamma - c["beta_2"])) ** -c["beta_3"]


def shear_strain(elongation, c):
    """Eq. 2.17."""
    coil = c["mandrel_diameter"] + c["wire_diameter"]
    first = np.arctan(c["initial_pitch"] / (2.0 * coil))
    angle = np.arctan(c["initial_pitch"] * (1.0 + elongation / c["free_length"]) / (2.0 * coil))
    cos2, sin2 = np.cos(angle) ** 2, np.sin(angle) ** 2
    opening = np.cos(first) ** 2 * (np.sin(angle) - np.sin(first))
    return opening / (coil / c["wire_diameter"] * cos2 * (cos2 + sin2 / (1.0 + c["poisson_ratio"])))


def force_and_resistance(xi0, gamma, c, memory):
    """Eqs. 2.29 to 2.33, 3.1 to 3.3, 2.40 and 2.41."""
    origin, hottest, hotter, loading = memory
    before = np.where(origin < 0, c["prestrain"], gamma[origin])
    heat = np.where(hotter, xi0, np.where(hottest < 0, 1.0, xi0[hottest]))
    limit = c["gR_amplitude"] * (1.0 + erf(c["gR_slope"] * before - c["gR_shift"]))
    residual = np.minimum(limit, c["gamma_L"] * detwinned(before, c)) * np.exp(c["gR_decay"] * (heat - 1.0))
    modulus = xi0 * c["G_m"] + (1.0 - xi0) * c["G_a"]
    induced = 0.5 * (1.0 + sigmoid(c["ka_1"] * gamma + c["ka_2"], c["ka_3"]))
    lost = c["gamma_L"] * (xi0 * c["G_m"] * detwinned(gamma, c) + (1.0 - xi0) * c["G_a"] * induced)
    stress = modulus * gamma - np.where(loading, lost, modulus * residual)
    wire, coil = c["wire_diameter"], c["mandrel_diameter"] + c["wire_diameter"]
    index = coil / wire
    wahl = (4.0 * index - 1.0) / (4.0 * index - 4.0) + 0.615 / index
    force = np.pi * wire**2 * stress / (8.0 * index * wahl)
    martensite = c["rho_mean"] + 0.5 * c["rho_span"] * sigmoid(c["km_1"] * detwinned(gamma, c) + c["km_2"], c["km_3"])
    austenite = c["alpha_1"] + c["alpha_2"] * induced
    exponent = np.maximum(c["a"] + (1.0 - c["a"]) * (np.maximum(gamma, 0.0) / c["gamma_max"]) ** c["b"], 0.5)
    weight = np.maximum(xi0, 0.0) ** exponent
    length = c["active_coils"] * np.hypot(np.pi * coil, c["initial_pitch"])
    return force, (weight * martensite + (1.0 - weight) * austenite) * length


class Test:
    """One recording as plain arrays."""

    __test__ = False  # of pytest

    def __init__(self, rows):
        held = np.asarray(rows.mask)
        decisions, extra = rows.extra["decisions"], rows.extra
        self.elongation, self.time = np.asarray(rows.inputs["elongation"])[held], np.asarray(rows.time)[held]
        self.measured = [np.asarray(rows.measured[n])[held] for n in ("force", "resistance")]
        self.weight = [np.asarray(rows.weight[n])[held] for n in ("force", "resistance")]
        names = ("origin", "hottest", "hotter", "loading")
        self.memory = [np.asarray(getattr(decisions, n))[held] for n in names]
        self.start = np.asarray(decisions.course)[held]
        self.base = {name: float(value) for name, value in rows.base.items()}
        self.process_noise, self.level, self.level_sd = (float(extra[n]) for n in ("process_noise", "level", "level_sd"))

    def misfit(self, xi0, constants):
        c, held = {**self.base, **constants}, self.level_sd == 0.0
        away = xi0 - self.level
        xi0 = np.full(len(xi0), self.level) if held else xi0
        found = force_and_resistance(xi0, shear_strain(self.elongation, c), c, self.memory)
        parts = [w * (f - m) for w, f, m in zip(self.weight, found, self.measured, strict=True)]
        if held:  # its fraction is known: what the solver moves there is worth nothing
            return np.concatenate([*parts, away, np.zeros(len(away))])
        steps = np.diff(xi0) / np.sqrt(self.process_noise * np.maximum(np.diff(self.time), 1e-6))
        outside = np.minimum(xi0, 0.0) + np.maximum(xi0 - 1.0, 0.0)
        return np.concatenate([*parts, [(xi0[0] - self.level) / self.level_sd], steps, outside / OVERSHOOT])

    def pattern(self):
        """Which row of the misfit depends on which row's fraction."""
        n = len(self.time)
        dependence = lil_matrix((4 * n, n), dtype=int)
        for k in range(n):
            dependence[[k, n + k, 3 * n + k], k] = 1
            if self.memory[1][k] >= 0:
                dependence[k, self.memory[1][k]] = 1
        dependence[2 * n, 0] = 1
        for k in range(1, n):
            dependence[2 * n + k, k] = dependence[2 * n + k, k - 1] = 1
        return dependence


def refitted(tests, mean, sd):
    """Constants of least squares over constants and all fractions.

    Args:
        tests: recordings.
        mean, sd: of the priors, by name; the means are where it starts.
    """
    names, sizes = list(mean), [len(t.time) for t in tests]
    ends = np.cumsum([len(names), *sizes])

    def constants(x):
        return {n: mean[n] + sd[n] * z for n, z in zip(names, x, strict=False)}

    def residual(x):
        parts = [t.misfit(x[a:b], constants(x)) for t, a, b in zip(tests, ends[:-1], ends[1:], strict=True)]
        return np.concatenate([*parts, x[: len(names)]])

    rows = 4 * sum(sizes) + len(names)
    pattern, top = lil_matrix((rows, ends[-1]), dtype=int), 0
    for t, a, b in zip(tests, ends[:-1], ends[1:], strict=True):
        pattern[top : top + 2 * len(t.time), : len(names)] = 1
        pattern[top : top + 4 * len(t.time), a:b] = t.pattern()
        top += 4 * len(t.time)
    for k in range(len(names)):
        pattern[top + k, k] = 1
    start = np.concatenate([np.zeros(len(names)), *(t.start for t in tests)])
    options = {"atol": 1e-10, "btol": 1e-10, "maxiter": 3000}
    found = least_squares(
        residual, start, jac_sparsity=pattern.tocsr(), x_scale="jac", tr_options=options, xtol=1e-9, ftol=1e-10,
        gtol=1e-8, max_nfev=60,
    )  # fmt: skip
    return constants(found.x), 2.0 * found.cost
