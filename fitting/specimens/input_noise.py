"""Errors in variables: noise of measured drivers, propagated to the weights of the outputs.

The method is the effective variance (Orear, Am. J. Phys. 50 (1982) 912).

Sensitivities come from the model: its outputs with a driver shifted by one standard deviation, up and down.
The whole variance of a driver counts, as if errors of different rows were independent, also where readings
were smoothed. Smoothing takes off fast errors and leaves slow ones, which are as large as white noise's.
"""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.readings import noise_of
from pneusma_jax.numerics.safe import as_arrays

from .registry import predictor_of
from .rows import CLEAN, Rows, stack, with_extra
from .specimen import Model

SIGMA = "sigma"
"""Entry of `Rows.extra`: the standard deviation of every driver by name, SI, shape ()."""


def with_driver_noise(rows: Rows, recording: Recording, drivers: Sequence[str], block: int) -> Rows:
    """The same rows with the noise of their drivers, as stated or as estimated from high frequencies.

    `Rows.extra` gets that noise as `SIGMA`, and the weights by the outputs' noise alone as `CLEAN`.

    Args:
        rows: recording as arrays, weighted by the noise of its outputs.
        recording: recording as read from its file.
        drivers: measured inputs with noise; other inputs count as exact.
        block: number of samples averaged in a row; their mean has less noise by the root of it.
    """
    sigma = {name: np.zeros(()) for name in rows.inputs}
    for name in drivers:
        sigma[name] = np.asarray(noise_of(recording, name) / np.sqrt(block))
    return with_extra(rows, **{CLEAN: dict(rows.weight), SIGMA: sigma})


def have_driver_noise(recordings: Sequence[Rows]) -> bool:
    """True if any driver of these recordings has a known noise."""
    return any(float(sigma) > 0.0 for rows in recordings for sigma in rows.extra.get(SIGMA, {}).values())


def with_effective_variance(
    model: Model, values: Mapping[str, float], recordings: Sequence[Rows]
) -> list[Rows]:
    """Recordings weighted by the noise of their outputs and of their drivers, at these parameters.

    The variance of an output is its own, and for each driver the square of the larger change by a shift.

    Args:
        model: model that predicts the outputs.
        values: free parameters by name, SI.
        recordings: recordings from `with_driver_noise` or from an earlier call.
    """
    fixed = as_arrays(values)
    predict, stacked = predictor_of(model), stack(recordings)
    current, variances = predict(fixed, stacked), {}
    for driver, sigma in stacked.extra[SIGMA].items():
        for sign in (1.0, -1.0):
            shifted_driver = stacked.inputs[driver] + sign * jnp.asarray(sigma)[:, None]
            shifted = predict(fixed, eqx.tree_at(lambda r, d=driver: r.inputs[d], stacked, shifted_driver))
            for name in shifted:
                change = jnp.nan_to_num(shifted[name] - current[name]) ** 2
                variances[name, driver] = jnp.maximum(variances.get((name, driver), 0.0), change)
    found = jax.device_get(variances)
    return [_weighted(rows, found, k) for k, rows in enumerate(recordings)]


def _weighted(rows: Rows, variances: Mapping[tuple[str, str], np.ndarray], k: int) -> Rows:
    """One recording with weights that count further variances.

    Args:
        rows: the recording.
        variances: variance of an output by a driver, SI, shape (recordings, padded rows), by both names.
        k: index of the recording.
    """
    weights = {}
    for name, clean in rows.extra[CLEAN].items():
        clean = np.asarray(clean)
        added = sum(change[k][: len(clean)] for (output, _), change in variances.items() if output == name)
        weights[name] = clean / np.sqrt(1.0 + clean**2 * added)
    return eqx.tree_at(lambda r: r.weight, rows, weights)
