"""Folders for results, names of files, and files that are written whole or not at all."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

from pneusma_jax.errors import InputError
from pneusma_jax.files import write_whole

__all__ = ["check_folder", "names_apart", "write_whole"]


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


def names_apart(names: Iterable[str]) -> list[str]:
    """Names of files that do not replace each other: with a number where an earlier one has the name.

    Names that differ in capitals alone are one file where a file system does not tell capitals.
    """
    used: set[str] = set()
    found = []
    for name in names:
        own, number = name, 1
        while own.casefold() in used:
            number += 1
            own = f"{name}_{number}"
        used.add(own.casefold())
        found.append(own)
    return found
