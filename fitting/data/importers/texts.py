"""Fields of a table that are no plain numbers: clocks (as text or counted), percent signs, grouped thousands,
words."""

import numpy as np

from pneusma_jax.errors import counted

from .clocks import Clock, read_clock
from .dates import (
    clock_under_another_heading,
    day_and_time,
    disagreement,
    has_clock,
    may_be_clock,
    may_be_date,
    names_a_unit_of_time,
    since_1900,
    since_1970,
)
from .grid import Grid
from .grouped import doubt_groups, say_grouped
from .marks import drop_marks
from .names import first_few
from .numerals import like_a_number
from .spelling import Heading, dimension, unit_name
from .split_clocks import add_fractions, take_split_clocks
from .words import meaning
from .written_blanks import say_written_blanks

MOST_LISTED = 6
"""Number of fields that a notice lists with their rows."""
MOST_EXAMPLES = 3
"""Number of texts that a notice about a column of text shows."""
COUNTER_BITS = (16, 32)
"""Bits of counters, which begin anew where these are full."""
LONGEST_STEP = 3.0
"""Maximum step of a counter where it begins anew, over its largest other one [1]."""
AFTER_WRAP, BEFORE_WRAP = 0.1, 0.9
"""Just after it begins anew a counter is below the first part of its period, just before above the second
[1]."""


def read_texts(grid: Grid, parsed: list[list[float | None]], decimal: str = ".") -> None:
    """Interpret fields of a table that are no plain numbers, and report it. The grid is changed in place.

    The order counts. Doubts about grouped thousands come first, since they change what is a number. Which
    headings name a time is asked before any column is taken as a clock, since that renames it. A date and a
    time of day are one clock before either can be one alone. Marks go before clocks that are counted, whose
    range they would spoil. Columns that are one clock together go before those, and all before the last
    resort, a column that a unit names. Parts of a second need the clock.

    Args:
        grid: table with its cells as text.
        parsed: numbers of each row, None where a field is text.
        decimal: decimal mark with which they were read.
    """
    say_grouped(grid, decimal)
    doubt_groups(grid, decimal)
    _percent_signs(grid)
    clockless = bool(grid.headings) and not has_clock(grid)
    _take_day_and_time(grid)
    _read_words(grid, parsed, clockless)
    drop_marks(grid)
    take_split_clocks(grid)
    say_written_blanks(grid)
    _take_counted_dates(grid, clockless)
    _continue_counters(grid)
    if clockless and not _has_unit_of_time(grid):
        _take_named_by_unit(grid)
    add_fractions(grid)


def _has_unit_of_time(grid: Grid, *units: str) -> bool:
    """True if a column has one of some units, by default any unit of time; a clock that was taken has `s`."""
    return any(h.unit in units if units else dimension(h.unit) == "time" for h in grid.headings)


def _percent_signs(grid: Grid) -> None:
    """Take the unit of columns whose fields end in a percent sign from that sign."""
    for column, heading in enumerate(grid.headings):
        signs = sum(cells[column].endswith("%") for cells in grid.cells if column < len(cells))
        if signs and heading.unit in (None, "1", "percent"):
            grid.headings[column] = Heading(heading.text, heading.name, "percent", heading.zero)
            filled = sum(bool(cells[column]) for cells in grid.cells if column < len(cells))
            if signs < filled:
                grid.trouble_rows.pop(column, None)
                grid.troubles[column] = (
                    f"{signs} of {filled} fields of {heading.text!r} end in a percent sign and the others do"
                    " not"
                )
            grid.notices.append(f"fields of column {heading.text!r} end in a percent sign: taken as percent")


def _take_day_and_time(grid: Grid) -> None:
    """Read a column of dates and one of times of day as one clock."""
    pair = day_and_time(grid)
    if pair is None:
        return
    day, time, clock = pair
    label = " and ".join(_label(grid, k) for k in (day, time))
    example = " ".join(grid.cells[0][k] for k in (day, time) if k < len(grid.cells[0]))
    _take_clock(grid, time, clock, f"columns {label} are one clock", example)
    grid.read_along |= {day}


