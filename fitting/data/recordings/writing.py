"""Writing of a recording as CSV and sidecar that read back equal. Both files appear whole or not at all."""

import os
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path, PurePosixPath

from pneusma_jax.files import replacing
from pneusma_jax.late import tomlkit

from ..csv_text import csv_text
from .checks import check_recording
from .recording import Recording, locate_table
from .table import unusable
from .unusual import plainly_named


def write_recording(recording: Recording, folder: str | Path, force: bool = True) -> Path:
    """Write `NAME.csv` and `NAME.toml`.

    Args:
        recording: recording to write; `read_recording` would have to accept it.
        folder: folder to write to, made if it does not exist. A name with folders in it (`"hot/run_1"`) makes
            those too.
        force: true to replace files of that name; otherwise they are an error.

    Returns:
        Path of the CSV.

    Raises:
        InputError: if the recording cannot be used, its name would leave the folder, a file is in the way, or
            the place cannot be written.
    """
    texts = recording_texts(recording, folder)
    target = target_path(recording, folder)
    _check_free(texts, force)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unusable(target, f"the recording cannot be written here ({error.strerror})") from None
    with ExitStack() as drafts:
        for file, text in texts.items():  # both or none; the CSV last: without it there is no recording
            drafts.enter_context(replacing(file)).write_bytes(text.encode())
    return target


def write_recordings(recordings: Sequence[Recording], folder: str | Path, force: bool = True) -> list[Path]:
    """Write several recordings, each as `write_recording`. All are checked before the first is written.

    Raises:
        InputError: as `write_recording`, of any of them, and where two have one name; a disk may still refuse
            a later one.
    """
    taken: set[Path] = set()
    for recording in recordings:
        files = list(recording_texts(recording, folder))
        if taken.intersection(files):
            raise unusable(files[0], "two recordings have this name")
        _check_free(files, force)
        taken.update(files)
    return [write_recording(recording, folder, force) for recording in recordings]


def _check_free(files: Iterable[Path], force: bool) -> None:
    for file in files:
        if file.exists() and not force:
            raise unusable(
                file, "this file is already there; choose another folder, or replace it with --force"
            )


def recording_texts(recording: Recording, folder: str | Path) -> dict[Path, str]:
    """Texts of CSV and sidecar for a folder, by path; nothing is written.

    Raises:
        InputError: if the recording cannot be used, or its name would leave the folder.
    """
    check_recording(recording)
    target = target_path(recording, folder)
    csv, sidecar = csv_text(plainly_named(recording), recording.comments), _toml_text(recording, target)
    return {target: csv, target.with_suffix(".toml"): sidecar}


def target_path(recording: Recording, folder: str | Path) -> Path:
    """Path of the CSV that a recording is written to.

    Raises:
        InputError: if its name would leave the folder.
    """
    name = PurePosixPath(recording.name)
    if not recording.name or name.is_absolute() or ".." in name.parts or "\\" in recording.name:
        raise unusable(folder, f"{recording.name!r} cannot be the name of a file in this folder")
    return Path(folder) / name.parent / f"{name.name}.csv"


def _toml_text(recording: Recording, target: Path) -> str:
    document = tomlkit.document()
    document["kind"] = recording.kind
    document["role"] = recording.role
    if recording.specimen:
        document["specimen"] = recording.specimen
    if recording.real is not None:
        document["real"] = recording.real
    if recording.noise_includes_rounding:
        document["noise_includes_rounding"] = True
    geometry = _relocated_geometry(recording, target)
    tables = {"source": recording.source, "noise": recording.noise, "geometry": geometry}
    tables["zero"] = recording.zero
    for key, table in tables.items():
        if table:
            document[key] = {name: _one_a_line(value) for name, value in table.items()}
    if recording.tolerance is not None:  # an empty table says that everything is exact
        document["tolerance"] = recording.tolerance
    return tomlkit.dumps(document)


def _one_a_line(value: object) -> object:
    """A list of sentences with a line for each; anything else unchanged."""
    if isinstance(value, list) and len(value) > 1 and all(isinstance(text, str) for text in value):
        lines = tomlkit.array()
        lines.extend(value)
        return lines.multiline(True)
    return value


def _relocated_geometry(recording: Recording, target: Path) -> dict:
    """Geometry whose relative paths still lead to the same file from the new place."""
    geometry = dict(recording.geometry)
    for key in ("alloy", "material"):
        if key in geometry:
            table = locate_table(str(geometry[key]), recording.path)
            if isinstance(table, Path) and table.exists() and not Path(geometry[key]).is_absolute():
                geometry[key] = Path(os.path.relpath(table.resolve(), target.parent.resolve())).as_posix()
    return geometry
