"""Raw files in folders: those that hold numbers, and everything else by name."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from pneusma_jax.errors import InputError, counted

from ..recordings.table import first_of, unusable
from . import other_workbooks
from .formats import FORMATS
from .matlab import is_matlab_or_hdf5
from .names import first_few
from .parts import Sample, samples_of
from .raw import open_raw

RAW_ENDINGS = (
    ".csv", ".tsv", ".txt", ".dat", ".asc", ".prn", ".tra", ".lvm", ".xlsx", ".xlsm", ".mat",
    *(other_workbooks.ENDINGS if other_workbooks.is_read() else ()),
)  # fmt: skip
_ABOUT = (
    "license",
    "licence",
    "citation",
    "provenance",
    "readme",
)  # begin the names of files about the others
_LISTED = 3
"""Number of files of one kind that a line names."""


class RawFiles(NamedTuple):
    """Files to import.

    Attributes:
        wanted: the named files, and those of named folders that hold numbers.
        aside: files of folders that are no tables, such as notes and licences.
        optional: those of `wanted` that come from a folder, so that nobody named them.
        refused: errors of files of folders that cannot be read at all.
    """

    wanted: list[Path]
    aside: list[Path]
    optional: list[Path]
    refused: list[InputError]


def raw_files(sources: Iterable[str | Path]) -> RawFiles:
    """Files to import: the named ones, and those of named folders that hold numbers.

    Raises:
        InputError: if a folder holds no raw file, or none that can be read.
    """
    found = RawFiles([], [], [], [])
    for source in map(Path, sources):
        if not source.is_dir():
            found.wanted.append(source)
            continue
        files = sorted(p for p in source.iterdir() if p.suffix.lower() in RAW_ENDINGS and p.is_file())
        with_numbers, refused = [], []
        for path in files:
            try:
                tests = _samples(path)
            except InputError as error:
                refused.append(error)
                continue
            if any(
                test.grid is not None or any(known.recognises(test) for known in FORMATS) for test in tests
            ):
                with_numbers.append(path)
            else:
                found.aside.append(path)
        if not with_numbers:
            if refused:
                raise first_of(refused)
            raise unusable(
                source, f"there is no raw file ({', '.join(RAW_ENDINGS)}) with numbers in this folder"
            )
        found.wanted.extend(with_numbers)
        found.optional.extend(with_numbers)
        found.refused.extend(refused)
    return found


def _samples(path: Path) -> list[Sample]:
    """Tests in a file of a folder; none in a file of MATLAB without vectors, such as saved settings.

    Raises:
        InputError: if another file cannot be read.
    """
    raw = open_raw(path)
    try:
        return samples_of(raw)
    except InputError:
        if not is_matlab_or_hdf5(raw.content):
            raise
        return []


def left_in_folders(sources: Iterable[str | Path]) -> list[str]:
    """Files that `raw_files` does not read: folders in a folder and files of other endings, a line each."""
    lines = []
    for folder in (path for path in map(Path, sources) if path.is_dir()):
        kinds: dict[str, list[Path]] = {}
        for path in sorted(folder.iterdir()):
            if path.name.startswith(".") or path.stem.lower().startswith(_ABOUT):
                continue
            if path.is_dir():
                count = sum(p.suffix.lower() in RAW_ENDINGS for p in path.rglob("*") if p.is_file())
                if count:
                    files = counted(count, "text file or workbook", "text files or workbooks")
                    lines.append(
                        f"{path}, a folder with {files}: name it to import"
                        f" {'it' if count == 1 else 'them'}, too"
                    )
            elif path.suffix.lower() not in RAW_ENDINGS:
                kinds.setdefault(path.suffix.lower(), []).append(path)
        for ending, paths in kinds.items():
            names = first_few((path.name for path in paths), _LISTED)
            lines.append(f"{folder}: {names} ({_reason(ending)})")
    return lines


def _reason(ending: str) -> str:
    if ending in other_workbooks.ENDINGS:
        return f"a workbook in the format {ending}: save it as .xlsx, or {other_workbooks.EXTRA}"
    ending = f"ending {ending}" if ending else "without an ending"
    return f"{ending}, not looked into: name the file to try it"
