"""What a raw file format is: a name, a sentence, a way to recognise it, and a way to read it."""

from collections.abc import Callable
from dataclasses import dataclass

from ..recordings import Recording
from .options import Options
from .parts import Sample


@dataclass(frozen=True)
class Format:
    """One shape of raw file.

    Attributes:
        name: what `--format` calls it.
        about: one line: what such a file holds and what becomes of it.
        recognises: whether a file looks like it, by content alone.
        read: makes the recording, or raises InputError with a sentence that says why it cannot be one.
        fallback: only tried where no other format recognises the file.
        refuses: whether reading always ends in a sentence that says what the file is.
    """

    name: str
    about: str
    recognises: Callable[[Sample], bool]
    read: Callable[[Sample, Options], Recording]
    fallback: bool = False
    refuses: bool = False
