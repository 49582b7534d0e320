"""Rows that the user leaves out of a test (`--rows`)."""

from collections.abc import Sequence
from dataclasses import replace

from pneusma_jax.errors import InputError, counted

from ..recordings.table import unusable
from .names import first_few, name_of, slug
from .options import Used
from .parts import Sample
from .row_ranges import RowChoice, RowRange, written
from .separators import LEAST_ROWS

MOST_NAMES = 12
"""Number of tests whose names a refusal lists."""


def _names_of(sample: Sample) -> set[str]:
    """Names under which the user may refer to a test, without regard to capitals."""
    path = sample.raw.path
    own = {sample.title, slug(sample.title)} if sample.title else set()
    return {name.casefold() for name in (name_of(path, sample.title), path.name, path.stem, str(path), *own)}


def called(sample: Sample, choice: RowChoice, alone: bool) -> list[str]:
    """Names of a choice that refer to a test; the empty name refers to the only one.

    Args:
        sample: the test.
        choice: rows that are kept.
        alone: true if no other test is imported with it.
    """
    return [name for name in choice if (name.casefold() in _names_of(sample) if name else alone)]


def refuse_several_named(choice: RowChoice, tests: Sequence[Sample]) -> None:
    """Refuse a choice of rows whose name refers to several tests.

    Args:
        choice: rows that are kept.
        tests: tests that are read.

    Raises:
        InputError: with the names of these tests.
    """
    for name, ranges in choice.items():
        meant = [sample for sample in tests if called(sample, {name: ranges}, alone=len(tests) == 1)]
        if len(meant) > 1:
            names = [name_of(sample.raw.path, sample.title) for sample in meant]
            apart = len({*names}) == len(names)
            say = _example(names[0], ranges) if apart else "import these files one by one"
            listed = first_few(names, MOST_NAMES)
            raise InputError(
                f"--rows {name}={written(ranges)}: {len(names)} tests are called so ({listed}); {say}"
            )


def refuse_unused_rows(choice: RowChoice, tests: Sequence[tuple[Sample, Used]]) -> None:
    """Refuse a choice of rows that no test used.

    Args:
        choice: rows that are kept.
        tests: all tests that are imported, each with the record of the options that it used.

    Raises:
        InputError: with the names of the tests.
    """
    names = [name_of(sample.raw.path, sample.title) for sample, _ in tests]
    listed = first_few(names, MOST_NAMES)
    for name, ranges in choice.items():
        if any(("--rows", name) in used.names for _, used in tests):
            continue
        if not name:
            raise InputError(
                f"--rows {written(ranges)}: {len(names)} tests are imported ({listed}); say of which,"
                f" {_example(names[0], ranges)}"
            )
        raise InputError(
            f"--rows {name}={written(ranges)}: no test here is called so; there is {listed}"
        )


def _example(name: str, ranges: Sequence[RowRange]) -> str:
    return f"e.g. --rows {name}={written(ranges)}"


def with_chosen_rows(sample: Sample, choice: RowChoice, names: Sequence[str]) -> Sample:
    """A test with the rows of a choice. A notice tells all others, and so do `left_out` and `kept`.

    Args:
        sample: the test.
        choice: rows that are kept.
        names: names in it that refer to this test.

    Raises:
        InputError: if a range has no row of the test, ends beyond it, or all of them leave out no row, or
            so many that no test is left.
    """
    grid = sample.require_grid()
    ranges = tuple(one for name in names for one in choice[name])
    option = f"--rows {names[0]}={written(ranges)}" if names[0] else f"--rows {written(ranges)}"
    place = f"{sample.raw.path} ({sample.title})" if sample.title else sample.raw.path
    there = f"its rows of numbers are {min(grid.rows)} to {max(grid.rows)}"
    for one in ranges:
        if not any(one.holds(row) for row in grid.rows):
            raise unusable(place, f"{option}: no row of this test is in {one}; {there}")
        if one.last is not None and one.last > max(grid.rows):
            raise unusable(
                place, f"{option}: there is no row {one.last}; {there}. {one.first}: keeps all to the end"
            )
    keep = [k for k, row in enumerate(grid.rows) if any(one.holds(row) for one in ranges)]
    if len(keep) == len(grid.rows):
        raise unusable(place, f"{option} leaves out no row, since {there}; leave the option out")
    if len(keep) < LEAST_ROWS:
        raise unusable(
            place, f"{option} keeps {counted(len(keep), 'row')} of {len(grid.rows)}, and a test has at least"
            f" {LEAST_ROWS}; {there}",
        )  # fmt: skip
    part = grid.cut(keep)
    settled = {c for c, rows in part.trouble_rows.items() if not rows & {*part.rows}}
    part.troubles = {c: why for c, why in part.troubles.items() if c not in settled}
    out = _in_words(grid.rows, {*keep})
    count = len(grid.rows) - len(keep)
    said = f"{option}: {counted(count, 'row')} left out ({out})"
    return replace(
        sample, grid=part, kept=ranges, left_out=f"{out} of {sample.raw.path.name}",
        notices=(*sample.notices, said),
    )  # fmt: skip


def _in_words(rows: Sequence[int], keep: set[int]) -> str:
    """Numbers of all rows that are not kept: `rows 2 to 19, 40`. Rows without numbers divide no range."""
    spans: list[list[int]] = []
    for k, row in enumerate(rows):
        if k in keep:
            continue
        if spans and k - 1 not in keep:
            spans[-1].append(row)
        else:
            spans.append([row])
    parts = [f"{min(span)} to {max(span)}" if len(span) > 1 else str(span[0]) for span in spans]
    return f"row{'s' * (len(parts) > 1 or len(spans[0]) > 1)} {', '.join(parts)}"
