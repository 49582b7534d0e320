"""Format: three columns without header, with time, stretch and nominal stress of a coupon that is loaded and
unloaded."""

from dataclasses import replace

import numpy as np

from ..recordings import Recording
from .assemble import Facts, assemble
from .channels import numbered
from .format import Format
from .names import slug
from .options import Options
from .parts import Sample
from .strain_unit import unit_assumed

NAME = "loading-unloading"
DEFAULT_UNIT = "kPa"


def recognises(sample: Sample) -> bool:
    """True for three columns of numbers: a clock, a stretch that begins near one, a stress that begins near
    zero."""
    if not sample.headerless(3) or not np.isfinite(sample.grid.values).all():
        return False
    time, stretch, stress = sample.grid.values.T
    return bool(
        (np.diff(time) >= 0.0).all()
        and time[0] >= 0.0
        and abs(stretch[0] - 1.0) < 0.05
        and stretch.min() > 0.0
        and abs(stress[0]) <= 0.1 * np.abs(stress).max()
    )


def read(sample: Sample, options: Options) -> Recording:
    """An elastomer coupon, strain = stretch - 1."""
    grid = sample.require_grid()
    channels = numbered(grid, ("time", "stretch", "stress"))
    channels["time"] = replace(channels["time"], unit="s")
    notices = [*grid.notices, "columns without names, taken as time (s), stretch, nominal stress"]
    if "stress" not in options.units:
        channels["stress"] = replace(channels["stress"], unit=DEFAULT_UNIT)
        notices.append(unit_assumed(channels, DEFAULT_UNIT))
    # Such files come one per rate or stretch: those of one folder are one material.
    folder = slug(sample.raw.path.resolve().parent.name)
    if options.specimen is None:
        notices.append(f"specimen taken from the folder's name, {folder!r} (--specimen to correct)")
    facts = Facts(NAME, specimen=folder)
    return assemble(sample, channels, options.kind or "elastomer", options, facts, notices)


FORMAT = Format(NAME, "no header (sheet or text); time, stretch, stress -> elastomer", recognises, read)
