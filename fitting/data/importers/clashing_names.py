"""Names of recordings from several files, which are told apart."""

from collections.abc import Sequence
from pathlib import Path

from ..files import distinct_names
from ..recordings import Recording
from ..recordings.table import unusable
from .names import slug


def refuse_twice(paths: Sequence[Path]) -> None:
    """Refuse a file that is given twice."""
    places = [path.resolve() for path in paths]
    for number, (path, place) in enumerate(zip(paths, places, strict=True)):
        if place in places[:number]:
            raise unusable(path, "this file is given twice")


def separate_names(recordings: list[Recording]) -> None:
    """Prefix names that would clash with as many of their folders as it takes; number those of one folder.

    Names that differ in capitals alone clash, too: they are one file where a file system does not tell them.
    """
    for depth in range(1, 6):
        clashing = [one for one in recordings if any(_clash(one, other) for other in recordings)]
        for recording in clashing:
            parts = recording.path.resolve().with_suffix("").parts
            recording.name = slug("_".join([*parts[-1 - depth :], str(recording.source.get("raw_part", ""))]))
    for recording, name in zip(recordings, distinct_names([one.name for one in recordings]), strict=True):
        recording.name = name


def _clash(one: Recording, other: Recording) -> bool:
    """True if recordings from different folders have one name."""
    if one.name.casefold() != other.name.casefold():
        return False
    return one.path.resolve().parent != other.path.resolve().parent
