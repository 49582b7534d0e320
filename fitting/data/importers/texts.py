"""Fields of a table that are no plain numbers: clocks, percent signs, grouped thousands, words."""

import re

import numpy as np

from pneusma_jax.errors import counted

from .clocks import DAY_S, Clock, read_clock
from .grid import Grid
from .grouped import doubt_groups, say_grouped
from .marks import drop_marks
from .numerals import like_a_number
from .spelling import Heading
from .words import meaning

SERIAL = (36526.0, 73050.0)
"""Days since 1900, as spreadsheets count them, from the year 2000 to 2099."""
MOST_LISTED = 6
"""Number of fields that a notice lists with their rows."""
YEAR_DAYS = 366.0
"""Maximum length of a test whose clock counts days since 1900 [d]."""


def read_texts(grid: Grid, parsed: list[list[float | None]], decimal: str = ".") -> None:
    """Interpret fields of a table that are no plain numbers, and report it. The grid is changed in place.

    Args:
        grid: table with its cells as text.
        parsed: numbers of each row, None where a field is text.
        decimal: decimal mark with which they were read.
    """
    say_grouped(grid, decimal)
    doubt_groups(grid, decimal)
    _percent_signs(grid)
    _read_words(grid, parsed)
    drop_marks(grid)
    _serial_dates(grid)


def _percent_signs(grid: Grid) -> None:
    """Take the unit of columns whose fields end in a percent sign from that sign."""
    for column, heading in enumerate(grid.headings):
        signs = sum(cells[column].endswith("%") for cells in grid.cells if column < len(cells))
        if signs and heading.unit in (None, "1", "percent"):
            grid.headings[column] = Heading(heading.text, heading.name, "percent", heading.zero)
            filled = sum(bool(cells[column]) for cells in grid.cells if column < len(cells))
            if signs < filled:
                grid.troubles[column] = (
                    f"{signs} of {filled} fields of {heading.text!r} end in a percent sign and the others do"
                    " not"
                )
            grid.notices.append(f"fields of column {heading.text!r} end in a percent sign: taken as percent")


def _read_words(grid: Grid, parsed: list[list[float | None]]) -> None:
    """Interpret columns of text: clocks, columns of words, and fields of number columns that are no
    numbers."""
    for column in range(grid.values.shape[1]):
        texts = [
            (row, cells[column])
            for row, cells, numbers in zip(grid.rows, grid.cells, parsed, strict=True)
            if column < len(numbers) and numbers[column] is None
        ]
        if not texts:
            continue
        label = repr(grid.headings[column].text) if grid.headings else str(column + 1)
        if not grid.headings or _may_be_clock(grid.headings[column]):
            clock = read_clock(
                [cells[column] if column < len(cells) else "" for cells in grid.cells],
                grid.headings[column].text if grid.headings else "",
            )
            if clock is not None:
                _take_clock(grid, column, clock, label, texts[0][1])
                continue
        filled = int(np.isfinite(grid.values[:, column]).sum()) + len(texts)
        numberlike = [(row, text) for row, text in texts if like_a_number(text)]
        if 2 * len(texts) > filled:
            if grid.headings and _may_be_clock(grid.headings[column]):
                grid.notices.append(
                    f"check: column {label} cannot be read as a clock ({texts[0][1]!r} in row {texts[0][0]})"
                    " and was left out; write it as seconds or as 2024-05-31 12:00:05, or state the step with"
                    " --interval"
                )
            else:
                grid.notices.append(f"column {label} is text and was left out")
            grid.troubles[column] = (
                f"{len(texts)} of {filled} fields of {label} are no numbers ({texts[0][1]!r} in row"
                f" {texts[0][0]})"
            )
        else:
            fields = f"{counted(len(texts), 'field')} of column {label}"
            grid.notices.append(
                f"check: {fields} {'is no number' if len(texts) == 1 else 'are no numbers'}"
                f" ({_listed(texts)}): missing"
            )
        if numberlike and 2 * len(texts) <= filled:
            row, text = numberlike[0]
            grid.troubles[column] = (
                f"{text!r} in row {row} of {label} cannot be told: its marks are not those of the other"
                " numbers"
            )


def _listed(texts: list[tuple[int, str]]) -> str:
    """Fields with their rows: all of them, or the first ones."""
    shown = ", ".join(f"{text[:40]!r} in row {row}" for row, text in texts[:MOST_LISTED])
    return shown + (f", and {len(texts) - MOST_LISTED} more" if len(texts) > MOST_LISTED else "")


def _may_be_clock(heading: Heading) -> bool:
    means = meaning(heading)
    return (means is not None and means.quantity == "time") or bool(
        re.search(r"time|zeit|clock|temps|uhr", heading.name)
    )


def _take_clock(grid: Grid, column: int, clock: Clock, label: str, example: str) -> None:
    """Put the seconds of a clock in the place of its texts, and report how they were read."""
    grid.values[:, column] = clock.seconds
    if clock.origin is not None:
        grid.origins[column] = clock.origin
    if grid.headings:
        old = grid.headings[column]
        grid.headings[column] = Heading(old.text, "time" if meaning(old) is None else old.name, "s")
    said = f"column {label} is a clock ({example!r}), read as seconds"
    said += f", as {clock.said}" if clock.said else ""
    grid.notices.append(f"check: {said}; {clock.remedy}" if clock.remedy else said)


def _serial_dates(grid: Grid) -> None:
    """Read clocks that count the days since 1900, as spreadsheets do, in place of their dates."""
    for column, heading in enumerate(grid.headings):
        values = grid.values[:, column]
        there = values[np.isfinite(values)]
        if heading.unit is not None or not _may_be_clock(heading) or there.size < 2:
            continue
        dates = (SERIAL[0] <= there.min()) and (there.max() <= SERIAL[1]) and np.ptp(there) <= YEAR_DAYS
        if dates and 2 * np.sum(there % 1.0 > 0.0) > there.size:
            first = float(np.floor(there[0]))
            days = Clock([float(x) for x in DAY_S * (values - first)], origin=DAY_S * first)
            _take_clock(grid, column, days, repr(heading.text), f"{there[0]:.15g}")
            grid.notices[-1] += ": days since 1900, as spreadsheets count"
