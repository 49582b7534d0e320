"""Writing of a set of result files: in a new folder they appear together or not at all.

In a folder that is there already they are moved one by one, the file that marks results last. Until then the
folder does not count as results.
"""

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath

from pneusma_jax.errors import InputError

from .files import check_folder

MARK = "report.json"
"""Name of the file that marks a folder as results."""


def check_free(folder: str | Path, force: bool = False) -> Path:
    """Refuse a folder that cannot take results, before any computation.

    Args:
        folder: folder for the results; it need not exist.
        force: true to allow replacing existing results.

    Raises:
        InputError: if it is a file, holds results already, or no folder can be made there.
    """
    folder = Path(folder)
    if (folder / MARK).exists() and not force:
        raise InputError(
            f"{folder}: results are here already; choose another folder, or replace them with --force"
        )
    check_folder(folder)
    return folder


def publish(
    folder: str | Path,
    documents: Mapping[str, str | bytes] | Callable[[], Mapping[str, str | bytes]],
    force: bool,
) -> list[Path]:
    """Write files into a draft folder and move them into place once all of them are there.

    Args:
        folder: folder for the results; made if it does not exist.
        documents: content by file name, or a function that makes it; text is written as UTF-8.
        force: true to replace existing results.

    Returns:
        Paths of the files.

    Raises:
        InputError: as `check_free`, if the disk refuses, or if a name is not that of a file in this folder.
    """
    folder = check_free(folder, force)
    content = documents() if callable(documents) else documents
    for name in content:
        if name in ("", ".", "..") or PurePosixPath(name).name != name or PureWindowsPath(name).name != name:
            raise InputError(f"{folder}: {name!r} cannot be the name of a file in this folder")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            for name, body in content.items():
                (draft / name).write_bytes(body.encode() if isinstance(body, str) else body)
            if folder.exists() and MARK in content:
                (folder / MARK).unlink(missing_ok=True)  # a kill after this leaves no results, not a mixture
            if not folder.exists():
                os.chmod(draft, 0o777 & ~_umask())
                os.rename(draft, folder)
            for name in (
                sorted(content, key=lambda name: name == MARK) if draft.exists() else ()
            ):  # the mark last
                os.replace(draft / name, folder / name)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written here ({error.strerror})") from None
    return [folder / name for name in content]


def _umask() -> int:
    """Current umask. A temporary folder is private; results should be as readable as any other folder."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
