"""A clock whose hours, minutes, seconds and parts of a second stand in columns of their own."""

import re
from typing import NamedTuple

import numpy as np

from pneusma_jax.units import to_si

from .clocks import DAY_S, HOUR_S, continued
from .dates import in_order, may_be_clock
from .grid import Grid
from .spelling import Heading, dimension, plain, unit_name

_LETTERS = {"hh": "h", "ss": "s"}
"""Units that the letters of a clock's format stand for. `mm` are minutes beside one of them."""
_WORDS = {"hour": "h", "minute": "min", "millisecond": "ms", "stunde": "h", "stunden": "h"} | _LETTERS
"""Headings that stand for a unit of time, beside the units themselves."""
_ELAPSED = ("elapsed", "test", "run", "total")
"""Words before a unit of time that name no other quantity."""
_SECOND = r"(?:seconds?|secs?|s)"
_FRACTION = re.compile(
    rf"(?:time )?(?:fraction(?:al|s)?(?: part)?|parts?)(?: of)?(?: an?| the)?,? {_SECOND}|"
    r"(?:time )?(?:milliseconds?|millis|msecs?|ms|millisekunden?|millisecondes?|milisegundos?)|"
    r"sekundenbruchteile?|fractions? de secondes?"
)
"""Headings of the part of a second beside a clock of whole ones."""
SMALLEST_ROUNDED = 1.0
"""Number of the larger unit that the smaller column may reach: 59.97 s may be rounded to 60.0."""


class _Part(NamedTuple):
    """One column of a clock, and its unit in seconds."""

    column: int
    seconds: float


def take_split_clocks(grid: Grid) -> None:
    """Read adjacent columns of falling units of time as one clock. The grid is changed in place.

    They are one clock if the larger ones are whole, and the smaller one begins anew wherever a larger one
    goes on. Two clocks that each count the whole time are not.
    """
    if any(column in grid.clocks for column in range(len(grid.headings))):
        return
    for parts in _groups(grid):
        total = _total(grid, parts)
        if total is not None:
            texts = " and ".join(grid.cells[-1][part.column] for part in parts)
            names = " and ".join(repr(grid.headings[part.column].text) for part in parts)
            seconds = f"{texts} in row {grid.rows[-1]}: {total[-1]:.10g} s"
            _take(grid, parts, total, f"columns {names} are one clock ({seconds})")
            return


def add_fractions(grid: Grid) -> None:
    """Add the parts of a second in a column of their own to the clock of a table, in place.

    The heading says that they are such parts, so they need not begin anew with every second.
    """
    if len(grid.clocks) != 1:
        return
    (clock,) = grid.clocks
    for column, heading in enumerate(grid.headings):
        named = _FRACTION.fullmatch(plain(heading.text))
        if not named or column == clock:
            continue
        unit = 1e-3 if re.search(r"mill?i|msec|\bms$", named[0]) else 1.0
        parts = [_Part(clock, 1.0), _Part(column, unit)]
        total = _total(grid, parts, named=True)
        if total is not None:
            said = f"{heading.text!r} is the part of a second of {grid.headings[clock].text!r}"
            _take(grid, parts, total, said)


def _take(grid: Grid, parts: list[_Part], total: np.ndarray, said: str) -> None:
    """Put the seconds of a clock in the place of its first column, and take the others as read with it."""
    first = parts[0].column
    grid.notices.append(said)
    grid.values[:, first] = total
    grid.headings[first] = Heading(grid.headings[first].text, "time", "s")
    grid.clocks |= {first}
    grid.read_along |= {part.column for part in parts[1:]}
    for part in parts[1:]:
        grid.headings[part.column] = Heading(grid.headings[part.column].text, "part of the clock", None)


def _groups(grid: Grid) -> list[list[_Part]]:
    """Runs of two or more adjacent columns that count time, each in a smaller unit than the one before."""
    groups: list[list[_Part]] = []
    for column in range(len(grid.headings)):
        unit = _unit_of(grid, column)
        if unit is None:
            continue
        part, last = _Part(column, float(to_si(1.0, unit))), groups[-1][-1] if groups else None
        if last is not None and last.column == column - 1 and last.seconds > part.seconds:
            groups[-1].append(part)
        else:
            groups.append([part])
    return [parts for parts in groups if len(parts) > 1]


def _unit_of(grid: Grid, column: int) -> str | None:
    """Unit of time that a heading names; None where it names another quantity, or none."""
    heading = grid.headings[column]
    if heading.unit is not None:
        named = not heading.name or may_be_clock(heading) or heading.name in _ELAPSED
        letters = _WORDS.get(heading.unit.lower(), heading.unit)
        return unit_name(letters) if named and dimension(letters) == "time" else None
    word = _WORDS.get(heading.name, heading.name)
    if word == "mm":
        beside = [grid.headings[c].name for c in (column - 1, column + 1) if 0 <= c < len(grid.headings)]
        return "min" if set(beside) & {*_LETTERS} else None
    return unit_name(word) if word and dimension(word) == "time" else None


def _total(grid: Grid, parts: list[_Part], named: bool = False) -> np.ndarray | None:
    """Seconds of the clock that some columns are, shape (rows,); None if they are no one clock.

    Args:
        grid: table.
        parts: its columns, the largest unit first.
        named: true if the headings say that the smaller ones are parts of the larger ones.
    """
    values = [grid.values[:, part.column] for part in parts]
    if len(grid.rows) < 2 or not all(np.isfinite(column).all() for column in values):
        return None
    if any(np.any(column % 1.0 != 0.0) for column in values[:-1]) or np.any(values[0] < 0.0):
        return None
    for larger, part, column in zip(parts[:-1], parts[1:], values[1:], strict=True):
        if np.any(column < 0.0) or np.any(column * part.seconds > SMALLEST_ROUNDED * larger.seconds):
            return None
    total = sum(part.seconds * column for part, column in zip(parts, values, strict=True))
    period = {HOUR_S: DAY_S, 60.0: HOUR_S}.get(parts[0].seconds)
    if period is not None and np.all(total < period):
        total = np.array(continued([float(x) for x in total], period))
    begins_anew = any(np.any(np.diff(column) < 0.0) for column in values[1:])
    still = all(np.ptp(column) == 0.0 for column in values[:-1])
    one = named or begins_anew or still
    return total if in_order(total) and np.ptp(total) > 0.0 and one else None
