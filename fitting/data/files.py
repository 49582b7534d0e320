"""Writing results so that a file is there whole or not at all."""

import os
from pathlib import Path

from pneusma_jax.errors import InputError


def check_folder(path: str | Path) -> None:
    """Refuse a place where no folder can be, before anything is computed for it.

    Raises:
        InputError: if a file is in its place.
    """
    for place in (Path(path), *Path(path).parents):
        if place.exists():
            if not place.is_dir():
                raise InputError(f"{place}: this is a file, but a folder for results is needed")
            return


def result_folder(path: str | Path) -> Path:
    """Folder for results, made if it is not there.

    Raises:
        InputError: if it cannot be made, or a file is in its place.
    """
    folder = Path(path)
    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written here ({error.strerror})") from None
    return folder


def write_whole(path: str | Path, content: str | bytes) -> Path:
    """Write or replace a file through a draft beside it; text is written as UTF-8.

    Raises:
        InputError: if the place cannot be written.
    """
    path = Path(path)
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        draft.write_bytes(content.encode() if isinstance(content, str) else content)
        os.replace(draft, path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    return path
