"""Formats that are recognised but that no kind of recording can hold, each with a description and advice."""

from collections.abc import Callable

import numpy as np

from ..recordings import Recording
from ..recordings.table import unusable
from .format import Format
from .options import Options
from .parts import Sample

SCAN_LINES = 80
"""Number of first lines of a calorimeter's file among which its headings are looked for. In an export of
Pyris they are in line 47, below a preamble that differs with the method."""
PROPORTIONAL = 1e-3
"""Maximum deviation of a column from a multiple of another one, over its largest number [1]. Rounding
to four digits changes it by at most half of that."""
TINY = 1e-300
"""Least sum of squares that a column is divided by, so that a column of zeros causes no division by zero."""


def _refused(name: str, recognises: Callable[[Sample], bool], what: str, advice: str) -> Format:
    """A format whose files are refused.

    Args:
        name: name of the format.
        recognises: true for a test that is of this format.
        what: what such a file is, for the message and for lists; a sentence without full stop.
        advice: what to do instead, likewise.
    """

    def read(sample: Sample, options: Options) -> Recording:
        raise unusable(sample.raw.path, f"{what}; {advice}")

    return Format(name, what, recognises, read, refuses=True)


def _is_fluke(sample: Sample) -> bool:
    """True for a log of a multimeter of the make Fluke."""
    return sample.head.startswith("FLUKE") and "Reading,Sample" in sample.head


def _is_dsc(sample: Sample) -> bool:
    """True for a scan of a calorimeter, by words at the start of the test's own sheet."""
    pages = sample.raw.pages
    own = next((page for page in pages if page.name == sample.sheet), pages[0])
    start = own.head(SCAN_LINES)
    return "Sample Weight:" in start and any(word in start for word in ("Heat Flow", "Pyris", "DSC"))


def _is_shear_relaxation(sample: Sample) -> bool:
    """True for five columns without headings: clock, load, displacement, stress and shear strain.

    The stress is a multiple of the load, and the shear strain one of the displacement.
    """
    if not sample.headerless(5) or not np.isfinite(sample.grid.values).all():
        return False
    time, load, displacement, stress, strain = sample.grid.values.T

    def proportional(a: np.ndarray, b: np.ndarray) -> bool:
        """True if b is a multiple of a, fitted by least squares."""
        scale = float(a @ b) / max(float(a @ a), TINY)
        return bool(np.abs(b - scale * a).max() <= PROPORTIONAL * np.abs(b).max())

    rises = bool((np.diff(time) >= 0.0).all())
    return rises and proportional(load, stress) and proportional(displacement, strain)


def _is_bending_actuators(sample: Sample) -> bool:
    """True for published angles of markers on bending actuators, by the headings of the first columns."""
    first = sample.head.partition("\n")[0].lower()
    return first.startswith("configuration,pressure,theta1")


def _is_single_column(sample: Sample) -> bool:
    """True for one column of numbers without a heading."""
    return sample.headerless(1)


FLUKE = _refused(
    "fluke-log",
    _is_fluke,
    "this is a multimeter's temperature log: temperature over time, no stress and no strain",
    "it cannot be a recording by itself. Add its temperatures as a column of the test that they belong to",
)
DSC = _refused(
    "dsc",
    _is_dsc,
    "this is a calorimeter scan (DSC): heat flow over temperature, no stress and no strain",
    "read T_mid and T_width off it and put them into the alloy's TOML",
)
SHEAR = _refused(
    "shear-relaxation",
    _is_shear_relaxation,
    "this is simple shear (time, load, displacement, stress, shear strain)",
    "an elastomer recording is uniaxial, and shear is not a kind that the format has",
)
BENDING = _refused(
    "bending-actuators",
    _is_bending_actuators,
    "these are marker angles of bending actuators with strain-limiting layers, over a pressure without unit"
    " or clock",
    "the actuator of the base model is a tube with springs, so they cannot be fitted here",
)
SINGLE = _refused(
    "single-column",
    _is_single_column,
    "this is one column of numbers",
    "put stress and stretch side by side in one file first, e.g. with"
    " `paste stress.txt stretch.txt > both.txt`",
)
FORMATS = (FLUKE, DSC, SHEAR, BENDING, SINGLE)
