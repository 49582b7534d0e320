"""Displacement of a machine whose file has a clock, and whose speed the user states (`--speed`).

Speed times time is the displacement of one ramp at constant speed. Of holds, returns and slow starts it is
wrong, so the import always asks about them. A speed that a line of the file states is never taken by itself,
since a machine may state several. It is named, and compared with the option.
"""

import math
import re
from dataclasses import replace

import numpy as np

from ..recordings.table import unusable
from .channels import in_unit
from .making import Channel
from .numerals import to_number
from .options import Options, speed_of
from .parts import Sample
from .sizes import filled_cells

OTHERS = ("elongation", "strain", "stretch", "true_strain", "length")
"""Quantities beside which no displacement is made."""
SPEED_TOLERANCE = 0.01
"""Maximum relative difference of two speeds that count as one: what rounding to three digits makes."""
_UNIT = r"(?P<length>[^\W\d_]+)\s*/\s*(?P<time>[^\W\d_]+)"
_NUMBER = r"(?P<number>\d[\d.,]*(?:[eE][+-]?\d+)?)"
_STATED = (
    re.compile(rf"(?<![\w.,]){_NUMBER}\s*[(\[]?\s*{_UNIT}(?![\w²^/])"),
    re.compile(rf"[(\[]\s*{_UNIT}\s*[)\]]\s*[:=]?\s*{_NUMBER}\s*$"),
)
"""A speed in a line of text: `500 mm/min`, and `Speed [mm/min] 500`."""


def with_displacement(
    channels: dict[str, Channel], sample: Sample, options: Options, notices: list[str]
) -> dict[str, Channel]:
    """The channels with the displacement that the stated speed makes; as they are without one.

    Raises:
        InputError: if the file has a displacement of its own or no clock, or if its clock does not rise.
    """
    if options.speed is None:
        return channels
    speed, words = options.speed
    place, option = sample.raw.path, f"--speed {words}"
    if own := next((channels[name] for name in OTHERS if name in channels), None):
        raise unusable(place, f"{option}: the file has {own.label!r} of its own; leave the option out")
    if "elongation" in {*options.units, *options.scales, *options.subtracted}:
        raise unusable(place, f"{option}: it makes the elongation in mm; state the right speed instead")
    time = _time(channels, sample, options, option)
    known = np.flatnonzero(np.isfinite(time))
    stands = np.flatnonzero(np.diff(time[known]) <= 0.0)
    if stands.size:
        row = sample.require_grid().rows[int(known[stands[0] + 1])]
        raise unusable(
            place, f"row {row}: the clock stands still or goes back, and {option} makes one displacement of"
            " each time; write times that rise, or keep one ramp with --rows",
        )  # fmt: skip
    if contradiction := _contradiction(speed, words, stated_speeds(sample)):
        notices.append(f"check: {contradiction}")
    values = 1e3 * speed * (time - time[known[0]])
    notices.append(f"check: {_asked(values, channels, sample, words)}")
    made = f"{words} (--speed) times the time since the first row"
    return {**channels, "elongation": Channel(values, "mm", option, made=made)}


def stated_speeds(sample: Sample) -> list[tuple[float, str, str]]:
    """Speeds that lines around the table state: in m/s, as the option writes it, and the line."""
    grid = sample.require_grid()
    found = []
    for row in (*grid.preamble, *grid.below, *sample.elsewhere):
        line = " ".join(filled_cells(row))
        for read in (match for pattern in _STATED for match in pattern.finditer(line)):
            numbers = (to_number(read["number"], mark) for mark in (grid.decimal, ".", ","))
            number = next(filter(None, numbers), 0.0)
            value = speed_of(number, read["length"], read["time"])
            if math.isfinite(value) and value > 0.0:
                found.append((value, f"{number:.6g}{read['length']}/{read['time']}", line))
    return found


def _contradiction(speed: float, words: str, stated: list[tuple[float, str, str]]) -> str:
    """Question about a speed that no line of the file states; empty where one does or none has any."""
    if not stated or any(abs(speed - value) <= SPEED_TOLERANCE * value for value, _, _ in stated):
        return ""
    lines = " and ".join(repr(line) for line in dict.fromkeys(line for _, _, line in stated))
    return f"--speed {words} is taken, but the file states {lines}. Which one is right?"


def _time(channels: dict[str, Channel], sample: Sample, options: Options, option: str) -> np.ndarray:
    """Times of the rows [s]."""
    if "time" not in channels:
        if options.interval_s is None:
            raise unusable(
                sample.raw.path, f"{option}: the file has no clock, which the displacement is made of; name"
                " its column with --map time=..., or state --interval",
            )  # fmt: skip
        return options.interval_s * np.arange(len(sample.require_grid().rows))
    channel = channels["time"]
    stated = replace(channel, unit=options.units.get("time", channel.unit))
    time = options.scales.get("time", 1.0) * in_unit(stated, "s", "time", sample.raw.path)
    if not np.isfinite(time).any():
        raise unusable(sample.raw.path, f"{option}: no number stands in {channel.label!r}")
    return time


def _asked(values: np.ndarray, channels: dict[str, Channel], sample: Sample, words: str) -> str:
    """Question about all that speed times time gets wrong, with the place of the largest load."""
    rows = sample.require_grid().rows
    load = channels.get("force") or channels.get("stress")
    largest = ""
    if load is not None and np.isfinite(load.values).any():
        peak = rows[int(np.nanargmax(np.abs(load.values)))]
        largest = f" {load.label!r} is largest in row {peak} of {rows[0]} to {rows[-1]}."
    return (
        f"the elongation is {words} times the time, 0 to {np.nanmax(values):.4g} mm. That holds for one ramp"
        f" at constant speed from the first row on.{largest} Rows of a hold, a return or a wait have to be"
        " left out with --rows"
    )
