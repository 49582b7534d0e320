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
    """1-sigma of one input of one recording, SI; correlated errors count as white ones that are as slow."""
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
    """Recordings with an input shifted by a number each, or by one in every row."""
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
    here = predicted(stacked) if noise else []
    changes = {}
    for name, sigma in noise.items():
        there = [predicted(shifted(stacked, name, sign * sigma)) for sign in (1.0, -1.0)]
        changes[name] = [
            [[b - a for a, b in zip(x, y, strict=True)] for x, y in zip(here, one, strict=True)]
            for one in there
        ]
    return changes


def with_input_noise(
    channels: list[list[Channel]], changes: Mapping[str, list[list[list[np.ndarray]]]]
) -> list[list[Channel]]:
    """Channels whose errors hold those of the inputs.

    Args:
        channels: channels by recording.
        changes: changes of predictions, as `changes_by_inputs` returns them.
    """
    found = []
    for k, members in enumerate(channels):
        row = []
        for j, channel in enumerate(members):
            more = np.zeros(len(channel.sigma))
            for name, signs in changes.items():
                if name != channel.quantity:
                    more += np.max([np.nan_to_num(change[k][j]) ** 2 for change in signs], axis=0)
            total = np.sqrt(channel.sigma**2 + more)
            there = np.isfinite(total)
            own = np.divide(channel.sigma, total, out=np.zeros(len(total)), where=there)
            shared = own * np.concatenate([own[:1], own[:-1]])  # errors of inputs are new in every row
            row.append(replace(channel, sigma=total, correlation=channel.correlation * shared))
        found.append(row)
    return found
