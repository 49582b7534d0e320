"""Questions to ask of recordings as they are read: about unseen heat and about copies."""

import re
from collections.abc import Iterable, Sequence

import numpy as np

from . import schema
from .recording import Recording


def ask(recording: Recording, question: str) -> None:
    """Add a question to the notices of a recording, once."""
    if question not in recording.notices:
        recording.notices.append(question)


HEATING_A = 0.02
"""Minimum current of a spring that counts as heated [A]. In still air it warms a wire of 0.25 mm by 0.1 K and
one of 0.1 mm by 2 K, with the constants of the shipped alloys. A current sensor's zero is smaller."""
_OF_SPRING = re.compile(r"current(?P<number>_\d+)?_")


def heated_unseen(recording: Recording) -> list[str]:
    """Questions about springs that carry a current, and whose resistance the recording does not have."""
    found = []
    for name in recording.known_columns:
        spring = _OF_SPRING.match(name)
        if spring is None or recording.has(f"resistance{spring['number'] or ''}"):
            continue
        if np.nanmax(np.abs(recording.si(name)), initial=0.0) <= HEATING_A:
            continue
        number = (spring["number"] or "").replace("_", " ")
        taken = "it is taken as cold" if number else (
            "its phase follows from the temperature, or is taken as cold beside tests with a resistance"
        )
        whose = f"spring{number}" if number else "the spring"
        found.append(
            f"check: {whose} carries a current, but its resistance was not recorded: {taken}"
        )
    return found


def ask_about_copies(recordings: Sequence[Recording]) -> None:
    """Ask about recordings that hold the same numbers in the same columns as an earlier one."""
    first: dict[tuple, Recording] = {}
    for recording in recordings:
        names = sorted(recording.known_columns)
        key = (recording.kind, *((name, recording.columns[name].tobytes()) for name in names))
        other = first.setdefault(key, recording)
        if other is not recording:
            question = (
                f"check: it holds the same numbers as {other.name!r}: is it a copy? Then leave it out, or"
                " every reading counts twice"
            )
            ask(recording, question)


def notices_of_reading(recordings: Iterable[Recording]) -> list[str]:
    """Notices and questions of each recording after its name. One that was made in memory is asked, too."""
    return [
        f"{recording.name}: {notice}"
        for recording in recordings
        for notice in dict.fromkeys([*recording.notices, *heated_unseen(recording)])
    ]


def questions_of_reading(recordings: Iterable[Recording]) -> list[str]:
    """Those of `notices_of_reading` that ask to check something, or name a column that is not used."""
    told = notices_of_reading(recordings)
    return [notice for notice in told if ": check: " in notice or notice.endswith(schema.IGNORED)]
