"""Values that are impossible in any recording with such a column, and gaps in columns."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from . import schema
from .impossible import refuse_first
from .recording import Recording
from .table import unusable

PRESSURE_LIMIT_KPA = 1000.0
"""Maximum pressure; a silicone tube bursts far below, so more is a pressure in the wrong unit."""
VACUUM_KPA = -102.0  # Minimum gauge pressure: just below perfect vacuum, to allow a sensor's zero error
ABSOLUTE_ZERO_DEGC = -273.15
OVERLOAD = 1e30
"""Least number that is no reading: instruments write 9.9e37 for none, in whatever unit the column has."""


def check_missing(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse columns and rows without a value."""
    columns = recording.known_columns
    gone = np.stack([np.isnan(recording.columns[name]) for name in columns])
    for name, column in zip(columns, gone, strict=True):
        if column.all():
            raise unusable(place, "no row has a value here; remove the column or fill it in", column=name)
    empty = np.flatnonzero(gone.all(axis=0))
    if empty.size:
        raise unusable(place, "every field is empty; remove the row", rows[int(empty[0])])


def check_time(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse a clock with gaps, or one that goes backwards."""
    if "time_s" not in recording.columns:
        return
    time = recording.columns["time_s"]
    unknown = np.flatnonzero(np.isnan(time))
    if unknown.size:
        raise unusable(place, "the time is missing; every row needs one", rows[int(unknown[0])], "time_s")
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        i = int(back[0]) + 1
        what = (
            f"time goes backwards, {time[i]:g} s after {time[i - 1]:g} s; rows must be in the order of time"
        )
        raise unusable(place, what, rows[i], "time_s")


# For recordings of every kind; `Kind.ranges` has those of one.
_RULES: tuple[schema.Rule, ...] = (
    (
        "pressure",
        lambda kilopascal: (kilopascal < VACUUM_KPA) | (kilopascal > PRESSURE_LIMIT_KPA),
        f"gauge pressure must lie in {VACUUM_KPA:g} to {PRESSURE_LIMIT_KPA:g} kPa; is the unit right?",
    ),
    (
        "temperature",
        lambda celsius: celsius < ABSOLUTE_ZERO_DEGC,
        "this is below absolute zero; is the unit right?",
    ),
    (
        "length",
        lambda length: length <= 0.0,
        "a length must be more than 0; to a change of length add that at rest (on import, for 56 mm:"
        " --subtract length_mm=-56)",
    ),
    ("resistance", lambda ohm: ohm <= 0.0, "a resistance must be more than 0"),
    ("setpoint", lambda ohm: ohm <= 0.0, "a resistance must be more than 0"),
    ("cycle", lambda count: count < 0.0, "a count of cycles must be 0 or more"),
)


def check_ranges(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse values that the rules of all kinds, or of the recording's kind, exclude."""
    for name in recording.known_columns:
        values = recording.columns[name]
        right = "an instrument writes it for no reading; leave the field empty"
        refuse_first(np.abs(values) >= OVERLOAD, recording, right, place, rows, name)
    for word, wrong, right in (*_RULES, *schema.KINDS[recording.kind].ranges):
        for name in (name for name in recording.known_columns if name.startswith(word)):
            refuse_first(wrong(recording.columns[name]), recording, right, place, rows, name)