def _read_words(grid: Grid, parsed: list[list[float | None]], clockless: bool) -> None:
    """Interpret columns of text: clocks, columns of words, and fields of number columns that are no
    numbers.

    Args:
        grid: table with its cells as text; changed in place.
        parsed: numbers of each row, None where a field is text.
        clockless: true if no heading of the table names a time.
    """
    for column in range(grid.values.shape[1]):
        if column in grid.read_along or column in grid.origins:
            continue
        texts = [
            (row, cells[column])
            for row, cells, numbers in zip(grid.rows, grid.cells, parsed, strict=True)
            if column < len(numbers) and numbers[column] is None
        ]
        if not texts or _is_clock(grid, column, texts[0][1], clockless):
            continue
        filled = int(np.isfinite(grid.values[:, column]).sum()) + len(texts)
        if 2 * len(texts) > filled:
            _leave_out(grid, column, texts, filled)
        else:
            _call_missing(grid, column, texts)


def _label(grid: Grid, column: int) -> str:
    """A column's heading, quoted, or its number."""
    text = grid.headings[column].text if grid.headings else ""
    return repr(text) if text else str(column + 1)


def _is_clock(grid: Grid, column: int, example: str, clockless: bool) -> bool:
    """Take a column of text as a clock, or compare it with one; true if it is done with."""
    label = _label(grid, column)
    if grid.headings and not may_be_clock(grid.headings[column]):
        return _take_or_compare_clock(grid, column, clockless, label, example)
    clock = read_clock(grid.texts(column), grid.headings[column].text if grid.headings else "")
    if clock is not None:
        _take_clock(grid, column, clock, f"column {label} is a clock", example)
    return clock is not None


def _leave_out(grid: Grid, column: int, texts: list[tuple[int, str]], filled: int) -> None:
    """Report a column that is text in most of its `filled` fields."""
    label, (row, example) = _label(grid, column), texts[0]
    place = label if grid.headings else f"column {label}"
    if grid.headings and may_be_clock(grid.headings[column]):
        grid.notices.append(
            f"check: column {label} cannot be read as a clock ({example!r} in row {row})"
            " and was left out. Write it as seconds or as 2024-05-31 12:00:05, or state the step with"
            " --interval"
        )
    else:
        asked = "check: " if _may_be_missed(grid, column, texts) else ""
        grid.notices.append(f"{asked}column {label} is text and was left out ({_examples(texts)})")
    grid.trouble_rows.pop(column, None)
    grid.troubles[column] = (
        f"{len(texts)} of {filled} fields of {place} are no numbers ({example!r} in row {row})"
    )


def _call_missing(grid: Grid, column: int, texts: list[tuple[int, str]]) -> None:
    """Report the fields of a column of numbers that are none."""
    label = _label(grid, column)
    fields = f"{counted(len(texts), 'field')} of column {label}"
    grid.notices.append(
        f"check: {fields} {'is no number' if len(texts) == 1 else 'are no numbers'}"
        f" ({_listed(texts)}): missing"
    )
    place = label if grid.headings else f"column {label}"
    doubtful = [(row, text) for row, text in texts if like_a_number(text)]
    if doubtful:
        row, text = doubtful[0]
        other = grid.trouble_rows.pop(column, frozenset()) if column in grid.troubles else frozenset({row})
        grid.troubles[column] = (
            f"{text!r} in row {row} of {place} cannot be told: its marks are not those of the other"
            f" numbers{_other_marks(grid, column, text)}"
        )
        if other:
            grid.trouble_rows[column] = other | {row for row, _ in doubtful}


def _other_marks(grid: Grid, column: int, text: str) -> str:
    """The number of a column with most marks of a doubtful one, as words: it tells what these marks mean."""
    marks = {mark for mark in text if mark in ".,'"}
    fields = zip(grid.rows, grid.texts(column), grid.values[:, column], strict=True)
    others = [(sum(map(other.count, marks)), row, other) for row, other, x in fields if np.isfinite(x)]
    count, row, other = max(others, key=lambda found: found[0], default=(0, 0, ""))
    return f" ({other!r} in row {row})" if count else ""


def _may_be_missed(grid: Grid, column: int, texts: list[tuple[int, str]]) -> bool:
    """True if a column of text is headed by a quantity, or by a date that changes."""
    if not grid.headings:
        return True
    heading = grid.headings[column]
    return meaning(heading) is not None or (may_be_date(heading) and len({text for _, text in texts}) > 1)


def _examples(texts: list[tuple[int, str]]) -> str:
    """The first texts of a column that differ, a few of them."""
    different = dict.fromkeys(text for _, text in texts)
    return first_few((repr(text[:20]) for text in different), MOST_EXAMPLES)


def _listed(texts: list[tuple[int, str]]) -> str:
    """Fields with their rows: all of them, or the first ones."""
    shown = ", ".join(f"{text[:40]!r} in row {row}" for row, text in texts[:MOST_LISTED])
    return shown + (f", and {len(texts) - MOST_LISTED} more" if len(texts) > MOST_LISTED else "")


