"""The interface of a raw file format: a name, a description, a recogniser and a reader."""

from collections.abc import Callable
from dataclasses import dataclass

from ..recordings import Recording
from .options import Options
from .parts import Sample


@dataclass(frozen=True)
class Format:
    """One raw file format.

    Attributes:
        name: name for `--format`.
        about: one line with the content of such a file and its result; what the file is if it is refused.
        recognises: function that is true for files of this format, by content alone.
        read: function that makes the recording, or raises InputError with the reason why the file cannot be
            one.
        fallback: true if it is only tried where no other format recognises the file.
        refuses: true if reading always ends in an error that describes the file.
    """

    name: str
    about: str
    recognises: Callable[[Sample], bool]
    read: Callable[[Sample, Options], Recording]
    fallback: bool = False
    refuses: bool = False
