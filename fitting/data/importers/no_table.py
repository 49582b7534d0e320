"""Reasons why a page with headings of quantities holds no table of numbers."""

import re
from collections.abc import Iterator

from pneusma_jax.errors import counted

from .headers import names_quantities
from .numerals import like_a_number, to_number
from .raw import Page, split_line
from .separators import LEAST_ROWS
from .words import meaning_of

MOST_NAMED_ROWS = 40
"""Number of rows of a page on which quantities may stand in rows."""
_LETTER = re.compile(r"[^\W\d_]")


def headers_of(page: Page) -> Iterator[tuple[list[list[str]], int]]:
    """Rows of a page in every division into fields, with each row that names two quantities.

    A line is divided only where it has the mark between fields and a letter, since numbers name nothing.
    """
    if page.rows is not None:
        yield from ((page.rows, at) for at, row in enumerate(page.rows) if names_quantities(row) >= 2)
        return
    lettered = [at for at, line in enumerate(page.lines) if _LETTER.search(line)]
    for delimiter in (",", ";", "\t", "|"):
        fields: list[list[str]] = []
        for at in lettered:
            line = page.lines[at]
            if delimiter in line and names_quantities(split_line(line, delimiter)) >= 2:
                fields = fields or page.fields(delimiter)
                yield fields, at


def words_for_numbers(page: Page) -> str:
    """Reason that a column of words stands below the headings. Empty otherwise."""
    for fields, at in headers_of(page):
        header = fields[at]
        body = [(i + 1, row) for i, row in enumerate(fields) if i > at and len(row) == len(header)]
        if len(body) < LEAST_ROWS:
            continue
        for column, text in enumerate(header):
            if not text or meaning_of(text) is None:
                continue
            texts = [(i, row[column]) for i, row in body if to_number(row[column], ".") is None]
            texts = [(i, text) for i, text in texts if to_number(text, ",") is None]
            if 2 * len(texts) > len(body):
                i, text = texts[0]
                label = repr(header[column])
                return f"{len(texts)} of {len(body)} fields of {label} are no numbers ({text!r} in row {i})"
    return ""


def in_rows(page: Page) -> str:
    """Reason that quantities stand in rows rather than in columns. Empty otherwise."""
    for delimiter in ("",) if page.is_sheet else (",", ";", "\t"):
        if page.count > MOST_NAMED_ROWS:
            continue
        rows = [row for row in page.fields(delimiter) if row and meaning_of(row[0]) is not None]
        wide = [row for row in rows if sum(map(like_a_number, row[1:])) >= LEAST_ROWS]
        if len(wide) >= 2:
            named = ", ".join(repr(row[0]) for row in wide[:MOST_NAMED_ROWS])
            return f"{named} stand in rows; write each in a column (transpose the table)"
    return ""


def few_numbers(page: Page) -> str:
    """Reason that too few rows of numbers stand below the headings. Empty otherwise."""
    for fields, at in headers_of(page):
        named = [text for text in fields[at] if text and meaning_of(text) is not None]
        count = sum(any(to_number(t, ".") is not None and t for t in row) for row in fields[at + 1 :])
        if count < LEAST_ROWS:
            what = f"{counted(count, 'row')} of numbers" if count else "no numbers"
            stand = "stands" if count == 1 else "stand"
            return (
                f"below the headings {', '.join(map(repr, named))} {stand} {what}; a table needs"
                f" {LEAST_ROWS}"
            )
    return ""
