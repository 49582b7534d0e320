"""Parser of clocks: times of day, elapsed times, dates with or without a time zone. A column has one
format."""

import math
import re
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import NamedTuple

from .numerals import is_blank

DAY_S, HOUR_S = 86400.0, 3600.0
EPOCH = datetime(1899, 12, 30)
"""Day 0 of the days that spreadsheets count."""
MOST_FRAMES = 30
"""Number of pictures a second of most films, which the last number of their clocks does not reach."""
_MONTHS = {
    word: number
    for number, words in enumerate(
        ("jan", "feb fév", "mar mär mrz", "apr avr", "may mai", "jun juin", "jul juil", "aug aoû", "sep",
         "oct okt", "nov", "dec dez déc"), start=1,
    ) for word in words.split()
}  # fmt: skip
_TIME = r"(?P<parts>\d{1,4}(?::\d{1,3}){1,3})(?:[.,](?P<part>\d+))?\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
_ZONE = r"(?:\s*(?P<zone>Z|UTC|GMT|[A-Z]{3,4}|(?:UTC|GMT)?[+-]\d{2}(?::?\d{2})?))?"
_DATE = (
    r"(?:(?P<compact>\d{8})|(?:[A-Za-z]{2,9}\.?,?\s+)?(?P<a>\d{1,4}|[A-Za-zäéû]{3,9})\.?(?P<mark>[-/. ])\s?"
    r"(?P<b>\d{1,2}|[A-Za-zäéû]{3,9})\.?(?:(?P=mark)|,?\s)\s?(?P<c>\d{4}|\d{2}))"
)
_UNDATED = re.compile(rf"(?:(?P<days>\d+)\s*(?:d|days?,?)\s*)?{_TIME}")
_DATED = re.compile(rf"{_DATE}(?:(?:\s*[-T,_]\s*|\s+){_TIME})?{_ZONE}")
_LETTERED = re.compile(
    r"(?:PT?)?(?=\d)(?:(?P<d>\d+)\s*(?:d|days?|tage?)(?![a-z])[\s,T]*)?"
    r"(?:(?P<h>\d+)\s*(?:hours?|hrs?|std|h)(?![a-z])[\s,:]*)?"
    r"(?:(?P<min>\d+)\s*(?:minutes?|mins?|m(?!s)|['′’])[\s,:]*)?"
    r"(?:(?P<s>\d+(?:[.,]\d+)?)\s*(?:seconds?|secs?|sek|s(?![a-z])|''|″|\")[\s,]*)?"
    r"(?:(?P<ms>\d+)\s*ms)?(?P<bare>\d+(?:[.,]\d+)?)?",
    re.IGNORECASE,
)
"""Elapsed times whose parts stand before letters or strokes: `1m30s`, `2 h 5 min`, `1'30"`, `PT1M30S`. The
last one may have none: `1m30`, `1h30`."""
_NEXT = {"h": "min", "min": "s"}
"""Unit of a last part without letters, by that of the part before it."""
_IN_SECONDS = {"d": DAY_S, "h": HOUR_S, "min": 60.0, "s": 1.0, "ms": 1e-3}
_ORDERS = {"ymd": "year-month-day", "dmy": "day/month/year", "mdy": "month/day/year"}


class Clock(NamedTuple):
    """A column of clock readings.

    Attributes:
        seconds: seconds since the first midnight, since the clock's own zero, or since the first date; NaN
            where blank.
        said: interpretation, in words; empty where there is only one.
        remedy: advice for those to whom another interpretation, which gives other numbers, is the right one.
        origin: moment of 0 seconds since `EPOCH` [s]; None where no date states it, or several might.
    """

    seconds: list[float]
    said: str = ""
    remedy: str = ""
    origin: float | None = None


