"""Fields of a table that are no plain numbers: clocks, percent signs, grouped thousands, words."""

import re

import numpy as np

from .grid import Grid
from .numerals import clock_seconds, like_a_number
from .spelling import Heading
from .words import meaning

_DAY_S = 86400.0
HUGE = 1e30
"""Minimum magnitude that no reading reaches in any unit. Instruments mark overflow by 1e37 or 9.9e37."""


def read_texts(grid: Grid, parsed: list[list[float | None]]) -> None:
    """Interpret fields of a table that are no plain numbers, and report it. The grid is changed in place.

    Args:
        grid: table with its cells as text.
        parsed: numbers of each row, None where a field is text.
    """
    _grouped_notice(grid)
    _percent_signs(grid)
    _read_words(grid, parsed)
    _drop_marks(grid)


def _grouped_notice(grid: Grid) -> None:
    """Report that thousands were grouped, with an example."""
    for row, cells in zip(grid.rows, grid.cells, strict=True):
        for text in cells:
            if re.fullmatch(
                r"[+-]?\d{1,3}([.,'’ \u00a0\u2009\u202f]\d{3})+[.,]\d*|[+-]?\d{1,3}(['’"
                r" \u00a0\u2009\u202f]\d{3})+",
                text,
            ):
                grid.notices.append(f"thousands are grouped: {text!r} in row {row}")
                return


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


def _drop_marks(grid: Grid) -> None:
    """Remove numbers by which loggers mark a missing reading: all nines, or huge, and far from every
    other."""
    for column in range(grid.values.shape[1]):
        values = grid.values[:, column]
        marks = np.array([_is_mark(value) for value in values])
        others = values[~marks & np.isfinite(values)]
        if not marks.any() or others.size < 2:
            continue
        for value in np.unique(values[marks]):
            if np.min(np.abs(others - value)) <= np.ptp(others):
                continue
            where = values == value
            row = grid.rows[int(np.argmax(where))]
            label = repr(grid.headings[column].text) if grid.headings else f"column {column + 1}"
            grid.notices.append(
                f"check: {value:g} in {int(where.sum())} rows of {label} (first in row {row}) lies farther"
                " from all others than these from each other: taken as a mark for no reading, so missing"
            )
            values[where] = np.nan


def _is_mark(value: float) -> bool:
    """True if a number consists of three or more nines, or exceeds any physical reading."""
    return bool(np.isfinite(value)) and (
        abs(value) >= HUGE or bool(re.fullmatch(r"-?999+(\.9+|\.0*)?", f"{value:.10g}"))
    )


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
        seconds = clock_seconds([cells[column] if column < len(cells) else "" for cells in grid.cells])
        if seconds is not None and (not grid.headings or _may_be_clock(grid.headings[column])):
            grid.values[:, column] = _past_midnight(np.array(seconds))
            if grid.headings:
                old = grid.headings[column]
                grid.headings[column] = Heading(old.text, "time" if meaning(old) is None else old.name, "s")
            grid.notices.append(f"column {label} is a clock ({texts[0][1]!r}), read as seconds")
            continue
        filled = int(np.isfinite(grid.values[:, column]).sum()) + len(texts)
        numberlike = [(row, text) for row, text in texts if like_a_number(text)]
        if 2 * len(texts) > filled:
            grid.notices.append(f"column {label} is text and was left out")
            grid.troubles[column] = (
                f"{len(texts)} of {filled} fields of {label} are no numbers ({texts[0][1]!r} in row"
                f" {texts[0][0]})"
            )
        else:
            row, text = texts[0]
            grid.notices.append(
                f"{len(texts)} fields of column {label} are not numbers ({text!r} in row {row}): missing"
            )
        if numberlike and 2 * len(texts) <= filled:
            row, text = numberlike[0]
            grid.troubles[column] = (
                f"{text!r} in row {row} of {label} cannot be told: its marks are not those of the other"
                " numbers"
            )


def _may_be_clock(heading: Heading) -> bool:
    means = meaning(heading)
    return (means is not None and means.quantity == "time") or bool(
        re.search(r"time|zeit|clock|temps|uhr", heading.name)
    )


def _past_midnight(seconds: np.ndarray) -> np.ndarray:
    """A clock of the day, continued past midnight."""
    filled = np.isfinite(seconds)
    days = np.cumsum(np.diff(seconds[filled], prepend=seconds[filled][0]) < -_DAY_S / 2.0)
    counted = seconds.copy()
    counted[filled] += _DAY_S * days
    return counted
