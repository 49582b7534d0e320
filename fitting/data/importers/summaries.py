"""Rows of a table that are no measurements: statistics of the rows above them, and a count of the columns."""

import re
from collections.abc import Sequence

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
_SPREADS = ("max", "min", "peak", "range", "total", "count", "máx", "mín", "最")


def statistics_rows(fields: Sequence[list[str]], parsed: Sequence[list | None]) -> dict[int, str]:
    """Rows of numbers that are statistics of others, by index, with the word that tells.

    A row of numbers is one in three cases. It begins with a word such as `Mean` or `Std. dev.`, it has one in
    a column of remarks, or it stands below a line such as `Statistics`. Where most rows of a page begin so,
    they are its data.

    Args:
        fields: fields of each row of a page.
        parsed: numbers of each row; None where it is no row of numbers.
    """
    numeric = [i for i, row in enumerate(parsed) if row is not None]
    found: dict[int, str] = {}
    width = max((len(fields[i]) for i in numeric), default=0)
    filled = [sum(len(fields[i]) > c and bool(fields[i][c]) for i in numeric) for c in range(width)]
    seldom = {c for c in range(width) if 5 * filled[c] < len(numeric)}  # columns of remarks
    for place, i in enumerate(numeric):
        column = next((c for c, text in enumerate(fields[i]) if text), 0)
        column = next((c for c, text in enumerate(fields[i]) if text and c in seldom), column)
        text = fields[i][column]
        if text[:1] in "+-.0123456789":
            continue
        if _WORDS.match(_words(text)) and not _named_like_its_neighbours(fields, numeric, place, column):
            found[i] = text
    if 2 * len(found) > len(numeric):
        return {}
    return found | _sections(fields, parsed)


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