def like_a_clock(text: str) -> bool:
    """True if a field may be a date or a time of day."""
    text = text.strip()
    return ":" in text and bool(_UNDATED.fullmatch(text)) or bool(_DATED.fullmatch(text)) or bool(
        re.fullmatch(r"\d{1,4}[-:/.]\d{1,2}[-:/.]\d{1,4}", text)
    ) or len(_lettered_parts(text)) > 1  # fmt: skip


def has_time_of_day(text: str) -> bool:
    """True if a field is a time of day, or an elapsed time, without a date."""
    return ":" in text and bool(_UNDATED.fullmatch(text.strip()))


def without_midnight(texts: Sequence[str]) -> list[str] | None:
    """Dates without the midnight that spreadsheets write behind them; None if a field is no date alone."""
    dates = []
    for text in texts:
        date = re.sub(r"[T ]00:00(?::00)?$", "", text.strip())
        found = _DATED.fullmatch(date)
        if found is None or found["parts"]:
            return None
        dates.append(date)
    return dates


def read_clock(texts: Sequence[str], heading: str = "") -> Clock | None:
    """Clock readings of a column, in one format for all of its fields.

    Of several formats that fit every field, one whose readings do not decrease is preferred, then the one
    with the shortest test.

    Args:
        texts: fields of the column.
        heading: text of the column's heading. It may name the format (`mm:ss`).

    Returns:
        The clock, or None where a field is neither blank nor a clock, or no format fits all fields.
    """
    stripped = [text.strip().strip('"') for text in texts]
    filled = [text for text in stripped if text and not is_blank(text)]
    if not filled:
        return None
    found = _undated(filled, heading) or _lettered(filled) or _dated(filled)
    if found is None:
        return None
    readings = iter(found.seconds)
    seconds = [next(readings) if text and not is_blank(text) else math.nan for text in stripped]
    return found._replace(seconds=seconds)


class _Format(NamedTuple):
    """One format and its readings in seconds."""

    name: str
    seconds: list[float]


def _picked(formats: list[_Format], remedy: str = "") -> Clock | None:
    """The format whose readings do not decrease and last shortest."""
    if not formats:
        return None

    def order(one: _Format) -> tuple[bool, float]:
        falls = any(b < a for a, b in zip(one.seconds[:-1], one.seconds[1:], strict=True))
        return falls, max(one.seconds) - min(one.seconds)

    first, *others = sorted(formats, key=order)
    others = [other for other in others if other.seconds != first.seconds]
    if not others:
        return Clock(first.seconds, first.name if len(formats) > 1 else "")
    lasting = ", ".join(f"{other.name}: {order(other)[1]:g} s" for other in others)
    said = f"{first.name}, with which it lasts {order(first)[1]:g} s ({lasting})"
    return Clock(first.seconds, said, remedy)


def continued(seconds: list[float], period: float) -> list[float]:
    """Readings of a clock that begins anew after a period, such as midnight, counted on.

    Where most of them fall, the last one is the first in time.
    """
    if math.isinf(period):
        return seconds
    steps = [b - a for a, b in zip(seconds[:-1], seconds[1:], strict=True) if abs(b - a) <= period / 2.0]
    if sum(step < 0.0 for step in steps) > sum(step > 0.0 for step in steps):
        return _counted_on(seconds[::-1], period)[::-1]
    return _counted_on(seconds, period)


def _counted_on(seconds: list[float], period: float) -> list[float]:
    turns, counted = 0, []
    for k, value in enumerate(seconds):
        turns += k > 0 and value - seconds[k - 1] < -period / 2.0
        counted.append(value + turns * period)
    return counted


