"""Folders for results, and files that are written whole or not at all."""

from pathlib import Path

from pneusma_jax.errors import InputError
from pneusma_jax.files import write_whole

__all__ = ["check_folder", "write_whole"]


def check_folder(path: str | Path) -> None:
    """Refuse a path where no folder can be made, before any computation.

    Raises:
        InputError: if a file is in its place.
    """
    for place in (Path(path), *Path(path).parents):
        if place.exists():
            if not place.is_dir():
                raise InputError(f"{place}: this is a file, but a folder for results is needed")
            return
