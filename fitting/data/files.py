"""Folders for results, and files that are written whole or not at all."""

import tempfile
from pathlib import Path

from pneusma_jax.errors import InputError
from pneusma_jax.files import write_whole

__all__ = ["check_folder", "write_whole"]


def check_folder(path: str | Path) -> None:
    """Refuse a path where no folder can be made, before any computation.

    Raises:
        InputError: if a file is in its place, or nothing can be written there. To find out, a file without
            name is made: what a system allows by its modes, a disk may refuse.
    """
    for place in (Path(path), *Path(path).absolute().parents):
        if place.exists():
            if not place.is_dir():
                raise InputError(f"{place}: this is a file, but a folder for results is needed")
            try:
                tempfile.TemporaryFile(dir=place).close()
            except OSError as error:
                why = (error.strerror or str(error)).lower()
                raise InputError(f"{path}: results cannot be written here ({place}: {why})") from None
            return
