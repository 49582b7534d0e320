"""Shared steps from a recording to arrays: columns of the usable rows, their weights, smoothed drivers."""

from collections.abc import Iterable, Sequence

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.channels import channel_weight
from fitting.inference.latent_trajectory.denoise import denoised
from fitting.inference.readings import measurements
from pneusma_jax.errors import InputError, counted

from .reduction import reduced
from .specimen import FITTED, RowOptions


def columns_of(
    recording: Recording, drivers: Sequence[str], outputs: Sequence[str], options: RowOptions = FITTED
) -> tuple[dict[str, np.ndarray], int]:
    """Time, drivers and outputs of the rows that have all drivers. Long recordings are reduced.

    Args:
        recording: checked recording.
        drivers: inputs of the model, such as `elongation`; a row without one of them is left out.
        outputs: quantities that the model predicts; they may be missing, in single rows or altogether.
        options: maximum and minimum numbers of rows.

    Returns:
        Columns in SI by quantity, shape (rows,); outputs are NaN where there is no measurement
        (`inference.readings`). Second, the number of readings averaged in a row. Without a clock, the time is
        the row's number.

    Raises:
        InputError: if fewer than `options.fewest` rows have all drivers, or none has an output besides.
    """
    recording = recording if options.most is None else reduced(recording, options.most)
    count = len(recording)
    columns = {"time": recording.si("time") if recording.has("time") else np.arange(count) * 1.0}
    for name in outputs:
        columns[name] = measurements(recording, name) if recording.has(name) else np.full(count, np.nan)
    for name in drivers:
        columns[name] = recording.si(name) if recording.has(name) else np.full(count, np.nan)
    complete = np.all([np.isfinite(columns[name]) for name in ("time", *drivers)], axis=0)
    if complete.sum() < options.fewest:
        raise InputError(
            f"{recording.path or recording.name}: {counted(int(complete.sum()), 'row')} with all of "
            f"{', '.join(dict.fromkeys(('time', *drivers)))}, and a fit needs {options.fewest} or more"
        )
    recorded = [name for name in outputs if recording.has(name)]
    if options.compared and recorded and not any(np.isfinite(columns[n][complete]).any() for n in recorded):
        raise InputError(
            f"{recording.path or recording.name}: no row has both {' or '.join(recorded)} and"
            f" {', '.join(drivers)}; if each was logged at moments of its own, bring them to one clock"
        )
    return {name: values[complete] for name, values in columns.items()}, recording.block


def measured_and_weight(
    recording: Recording,
    outputs: Iterable[str],
    columns: dict[str, np.ndarray],
    block: int,
    options: RowOptions = FITTED,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Measured outputs in SI, and their weights, both of shape (rows,) by quantity.

    A missing measurement is 0. A weight is the inverse standard deviation of a measurement. It is 0 for a
    quantity that was not recorded, and everywhere without `options.compared`.

    Args:
        recording: checked recording.
        outputs: quantities that the model predicts.
        columns: columns by quantity; see `columns_of`.
        block: number of readings averaged in a row.
        options: whether outputs are compared with the model.
    """
    measured, weight = {}, {}
    for name in outputs:
        measured[name] = np.nan_to_num(columns[name])
        weight[name] = np.zeros(len(columns["time"]))
        if options.compared and recording.has(name):
            weight[name] = channel_weight(recording, name, columns, block)
    return measured, weight


def smooth(columns: dict[str, np.ndarray], name: str, options: RowOptions = FITTED) -> np.ndarray:
    """A noisy driver, smoothed as far as its trend and its noise can be separated, and interpolated in gaps.

    Without `options.smooth` it is returned as it is.
    """
    if not options.smooth:
        return columns[name]
    time = columns["time"]
    return interpolated(time, time, denoised(time, columns[name]))


def interpolated(time: np.ndarray, read_at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A column at other times than those of its readings, linear between them; NaN where nothing was read.

    Args:
        time: times that are asked for [s], shape (rows,).
        read_at: times of the readings [s], shape (readings,).
        values: the readings, NaN where one is missing, shape (readings,).
    """
    there = np.isfinite(read_at) & np.isfinite(values)
    return np.interp(time, read_at[there], values[there]) if there.any() else np.full(len(time), np.nan)
