"""Checks of a recording: what is impossible is refused, what is unusual is asked about."""

from collections.abc import Sequence
from pathlib import Path

from .column_ranges import check_missing, check_ranges, check_time
from .named_tables import check_table_names
from .questions import ask, heated_unseen
from .recording import Recording
from .size_limits import check_against_sizes, check_resistance, check_tube
from .unusual import ask_about_magnitudes, ask_about_noise, ask_about_sizes, check_kelvin


def check_recording(
    recording: Recording, rows: Sequence[int] | None = None, sidecar: Path | str | None = None
) -> None:
    """Refuse impossible values.

    Args:
        recording: recording with columns in canonical units.
        rows: line number in the file of each sample; None counts samples from 1.
        sidecar: file that messages about settings name; None for the recording's own.

    Raises:
        InputError: at the first impossible sample or setting, in one line.
    """
    place = recording.path or recording.name
    rows = rows if rows is not None else range(1, len(recording) + 1)
    where = sidecar or place
    ask_about_sizes(recording)
    ask_about_noise(recording)
    check_tube(recording, where)
    check_table_names(recording, where)
    check_missing(recording, place, rows)
    check_time(recording, place, rows)
    check_ranges(recording, place, rows)
    check_kelvin(recording, place)
    check_resistance(recording, place, rows)
    check_against_sizes(recording, place, rows)
    ask_about_magnitudes(recording)
    for question in heated_unseen(recording):
        ask(recording, question)
