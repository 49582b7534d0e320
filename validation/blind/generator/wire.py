"""A straight wire under prescribed stress, its phases from its temperature."""

import numpy as np

from . import nitinol
from .march import batch, columns, rows

MEGA = 1e6


def _wire(bench, numbers, series, effects):
    q = columns(numbers)
    shape = (series["stress_MPa"].shape[0], len(bench.recordings))
    written = dict(series)
    for effect in effects:
        effect.begin(shape, q, bench)
        series = effect.drives(bench, series)
    memory = nitinol.Memory(q, shape, bench.geometry["prestrain"], modulus=("E_m", "E_a"), length="eps_L")
    strain = np.empty_like(np.asarray(series["stress_MPa"], float))
    x = None
    for row in rows(bench.times, series):
        wanted = MEGA * row.drive["stress_MPa"]
        temperature = row.drive["temperature_degC"]
        for effect in effects:
            temperature = effect.warmth(temperature, wanted, row, q)
        xi0 = nitinol.fraction_from_temperature(q, temperature)
        for effect in effects:
            xi0 = effect.phase(xi0, temperature, row, q)
        xi0 = np.broadcast_to(xi0, shape)

        def residual(x, row=row, wanted=wanted, xi0=xi0):
            eps = x[..., 0]
            for effect in effects:
                eps = effect.shear(eps, row, 1)
            stress = memory.stress(eps, xi0)
            for effect in effects:
                stress = effect.metal(eps, stress, xi0, row, 1)
            return ((stress - wanted) / 50e9)[..., None]

        first = (wanted / (nitinol.GIGA * q["E_m"]))[..., None] if x is None else x
        x = _search(residual, np.broadcast_to(first, shape + (1,)))
        strain[..., row.index] = x[..., 0]
        eps = x[..., 0]
        for effect in effects:
            eps = effect.shear(eps, row, 1)
        memory.commit(eps, xi0)
        for effect in effects:
            effect.close_metal(x[..., 0], eps, xi0, row, 1)
    out = written | {"strain": strain}
    for effect in effects:
        out = effect.record(bench, out)
    return out


def _search(residual, guess):
    """Newton inside a bracket that only shrinks, since the flat plateau throws plain Newton far away."""
    low, high, x = np.full(guess.shape, -0.03), np.full(guess.shape, 0.2), np.array(guess)
    for _ in range(70):
        value, beside = residual(np.stack([x, x + 1e-8]))
        low, high = np.where(value < 0, x, low), np.where(value < 0, high, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            trial = x - value * 1e-8 / (beside - value)
        middle = 0.5 * (low + high)
        inside = (trial > low) & (trial < high) & (np.abs(trial - x) < 0.02)
        following = np.where(inside, trial, middle)
        if np.max(np.minimum(np.abs(following - x), high - low)) < 1e-11:
            return following
        x = following
    if np.max(np.abs(residual(x[None]))) < 1e-7:
        return x
    raise ArithmeticError("no strain of the wire carries this stress")


def wire_truth(bench, numbers, effects=()):
    """Columns of a wire under prescribed stress and temperature."""
    size = max([np.size(v) for v in numbers.values()] + [len(e.amplitude) for e in effects])
    return _wire(bench, numbers, {name: batch(bench.stack(name), size) for name in bench.drives}, effects)


def wire_base(bench, numbers, recorded):
    """Prediction of the base from recorded stress and temperature."""
    size = max(np.size(v) for v in numbers.values())
    return _wire(bench, numbers, {name: batch(recorded[name], size) for name in bench.inputs}, ())
