"""Silicone without springs: a coupon that is pulled, and a pressurised tube that stretches."""

import numpy as np

from .march import batch, columns, rows
from .roots import solve
from .silicone import base_stress


class Body:
    """A trial configuration for the effects."""

    def __init__(self, **values):
        self.__dict__.update(values)


def fibre_stress(q, strain, row, effects):
    """Stress of silicone (..., B, K, points): the base's, changed by the effects."""
    stress = q["silicone_stiffness"][..., None] * base_stress(strain)
    for effect in effects:
        stress = effect.fibre(strain, stress, row)
    return stress


def close_fibres(q, strain, row, effects):
    """Pass a solved row to the effects' memories, each with the stress that it received."""
    stress = q["silicone_stiffness"][..., None] * base_stress(strain)
    for effect in effects:
        given, stress = stress, effect.fibre(strain, stress, row)
        effect.close_fibre(strain, given, row)


def elastomer_truth(bench, numbers, effects=()):
    """Columns of a coupon pulled through prescribed strains."""
    q = columns(numbers)
    size = max([len(q["silicone_stiffness"])] + [len(e.amplitude) for e in effects])
    series = {"strain": batch(bench.stack("strain"), size)}
    for effect in effects:
        effect.begin((size, len(bench.recordings)), q, bench)
        series = effect.drives(bench, series)
    stress = np.empty_like(series["strain"])
    for row in rows(bench.times, series):
        strain = row.drive["strain"][..., None]
        stress[..., row.index] = fibre_stress(q, strain, row, effects)[..., 0]
        close_fibres(q, strain, row, effects)
    out = {"strain": series["strain"], "stress_kPa": 1e-3 * stress}
    for effect in effects:
        out = effect.record(bench, out)
    return out


def elastomer_base(bench, numbers, recorded):
    """Prediction of the base model from the recorded strain; without history, so all rows at once."""
    q = columns(numbers)
    strain = np.asarray(recorded["strain"])
    return {"stress_kPa": 1e-3 * q["silicone_stiffness"][..., None] * base_stress(strain)}


def _areas(q):
    outer = 1e-3 * q["outer_diameter_mm"]
    inner = outer - 2e-3 * q["wall_thickness_mm"]
    return 0.25 * np.pi * inner**2, 0.25 * np.pi * (outer**2 - inner**2)


def tube_truth(bench, numbers, effects=()):
    """Columns of a tube under prescribed pressure, Eqs. 3.9-3.10."""
    q = columns(numbers)
    size = max([len(q["silicone_stiffness"])] + [len(e.amplitude) for e in effects])
    series = {"pressure_kPa": batch(bench.stack("pressure_kPa"), size)}
    written = dict(series)
    shape = (size, len(bench.recordings))
    for effect in effects:
        effect.begin(shape, q, bench)
        series = effect.drives(bench, series)
    bore, wall = _areas(q)
    strain = np.empty_like(series["pressure_kPa"])
    x = np.zeros(shape + (1,))
    for row in rows(bench.times, series):
        pressure = 1e3 * row.drive["pressure_kPa"]

        def residual(x, row=row, pressure=pressure):
            e = x[..., 0]
            body = Body(axial=e, bend=0.0 * e, pressure=pressure, q=q, bore=bore, wall=wall)
            force = wall * fibre_stress(q, x, row, effects)[..., 0] - pressure * bore
            for effect in effects:
                force = force + effect.load(body, row)[0]
            return (force / (wall * 1e5))[..., None]

        x = solve(residual, x)
        strain[..., row.index] = x[..., 0]
        body = Body(axial=x[..., 0], bend=0.0 * x[..., 0], pressure=pressure, q=q, bore=bore, wall=wall)
        close_fibres(q, x, row, effects)
        for effect in effects:
            effect.close_load(body, row)
    out = {"pressure_kPa": written["pressure_kPa"], "length_mm": q["length_mm"][..., None] * (1.0 + strain)}
    for effect in effects:
        out = effect.record(bench, out)
    return out


def tube_base(bench, numbers, recorded):
    """Prediction of the base from the recorded pressure: every row independent, solved at once."""
    q = columns(numbers)
    bore, wall = _areas(q)
    size = len(q["silicone_stiffness"])
    pressure = batch(recorded["pressure_kPa"], size)
    wanted = (1e3 * bore / wall / q["silicone_stiffness"])[..., None] * pressure
    strain = solve(lambda x: 1e-5 * (base_stress(x) - wanted[..., None]), np.zeros(wanted.shape + (1,)))[..., 0]
    return {"length_mm": q["length_mm"][..., None] * (1.0 + strain)}
