"""Format: three columns without header, with temperature, strain and stress of a shape-memory alloy under
constant load."""

from dataclasses import replace

import numpy as np

from ..recordings import Recording
from .assemble import Facts, assemble
from .channels import numbered
from .format import Format
from .names import slug
from .options import Options
from .parts import Sample

NAME = "sma-columns"
LOAD_NOISE_MPA = 5.0  # Maximum spread of a constant load near zero
FRACTION_LIMIT = 0.15
"""Maximum strain as a fraction; no shape-memory alloy recovers more, so larger numbers are percent."""


def recognises(sample: Sample) -> bool:
    """True for three columns of numbers: one that varies like a temperature, one small, one nearly
    constant."""
    if not sample.headerless(3):
        return False
    temperature, strain, stress = sample.grid.values.T
    finite = np.isfinite(sample.grid.values).all()
    return bool(
        finite
        and -273.15 < temperature.min()
        and temperature.max() < 1500.0
        and np.ptp(temperature) > 5.0
        and np.abs(strain).max() < 20.0
        and np.ptp(stress) <= max(0.5 * np.median(np.abs(stress)), LOAD_NOISE_MPA)
    )


def read(sample: Sample, options: Options) -> Recording:
    """A wire. A strain beyond 0.15 is taken as percent, unless `--unit strain=...` says otherwise."""
    grid = sample.require_grid()
    channels = numbered(grid, ("temperature", "strain", "stress"))
    largest = float(np.nanmax(np.abs(channels["strain"].values)))
    guess = "percent" if largest > FRACTION_LIMIT else "1"
    units = {"temperature": "degC", "strain": guess, "stress": "MPa"} | dict(options.units)
    notices = [*grid.notices, "columns without names, taken as temperature, strain, stress"]
    if "strain" not in options.units:
        words = "percent" if guess == "percent" else "a fraction"
        notices.append(
            f"strain reaches {largest:.4g}: taken as {words} (--unit strain=percent or strain=1 to correct)"
        )
    notices += [
        f"{quantity} taken as {units[quantity]} (--unit {quantity}=... to correct)"
        for quantity in ("temperature", "stress")
        if quantity not in options.units
    ]
    channels = {q: replace(channel, unit=units[q]) for q, channel in channels.items()}
    # Such files come one per load: those of one folder are one specimen.
    folder = slug(sample.raw.path.resolve().parent.name)
    if options.specimen is None:
        notices.append(f"specimen taken from the folder's name, {folder!r} (--specimen to correct)")
    return assemble(sample, channels, options.kind or "wire", options, Facts(NAME, specimen=folder), notices)


FORMAT = Format(NAME, "no header; temperature, strain, stress in three columns -> wire", recognises, read)
