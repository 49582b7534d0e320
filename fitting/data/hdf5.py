"""Access to HDF5 files, in which every fault of a file ends in one line."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from pneusma_jax.errors import InputError

from .sealed import check_seal


@contextmanager
def opened(source: Path | bytes, name: str, what: str, more: str = "") -> Iterator[h5py.File]:
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
        check_seal(source, name)
        with h5py.File(io.BytesIO(source) if isinstance(source, bytes) else source, "r") as file:
            yield file
    except (InputError, FileNotFoundError):
        raise
    except Exception as error:  # h5py raises a dozen types for damaged files
        words = " ".join(str(error).split())[:200]
        raise InputError(f"{name}: cannot be read as {what} ({words}){more}") from None
