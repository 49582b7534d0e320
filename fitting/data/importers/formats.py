"""Known formats of raw files, and the choice of the one that a test is read with."""

import numpy as np

from pneusma_jax.errors import InputError, nearest

from ..recordings.table import unusable
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
from .channels import named_channels
from .format import Format
from .grid import Grid
from .no_table import few_numbers, in_rows, words_for_numbers
from .numbered_columns import AS_HEADINGS
from .options import QUANTITIES, Options
from .other_headings import advised
from .parts import Sample
from .raw import formulas_without_values
from .separators import LEAST_ROWS
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
    raise unusable(sample.raw.path, _no_format(sample))


def _no_format(sample: Sample) -> str:
    """Why no format recognises a test, as precisely as its content tells, and the way out."""
    grid, pages = sample.grid, sample.raw.pages
    if grid is not None and (test := unmodelled(sample, named_channels(grid))):
        return test.sentence
    if grid is not None and (why := one_channel_a_row(grid)):
        return why
    if grid is None or not grid.headings:
        if why := next(filter(None, map(in_rows, pages)), None):
            return why
    if grid is None:
        for page in pages:
            if why := words_for_numbers(page):
                return f"{why}; write them as numbers, or leave them empty"
            if why := few_numbers(page):
                return why
    if why := formulas_without_values(sample.raw):
        return why
    if grid is None:
        return (
            f"no table of numbers was found in it; a table has at least {LEAST_ROWS} rows of numbers, and a"
            " column for each quantity"
        )
    return _columns_to_name(grid)


def _columns_to_name(grid: Grid) -> str:
    """Advice to name the columns of a table that fits no format, and the known formats."""
    headings = grid.headings
    columns = f" ({', '.join(repr(heading.text) for heading in headings)})" if headings else ""
    columns = columns or f" (without headings right above them, numbers 1 to {grid.values.shape[1]})"
    found = named_channels(grid)
    advice = advised(headings, {c.column for c in found.values()}, found)
    advice = f", {advice}" if advice else ""
    if empty := _without_numbers(grid):
        advice += f" (no number stands below {', '.join(map(repr, empty))})"
    asked = next((text for text in grid.notices if AS_HEADINGS in text), "")
    advice += f" ({asked.removeprefix('check: ')})" if asked else ""
    known = ", ".join(format.name for format in FORMATS)
    return (
        f"no known format; name its columns{columns} with --map QUANTITY=COLUMN{advice},"
        f" where QUANTITY is one of {', '.join(QUANTITIES)}; or see the known formats: {known}"
    )


def _without_numbers(grid: Grid) -> list[str]:
    """Headings of quantities below which every field is blank."""
    blank = np.isnan(grid.values).all(axis=0)
    empty = [h for c, h in enumerate(grid.headings) if blank[c] and c not in grid.troubles]
    return list(dict.fromkeys(h.text for h in empty if meaning(h) is not None))


def format_or_error(sample: Sample, options: Options) -> Format | InputError:
    """The format that a test is read with, or why there is none."""
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


def _named_format(name: str, sample: Sample) -> Format:
    chosen = next((known for known in FORMATS if known.name == name), None)
    if chosen is None:
        raise InputError(
            f"--format {name}: no such format, {nearest(name, [known.name for known in FORMATS])}"
        )
    if not chosen.recognises(sample):
        raise unusable(sample.raw.path, f"this does not look like --format {name} ({chosen.about})")
    return chosen