def _undated(texts: list[str], heading: str) -> Clock | None:
    """Times of day and elapsed times."""
    rows = [_UNDATED.fullmatch(text) for text in texts]
    if not all(rows):
        return None
    found = [row for row in rows if row is not None]
    days = [DAY_S * int(row["days"] or 0) for row in found]
    parts = [row["parts"].split(":") for row in found]
    rest = [_fraction(row["part"]) for row in found]
    numbers = [[int(text) for text in row] for row in parts]
    counts = {len(row) for row in numbers}
    half = [row["half"] for row in found]

    def made(name: str, seconds: Callable[[list[int]], float], period: float = math.inf) -> _Format:
        values = [d + seconds(row) + f for d, row, f in zip(days, numbers, rest, strict=True)]
        return _Format(name, continued(values, period))

    within = all(number < 61 for row in numbers for number in row[1:])
    within = within and all(len(text) < 3 for row in parts for text in row[1:])
    if any(half):
        if not all(half) or not within or max(counts) > 3:
            return None
        numbers = [[_of_half(row[0], h), *row[1:]] for row, h in zip(numbers, half, strict=True)]
        return _picked([made("hours:minutes:seconds", _sexagesimal, DAY_S)])
    if counts == {3} and within:
        return _picked([made("hours:minutes:seconds", _sexagesimal, DAY_S)])
    if counts == {2, 3} and within:
        return _picked([made("hours:minutes:seconds", lambda row: _sexagesimal([0, *row][-3:]))])
    if counts == {2} and within:
        wrapping = HOUR_S if all(row[0] < 60 for row in numbers) else math.inf
        formats = [made("minutes:seconds", lambda row: 60.0 * row[0] + row[1], wrapping)]
        minutes = made("hours:minutes", lambda row: HOUR_S * row[0] + 60.0 * row[1], DAY_S)
        if re.search(r"\bh+:m+\b", heading, re.IGNORECASE):
            return _picked([minutes])
        named = re.search(r"\bm+:s+", heading, re.IGNORECASE)
        possible = all(row[0] < 24 and row[1] < 60 for row in numbers) and not any(rest)
        remedy = "if not, --scale time=60, or 1/60"
        return _picked(formats + ([minutes] if possible and not named else []), remedy)
    return _with_fractions(parts, counts, made)


def _lettered_parts(text: str) -> dict[str, float]:
    """Numbers of an elapsed time before its letters, by unit; empty for any other text, and plain numbers."""
    found = _LETTERED.fullmatch(text)
    if found is None or not re.search(r"[^\d.,\s]", text):
        return {}
    parts = {unit: float(part.replace(",", ".")) for unit, part in found.groupdict().items() if part}
    if (bare := parts.pop("bare", None)) is not None:
        smallest = next(reversed(parts), "")  # none in `P5`, the name of a specimen
        if smallest not in _NEXT:
            return {}
        parts[_NEXT[smallest]] = bare
    return parts


def _lettered(texts: list[str]) -> Clock | None:
    """Elapsed times with a letter behind each part, in one or more fields of two parts or more."""
    rows = [_lettered_parts(text) for text in texts]
    if not all(rows) or max(map(len, rows)) < 2:
        return None
    return Clock([sum(_IN_SECONDS[unit] * number for unit, number in row.items()) for row in rows])


def _with_fractions(parts: list[list[str]], counts: set[int], made: Callable[..., _Format]) -> Clock | None:
    """Clocks whose last number may be a part of a second (`12:00:01:037`), or whose first one days."""
    if counts not in ({3}, {4}) or any(int(text) > 59 for row in parts for text in row[1:-1]):
        return None
    widths = {len(row[-1]) for row in parts}
    most = max(int(row[-1]) for row in parts)
    scale = 10.0 ** -widths.pop() if len(widths) == 1 else 1e-3  # without leading zeros: milliseconds

    def fractional(row: list[int]) -> float:
        return _sexagesimal([0, *row[:-1]][-3:]) + scale * row[-1]

    if counts == {4} and most < 60 and all(len(row[-1]) < 3 for row in parts):
        found = _picked(
            [made("days:hours:minutes:seconds", lambda row: DAY_S * row[0] + _sexagesimal(row[1:]))]
        )
        if found is None or most >= MOST_FRAMES or any(int(row[0]) for row in parts):
            return found
        asked = "if the last number counts the pictures of a film, write seconds"
        return found._replace(said="days:hours:minutes:seconds", remedy=asked)
    name = "the last number being a part of a second"
    return _picked([made(name, fractional, DAY_S if counts == {4} else HOUR_S)])


