"""Binary files with a digest after their content, which reveals damage.

Libraries that read HDF5 and pickled files accept a flipped bit in a column of numbers. Such a library may
even end the process where the structure is damaged, so the digest is compared before. Readers of HDF5 and of
pickled objects ignore bytes after the content, so other software opens these files as usual. Software that
changes a file in place cuts the digest off. A file without a digest is read without a check of its
content. Its reader knows where the content ends, and refuses other bytes behind it: a damaged digest.
"""

import hashlib
import io
from pathlib import Path

from pneusma_jax.errors import InputError, counted

MARK = b"\npneusma sha256 "
"""Separator between the content and its digest."""
SEAL = len(MARK) + 64
"""Number of bytes after the content."""
BLOCK = 2**20
"""Number of bytes that are read at a time."""


def sealed(content: bytes) -> bytes:
    """Content with its digest after it."""
    return content + MARK + hashlib.sha256(content).hexdigest().encode()


def check_seal(source: Path | bytes, name: str) -> bool:
    """Refuse a file whose content does not match its digest.

    Returns:
        True if it has a digest, false for a file without one.

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
            return False
        file.seek(size)
        mark, stated = file.read(len(MARK)), file.read()
        if mark != MARK:
            return False
        file.seek(0)
        found = hashlib.sha256()
        while size > 0:
            block = file.read(min(BLOCK, size))
            found.update(block)
            size -= len(block)
    if found.hexdigest().encode() != stated:
        raise InputError(f"{name}: damaged or altered (its content does not have the digest that it states)")
    return True


def remains(count: int) -> str:
    """Words about a file without a digest that has other bytes behind its content, such as a damaged digest.

    Args:
        count: number of these bytes.
    """
    found = counted(count, "byte that is no digest follows", "bytes that are no digest follow")
    return f"damaged or altered, {found} its content"