def _take_or_compare_clock(grid: Grid, column: int, clockless: bool, label: str, example: str) -> bool:
    """Take a clock under a heading that names no time, where a table has no other one; else compare them.

    Returns:
        True if the column is done with.
    """
    clock = clock_under_another_heading(grid, column)
    if clock is None:
        return False
    if clockless and not _has_unit_of_time(grid, "s"):  # one in ms does not keep dates from it
        subject = f"column {label} is a clock"
        _take_clock(grid, column, clock, subject, example, "; no heading names a time", asked=True)
        return True
    said = disagreement(grid, column, clock)
    grid.notices.append(said or f"column {label} is a clock, too ({example!r}), and was left out")
    return True


def _take_clock(
    grid: Grid, column: int, clock: Clock, subject: str, example: str, more: str = "", asked: bool = False
) -> None:
    """Put the seconds of a clock in the place of its texts, and report how they were read.

    Args:
        grid: table; changed in place.
        column: column of the clock.
        clock: its readings.
        subject: first words of the notice, such as `column 'Time' is a clock`.
        example: text of its first reading.
        more: last words of the notice.
        asked: true if the notice is one to be looked at, as it always is where there is a remedy.
    """
    grid.values[:, column] = clock.seconds
    grid.clocks |= {column}
    if clock.origin is not None:
        grid.origins[column] = clock.origin
    if grid.headings:
        old = grid.headings[column]
        grid.headings[column] = Heading(old.text, "time" if meaning(old) is None else old.name, "s")
    said = f"{subject} ({example!r}), read as seconds"
    said += f", as {clock.said}" if clock.said else ""
    said += f"; {clock.remedy}" if clock.remedy else ""
    grid.notices.append(f"{'check: ' if asked or clock.remedy else ''}{said}{more}")


def _continue_counters(grid: Grid) -> None:
    """Continue a clock in milli- or microseconds that begins anew at 2^16 or 2^32, as microcontrollers do."""
    for column, heading in enumerate(grid.headings):
        values = grid.values[:, column]
        unit = unit_name(heading.unit or heading.name)
        if unit not in ("ms", "us") or not np.isfinite(values).all() or values.size < 2:
            continue
        falls = np.diff(values) < 0.0
        for bits in COUNTER_BITS:
            period = 2.0**bits
            before, after = values[:-1] / period, values[1:] / period
            wraps = falls & (before > BEFORE_WRAP) & (after < AFTER_WRAP)
            inside = values.min() >= 0.0 and values.max() < period and falls.any()
            steps = np.where(falls, np.diff(values) + period, np.diff(values))
            usual = float(np.max(steps[~falls], initial=0.0))
            if inside and np.array_equal(falls, wraps) and np.all(steps[falls] <= LONGEST_STEP * usual):
                grid.values[1:, column] += period * np.cumsum(wraps)
                row = grid.rows[int(np.argmax(wraps)) + 1]
                grid.notices.append(
                    f"check: {heading.text!r} begins anew in row {row}, where a counter of {bits} bits does:"
                    " continued"
                )
                break


def _take_named_by_unit(grid: Grid) -> None:
    """Give the one column that rises in every row, and is named by a unit of time (`millis`), that unit."""
    found = []
    for column, heading in enumerate(grid.headings):
        if names_a_unit_of_time(heading) and np.all(np.diff(grid.values[:, column]) > 0.0):
            found.append(column)
    if len(found) == 1:
        old = grid.headings[found[0]]
        grid.headings[found[0]] = Heading(old.text, old.name, unit_name(old.name))


def _take_counted_dates(grid: Grid, clockless: bool) -> None:
    """Read clocks that count from a date: days since 1900, as spreadsheets do, or seconds since 1970."""
    for column, heading in enumerate(grid.headings):
        values = grid.values[:, column]
        there = values[np.isfinite(values)]
        named = may_be_clock(heading) or (clockless and may_be_date(heading))
        if heading.unit is not None or not named or there.size < 2:
            continue
        subject, example = f"column {heading.text!r} is a clock", f"{there[0]:.15g}"
        if (days := since_1900(values)) is not None:
            more = ": days since 1900, as spreadsheets count"
            _take_clock(grid, column, days, subject, example, more)
        elif (found := since_1970(values)) is not None:
            _take_clock(grid, column, found[0], subject, example, f": {found[1]} since 1970")
