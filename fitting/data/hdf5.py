"""Access to HDF5 files, in which every fault of a file ends in one line.

The HDF5 library may end the process, or read without end, where the structure of a file is damaged. A file
with a digest is checked before. A file without one is first read to its end by a process of its own.
"""

import functools
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneusma_jax.errors import InputError, reason_of
from pneusma_jax.late import Late

from .first_reading import fault_of_reading
from .sealed import check_seal, remains

h5py = Late("h5py")

CAUTION = "caution"
"""Attribute of a posterior's file: what its draws do not count, in sentences."""
UNCOUNTED = "its draws do not count all that they may be wrong by"
"""Words after the name of such a file. A zero that drifts widens intervals; it makes no number wrong."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HEAD = 64
"""Number of bytes of a file that hold its size, in any version of the format."""
_SIZE_OF_ADDRESS, _FIRST_ADDRESS = {0: 13, 1: 13, 2: 9, 3: 9}, {0: 24, 1: 28, 2: 12, 3: 12}
"""Places of the size of addresses and of the first address, by the version of the superblock (section II.A of
the HDF5 File Format Specification)."""


@contextmanager
def opened(source: Path | bytes, name: str, what: str, more: str = "") -> Iterator[Any]:
    """An HDF5 file, open for reading. Every fault of it raises an error of one line.

    Args:
        source: path of the file, or its bytes.
        name: name of the file in messages.
        what: required content, such as `a chain`.
        more: remedy for a wrong file.

    Raises:
        FileNotFoundError: if there is no such file.
        InputError: if it is damaged, or reading it fails in any way inside of the `with` block.
    """
    try:
        if not check_seal(source, name):
            if fault := _wrong_size(source) or _fault(source):
                raise InputError(f"{name}: cannot be read as {what} ({fault}){more}")
        with h5py.File(io.BytesIO(source) if isinstance(source, bytes) else source, "r") as file:
            yield file
    except (InputError, FileNotFoundError):
        raise
    except Exception as error:  # h5py raises a dozen types for damaged files
        raise InputError(f"{name}: cannot be read as {what} ({reason_of(error)}){more}") from None


def caution_of(file: Any) -> str:
    """What the draws of a posterior do not count, in sentences; empty where they count everything."""
    return str(file.attrs.get(CAUTION, ""))


def uncounted(path: Path | str, caution: str) -> str:
    """Sentences on the draws of a posterior's file, by its name and what it says of them."""
    return f"{path}: {UNCOUNTED}. {caution}"


def _wrong_size(source: Path | bytes) -> str:
    """Words about a file that is longer or shorter than it states; empty for others."""
    with io.BytesIO(source) if isinstance(source, bytes) else open(source, "rb") as file:
        head = file.read(_HEAD)
        size = file.seek(0, io.SEEK_END)
    end = _stated_size(head)
    if end is None or size == end:
        return ""
    return remains(size - end) if size > end else f"damaged, {size} bytes where it states {end}"


def _stated_size(head: bytes) -> int | None:
    """Size that the beginning of a file states [B]; None where it is no usual HDF5 file."""
    if len(head) < _HEAD or not head.startswith(SIGNATURE) or head[8] not in _FIRST_ADDRESS:
        return None
    size, first = head[_SIZE_OF_ADDRESS[head[8]]], _FIRST_ADDRESS[head[8]]
    base, _, end = (
        int.from_bytes(head[first + k * size : first + (k + 1) * size], "little") for k in range(3)
    )
    return end if size in (4, 8) and base == 0 else None


def _fault(source: Path | bytes) -> str:
    """Reason why a file without a digest cannot be read in this process; empty if it can."""
    if isinstance(source, bytes):
        return fault_of_reading("hdf5", source)
    state = Path(source).stat()
    return _fault_in(str(source), state.st_size, state.st_mtime_ns)


@functools.lru_cache(maxsize=64)
def _fault_in(path: str, size: int, changed: int) -> str:
    """The same of a file on disk. A command opens a file several times, but it is looked at once."""
    return fault_of_reading("hdf5", Path(path))
