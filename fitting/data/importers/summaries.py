"""Rows of a table that are no measurements: statistics of the rows above them, and a count of the columns."""

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from .marks import HUGE
from .numerals import like_a_number
from .separators import LEAST_ROWS
from .spelling import plain
from .words import meaning_of

_WORDS = re.compile(
    r"(mean|average|avg|ave|arithmetic mean|median|max|maximum|min|minimum|peak|std|st dev|std dev|stdev|sd|"
    r"s d|sem|standard deviation|standard error|variance|cov|c v|cv|coefficient of variation|coeff of var|"
    r"range|total|sum|count|x̄|mittelwert|mittel|durchschnitt|standardabweichung|streuung|summe|maximalwert|"
    r"minimalwert|moyenne|écart type|ecart type|médiane|somme|media|promedio|desviación estándar|máximo|"
    r"mínimo|平均值|平均|标准差|最大值|最小值)(?!\w)"
)
_SECTIONS = re.compile(
    r"(statistics?|summary|results?|test results?|mean values?|statistik|ergebnisse?|zusammenfassung|"
    r"kennwerte|auswertung|statistiques?|résultats?|结果|统计)(?!\w)"
)
MOST_UNLABELLED = 8
"""Maximum number of rows without a label, at one end of a table, that may be statistics of the others."""
CHANCE = 1e-4
"""Maximum probability with which a reading anywhere in its range agrees with one statistic in all columns.
Three digits in two columns make it 1e-6. Of 143 recordings, cut in 774 ways, none lost a row."""
LEAP = 3.0
"""Minimum step from the readings to a row of statistics, in median steps between readings of that column."""
SAMPLED = 1000
"""Number of rows, evenly spread, from which the last written digits of a long table are read."""
_STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "mean": np.mean,
    "standard deviation": lambda x: np.std(x, ddof=1),
    "standard deviation of all": np.std,
    "median": np.median,
    "variance": lambda x: np.var(x, ddof=1),
    "standard error": lambda x: np.std(x, ddof=1) / np.sqrt(len(x)),
    "coefficient of variation": lambda x: np.std(x, ddof=1) / (np.mean(x) or np.nan),
    "coefficient of variation in percent": lambda x: 100.0 * np.std(x, ddof=1) / (np.mean(x) or np.nan),
    "minimum": np.min,
    "maximum": np.max,
    "sum": np.sum,
    "range": np.ptp,
    "count": len,
}
_READINGS = ("median", "minimum", "maximum", "range", "count")
"""Statistics that one reading may be in all columns, such as that at rest or at the peak."""
_SPREADS = ("max", "min", "peak", "range", "total", "count", "máx", "mín", "最")


def statistics_rows(fields: Sequence[list[str]], parsed: Sequence[list | None]) -> dict[int, str]:
    """Rows of numbers that are statistics of others, by index, with the word that tells.

    A row of numbers is one in three cases. It begins with a word such as `Mean` or `Std. dev.`, or has one
    in a column of remarks. Or it stands below a line such as `Statistics`. Where most rows of a page begin
    so, they are its data.

    Args:
        fields: fields of each row of a page.
        parsed: numbers of each row; None where it is no row of numbers.
    """
    numeric = [i for i, row in enumerate(parsed) if row is not None]
    found: dict[int, str] = {}
    width = max((len(fields[i]) for i in numeric), default=0)
    filled = [sum(len(fields[i]) > c and bool(fields[i][c]) for i in numeric) for c in range(width)]
    seldom = {c for c in range(width) if 5 * filled[c] < len(numeric)}  # columns of remarks
    gap = next((c for c in range(1, width) if not filled[c] and any(filled[:c])), width)
    for place, i in enumerate(numeric):
        column = next((c for c, text in enumerate(fields[i]) if text), 0)
        remarks = (c for c, text in enumerate(fields[i]) if text and c in seldom)
        column = next((c for c in remarks if c < gap or not _labels_a_number(fields[i], c)), column)
        text = fields[i][column]
        if text[:1] in "+-.0123456789":
            continue
        if _WORDS.match(_words(text)) and not _named_like_its_neighbours(fields, numeric, place, column):
            found[i] = text
    if 2 * len(found) > len(numeric):
        return {}
    return found | _sections(fields, parsed)


