"""Folder with recordings of other laboratories, if there is one. They are never part of the project."""

import os
from pathlib import Path

from .table import unusable

ENVIRONMENT_VARIABLE = "PNEUSMA_RECORDINGS"


def recordings_folder() -> Path | None:
    """Folder of measured recordings: `$PNEUSMA_RECORDINGS`, else `shared/recordings` beside the repository.

    Returns:
        The folder, or None if there is none.

    Raises:
        InputError: if the environment variable names something that is not a folder.
    """
    stated = os.environ.get(ENVIRONMENT_VARIABLE, "").strip()
    if stated:
        if not Path(stated).is_dir():
            raise unusable(stated, f"{ENVIRONMENT_VARIABLE} names this, but it is not a folder")
        return Path(stated)
    beside = Path(__file__).resolve().parents[4] / "shared" / "recordings"
    return beside if beside.is_dir() else None