def _sexagesimal(row: list[int]) -> float:
    hours, minutes, seconds = [*row, 0][:3]
    return HOUR_S * hours + 60.0 * minutes + seconds


def _of_half(hour: int, half: str | None) -> int:
    """Hour of the day for an hour before or after noon."""
    return hour if half is None else hour % 12 + (12 if half[0] in "Pp" else 0)


def _fraction(text: str | None) -> float:
    return float(f"0.{text}") if text else 0.0


def _dated(texts: list[str]) -> Clock | None:
    """Dates with a time of day."""
    rows = [_DATED.fullmatch(text) for text in texts]
    if not all(rows):
        return None
    formats, origins = [], set()
    for order, name in _ORDERS.items():
        moments = [_moment(row, order) for row in rows if row is not None]
        if all(moment is not None for moment in moments):
            first = moments[0]
            formats.append(_Format(name, [_apart(moment, first) for moment in moments]))
            origins.add(_apart(first, (EPOCH, 0.0)))
    clock = _picked(formats, "if not, write the dates as 2024-05-31")
    if clock is None:
        return None
    origin = origins.pop() if len(origins) == 1 else None
    return clock._replace(said=clock.said if clock.remedy else "", origin=origin)


def _apart(moment: tuple[datetime, float] | None, first: tuple[datetime, float] | None) -> float:
    """Seconds between two moments, with their parts of a second and offsets from universal time."""
    if moment is None or first is None:
        return math.nan
    return (moment[0] - first[0]).total_seconds() + (moment[1] - first[1])


def _moment(row: re.Match[str], order: str) -> tuple[datetime, float] | None:
    """Date and time of a field in one order of day, month and year, and seconds to add; None if none."""
    date = _date_in(row, order)
    if date is None:
        return None
    numbers = [int(text) for text in row["parts"].split(":")] if row["parts"] else [0]
    part = _fraction(row["part"])
    if len(numbers) == 4:
        part = numbers.pop() * 10.0 ** -len(row["parts"].rpartition(":")[2])
    hour, minute, second = [*numbers, 0, 0][:3]
    zone = re.search(r"([+-])(\d{2}):?(\d{2})?$", row["zone"] or "")
    offset = (
        (1.0 if zone[1] == "+" else -1.0) * (HOUR_S * int(zone[2]) + 60.0 * int(zone[3] or 0))
        if zone
        else 0.0
    )
    try:
        return datetime(*date, _of_half(hour, row["half"]), minute, min(second, 59)), (
            part - offset + (1.0 if second == 60 else 0.0)
        )
    except ValueError:
        return None


def _date_in(row: re.Match[str], order: str) -> tuple[int, int, int] | None:
    """Year, month and day of a field in one order."""
    if row["compact"]:
        text = row["compact"]
        return (int(text[:4]), int(text[4:6]), int(text[6:])) if order == "ymd" else None
    written = dict(zip(order, (row["a"], row["b"], row["c"]), strict=True))
    year, month, day = written["y"], written["m"], written["d"]
    if (
        not year.isdigit()
        or not day.isdigit()
        or len(day) > 2
        or (row["mark"] == "." and order == "mdy" and month.isdigit())
    ):
        return None
    if len(year) != 4 and (len(year) != 2 or 4 in (len(row["a"]), len(row["c"]))):
        return None
    number = (
        int(month) if month.isdigit() else _MONTHS.get(month.lower()[:4], _MONTHS.get(month.lower()[:3], 0))
    )
    whole = int(year) if len(year) == 4 else int(year) + (2000 if int(year) < 70 else 1900)
    return whole, number, int(day)
