"""Ranges of rows that a test keeps (`--rows`), by the numbers that messages give to rows."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from pneusma_jax.errors import InputError

_RANGE = re.compile(r"([0-9]{0,9})\s*(:?)\s*([0-9]{0,9})")


class RowRange(NamedTuple):
    """Rows of a file that are kept, both ends included.

    Attributes:
        first: number of the first row, from 1.
        last: number of the last row; None for all rows to the end.
    """

    first: int
    last: int | None

    def holds(self, row: int) -> bool:
        """True if a row is kept."""
        return self.first <= row and (self.last is None or row <= self.last)

    def __str__(self) -> str:
        last = "" if self.last is None else str(self.last)
        return last if self.first == self.last else f"{self.first}:{last}"


RowChoice = Mapping[str, tuple[RowRange, ...]]
"""Ranges of rows that are kept, by the name of a test; under an empty name for the only test there is."""


def parse_rows(texts: Iterable[str]) -> RowChoice:
    """Ranges of rows by the name of a test, from texts such as `1:350`, `20:` or `TEST=:99,120:`.

    Raises:
        InputError: for a range that no row can be in, or if only some texts name their test.
    """
    chosen: dict[str, tuple[RowRange, ...]] = {}
    for text in texts:
        name, equals, ranges = (part.strip() for part in text.rpartition("="))
        if equals and not name:
            raise InputError(f"--rows {text}: the name of a test is missing before the =")
        found = tuple(_range(text, part) for part in ranges.split(","))
        chosen[name] = (*chosen.get(name, ()), *found)
    if "" in chosen and len(chosen) > 1:
        other = next(filter(None, chosen))
        raise InputError(
            f"--rows {written(chosen[''])} names no test, and --rows {other}=... does; name the test of each"
        )
    return chosen


def _range(text: str, part: str) -> RowRange:
    found = _RANGE.fullmatch(part.strip())
    if found is None or not (found[1] or found[3]):
        raise InputError(
            f"--rows {text}: {part.strip()!r} must be FIRST:LAST, the numbers of the first and the last row"
            " that are kept, e.g. 1:350, :350 or 20:"
        )
    first = int(found[1] or 1)
    last = int(found[3]) if found[3] else None if found[2] else first
    if first < 1 or last == 0:
        raise InputError(f"--rows {text}: rows are counted from 1, the first line of the file")
    if last is not None and last < first:
        raise InputError(f"--rows {text}: {part.strip()} ends before it begins; did you mean {last}:{first}?")
    return RowRange(first, last)


def written(ranges: Sequence[RowRange]) -> str:
    """Ranges as they are stated on the command line."""
    return ",".join(map(str, ranges))


def option_to_keep(sample_name: str, kept: Sequence[RowRange], first: int, last: int | None) -> str:
    """The option that keeps the rows from one to another of those that are kept already.

    Args:
        sample_name: name of the test; empty if it is the only one.
        kept: ranges that the user stated; empty without any.
        first, last: numbers of the first and the last row; None for all rows to the end.
    """
    both = []
    for one in kept or (RowRange(1, None),):
        end = min((x for x in (one.last, last) if x is not None), default=None)
        begin = max(first, one.first)
        if end is None or begin <= end:
            both.append(RowRange(begin, end))
    name = f"{sample_name}=" if sample_name else ""
    return f"--rows {name}{written(both)}"
