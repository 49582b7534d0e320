"""Folders and files that tasks are about: names of their own, and digests of their content."""

import hashlib
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

from pneusma_jax.errors import InputError


def unique_names(paths: Sequence[Path]) -> list[str]:
    """A name for each folder or file: its own, with a number where another one had it before.

    Raises:
        InputError: if one is named twice: its data would count twice.
    """
    names: list[str] = []
    for number, path in enumerate(paths):
        if path.resolve() in [other.resolve() for other in paths[:number]]:
            raise InputError(f"{path}: this campaign is named twice")
        own = path.resolve().stem if path.is_file() else path.resolve().name
        count = sum(known == own or known.rpartition("_")[0] == own for known in names)
        names.append(own if not count else f"{own}_{count + 1}")
    return names


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
