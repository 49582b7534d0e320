"""Registry of formats, their detection, and the conversion of files to recordings."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneusma_jax.errors import InputError, counted, nearest

from ..files import names_apart
from ..recordings import Recording, ask_about_copies
from ..recordings.table import first_of, unusable
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
from .already import SENTENCE, is_recording
from .channel_lists import one_channel_a_row
from .channels import has_column, mapped_channels, named_channels
from .chosen_rows import called, refuse_several_named, refuse_unused_rows, with_chosen_rows
from .format import Format
from .grid import Grid
from .names import name_of, slug
from .no_table import few_numbers, in_rows, words_for_numbers
from .numbered_columns import AS_HEADINGS
from .options import QUANTITIES, Options
from .other_headings import advised
from .parts import Sample, samples_of
from .raw import formulas_without_values, open_raw
from .separators import LEAST_ROWS
from .successive import joined
from .unmodelled import unmodelled
from .words import meaning

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


def detect(sample: Sample) -> Format:
    """The one format that recognises a file by its content.

    Raises:
        InputError: if none does (the known ones are listed), several do (the person picks), or the file is a
            recording already.
    """
    if is_recording(sample):
        raise unusable(sample.raw.path, SENTENCE)
    hits = [format for format in FORMATS if not format.fallback and format.recognises(sample)]
    hits = hits or [format for format in FORMATS if format.fallback and format.recognises(sample)]
    if len(hits) == 1:
        return hits[0]
    if hits:
        names = " or ".join(hit.name for hit in hits)
        raise unusable(sample.raw.path, f"this could be {names}; pick one with --format")
    unmodelled_test = unmodelled(sample, named_channels(sample.grid)) if sample.grid is not None else None
    if unmodelled_test:
        raise unusable(sample.raw.path, unmodelled_test.sentence)
    if sample.grid is not None and (why := one_channel_a_row(sample.grid)):
        raise unusable(sample.raw.path, why)
    if sample.grid is None or not sample.grid.headings:
        for page in sample.raw.pages:
            if why := in_rows(page):
                raise unusable(sample.raw.path, why)
    if sample.grid is None:
        for page in sample.raw.pages:
            if why := words_for_numbers(page):
                raise unusable(sample.raw.path, f"{why}; write them as numbers, or leave them empty")
            if why := few_numbers(page):
                raise unusable(sample.raw.path, why)
    if why := formulas_without_values(sample.raw):
        raise unusable(sample.raw.path, why)
    if sample.grid is None:
        raise unusable(
            sample.raw.path, "no table of numbers was found in it; a table has at least"
            f" {LEAST_ROWS} rows of numbers, and a column for each quantity",
        )  # fmt: skip
    names = ", ".join(format.name for format in FORMATS)
    headings = sample.grid.headings
    columns = f" ({', '.join(repr(heading.text) for heading in headings)})" if headings else ""
    columns = columns or f" (without headings right above them, numbers 1 to {sample.grid.values.shape[1]})"
    found = named_channels(sample.grid)
    advice = advised(headings, {c.column for c in found.values()}, found)
    advice = f", {advice}" if advice else ""
    if empty := _without_numbers(sample.grid):
        advice += f" (no number stands below {', '.join(map(repr, empty))})"
    asked = next((text for text in sample.grid.notices if AS_HEADINGS in text), "")
    advice += f" ({asked.removeprefix('check: ')})" if asked else ""
    raise unusable(
        sample.raw.path,
        f"no known format; name its columns{columns} with --map QUANTITY=COLUMN{advice},"
        f" where QUANTITY is one of {', '.join(QUANTITIES)}; or see the known formats: {names}",
    )


def _without_numbers(grid: Grid) -> list[str]:
    """Headings of quantities below which every field is blank."""
    blank = np.isnan(grid.values).all(axis=0)
    empty = [h for c, h in enumerate(grid.headings) if blank[c] and c not in grid.troubles]
    return list(dict.fromkeys(h.text for h in empty if meaning(h) is not None))


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


def _tests_of(path: str | Path, options: Options, alone: bool = True) -> list[Made]:
    """Recordings of a file, each with its own record of used options.

    Args:
        path: text file or xlsx.
        options: statements of the user.
        alone: true if no other file is imported with it.
    """
    samples, options = _selected_test(samples_of(open_raw(path), options.sheet), options)
    formats: list[Format | InputError] = [_format_or_error(sample, options) for sample in samples]
    lacking = _lacking(samples, options)
    formats = [InputError(why) if why else found for found, why in zip(formats, lacking, strict=True)]
    formats_of_tests = [found for found in formats if isinstance(found, Format) and not found.refuses]
    if not formats_of_tests:
        _refuse_doubtful(samples)
        first = formats[0]
        if isinstance(first, InputError):
            raise first
        _read(first, samples[0], options.alone())
    tests = [sample for sample, found in zip(samples, formats, strict=True) if found in formats_of_tests]
    refuse_several_named(options.rows, tests)
    alone = alone and len(tests) == 1
    made: list[Made] = []
    aside = []
    for sample, found, why in zip(samples, formats, lacking, strict=True):
        if why:
            is_a_test = isinstance(_format_or_error(sample, replace(options, columns={})), Format)
            aside.append(f"{'check: ' if is_a_test else ''}{sample.title!r} was left out: {why}")
            continue
        if isinstance(found, InputError) or found.refuses:
            # Beside tests that are read, a sheet of results or notes is no reason to refuse the file.
            why = found.about if isinstance(found, Format) else f"{_columns_of(sample)} fit no known format"
            aside.append(f"{sample.title!r} was left out: {why}")
            continue
        _refuse_doubtful([sample])
        own = options.alone()
        sample = _with_rows(sample, own, alone)
        made.append(Made(_read(found, sample, own), own, sample))
    for one in made:
        _add_notices(one.recording, [*aside, *_several_tests_notice(one.recording, made)])
    return made


def _lacking(samples: list[Sample], options: Options) -> list[str]:
    """Reason why each test is not one in which `--map` names columns; empty where it is, or where none is.

    A table of results, above the tables of readings, has none of the columns that a person names.
    """
    lacks = [
        [name for name in options.columns.values() if sample.grid and not has_column(sample.grid, name)]
        for sample in samples
    ]
    if all(lacks):
        return [""] * len(samples)
    return [f"it has no column {names[0]!r}, which --map names" if names else "" for names in lacks]


def _with_rows(sample: Sample, own: Options, alone: bool) -> Sample:
    """A test without the rows that the user leaves out, which is recorded as used.

    Args:
        sample: the test.
        own: statements of the user, with the record of those that this test uses.
        alone: true if no other test is imported with it.

    Raises:
        InputError: if its rows cannot be chosen so.
    """
    sample = sample if alone else replace(sample, called=name_of(sample.raw.path, sample.title))
    names = called(sample, own.rows, alone)
    own.used.names.update(("--rows", name) for name in names)
    return with_chosen_rows(sample, own.rows, names) if names else sample


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


def _selected_test(samples: list[Sample], options: Options) -> tuple[list[Sample], Options]:
    """The test that `--specimen` names, where a file holds several and one has that name."""
    wanted = options.specimen
    if wanted is None or len(samples) < 2:
        return samples, options
    hits = [s for s in samples if wanted.casefold() in (s.title.casefold(), slug(s.title).casefold())]
    if len(hits) != 1:
        warning = f"check: --specimen {wanted} names none of the tests in this file: all are taken as one"
        own = any(sample.own_specimen for sample in samples)
        return [replace(s, notices=(*s.notices, warning)) if own else s for s in samples], options
    titles = ", ".join(repr(sample.title) for sample in samples)
    only = replace(
        hits[0], notices=(*hits[0].notices, f"--specimen names one of the tests {titles}: only that was read")
    )
    return [only], replace(options, specimen=slug(wanted))


def _format_or_error(sample: Sample, options: Options) -> Format | InputError:
    try:
        if options.format is not None:
            return _named_format(options.format, sample)
        if options.mends() and is_recording(sample):
            return named_columns.FORMAT
        if not options.columns:
            return detect(sample)
        # A format that reads headings also takes named columns; the user must name columns without headings.
        hits = [
            known
            for known in FORMATS
            if not known.fallback and not known.refuses and known.recognises(sample)
        ]
        return hits[0] if len(hits) == 1 and sample.require_grid().headings else named_columns.FORMAT
    except InputError as error:
        return error


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
    for pair in options.stated():
        without = [one for one in made if pair not in one.options.used.names]
        if len(without) == len(made):
            recording, own, _ = made[0]
            raise unusable(
                recording.path or recording.name,
                own.used.why.get(pair, f"{' '.join(pair).strip()} has no effect here; leave it out"),
            )
        for recording, own, _ in without:
            _add_notices(recording, [f"check: not used here: {own.used.why[pair]}"])


def _named_format(name: str, sample: Sample) -> Format:
    chosen = next((known for known in FORMATS if known.name == name), None)
    if chosen is None:
        raise InputError(
            f"--format {name}: no such format, {nearest(name, [known.name for known in FORMATS])}"
        )
    if not chosen.recognises(sample):
        raise unusable(sample.raw.path, f"this does not look like --format {name} ({chosen.about})")
    return chosen


def import_files(paths: Iterable[str | Path], options: Options | None = None) -> list[Recording]:
    """Make the recordings of each file, all or none. Names that would clash are told apart.

    With `options.successive` they are one recording, in the order of the files.

    Raises:
        InputError: if any file cannot be imported (first one's line and the number of others), or if no file
            uses an option.
    """
    options, paths = options or Options(), list(map(Path, paths))
    made: list[Made] = []
    alone = len(paths) == 1
    errors: list[InputError] = []
    for path in paths:
        try:
            made += _tests_of(path, options, alone)
        except InputError as error:
            errors.append(error)
    if errors:
        raise first_of(errors)
    _refuse_unused(made, options)
    refuse_unused_rows(options.rows, [(one.sample, one.options.used) for one in made])
    refuse_several_named(options.rows, [one.sample for one in made])
    recordings = [one.recording for one in made]
    _refuse_twice(paths)
    if options.successive:
        return [_one_of_all(paths, made, options)]
    _separate_names(recordings)
    ask_about_copies(recordings)
    for recording in recordings:
        recording.source["notes"] = list(recording.notices)
    return recordings


def _one_of_all(paths: Sequence[Path], made: Sequence[Made], options: Options) -> Recording:
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
    return joined(recordings, sizes, options.specimen, origins)


def _clock_origin(sample: Sample, options: Options) -> float | None:
    """Moment of 0 s of a test's clock (`clocks.EPOCH`) [s]; None where no date states it."""
    if sample.grid is None or options.interval_s or "time" in {*options.units, *options.scales}:
        return None
    clock = {**named_channels(sample.grid), **mapped_channels(sample, options)}.get("time")
    return None if clock is None else sample.grid.origins.get(clock.column)


def _refuse_twice(paths: Sequence[Path]) -> None:
    places = [path.resolve() for path in paths]
    for number, (path, place) in enumerate(zip(paths, places, strict=True)):
        if place in places[:number]:
            raise unusable(path, "this file is given twice")


def _separate_names(recordings: list[Recording]) -> None:
    """Prefix names that would clash with as many of their folders as it takes; number those of one folder.

    Names that differ in capitals alone clash, too: they are one file where a file system does not tell them.
    """
    for depth in range(1, 6):
        clashing = [one for one in recordings if any(_clash(one, other) for other in recordings)]
        for recording in clashing:
            parts = recording.path.resolve().with_suffix("").parts
            recording.name = slug("_".join([*parts[-1 - depth :], str(recording.source.get("raw_part", ""))]))
    for recording, name in zip(recordings, names_apart([one.name for one in recordings]), strict=True):
        recording.name = name


def _clash(one: Recording, other: Recording) -> bool:
    """True if recordings from different folders have one name."""
    if one.name.casefold() != other.name.casefold():
        return False
    return one.path.resolve().parent != other.path.resolve().parent