def _labels_a_number(row: list[str], column: int) -> bool:
    """True for a text with a number to its right, as in a table of results beside the measurements."""
    return column + 1 < len(row) and like_a_number(row[column + 1])


def _words(text: str) -> str:
    return plain(re.sub(r"[.\-]", " ", text))


def _named_like_its_neighbours(
    fields: Sequence[list[str]], numeric: list[int], place: int, column: int
) -> bool:
    """True for a word such as `max` between rows that also begin with words, such as the phases of a test."""
    around = [numeric[k] for k in (place - 1, place + 1) if 0 <= k < len(numeric)]
    words = [fields[i][column] for i in around if column < len(fields[i])]
    named = [w for w in words if re.search(r"[^\W\d]", w) and not _WORDS.match(_words(w))]
    return len(named) == 2 and _words(fields[numeric[place]][column]).startswith(_SPREADS)


def _sections(fields: Sequence[list[str]], parsed: Sequence[list | None]) -> dict[int, str]:
    """Rows of numbers below a line that says `Statistics`, up to the next headings."""
    found: dict[int, str] = {}
    above, title = 0, ""
    for i, row in enumerate(parsed):
        if not fields[i]:
            continue
        if row is not None:
            above += 1
            if title:
                found[i] = title
            continue
        filled = [text for text in fields[i] if text]
        if len(filled) <= 2 and above >= LEAST_ROWS and _SECTIONS.match(_words(filled[0])):
            title = filled[0]
        elif sum(meaning_of(text) is not None for text in filled) >= 2:
            above, title = 0, ""
    return found


def counts_columns(fields: Sequence[list[str]], rows: Sequence[int]) -> bool:
    """True if the first of some rows only counts the columns, `1, 2, 3`. Such a row has whole numbers above
    decimals, or a clock that would then go back.

    Args:
        fields: fields of each row of a page.
        rows: indices of the rows of numbers of one table.
    """
    first = fields[rows[0]]
    if len(first) < 3 or first not in (
        [str(k + 1) for k in range(len(first))],
        [str(k) for k in range(len(first))],
    ):
        return False
    rest = [text for i in rows[1:] for text in fields[i] if text]
    decimals = sum(not re.fullmatch(r"[+-]?\d+", text) for text in rest)
    return 2 * decimals > len(rest)


class Unlabelled(NamedTuple):
    """Rows at one end of a table that agree with statistics of all the others.

    Attributes:
        rows: name of the statistic by position of the row.
        sure: true if they are no readings.
    """

    rows: dict[int, str]
    sure: bool


def unlabelled_statistics(values: np.ndarray, texts: Sequence[list[str]]) -> Unlabelled:
    """Rows at the ends of a table that are statistics of all the others, though no word says so.

    Each of them agrees with another statistic in every column, to the digits that are written. A whole number
    is as exact as the readings. One of the rows at least leaps away from them. They are surely no readings
    where one is a mean, a sum or a deviation. A reading may be the minimum, the median or the maximum.

    Args:
        values: numbers of the table, shape (rows, columns), NaN where a field is blank.
        texts: fields of each row.
    """
    last = len(values) - 1
    values = np.where(np.abs(values) < HUGE, values, np.nan)  # marks for no reading have no statistics
    below, above = _at_the_end(values, texts), _at_the_end(values[::-1], texts[::-1])
    above = Unlabelled({last - k: name for k, name in above.rows.items()}, above.sure)
    return below if below.sure or (below.rows and not above.sure) else above


