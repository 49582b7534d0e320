"""Detection of a page's delimiter and decimal mark: those with which most of its fields are numbers."""

import math
import re
from typing import NamedTuple

from .clocks import like_a_clock
from .numerals import CellNumber, decimal_evidence, like_a_number, to_number
from .raw import Page

LEAST_ROWS = 3  # Minimum number of rows of numbers in a table
_SAMPLED = 1000  # Number of lines that decide the delimiter and the decimal mark


class Reading(NamedTuple):
    """Delimiter and decimal mark of a page.

    Attributes:
        delimiter: character between fields; a space for any white space, empty for the cells of a sheet.
        decimal: decimal mark.
        doubtful: field that another decimal mark would make another number, where nothing proves either.
    """

    delimiter: str
    decimal: str
    doubtful: str = ""


def best_reading(page: Page) -> Reading | None:
    """Delimiter and decimal mark with which most fields of a sample of lines are numbers and fewest are
    text."""
    best: tuple[float, Reading] | None = None
    pure = False
    for delimiter in ("",) if page.is_sheet else (",", ";", "\t", "|", " "):
        fields = _sample(page, delimiter)
        if delimiter == " " and pure:
            continue  # a file that another mark divides into columns; spaces may group its thousands
        scores = {}
        for decimal in (".", ","):
            rows = [
                (row, numeric_row(row, decimal, "point" if delimiter == "," else "any")) for row in fields
            ]
            rows = [(row, numbers) for row, numbers in rows if numbers is not None]
            most_fields = max((len(row) for row, _ in rows), default=0)
            if len(rows) < LEAST_ROWS or (most_fields == 1 and delimiter not in (" ", "")):
                continue
            numeric_fields = sum(x is not None and not math.isnan(x) for _, numbers in rows for x in numbers)
            words = [
                text
                for row, numbers in rows
                for x, text in zip(numbers, row, strict=True)
                if x is None
            ]
            clocks = sum(map(like_a_clock, words))
            texts = len(words) - clocks
            scores[decimal] = (numeric_fields + clocks - texts, rows)
            pure = pure or (4 * texts <= numeric_fields and most_fields > 1)
        if not scores:
            continue
        most = max(score for score, _ in scores.values())
        tied = [decimal for decimal, (score, _) in scores.items() if score == most]
        decimal, doubtful = (
            (tied[0], "") if len(tied) == 1 else _decimal_of([row for row, _ in scores["."][1]])
        )
        if best is None or most > best[0]:
            best = (most, Reading(delimiter, decimal, doubtful))
    return best[1] if best and best[0] > 0 else None


def _sample(page: Page, delimiter: str) -> list[list[str]]:
    """Fields of the first lines and of lines spread over the rest."""
    count = page.count
    first = min(count, _SAMPLED // 2)
    step = max(1, (count - first) // (_SAMPLED // 2))
    return page.fields(delimiter, [*range(first), *range(first, count, step)])


def _decimal_of(rows: list[list[str]]) -> tuple[str, str]:
    """Decimal mark that more fields prove, and an ambiguous field where none proves either.

    A column of `950` and `1,045` groups thousands. Three decimals would appear in all of its fields.
    """
    rows = [["" if isinstance(text, CellNumber) else text for text in row] for row in rows]
    fields = [text for row in rows for text in row]
    proofs = [proof for text in fields if (proof := decimal_evidence(text)) is not None]
    if proofs:
        return ("," if proofs.count(",") > proofs.count(".") else "."), ""
    with_comma = [text for text in fields if "," in text and like_a_number(text)]
    if not with_comma and _points_group(rows):
        return ",", ""
    if not with_comma or any("." in text for text in fields):
        return ".", ""
    for column in range(max(map(len, rows))):
        texts = [row[column] for row in rows if column < len(row)]
        if any("," in text for text in texts) and any(re.fullmatch(r"[+-]?\d{2,3}", text) for text in texts):
            return ".", ""
    return ",", with_comma[0]


_GROUP = re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+")


def _points_group(rows: list[list[str]]) -> bool:
    """True if points group the thousands of whole numbers: `998`, `1.003`, and no number has decimals.

    Three decimals would appear in every number of a column, or in numbers below 1. Where both readings are
    possible, the course of the column tells: the right one leaps less over its range.
    """
    columns = [[row[c] for row in rows if c < len(row) and row[c]] for c in range(max(map(len, rows)))]
    pointed = [[text for text in texts if "." in text] for texts in columns]
    if not all(_GROUP.fullmatch(text) for texts in pointed for text in texts):
        return False
    grouped = False
    for texts, with_points in zip(columns, pointed, strict=True):
        whole = [text for text in texts if re.fullmatch(r"[+-]?\d{2,3}", text)]
        if len(with_points) < LEAST_ROWS or not whole:
            continue
        numbers = [text for text in texts if like_a_number(text)]
        decimals = _roughness([float(to_number(text, ".") or 0.0) for text in numbers])
        thousands = _roughness([float(to_number(text, ",") or 0.0) for text in numbers])
        if thousands >= decimals:
            return False
        grouped = True
    return grouped


def _roughness(numbers: list[float]) -> float:
    """Sum of all changes from number to number over their range [1]; infinite for numbers without a range."""
    span = max(numbers) - min(numbers)
    moved = sum(abs(b - a) for a, b in zip(numbers[:-1], numbers[1:], strict=True))
    return moved / span if span > 0.0 else math.inf


def numeric_row(row: list[str], decimal: str, spaced: str = "any") -> list[float | None] | None:
    """Numbers of a row (None where a field is text), or None if it is mostly text or blank and so no data.

    A field of digits with unreadable marks, or of a date, is no text: its row is data.
    """
    numbers = [to_number(text, decimal, spaced) for text in row]
    texts = 0
    if None in numbers:
        texts = sum(
            x is None and not like_a_number(text) and not like_a_clock(text)
            for x, text in zip(numbers, row, strict=True)
        )
    real = sum(x is not None and not math.isnan(x) for x in numbers)
    return None if real == 0 or 2 * texts >= len(row) or (texts and real < 2) else numbers
