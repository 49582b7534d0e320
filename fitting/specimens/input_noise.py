"""Errors in variables: what noise of measured drivers adds to that of the outputs (effective variance, Orear,
Am. J. Phys. 50 (1982) 912).

The model says by how much: its outputs with a driver moved by its 1-sigma, up and down. Smoothing a driver
leaves its slow errors as large as those of white noise, so that the whole variance counts, as if it were new
in every row.
"""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.readings import noise_found

from .registry import predictor_of
from .rows import Rows, stack
from .specimen import Model

CLEAN, SIGMA = "clean", "sigma"
"""Entries of `Rows.extra`: weights by the outputs' own noise, and every driver's 1-sigma."""


def with_drivers(rows: Rows, recording: Recording, drivers: Sequence[str], block: int) -> Rows:
    """A recording that knows the noise of its drivers: as it is stated, or as their fast changes show it.

    Args:
        rows: the recording as arrays, weighted by the noise of its outputs.
        recording: as it was read.
        drivers: inputs of the model that drive it in this recording; the others count as exact.
        block: samples that a row is the mean of.
    """
    sigma = {name: np.zeros(()) for name in rows.inputs}
    for name in drivers:
        noise = recording.noise_si(name) or noise_found(recording, name)
        sigma[name] = np.asarray(noise / np.sqrt(block))
    return eqx.tree_at(lambda r: r.extra, rows, {**rows.extra, CLEAN: dict(rows.weight), SIGMA: sigma})


def noisy(recordings: Sequence[Rows]) -> bool:
    """Whether any driver of these recordings has noise that is known."""
    return any(float(sigma) > 0.0 for rows in recordings for sigma in rows.extra.get(SIGMA, {}).values())


def carried_over(model: Model, values: Mapping[str, float], recordings: Sequence[Rows]) -> list[Rows]:
    """The same recordings, weighted by the noise of their outputs and of their drivers at these values.

    Args:
        model: what predicts them.
        values: free parameters by name, SI.
        recordings: of `with_drivers`, or of an earlier call.
    """
    held = {name: jnp.asarray(float(value)) for name, value in values.items()}
    predict, stacked = predictor_of(model), stack(recordings)
    here, more = predict(held, stacked), {}
    for driver, sigma in stacked.extra[SIGMA].items():
        for sign in (1.0, -1.0):
            moved = stacked.inputs[driver] + sign * jnp.asarray(sigma)[:, None]
            there = predict(held, eqx.tree_at(lambda r, d=driver: r.inputs[d], stacked, moved))
            for name in there:
                change = jnp.nan_to_num(there[name] - here[name]) ** 2
                more[name, driver] = jnp.maximum(more.get((name, driver), 0.0), change)
    found = jax.device_get(more)
    return [_weighted(rows, found, k) for k, rows in enumerate(recordings)]


def _weighted(rows: Rows, more: Mapping[tuple[str, str], np.ndarray], k: int) -> Rows:
    weights = {}
    for name, clean in rows.extra[CLEAN].items():
        clean = np.asarray(clean)
        added = sum(change[k][: len(clean)] for (output, _), change in more.items() if output == name)
        weights[name] = clean / np.sqrt(1.0 + clean**2 * added)
    return eqx.tree_at(lambda r: r.weight, rows, weights)
