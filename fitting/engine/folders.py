"""Folders and files that tasks are about: names of their own, and digests of their content."""

import hashlib
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

from fitting.data.files import distinct_names
from pneusma_jax.errors import InputError


def unique_names(paths: Sequence[Path]) -> list[str]:
    """A name for each folder or file: its own, with a number where another one had it before, see
    `distinct_names`.

    Raises:
        InputError: if one is named twice: its data would count twice.
    """
    places = [path.resolve() for path in paths]
    for number, (path, place) in enumerate(zip(paths, places, strict=True)):
        if place in places[:number]:
            raise InputError(f"{path}: this campaign is named twice")
    return distinct_names([place.stem if place.is_file() else place.name for place in places])


def digest(paths: Iterable[Path], *of: object) -> str:
    """Sixteen hexadecimal digits that change with the files, with `of`, and with the program's version.

    Args:
        paths: a folder stands for all files in it, a CSV for itself and the TOML files beside it.
        of: options, told apart by how they are written.
    """
    found = hashlib.sha256(repr((version("pneusma-jax"), *of)).encode())
    for path in paths:
        beside = sorted(path.parent.glob("*.toml")) if path.suffix.lower() == ".csv" else []
        files = [path, *beside] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
        for file in files:
            found.update(file.name.encode() + file.read_bytes())
    return found.hexdigest()[:16]
