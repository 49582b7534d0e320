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
from .spelling import Heading, dimension, unit_name
from .split_by_name import names_specimens
from .words import meaning

ELAPSED_S = 60.0
"""Minimum reading of a time of day that stands beside one date alone [s]. A column that begins within a
minute of midnight counts the time of the test: few tests begin then."""
DURATIONS_DIFFER = 0.02
"""Minimum difference of the durations of two clocks that is reported, as part of the longer one [1]."""
YEAR_DAYS = 366.0
"""Maximum length of a test whose clock counts from a date [d]."""
CENTURY_D = (36526.0, 73050.0)
"""Begin and end of the years 2000 to 2099 in days since 1900, as spreadsheets count them [d]."""
_UNIX = datetime(1970, 1, 1)
_CENTURY_S = (946684800.0, 4102444800.0)
"""Begin and end of the same years in seconds since 1970 [s]."""
_PER_SECOND = {"seconds": 1.0, "milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
"""Number of units of time in a second, by their name."""
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

    A table without headings may have such a pair, too. None where a table has none, or the order of day and
    month cannot be told. None also where the times count from the begin of the test: near zero, beside one
    date alone or dates that jump by a day.
    """
    days, times = [], []
    for column in range(grid.values.shape[1]):
        heading = grid.headings[column] if grid.headings else None
        texts = grid.texts(column)
        filled = [text for text in texts if text and not is_blank(text)]
        if not filled or (heading is not None and names_specimens(heading)):
            continue
        dates = without_midnight(filled)
        if dates is not None:
            days.append((column, _filled_down(texts)))
        elif (heading is None or may_be_clock(heading)) and all(map(has_time_of_day, filled)):
            times.append((column, texts))
    if len(days) != 1 or len(times) != 1:
        return None
    (day, dates_down), (time, texts) = days[0], times[0]
    pairs = [f"{date} {text}" if date and text else "" for date, text in zip(dates_down, texts, strict=True)]
    named = grid.headings[time].text if grid.headings else ""
    alone, clock = read_clock(texts, named), read_clock(pairs)
    if alone is None or clock is None or clock.origin is None:
        return None
    moments, times_alone = np.array(clock.seconds), np.array(alone.seconds)
    one_date = len({date for date in dates_down if date}) <= 1
    jumps = np.any(np.abs(np.diff(moments[np.isfinite(moments)])) >= DAY_S)
    if (jumps or one_date) and not np.nanmin(times_alone) >= ELAPSED_S:
        return None
    if not in_order(moments) and in_order(times_alone):  # `read_clock` goes on past midnight
        seconds = times_alone - times_alone[np.isfinite(moments)][0]
        check = "the date stays the same past midnight, so the time of day was counted on"
        clock = clock._replace(seconds=[float(x) for x in seconds], remedy=check)
    return day, time, clock


def in_order(values: np.ndarray) -> bool:
    """True if numbers never fall, or never rise."""
    steps = np.diff(values[np.isfinite(values)])
    return bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))


def clock_under_another_heading(grid: Grid, column: int) -> Clock | None:
    """Clock of a column whose heading names neither a quantity nor a specimen; None if it is no clock.

    Its readings never fall, or never rise: some logs begin with the newest one.
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
    """Clock of numbers that count the days since 1900, as spreadsheets do; None if they count anything else.

    They do if all lie in this century and within a year, and most have a time of day behind the point.
    """
    there = values[np.isfinite(values)]
    if there.min() < CENTURY_D[0] or there.max() > CENTURY_D[1] or np.ptp(there) > YEAR_DAYS:
        return None
    if 2 * np.sum(there % 1.0 > 0.0) <= there.size:
        return None
    first = float(there[0])
    return Clock([float(x) for x in DAY_S * (values - first)], origin=DAY_S * first)


def since_1970(values: np.ndarray) -> tuple[Clock, str] | None:
    """Clock of numbers that count seconds, or parts of one, since 1970; None if they count anything else.

    Returns:
        The clock, and the unit that the numbers count.
    """
    there = values[np.isfinite(values)]
    begin, end = _CENTURY_S
    for unit, count in _PER_SECOND.items():
        if there.size > 1 and np.all((count * begin <= there) & (there <= count * end)):
            if 0.0 < np.ptp(there) <= count * DAY_S * YEAR_DAYS:
                first = float(there[0])
                seconds = [float(x) for x in (values - first) / count]
                return Clock(seconds, origin=(_UNIX - EPOCH).total_seconds() + first / count), unit
    return None


def disagreement(grid: Grid, column: int, clock: Clock) -> str:
    """Notice that by its dates a test lasts longer or shorter than by its clock; empty where they agree.

    They agree within `DURATIONS_DIFFER`, or two steps of the dates, which may be whole seconds or minutes.

    Args:
        grid: table whose clock has been read.
        column: column of the dates.
        clock: readings of the dates.
    """
    dated = np.array(clock.seconds)
    for other, heading in enumerate(grid.headings):
        means, values = meaning(heading), grid.values[:, other]
        both = np.isfinite(values) & np.isfinite(dated)
        if means is None or means.quantity != "time" or dimension(heading.unit) != "time" or both.sum() < 2:
            continue
        by_clock = float(convert(np.ptp(values[both]), unit_name(str(heading.unit)), "s"))
        by_dates = float(np.ptp(dated[both]))
        steps = np.diff(dated[both])
        step = float(steps[steps > 0.0].min()) if (steps > 0.0).any() else math.inf
        if abs(by_clock - by_dates) > max(DURATIONS_DIFFER * max(by_clock, by_dates), 2.0 * step):
            dates = repr(grid.headings[column].text)
            return (
                f"check: by {heading.text!r} the test lasts {by_clock:.6g} s, and by {dates}"
                f" {by_dates:.6g} s: is the unit of {heading.text!r} right? --unit time=... or --map"
                f" time={column + 1} corrects it"
            )
    return ""


def _filled_down(texts: Sequence[str]) -> list[str]:
    """Dates in which an empty field repeats the one above, without the midnight behind each."""
    found, last = [], ""
    for text in texts:
        if text and not is_blank(text):
            last = (without_midnight([text]) or [""])[0]
        found.append(last)
    return found
