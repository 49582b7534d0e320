"""Files that are on disk whole or not at all: the one way in which this project writes."""

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError

DRAFT = ".part"
"""Ending of files that are being written; a killed run may leave one."""


@contextmanager
def _drafted(path: Path) -> Iterator[Path]:
    """A draft beside a file, which takes the file's name when the block ends without an error."""
    draft = path.with_name(f".{path.name}.{uuid.uuid4().hex}{DRAFT}")
    try:
        yield draft
        os.replace(draft, path)
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A draft beside a file, which takes the file's name when the block ends without an error.

    After an error the draft is gone and the file is what it was.

    Args:
        path: the file; its folder must be there.

    Raises:
        InputError: if the place cannot be written.
    """
    path = Path(path)
    try:
        with _drafted(path) as draft:
            yield draft
    except OSError as error:
        raise InputError(f"{path}: cannot be written here ({error.strerror or error})") from None


def write_durably(path: Path, content: bytes) -> None:
    """Write or replace a file as `write_whole` does; it is on the disk when this returns.

    Raises:
        OSError: if the disk refuses; no part of the file is left.
    """
    with _drafted(path) as draft, open(draft, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def write_whole(path: str | Path, content: str | bytes) -> Path:
    """Write or replace a file through a draft beside it; text is written as UTF-8.

    Raises:
        InputError: if the place cannot be written.
    """
    path = Path(path)
    with replacing(path) as draft:
        draft.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
