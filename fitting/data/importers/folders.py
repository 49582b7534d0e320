"""Raw files in folders: those that hold numbers, and everything else by name."""

from collections.abc import Iterable
from pathlib import Path

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
_ABOUT = ("license", "licence", "citation", "provenance", "readme")
"""Words that begin the names of files about the others, such as a licence; nothing is said of these files."""
_LISTED = 3
"""Number of files of one ending that a line names."""


def raw_files(
    sources: Iterable[str | Path], refused: list[InputError] | None = None
) -> tuple[list[Path], list[Path]]:
    """Files to import: the named ones, and those of named folders that hold numbers.

    Args:
        sources: files and folders.
        refused: errors of files of a folder that cannot be read are added to this list. Without it the first
            one is raised.

    Returns:
        The files, and the files of folders that were ignored because they are notes or licences.

    Raises:
        InputError: if a folder holds no raw file that can be read, and without `refused` if it holds one that
            cannot.
    """
    wanted: list[Path] = []
    ignored: list[Path] = []
    for source in map(Path, sources):
        if not source.is_dir():
            wanted.append(source)
            continue
        files = sorted(p for p in source.iterdir() if p.suffix.lower() in RAW_ENDINGS and p.is_file())
        samples: dict[Path, list[Sample]] = {}
        errors: list[InputError] = []
        for path in files:
            try:
                samples[path] = _samples(path)
            except InputError as error:
                errors.append(error)
        with_numbers = [path for path, tests in samples.items() if any(map(_holds_numbers, tests))]
        if errors and (refused is None or not with_numbers):
            raise first_of(errors)
        if not with_numbers:
            raise unusable(
                source, f"there is no raw file ({', '.join(RAW_ENDINGS)}) with numbers in this folder"
            )
        if refused is not None:
            refused += errors
        wanted += with_numbers
        ignored += [path for path in samples if path not in with_numbers]
    return wanted, ignored


def _holds_numbers(test: Sample) -> bool:
    """True if a test has a table of numbers, or a known format reads it."""
    return test.grid is not None or any(known.recognises(test) for known in FORMATS)


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
    """Why files of an ending are not read, and what to do about it."""
    if ending in other_workbooks.ENDINGS:
        return f"a workbook in the format {ending}: save it as .xlsx, or {other_workbooks.EXTRA}"
    ending = f"ending {ending}" if ending else "without an ending"
    return f"{ending}, not looked into: name the file to try it"
