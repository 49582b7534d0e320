"""Binary files with a digest after their content, which reveals damage.

Libraries that read HDF5 and pickled files accept a flipped bit in a column of numbers. Such a library may
even end the process where the structure is damaged, so the digest is compared before. Readers of HDF5 and of
pickled objects ignore bytes after the content, so other software opens these files as usual. Software that
changes a file in place cuts the digest off. A file without a digest is read without a check.
"""

import hashlib
import io
from pathlib import Path

from pneusma_jax.errors import InputError

MARK = b"\npneusma sha256 "
"""Separator between the content and its digest."""
SEAL = len(MARK) + 64
"""Number of bytes after the content."""
BLOCK = 2**20
"""Number of bytes that are read at a time."""


def sealed(content: bytes) -> bytes:
    """Content with its digest after it."""
    return content + MARK + hashlib.sha256(content).hexdigest().encode()


def check_seal(source: Path | bytes, name: str) -> None:
    """Refuse a file whose content does not match its digest.

    Args:
        source: path of the file, or its bytes.
        name: name of the file in the message.

    Raises:
        InputError: if the file was damaged or altered.
        OSError: if it cannot be read.
    """
    with io.BytesIO(source) if isinstance(source, bytes) else open(source, "rb") as file:
        size = file.seek(0, io.SEEK_END) - SEAL
        if size < 0:
            return
        file.seek(size)
        mark, stated = file.read(len(MARK)), file.read()
        if mark != MARK:
            return
        file.seek(0)
        found = hashlib.sha256()
        while size > 0:
            block = file.read(min(BLOCK, size))
            found.update(block)
            size -= len(block)
    if found.hexdigest().encode() != stated:
        raise InputError(f"{name}: damaged or altered (its content does not have the digest that it states)")
