"""Assumptions about the specimens of a campaign: the source's nominal values stand for what it does not
state."""

from collections.abc import Sequence

from fitting.data.recordings import Recording
from fitting.inference.notes import of_several
from fitting.inference.readings import cautions
from fitting.specimens.reduction import said
from fitting.specimens.rows import MOST_ROWS

SILENT = ("prestrain", "cycles_before", "attached_length_mm", "free_length_mm", "orientation")
"""Keys whose nominal value says that nothing is special, or follows from others."""
NEW = {
    "alloy": 'for an alloy of your own write alloy = "fit", or the name of its table',
    "material": "for a silicone of your own write the name of its table",
}


def notices_of(recordings: Sequence[Recording], most: int = MOST_ROWS) -> list[str]:
    """Cautions: assumptions, rows that are no measurements, recordings that were reduced, and the notices of
    each reading.

    Args:
        recordings: the recordings as read.
        most: rows that were taken of each.
    """
    own = [f"{r.name}: {notice}" for r in recordings for notice in r.notices]
    notes = [*assumed(recordings), *cautions(recordings), *said(recordings, most), *own]
    return of_several(notes, [recording.name for recording in recordings])


def assumed(recordings: Sequence[Recording]) -> list[str]:
    """A sentence where recordings leave out what their specimens are; nothing where all is stated.

    A `design` states everything that its table holds.
    """
    missing: dict[str, str] = {}
    silent = []
    for recording in recordings:
        if "design" in recording.geometry:
            continue
        nominal = recording.full_geometry()
        left = [key for key in nominal if key not in recording.geometry and key not in SILENT]
        missing |= {key: str(nominal[key]) for key in left}
        silent += [recording.name] if left else []
    if not missing:
        return []
    taken = ", ".join(f"{key} = {value}" for key, value in missing.items())
    hints = "".join(f"; {hint}" for key, hint in NEW.items() if key in missing)
    return [f"{', '.join(silent)}: not stated in [geometry], so the source's are taken: {taken}{hints}"]
