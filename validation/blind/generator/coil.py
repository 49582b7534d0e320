"""A nitinol spring: the published law with the hooks of the effects, on a stand or on an actuator."""

import numpy as np

from . import nitinol
from .march import batch, columns, rows


class Coil:
    """Spring number `which` of a campaign, with its memory; strains of any leading shape over (B, K)."""

    def __init__(self, q, shape, prestrain, effects=(), which=1):
        self.q, self.effects, self.which = q, effects, which
        self.memory = nitinol.Memory(q, shape, prestrain)
        self.lever = nitinol.force_per_stress(q)
        self.wire = nitinol.wire_length(q)

    def gamma(self, strain, row):
        """Shear strain in the law."""
        for effect in self.effects:
            strain = effect.opening(strain, row, self.which)
        gamma = nitinol.shear_strain(self.q, strain)
        for effect in self.effects:
            gamma = effect.shear(gamma, row, self.which)
        return gamma

    def force(self, strain, xi0, row, gamma=None):
        """Pull [N] at a spring strain and a zero-stress martensite fraction."""
        gamma = self.gamma(strain, row) if gamma is None else gamma
        stress, lever = self.memory.stress(gamma, xi0), self.lever
        for effect in self.effects:
            stress = effect.metal(gamma, stress, xi0, row, self.which)
            lever = effect.lever(strain, lever, row, self.which)
        force = lever * stress
        for effect in self.effects:
            force = effect.pull(strain, force, row, self.which)
        return force

    def fraction(self, strain, ohm, row):
        """Zero-stress martensite fraction that a resistance [ohm] implies, and the shear strain."""
        gamma = self.gamma(strain, row)
        return nitinol.fraction_from_resistivity(self.q, ohm / self.wire, gamma), gamma

    def ohm(self, strain, xi0, row):
        """Resistance [ohm] of the solved row."""
        gamma = self.gamma(strain, row)
        value = self.wire * nitinol.resistivity(self.q, xi0, gamma)
        for effect in self.effects:
            value = effect.resistance(value, gamma, xi0, row, self.which, self)
        return value

    def close(self, strain, xi0, row):
        """Commit the solved row."""
        gamma = self.gamma(strain, row)
        if self.effects:
            force = self.force(strain, xi0, row, gamma)
        self.memory.commit(gamma, xi0)
        for effect in self.effects:
            effect.solved(strain, force, row, self.which)
            effect.close_metal(strain, gamma, xi0, row, self.which)


class Watch:
    """Copy of memories before each row: the last parameter set but one gets the first one's. `source` (K, N)
    is the row whose fraction the first one's memory of spring `which` holds."""

    def __init__(self, which, shape):
        self.which, self.source = which, np.full(shape, -1)

    def __call__(self, coils, row):
        for which, coil in coils.items():
            coil.memory.follow(-2, 0)
            if which == self.which:
                self.source[:, row.index] = coil.memory.source[0]


def spring_truth(bench, numbers, effects=()):
    """Columns of a spring on a test stand, driven by elongation and by heat."""
    q = columns(numbers)
    size = max([len(q["G_m"])] + [len(e.amplitude) for e in effects])
    series = {name: batch(bench.stack(name), size) for name in bench.drives}
    shape = (size, len(bench.recordings))
    for effect in effects:
        effect.begin(shape, q, bench)
        series = effect.drives(bench, series)
    coil = Coil(q, shape, bench.geometry["prestrain"], effects)
    force, ohm = np.empty((2,) + series["xi0"].shape)
    for row in rows(bench.times, series):
        strain = row.drive["elongation_mm"] / q["free_length_mm"]
        xi0 = row.drive["xi0"]
        force[..., row.index] = coil.force(strain, xi0, row)
        ohm[..., row.index] = coil.ohm(strain, xi0, row)
        coil.close(strain, xi0, row)
    out = {k: v for k, v in series.items() if k != "xi0"} | {"force_N": force, "resistance_ohm": ohm}
    for effect in effects:
        out = effect.record(bench, out)
    return out


def spring_base(bench, numbers, recorded):
    """Prediction of the base from recorded elongation and resistance: the force, and the explainable
    resistance."""
    q = columns(numbers)
    size = len(q["G_m"])
    series = {name: batch(recorded[name], size) for name in ("elongation_mm", "resistance_ohm")}
    coil = Coil(q, (size, len(bench.recordings)), bench.geometry["prestrain"])
    strain = series["elongation_mm"] / q["free_length_mm"][..., None]
    three = {name: value[..., None] for name, value in q.items()}
    gamma = nitinol.shear_strain(three, strain)
    wire = nitinol.wire_length(three)
    xi0 = nitinol.fraction_from_resistivity(three, series["resistance_ohm"] / wire, gamma)
    force = np.empty_like(xi0)
    for row in rows(bench.times, {}):
        n = row.index
        force[..., n] = coil.force(strain[..., n], xi0[..., n], row, gamma[..., n])
        coil.memory.commit(gamma[..., n], xi0[..., n])
    return {"force_N": force, "resistance_ohm": wire * nitinol.resistivity(three, xi0, gamma)}


def spring_forward(bench, numbers, recorded, course, watched=False):
    """Force and resistance from recorded elongation and fractions (B, K, N), and the row sources of a
    `Watch`."""
    q = columns(numbers)
    size = len(q["G_m"])
    coil = Coil(q, (size, len(bench.recordings)), bench.geometry["prestrain"])
    strain = batch(recorded["elongation_mm"], size) / q["free_length_mm"][..., None]
    three = {name: value[..., None] for name, value in q.items()}
    gamma = nitinol.shear_strain(three, strain)
    force, watch = np.empty_like(gamma), Watch(1, bench.times.shape)
    for row in rows(bench.times, {}):
        n = row.index
        if watched:
            watch({1: coil}, row)
        force[..., n] = coil.force(strain[..., n], course[..., n], row, gamma[..., n])
        coil.memory.commit(gamma[..., n], course[..., n])
    ohm = nitinol.wire_length(three) * nitinol.resistivity(three, course, gamma)
    return {"force_N": force, "resistance_ohm": ohm}, watch.source
