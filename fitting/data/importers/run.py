"""Import of raw files: each becomes the recordings of its tests, all or none."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneusma_jax.errors import InputError, counted

from ..recordings import Recording, ask_about_copies
from ..recordings.table import first_of, unusable
from .channels import mapped_channels, named_channels
from .chosen_rows import refuse_several_named, refuse_unused_rows
from .chosen_test import lacking_columns, selected_test, with_rows
from .clashing_names import refuse_twice, separate_names
from .format import Format
from .formats import format_or_error
from .options import Options
from .parts import Sample, samples_of
from .raw import formulas_without_values, open_raw
from .start_lines import stated_begin
from .successive import joined

MOST_TITLES = 12
"""Number of tests of a file whose names a notice lists."""


class Made(NamedTuple):
    """A recording that was made of a test.

    Attributes:
        recording: the recording.
        options: statements of the user, with the record of those that it used.
        sample: the test.
    """

    recording: Recording
    options: Options
    sample: Sample


def import_file(path: str | Path, options: Options | None = None) -> Recording:
    """Make a recording of a raw laboratory file that holds one test.

    Args:
        path: text file or xlsx.
        options: statements of the user; none by default.

    Returns:
        A checked recording with `real = true`. Its `notices` report the interpretation.

    Raises:
        InputError: if the file is of no known format, of several, holds several tests, or cannot be a
            recording. The message is one line, with remedy.
    """
    recordings = import_tests(path, options)
    if len(recordings) > 1:
        titles = ", ".join(repr(recording.source["raw_part"]) for recording in recordings)
        raise unusable(
            path, f"this file holds {len(recordings)} tests ({titles}); choose one with --sheet or --specimen"
        )
    return recordings[0]


def import_tests(path: str | Path, options: Options | None = None) -> list[Recording]:
    """Make a recording of each test in a raw file: its sheets, its tables, its groups of columns.

    Args:
        path: text file or xlsx.
        options: statements of the user; `specimen` selects the test of that name, if there is one.

    Raises:
        InputError: as `import_file`, and if the person states something that no test uses.
    """
    options = options or Options()
    made = _tests_of(path, options)
    _refuse_unused(made, options)
    refuse_unused_rows(options.rows, [(one.sample, one.options.used) for one in made])
    return [one.recording for one in made]


def import_files(
    paths: Iterable[str | Path],
    options: Options | None = None,
    optional: Collection[Path] = (),
    refused: list[InputError] | None = None,
) -> list[Recording]:
    """Make the recordings of each file, all or none. Names that would clash are told apart.

    With `options.successive` they are one recording, in the order of the files.

    Args:
        paths: raw files.
        options: statements of the user; none by default.
        optional: files without which the others are imported, such as those of a folder.
        refused: errors of optional files are added to this list.

    Raises:
        InputError: if another file cannot be imported (first one's line and the number of others), if none
            can, or if no file uses an option.
    """
    options, paths = options or Options(), list(map(Path, paths))
    made: list[Made] = []
    errors: list[InputError] = []
    left_out: list[InputError] = []
    for path in paths:
        try:
            made += _tests_of(path, options, len(paths) == 1)
        except InputError as error:
            (left_out if path in optional else errors).append(error)
    if errors or not made:
        raise first_of(errors or left_out)
    if refused is not None:
        refused += left_out
    _refuse_unused(made, options)
    refuse_unused_rows(options.rows, [(one.sample, one.options.used) for one in made])
    refuse_several_named(options.rows, [one.sample for one in made])
    recordings = [one.recording for one in made]
    refuse_twice(paths)
    if options.successive:
        return [_joined_tests(paths, made, options)]
    separate_names(recordings)
    ask_about_copies(recordings)
    for recording in recordings:
        recording.source["notes"] = list(recording.notices)
    return recordings


def _tests_of(path: str | Path, options: Options, only_file: bool = True) -> list[Made]:
    """Recordings of a file, each with its own record of used options.

    Args:
        path: text file or xlsx.
        options: statements of the user.
        only_file: true if no other file is imported with it.
    """
    samples, options = selected_test(samples_of(open_raw(path), options.sheet), options)
    formats: list[Format | InputError] = [format_or_error(sample, options) for sample in samples]
    lacking = lacking_columns(samples, options)
    formats = [InputError(why) if why else found for found, why in zip(formats, lacking, strict=True)]
    formats_of_tests = [found for found in formats if isinstance(found, Format) and not found.refuses]
    if not formats_of_tests:
        _refuse_doubtful(samples)
        first = formats[0]
        if isinstance(first, InputError):
            raise first
        _read(first, samples[0], options.with_own_record())  # raises, and says why no format takes it
    tests = [sample for sample, found in zip(samples, formats, strict=True) if found in formats_of_tests]
    refuse_several_named(options.rows, tests)
    only_test = only_file and len(tests) == 1
    made: list[Made] = []
    aside = []
    for sample, found, why in zip(samples, formats, lacking, strict=True):
        if why:
            is_a_test = isinstance(format_or_error(sample, replace(options, columns={})), Format)
            aside.append(f"{'check: ' if is_a_test else ''}{sample.title!r} was left out: {why}")
            continue
        if isinstance(found, InputError) or found.refuses:
            # Beside tests that are read, a sheet of results or notes is no reason to refuse the file.
            why = found.about if isinstance(found, Format) else f"{_columns_of(sample)} fit no known format"
            aside.append(f"{sample.title!r} was left out: {why}")
            continue
        _refuse_doubtful([sample])
        own = options.with_own_record()
        sample = with_rows(sample, own, only_test)
        made.append(Made(_read(found, sample, own), own, sample))
    for one in made:
        _add_notices(one.recording, [*aside, *_several_tests_notice(one.recording, made)])
    return made


def _read(format: Format, sample: Sample, options: Options) -> Recording:
    """The recording of a test. Formulas that no program computed are named where numbers are missing.

    Raises:
        InputError: if the format refuses the test, or formulas without values leave gaps in it.
    """
    grid = sample.grid
    rows = grid.rows if grid is not None and np.isnan(grid.values).any() else []
    try:
        recording = format.read(sample, options)
    except InputError:
        if rows and (why := formulas_without_values(sample.raw, sample.sheet, rows)):
            raise unusable(sample.raw.path, why) from None
        raise
    gaps = any(np.isnan(values).any() for values in recording.columns.values())
    if rows and (why := formulas_without_values(sample.raw, sample.sheet, rows)):
        if gaps or len(recording) < len(rows):
            raise unusable(sample.raw.path, why)
        _add_notices(recording, [f"check: {why}"])
    return recording


def _refuse_doubtful(samples: list[Sample]) -> None:
    """Refuse tables whose columns cannot be told from each other."""
    for sample in samples:
        if sample.grid is not None and sample.grid.doubt:
            place = f"{sample.raw.path} ({sample.title})" if sample.title else sample.raw.path
            raise unusable(place, sample.grid.doubt)


def _several_tests_notice(recording: Recording, made: list[Made]) -> list[str]:
    """Notice that a file holds several tests, with their names."""
    if len(made) < 2:
        return []
    titles = ", ".join(repr(other.recording.source["raw_part"]) for other in made[:MOST_TITLES])
    titles += ", ..." if len(made) > MOST_TITLES else ""
    own = recording.source["raw_part"]
    return [
        f"one of {len(made)} tests in this file ({titles}), here {own!r}; --sheet or --specimen picks one"
    ]


def _add_notices(recording: Recording, more: list[str]) -> None:
    recording.notices += [text for text in more if text not in recording.notices]
    recording.source["notes"] = list(recording.notices)


def _columns_of(sample: Sample) -> str:
    headings = [heading.text for heading in sample.grid.headings if heading.text] if sample.grid else []
    return (
        f"its columns ({', '.join(map(repr, headings[:8]))})" if headings else "its columns without headings"
    )


def _refuse_unused(made: list[Made], options: Options) -> None:
    """Refuse statements of the user that no recording uses. Report those that only some recordings use.

    Raises:
        InputError: with the reason, and the option that is meant.
    """
    for statement in options.stated():
        without = [one for one in made if statement not in one.options.used.names]
        if len(without) == len(made):
            recording, own, _ = made[0]
            no_effect = f"{' '.join(statement).strip()} has no effect here; leave it out"
            raise unusable(recording.path or recording.name, own.used.why.get(statement, no_effect))
        for recording, own, _ in without:
            _add_notices(recording, [f"check: not used here: {own.used.why[statement]}"])


def _joined_tests(paths: Sequence[Path], made: Sequence[Made], options: Options) -> Recording:
    """The recordings of files that hold one test each, joined in the order of the files."""
    for path in paths:
        count = sum(one.recording.path == path for one in made)
        if count != 1:
            raise unusable(
                path, f"this file holds {counted(count, 'test')}, and --successive joins files of one test"
                " each; choose one with --sheet",
            )  # fmt: skip
    origins = [_clock_origin(one.sample, options) for one in made]
    recordings, sizes = [one.recording for one in made], [one.sample.sizes for one in made]
    begins = [stated_begin(one.sample.require_grid()) for one in made]
    return joined(recordings, sizes, options.specimen, origins, begins)


def _clock_origin(sample: Sample, options: Options) -> float | None:
    """Moment of 0 s of a test's clock (`clocks.EPOCH`) [s]; None where no date states it."""
    if sample.grid is None or options.interval_s or "time" in {*options.units, *options.scales}:
        return None
    clock = {**named_channels(sample.grid), **mapped_channels(sample, options)}.get("time")
    return None if clock is None else sample.grid.origins.get(clock.column)
