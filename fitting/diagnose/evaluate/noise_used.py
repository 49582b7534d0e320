"""The noise that a diagnosis judges every output by, as data."""

from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import schema
from pneusma_jax.units import from_si

from .program import Program


@dataclass(frozen=True)
class NoiseUsed:
    """Noise of one output of one recording.

    Attributes:
        recording: name of the recording.
        column: canonical column of the output; unit: its unit.
        sd: standard deviation of a row, the median over rows. What noise of inputs adds is in it.
        stated: standard deviation of a reading that the recording states; None where nobody states it.
        readings: number of readings that a row is the mean of.
        correlation: correlation of the errors of neighbouring rows, the median.
    """

    recording: str
    column: str
    unit: str
    sd: float
    stated: float | None
    readings: int
    correlation: float


def noise_used(program: Program) -> list[NoiseUsed]:
    """Noise of every output of every recording of a program, in units of files.

    Args:
        program: program whose noise is judged: that of the fitted model.
    """
    found = []
    for recording, channels in zip(program.recordings, program.channels, strict=True):
        for channel in channels:
            counted = np.isfinite(channel.sigma)
            column = schema.column_of(program.kind, channel.quantity)
            if column is None or not counted.any():
                continue
            unit = schema.quantity_and_unit(column)[1]
            stated = recording.noise_si(channel.quantity)
            correlation = np.broadcast_to(channel.correlation, counted.shape)[counted]
            found.append(
                NoiseUsed(
                    recording=recording.name,
                    column=column,
                    unit=unit,
                    sd=float(from_si(np.median(channel.sigma[counted]), unit, True)),
                    stated=float(from_si(stated, unit, True)) if stated else None,
                    readings=int(recording.block),
                    correlation=float(np.median(correlation)),
                )
            )
    return found
