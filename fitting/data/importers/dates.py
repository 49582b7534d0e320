"""Dates: the day beside a time of day, clocks whose heading names no time, numbers that count from a date."""

import math
import re
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from ..recordings.columns import convert
from .clocks import DAY_S, EPOCH, Clock, has_time_of_day, read_clock, without_midnight
from .grid import Grid
from .numerals import is_blank
from .spelling import Heading, dimension, plain, unit_name
from .split_by_name import names_specimens
from .words import meaning

ELAPSED_S = 60.0
"""Minimum reading of a time of day beside one date [s]. One that begins at midnight is an elapsed time."""
APART = 0.02
"""Minimum difference of the durations of two clocks that is reported, as part of the longer one."""
YEAR_DAYS = 366.0
"""Maximum length of a test whose clock counts from a date [d]."""
SERIAL = (36526.0, 73050.0)
"""Days since 1900, as spreadsheets count them, from the year 2000 to 2099."""
_UNIX = datetime(1970, 1, 1)
_EPOCHS = (946684800.0, 4102444800.0)  # the years 2000 to 2099 [s]
_PARTS = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
_SECOND = r"(?:seconds?|secs?|s)"
_FRACTION = re.compile(
    rf"(?:time )?(?:fraction(?:al|s)?(?: part)?|parts?)(?: of)?(?: an?| the)?,? {_SECOND}|"
    r"(?:time )?(?:milliseconds?|millis|msecs?|ms|millisekunden?|millisecondes?|milisegundos?)|"
    r"sekundenbruchteile?|fractions? de secondes?"
)
"""Headings of the part of a second beside a clock of whole ones."""
_DATE = re.compile(r"\bdate|datum|fecha|日期")


def may_be_clock(heading: Heading) -> bool:
    """True if a heading names a time."""
    means = meaning(heading)
    return (means is not None and means.quantity == "time") or bool(
        re.search(r"time|zeit|clock|temps|uhr", heading.name)
    )


def names_a_unit_of_time(heading: Heading) -> bool:
    """True if a heading is a unit of time alone: `millis`. `Min` and `Std` are statistics, `h` a height."""
    word = heading.name if heading.unit is None and len(heading.name) > 1 else ""
    return word not in ("min", "std") and dimension(word) == "time"


def may_be_date(heading: Heading) -> bool:
    """True if a heading names a date."""
    return bool(_DATE.search(heading.name))


def has_clock(grid: Grid) -> bool:
    """True if a heading names a time, and its column is not empty."""
    return any(
        may_be_clock(heading) and any(grid.texts(column))
        for column, heading in enumerate(grid.headings)
    )


def day_and_time(grid: Grid) -> tuple[int, int, Clock] | None:
    """The column of dates and that of the time of day which are one clock, and its readings.

    None where a table has no such pair, or the order of day and month cannot be told.
    """
    days, times = [], []
    for column, heading in enumerate(grid.headings):
        texts = grid.texts(column)
        filled = [text for text in texts if text and not is_blank(text)]
        if not filled or names_specimens(heading):
            continue
        dates = without_midnight(filled)
        if dates is not None:
            days.append((column, _filled_down(texts)))
        elif may_be_clock(heading) and all(map(has_time_of_day, filled)):
            times.append((column, texts))
    if len(days) != 1 or len(times) != 1:
        return None
    (day, dates_down), (time, texts) = days[0], times[0]
    pairs = [f"{date} {text}" if date and text else "" for date, text in zip(dates_down, texts, strict=True)]
    alone, clock = read_clock(texts, grid.headings[time].text), read_clock(pairs)
    if alone is None or clock is None or clock.origin is None:
        return None
    moments, counted_on = np.array(clock.seconds), np.array(alone.seconds)
    changes = len({date for date in dates_down if date}) > 1
    jumps = np.any(np.abs(np.diff(moments[np.isfinite(moments)])) >= DAY_S)
    if (jumps or not changes) and not np.nanmin(counted_on) >= ELAPSED_S:
        return None
    if not in_order(moments) and in_order(counted_on):
        seconds = counted_on - counted_on[np.isfinite(moments)][0]
        said = "the date stays the same past midnight, so the time of day was counted on"
        clock = clock._replace(seconds=[float(x) for x in seconds], remedy=said)
    return day, time, clock


def in_order(values: np.ndarray) -> bool:
    """True if numbers never fall, or never rise."""
    steps = np.diff(values[np.isfinite(values)])
    return bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))


