"""Names of files that replace no other, and whether a folder for results can be written."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

from pneusma_jax.errors import InputError


def check_folder(path: str | Path) -> None:
    """Refuse a path where no folder can be made, before any computation.

    A file without a name is made to find that out. A disk may refuse what its modes allow.

    Args:
        path: folder for results, which need not exist.

    Raises:
        InputError: if a file is in its place, or nothing can be written there.
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


def distinct_names(names: Iterable[str]) -> list[str]:
    """Names of files that do not replace each other: with a number where an earlier one has the name.

    Capitals are not told from small letters, as some file systems do not.

    Args:
        names: wanted names, without the ends of files.
    """
    used: set[str] = set()
    found = []
    for name in names:
        distinct, number = name, 1
        while distinct.casefold() in used:
            number += 1
            distinct = f"{name}_{number}"
        used.add(distinct.casefold())
        found.append(distinct)
    return found
