"""Formats that are recognised but that no kind of recording can hold, each with a description and advice."""

from collections.abc import Callable

import numpy as np

from ..recordings import Recording, schema
from ..recordings.table import refuse
from .channels import named_channels
from .format import Format
from .options import Options
from .parts import Sample


def _refused(name: str, recognises: Callable[[Sample], bool], sentence: str) -> Format:
    def read(sample: Sample, options: Options) -> Recording:
        raise refuse(sample.raw.path, sentence)

    return Format(name, f"refused: {sentence.partition(';')[0]}", recognises, read, refuses=True)


def _is_fluke(sample: Sample) -> bool:
    return sample.head.startswith("FLUKE") and "Reading,Sample" in sample.head


def _is_dsc(sample: Sample) -> bool:
    head = sample.raw.pages[0].head(80)
    return "Sample Weight:" in head and ("Heat Flow" in head or "Pyris" in head or "DSC" in head)


def _is_shear_relaxation(sample: Sample) -> bool:
    """True for five columns: clock, load, displacement, stress (multiple of load), shear strain (of
    displacement)."""
    if not sample.headerless(5) or not np.isfinite(sample.grid.values).all():
        return False
    time, load, shift, stress, strain = sample.grid.values.T

    def proportional(a: np.ndarray, b: np.ndarray) -> bool:
        scale = float(a @ b) / max(float(a @ a), 1e-300)
        return bool(np.abs(b - scale * a).max() <= 1e-3 * np.abs(b).max())

    return bool((np.diff(time) >= 0.0).all() and proportional(load, stress) and proportional(shift, strain))


def _is_bending_actuators(sample: Sample) -> bool:
    first = sample.head.partition("\n")[0].lower()
    return first.startswith("configuration,pressure,theta1")


def _is_single_column(sample: Sample) -> bool:
    return sample.headerless(1)


def _is_recording(sample: Sample) -> bool:
    """True for a header of canonical names with every required column of some kind, and no other clock."""
    if sample.raw.is_workbook or sample.grid is None:
        return False
    clock = named_channels(sample.grid).get("time")
    if clock is not None and not clock.label.startswith("time_"):
        return False
    lines = (line for page in sample.raw.pages for line in page.lines)
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    header = {name.strip() for name in first.split(",")}
    return any(set(kind.columns.required) <= header for kind in schema.KINDS.values())


FLUKE = _refused(
    "fluke-log",
    _is_fluke,
    "this is a multimeter's temperature log: temperature over time, no stress and no strain; it cannot be a"
    " recording by itself. Add its temperatures as a column of the test that they belong to",
)
DSC = _refused(
    "dsc",
    _is_dsc,
    "this is a calorimeter scan (DSC): heat flow over temperature, no stress and no strain; read T_mid and"
    " T_width off it and put them into the alloy's TOML",
)
SHEAR = _refused(
    "shear-relaxation",
    _is_shear_relaxation,
    "this is simple shear (time, load, displacement, stress, shear strain); an elastomer recording is"
    " uniaxial, and shear is not a kind that the format has",
)
BENDING = _refused(
    "bending-actuators",
    _is_bending_actuators,
    "these are marker angles of bending actuators with strain-limiting layers, over a pressure without unit"
    " or clock; the actuator of the base model is a tube with springs, so they cannot be fitted here",
)
SINGLE = _refused(
    "single-column",
    _is_single_column,
    "this is one column of numbers; put stress and stretch side by side in one file first, e.g. with"
    " `paste stress.txt stretch.txt > both.txt`",
)
RECORDING = _refused(
    "recording",
    _is_recording,
    "this already is in the recording format; it can be used as it is (options that mend it, such as"
    " --compression or"
    " --slack auto, are applied if stated)",
)
FORMATS = (FLUKE, DSC, SHEAR, BENDING, SINGLE, RECORDING)
