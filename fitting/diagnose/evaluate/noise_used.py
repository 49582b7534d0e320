"""The noise that a diagnosis judges every output by, as data."""

from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.numbers import number
from fitting.inference.readings import noise_found
from pneusma_jax.units import amount, from_si

from ..settings import DEFAULT
from .program import Program

CHANCE = DEFAULT.chance


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
        fast_scatter: standard deviation of a row that the fast scatter of the readings alone says, as if
            errors were independent; None where the noise is stated.
        over_fast: estimated standard deviation, without the noise of inputs, over `fast_scatter` [1]; None
            where the noise is stated.
    """

    recording: str
    column: str
    unit: str
    sd: float
    stated: float | None
    readings: int
    correlation: float
    fast_scatter: float | None = None
    over_fast: float | None = None


def noise_used(program: Program) -> list[NoiseUsed]:
    """Noise of every output of every recording of a program, in units of files.

    Args:
        program: program whose noise is judged: that of the fitted model.
    """
    found = []
    for recording, channels, bare in zip(program.recordings, program.channels, program.bare, strict=True):
        for channel, own in zip(channels, bare, strict=True):
            counted = np.isfinite(channel.sigma)
            column = schema.column_of(program.kind, channel.quantity)
            if column is None or not counted.any():
                continue
            unit = schema.quantity_and_unit(column)[1]
            stated = recording.noise_si(channel.quantity)
            fast = None if stated else noise_found(recording, channel.quantity) / np.sqrt(recording.block)
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
                    fast_scatter=None if fast is None else float(from_si(fast, unit, True)),
                    over_fast=float(np.median(own.sigma[counted]) / fast) if fast else None,
                )
            )
    return found


def slow_as_noise(program: Program) -> list[str]:
    """A note for every column whose estimated noise is far larger than the fast scatter of its readings.

    Slow misfit that was taken for correlated noise looks so. A recording of the largest ratio stands for all.
    """
    largest: dict[str, NoiseUsed] = {}
    for one in noise_used(program):
        if one.over_fast is not None and one.over_fast > CHANCE.scatter_ratio:
            largest[one.column] = max(one, largest.get(one.column, one), key=lambda n: n.over_fast or 0.0)
    return [
        f"the noise of {one.column} is not stated, and was estimated as "
        f"{amount(number(_own(one)), one.unit)} a row, with a correlation of {one.correlation:.2f} between "
        f"rows. The fast scatter of the readings "
        f"alone says {amount(number(one.fast_scatter), one.unit)}, {number(one.over_fast, '.2g')} times less "
        f"({one.recording}). Slow misfit may have been taken for noise: effects may be missed then, and "
        f"errors are too large. State the noise of {one.column}, in [noise] of campaign.toml or of the "
        "sidecars"
        for one in largest.values()
    ]


def _own(one: NoiseUsed) -> float:
    """Estimated standard deviation of a row without the noise of inputs."""
    return (one.over_fast or 0.0) * (one.fast_scatter or 0.0)
