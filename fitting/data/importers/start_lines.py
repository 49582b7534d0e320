"""The begin of a test, as a line above its table states it: `Datum;03.11.2026 09:10`."""

import re
from typing import NamedTuple

from .clocks import has_time_of_day, read_clock
from .grid import Grid
from .sizes import filled_cells

_OF_A_TEST = r"(?:(?:test|start|measurement|recording|prüf|mess|versuchs|aufnahme)[ -]?)?"
_AT = re.compile(
    rf"{_OF_A_TEST}(?:date(?: ?(?:&|and|/|-)? ?time)?|datum(?: ?(?:&|und|/|-)? ?(?:uhr)?zeit)?)"
    r"(?: of (?:the )?test)?"
    r"|started(?: at)?|start of (?:the )?test|(?:test|versuchs|mess)?beginn|zeitstempel|timestamp"
)
"""Names of a date, or of a date and a time of day, that are those of a test."""
_OF_DAY = re.compile(rf"{_OF_A_TEST}(?:time|zeit)(?: of (?:the )?day)?|(?:uhr|tages)zeit")
"""Names of a time of day on a line of its own."""
_STATED = re.compile(r"\W*(?P<name>[^\W\d][^\d:=]*?)\W*[:=]?\s*(?P<value>\d.*)")


class Begin(NamedTuple):
    """The moment at which a test began, by a line of its file.

    Attributes:
        moment: seconds since `clocks.EPOCH`.
        said: the line.
    """

    moment: float
    said: str


def stated_begin(grid: Grid) -> Begin | None:
    """The begin of a test by the lines above its table; None where none, or several, state date and time.

    A date without a time of day states no begin, nor does one whose day and month cannot be told apart. Dates
    of something else, such as a calibration, are none of the test.

    Args:
        grid: table of the test with the lines above it.
    """
    dates, times = [], []
    for row in grid.preamble:
        said = " ".join(filled_cells(row))
        found = _STATED.fullmatch(said)
        name, value = (found["name"].casefold(), found["value"].strip()) if found else ("", "")
        value = re.sub(r"\s*(?:uhr|h)$", "", value, flags=re.IGNORECASE)
        if _AT.fullmatch(name):
            dates.append((value, said))
            times += [("", "")] if ":" in value else []
        elif _OF_DAY.fullmatch(name) and has_time_of_day(value):
            times.append((value, said))
    if len(dates) != 1 or len(times) != 1:
        return None
    (date, one), (time, two) = dates[0], times[0]
    clock = read_clock([f"{date} {time}".strip()])
    if clock is None or clock.origin is None:
        return None
    return Begin(clock.origin, f"{one}, {two}" if two else one)
