"""Which formats there are, which one a file is, and the way from files to recordings."""

from collections.abc import Iterable
from pathlib import Path

from pneusma_jax.errors import InputError, nearest

from ..recordings import Recording
from ..recordings.table import first_of, refuse
from . import (
    compression_test,
    loading_unloading,
    machine_log,
    named_columns,
    refused,
    sma_columns,
    stress_stretch,
    tensile_database,
)
from .assemble import slug
from .format import Format
from .grid import Sample
from .options import Options
from .raw import open_raw

FORMATS: tuple[Format, ...] = (
    tensile_database.FORMAT,
    compression_test.FORMAT,
    sma_columns.FORMAT,
    machine_log.FORMAT,
    loading_unloading.FORMAT,
    stress_stretch.FORMAT,
    *refused.FORMATS,
    named_columns.FORMAT,
)
RAW_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".xlsx")


def detect(sample: Sample) -> Format:
    """The one format that recognises a file by its content.

    Raises:
        InputError: if none does (the known ones are listed), or several do (the person picks).
    """
    hits = [known for known in FORMATS if not known.fallback and known.recognises(sample)]
    hits = hits or [known for known in FORMATS if known.fallback and known.recognises(sample)]
    if len(hits) == 1:
        return hits[0]
    if hits:
        names = " or ".join(hit.name for hit in hits)
        raise refuse(sample.raw.path, f"this could be {names}; pick one with --format")
    known = ", ".join(known.name for known in FORMATS)
    headings = [] if sample.grid is None else [heading.text for heading in sample.grid.headings]
    columns = f" ({', '.join(repr(text) for text in headings)})" if headings else ""
    raise refuse(
        sample.raw.path,
        f"no known format; name its columns{columns} with --map QUANTITY=COLUMN, or see the known ones: "
        f"{known}",
    )


def import_file(path: str | Path, options: Options | None = None) -> Recording:
    """Make a recording of one raw laboratory file.

    Args:
        path: text or xlsx.
        options: what the person states; none by default.

    Returns:
        A checked recording with `real = true`; its `notices` say what was understood. `source` has no licence
        where none was stated or found: `write_recording` refuses it then.

    Raises:
        InputError: if the file is of no known format, of several, or cannot be a recording; one line, with
            remedy.
    """
    options = options or Options()
    sample = Sample(open_raw(path))
    if options.format is not None:
        return _named_format(options.format, sample).read(sample, options)
    if options.columns:
        return named_columns.FORMAT.read(sample, options)
    return detect(sample).read(sample, options)


def _named_format(name: str, sample: Sample) -> Format:
    chosen = next((known for known in FORMATS if known.name == name), None)
    if chosen is None:
        raise InputError(
            f"--format {name}: no such format, {nearest(name, [known.name for known in FORMATS])}"
        )
    if not chosen.recognises(sample):
        raise refuse(sample.raw.path, f"this does not look like --format {name} ({chosen.about})")
    return chosen


def import_files(paths: Iterable[str | Path], options: Options | None = None) -> list[Recording]:
    """Make a recording of each file; all or none. Names that would clash get their folders in front.

    Raises:
        InputError: if any cannot be imported: the first one's line, with how many more are wrong.
    """
    recordings: list[Recording] = []
    errors: list[InputError] = []
    for path in paths:
        try:
            recordings.append(import_file(path, options))
        except InputError as error:
            errors.append(error)
    if errors:
        raise first_of(errors)
    _separate_names(recordings)
    return recordings


def raw_files(sources: Iterable[str | Path]) -> tuple[list[Path], list[Path]]:
    """Files to import: those named, and those of named folders that hold numbers.

    Returns:
        The files, and the ones of folders that were left aside because they are notes or licences.

    Raises:
        InputError: if a folder holds no raw file.
    """
    wanted: list[Path] = []
    aside: list[Path] = []
    for source in map(Path, sources):
        if not source.is_dir():
            wanted.append(source)
            continue
        files = sorted(p for p in source.iterdir() if p.suffix.lower() in RAW_ENDINGS and p.is_file())
        samples = {path: Sample(open_raw(path)) for path in files}
        held = [p for p, s in samples.items() if s.grid is not None or any(f.recognises(s) for f in FORMATS)]
        if not held:
            raise refuse(
                source, f"there is no raw file ({', '.join(RAW_ENDINGS)}) with numbers in this folder"
            )
        wanted += held
        aside += [path for path in files if path not in held]
    return wanted, aside


def _separate_names(recordings: list[Recording]) -> None:
    """Put the folders in front of names that would clash, as many as it takes."""
    for depth in range(1, 6):
        names = [recording.name for recording in recordings]
        clashing = [recording for recording in recordings if names.count(recording.name) > 1]
        if not clashing:
            return
        for recording in clashing:
            parts = recording.path.resolve().with_suffix("").parts
            recording.name = slug("_".join(parts[-1 - depth :]))
    names = [recording.name for recording in recordings]
    twice = next(recording for recording in recordings if names.count(recording.name) > 1)
    raise refuse(twice.path, "this file is given twice")
