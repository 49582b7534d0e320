"""Errors in variables: noise of measured inputs (pressure, temperature, a resistance) in the outputs.

The model gives its size: the change of the outputs when an input is shifted by its 1-sigma, up and down.
Inputs are smoothed before they drive a model, which leaves their slow errors. So the whole variance counts,
as if it were new in every row. Beside correlated errors of an instrument, only neighbouring rows are whitened
exactly. The deflation of evidence accounts for longer correlation.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import Channel, serial_correlation
from fitting.inference.noise import robust_noise, rounding_noise
from fitting.inference.readings import noise_of, read_values
from fitting.specimens.rows import Rows
from pneusma_jax.numerics.safe import as_array


def input_noise(recordings: list[Recording], stacked: Rows) -> dict[str, np.ndarray]:
    """1-sigma of every input, stated or as its fast changes show it, SI, by quantity, shape (recordings,).

    An input that is an output of the model, too, has its noise there.

    Args:
        recordings: recordings as they were read, or reduced.
        stacked: the same as arrays, padded with further recordings.
    """
    found = {}
    for name in sorted(stacked.inputs.keys() - stacked.measured.keys()):
        sigma = np.zeros(len(np.asarray(stacked.mask)))
        for k, recording in enumerate(recordings):
            sigma[k] = _noise(recording, name) / np.sqrt(recording.block)
        if np.any(sigma > 0.0):
            found[name] = sigma
    return found


def _noise(recording: Recording, name: str) -> float:
    """1-sigma of one input of one recording, SI.

    Correlated errors count as white ones whose mean over many rows scatters as much.
    """
    if not recording.has(name):
        return 0.0
    sigma, stated = noise_of(recording, name), recording.noise_si(name)
    if not stated:
        return sigma
    values = read_values(recording, name)
    correlation = serial_correlation(values, float(np.hypot(stated, rounding_noise(values))))
    return sigma * float(np.sqrt((1.0 + correlation) / (1.0 - correlation)))


def white_noise(recordings: list[Recording], stacked: Rows) -> dict[str, np.ndarray]:
    """1-sigma of the white part of noisy inputs, SI, by quantity, (recordings of the stack,).

    It is that of the rows, smoothed or averaged, from their second differences, and at most `input_noise`.
    Correlated errors are not part of it, nor is a stated size that the readings do not show.
    """
    found = input_noise(recordings, stacked)
    for name, sigma in found.items():
        for k in np.flatnonzero(sigma):
            there = np.asarray(stacked.mask)[k]
            time, rows = np.asarray(stacked.time)[k][there], np.asarray(stacked.inputs[name])[k][there]
            sigma[k] = min(sigma[k], robust_noise(time, rows)) if len(rows) > 2 else 0.0
    return found


def shifted(stacked: Rows, name: str, sigma: np.ndarray) -> Rows:
    """Recordings with an input shifted.

    Args:
        stacked: recordings as arrays.
        name: the input.
        sigma: shift, SI, shape (recordings,) or (recordings, rows).
    """
    moved = as_array(np.asarray(stacked.inputs[name]) + np.reshape(sigma, (len(sigma), -1)))
    return replace(stacked, inputs=stacked.inputs | {name: moved})


def changes_by_inputs(
    predicted: Callable[[Rows], list[list[np.ndarray]]], recordings: list[Recording], stacked: Rows
) -> dict[str, list[list[list[np.ndarray]]]]:
    """Changes of predictions when an input is shifted by its 1-sigma, up and down, SI.

    Args:
        predicted: predictions of a stack by recording and channel, each of shape (rows,).
        recordings: recordings as they were read, or reduced.
        stacked: the same as arrays.

    Returns:
        By the input's name: by sign, recording and channel, each of shape (rows,).
    """
    noise = input_noise(recordings, stacked)
    plain = predicted(stacked) if noise else []

    def changed(moved: Rows) -> list[list[np.ndarray]]:
        pairs = zip(plain, predicted(moved), strict=True)
        return [[after - before for before, after in zip(*pair, strict=True)] for pair in pairs]

    return {
        name: [changed(shifted(stacked, name, sign * sigma)) for sign in (1.0, -1.0)]
        for name, sigma in noise.items()
    }


def with_input_noise(
    channels: list[list[Channel]], changes: Mapping[str, list[list[list[np.ndarray]]]]
) -> list[list[Channel]]:
    """Channels whose errors hold those of the inputs.

    Args:
        channels: channels by recording.
        changes: changes of predictions, as `changes_by_inputs` returns them.
    """
    return [
        [
            _with_more_noise(channel, _variance_of_inputs(channel.quantity, changes, k, j))
            for j, channel in enumerate(of_recording)
        ]
        for k, of_recording in enumerate(channels)
    ]


def _variance_of_inputs(
    quantity: str, changes: Mapping[str, list[list[list[np.ndarray]]]], recording: int, channel: int
) -> np.ndarray | float:
    """Variance of a channel's predictions by the noise of all inputs but itself, the larger of both signs."""
    return sum(
        np.max([np.nan_to_num(of_sign[recording][channel]) ** 2 for of_sign in signs], axis=0)
        for name, signs in changes.items()
        if name != quantity
    )


def _with_more_noise(channel: Channel, variance: np.ndarray | float) -> Channel:
    """A channel with errors of inputs beside its own.

    Those of inputs are new in every row. Its own may be correlated.
    """
    total = np.sqrt(channel.sigma**2 + variance)
    own = np.divide(channel.sigma, total, out=np.zeros(len(total)), where=np.isfinite(total))
    shared = own * np.concatenate([own[:1], own[:-1]])
    return replace(channel, sigma=total, correlation=channel.correlation * shared)