def _at_the_end(values: np.ndarray, texts: Sequence[list[str]]) -> Unlabelled:
    """The most rows that repeat no reading, or else the fewest that surely are no readings."""
    found: list[tuple[Unlabelled, bool]] = []
    for count in range(min(MOST_UNLABELLED, len(values) - 2 * LEAST_ROWS), 0, -1):
        readings = values[:-count]
        places = range(len(readings), len(values))
        digits = _last_digits(texts[: len(readings) : 1 + len(readings) // SAMPLED])
        names: dict[int, str] = {}
        for i in reversed(places):
            fitting = _statistics(readings, digits, values[i], texts[i])
            names[i] = next((name for name in fitting if name not in names.values()), "")
            if not names[i]:
                break
        if all(names.values()) and any(_leaps(readings, values[i], names[i]) for i in places):
            repeated = {i for i in places if _is_reading(readings, values[i])}
            sure = any(name not in _READINGS for i, name in names.items() if i not in repeated)
            found.append((Unlabelled(dict(sorted(names.items())), sure), bool(repeated)))
    sure = [one for one, _ in found if one.sure]
    return next((one for one, repeats in found if one.sure and not repeats), None) or (
        sure[-1] if sure else found[0][0] if found else Unlabelled({}, sure=False)
    )


def _is_reading(readings: np.ndarray, row: np.ndarray) -> bool:
    there = np.isfinite(row)
    return bool((readings[:, there] == row[there]).all(axis=1).any())


def _statistics(readings: np.ndarray, digits: list[float], row: np.ndarray, texts: list[str]) -> list[str]:
    """The statistics of the readings that a row is, within half a last digit of both."""
    filled = [c for c in np.flatnonzero(np.isfinite(row)) if np.isfinite(readings[:, c]).sum() > LEAST_ROWS]
    spread = [c for c in filled if np.nanmax(readings[:, c]) > np.nanmin(readings[:, c])]
    if len(spread) < 2 or len(filled) < np.isfinite(row).sum():
        return []
    own = [min(size, digits[c]) if size >= 1.0 else size for c, size in enumerate(_last_digits([texts]))]
    columns = {c: readings[np.isfinite(readings[:, c]), c] for c in filled}
    slack = {c: 0.5 * (digits[c] + own[c]) + 1e-9 * float(np.abs(columns[c]).max()) for c in filled}
    chance = np.prod([min(1.0, 2.0 * slack[c] / float(np.ptp(columns[c]))) for c in spread])
    if chance > CHANCE:
        return []
    return [
        name
        for name, of in _STATISTICS.items()
        if all(abs(float(of(columns[c])) - row[c]) <= slack[c] for c in filled)
    ]


def _leaps(readings: np.ndarray, row: np.ndarray, name: str) -> bool:
    """True for a row that is far from the last reading, and repeats none but that of the maximum.

    A specimen may be at rest again at the end, as at the beginning. No test ends with a leap to its peak.
    """
    there = np.isfinite(row)
    rows = readings[:, there]
    if name != "maximum" and _is_reading(readings, row):
        return False
    usual = np.nanmedian(np.abs(np.diff(rows, axis=0)), axis=0)
    return bool(np.any(np.abs(row[there] - rows[-1]) > LEAP * usual))


_DECIMALS = re.compile(r"[.,](\d+)\s*%?$")
_EXPONENT = re.compile(r"^(.*?)[eEdD]([+-]?\d{1,9})$")


def _last_digits(texts: Sequence[list[str]]) -> list[float]:
    """Size of the last written digit of each column, in its finest field."""
    width = max(map(len, texts), default=0)
    finest = [np.inf] * width
    for row in texts:
        for c, text in enumerate(row):
            if text and text[-1] in "0123456789.,%":
                scaled = _EXPONENT.match(text)
                decimals = _DECIMALS.search(scaled[1] if scaled else text)
                power = (int(scaled[2]) if scaled else 0) - (len(decimals[1]) if decimals else 0)
                finest[c] = min(finest[c], float(f"1e{power}"))  # of 1e400 infinite
    return [0.0 if digit == np.inf else digit for digit in finest]
