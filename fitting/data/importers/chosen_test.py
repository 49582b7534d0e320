"""The test of a file that the user chooses, and its rows."""

from dataclasses import replace

from .channels import has_column
from .chosen_rows import called, with_chosen_rows
from .names import name_of, slug
from .options import Options
from .parts import Sample


def with_rows(sample: Sample, own: Options, alone: bool) -> Sample:
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


def selected_test(samples: list[Sample], options: Options) -> tuple[list[Sample], Options]:
    """The test that `--specimen` names, where a file holds several and one has that name."""
    wanted = options.specimen
    if wanted is None or len(samples) < 2:
        return samples, options
    hits = [s for s in samples if wanted.casefold() in (s.title.casefold(), slug(s.title).casefold())]
    if len(hits) != 1:
        warning = f"check: --specimen {wanted} names no test of this file: it is the specimen of all of them"
        own = any(sample.own_specimen for sample in samples)
        return [replace(s, notices=(*s.notices, warning)) if own else s for s in samples], options
    titles = ", ".join(repr(sample.title) for sample in samples)
    only = replace(
        hits[0], notices=(*hits[0].notices, f"--specimen names one of the tests {titles}: only that was read")
    )
    return [only], replace(options, specimen=slug(wanted))


def lacking_columns(samples: list[Sample], options: Options) -> list[str]:
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