def clock_under_another_heading(grid: Grid, column: int) -> Clock | None:
    """Readings of a column that goes on like a clock, and whose heading names neither time nor specimen.

    They may go back in every row: some logs begin with the newest one.
    """
    heading = grid.headings[column]
    if names_specimens(heading) or meaning(heading) is not None:
        return None
    clock = read_clock(grid.texts(column), heading.text)
    if clock is None:
        return None
    seconds = np.array(clock.seconds)
    seconds = seconds[np.isfinite(seconds)]
    return clock if np.any(np.diff(seconds) != 0.0) and in_order(seconds) else None


def since_1900(values: np.ndarray) -> Clock | None:
    """Readings of numbers that count the days since 1900, as spreadsheets do, most with a time of day.

    None of others.
    """
    there = values[np.isfinite(values)]
    if there.min() < SERIAL[0] or there.max() > SERIAL[1] or np.ptp(there) > YEAR_DAYS:
        return None
    if 2 * np.sum(there % 1.0 > 0.0) <= there.size:
        return None
    first = float(there[0])
    return Clock([float(x) for x in DAY_S * (values - first)], origin=DAY_S * first)


def since_1970(values: np.ndarray) -> tuple[Clock, str] | None:
    """Readings of numbers that count seconds, or parts of one, since 1970; None of others.

    Returns:
        The clock, and the unit that the numbers count.
    """
    there = values[np.isfinite(values)]
    for unit, parts in _PARTS.items():
        if there.size > 1 and np.all((parts * _EPOCHS[0] <= there) & (there <= parts * _EPOCHS[1])):
            if 0.0 < np.ptp(there) <= parts * DAY_S * YEAR_DAYS:
                first = float(there[0])
                seconds = [float(x) for x in (values - first) / parts]
                return Clock(seconds, origin=(_UNIX - EPOCH).total_seconds() + first / parts), unit
    return None


def add_fractions(grid: Grid) -> None:
    """Add parts of a second that stand in a column of their own to a clock that was read from times of day.

    The grid is changed in place.
    """
    for column, heading in enumerate(grid.headings):
        values, named = grid.values[:, column], _FRACTION.fullmatch(plain(heading.text))
        if not named or column in grid.clocks or len(grid.clocks) != 1 or np.isnan(values).any():
            continue
        (clock,) = grid.clocks
        time = grid.values[:, clock]
        milli = re.search(r"mill?i|msec|\bms$", named[0])
        parts = (1e-3 if milli else 1.0) * values
        fits = np.all((parts >= 0.0) & (parts < 1.0)) and np.all(time % 1.0 == 0.0)
        if fits and in_order(time + parts):
            grid.values[:, clock] = time + parts
            grid.read_along |= {column}
            grid.notices.append(
                f"{heading.text!r} is the part of a second of {grid.headings[clock].text!r}"
            )


def disagreement(grid: Grid, column: int, clock: Clock) -> str:
    """Notice about dates that last another time than the clock of a table; empty where they agree.

    Args:
        grid: table whose clock has been read.
        column: column of the dates.
        clock: its readings.
    """
    dated = np.array(clock.seconds)
    for other, heading in enumerate(grid.headings):
        means, values = meaning(heading), grid.values[:, other]
        both = np.isfinite(values) & np.isfinite(dated)
        if means is None or means.quantity != "time" or dimension(heading.unit) != "time" or both.sum() < 2:
            continue
        lasts = float(convert(np.ptp(values[both]), unit_name(str(heading.unit)), "s"))
        said = float(np.ptp(dated[both]))
        steps = np.diff(dated[both])
        step = float(steps[steps > 0.0].min()) if (steps > 0.0).any() else math.inf
        if abs(lasts - said) > max(APART * max(lasts, said), 2.0 * step):
            dates = repr(grid.headings[column].text)
            return (
                f"check: by {heading.text!r} the test lasts {lasts:.6g} s, and by {dates} {said:.6g} s:"
                f" is the unit of {heading.text!r} right? --unit time=... or --map"
                f" time={column + 1} corrects it"
            )
    return ""


def _filled_down(texts: Sequence[str]) -> list[str]:
    """Texts in which an empty field repeats the one above; midnights are left out."""
    found, last = [], ""
    for text in texts:
        last = (without_midnight([text]) or [""])[0] if text and not is_blank(text) else last
        found.append(last)
    return found
