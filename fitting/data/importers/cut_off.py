"""The last row of a text that ends in the middle of a row, as a copy or a crashed logger leaves it."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from .raw import Page
from .separators import LEAST_ROWS
from .words import heading_of, meaning

_DECIMALS = re.compile(r"[+-]?\d*[.,](\d*)")
_EXPONENT = re.compile(r"[+-]?\d+(?:[.,]\d*)?[eE][+-]?(\d*)")


class CutOff(NamedTuple):
    """The end of a text that is cut off.

    Attributes:
        said: notice that names the row.
        spoilt: true if the row's last number may be another one, so that the row cannot be used.
    """

    said: str
    spoilt: bool


def cut_off(
    page: Page, fields: Sequence[list[str]], keep: Sequence[int], delimiter: str, header: Sequence[str]
) -> CutOff | None:
    """Find a last row that ends earlier than every other one; None if there is none.

    It has fewer fields than all others, or fewer decimals in its last field, or fewer digits in an exponent
    that all others have. A last field that is blank here alone spoils nothing, but is said.

    Args:
        page: the page; the cells of a sheet are never cut off.
        fields: fields of each row of the page, without the blank ones at their ends.
        keep: indices of the rows of a table.
        delimiter: character between the fields.
        header: headings of the columns; empty if there are none.
    """
    if page.is_sheet or len(keep) <= LEAST_ROWS:
        return None
    if any(fields[keep[-1] + 1 :]) or any(fields[keep[-2] + 1 : keep[-1]]):
        return None  # lines of text below it, or between it and the others
    last, others = fields[keep[-1]], [fields[i] for i in keep[:-1]]
    line = page.lines[keep[-1]]
    row, end = f"check: row {keep[-1] + 1}, the last one,", repr(line.strip()[-40:])
    asked = "was the file cut off? The row was left out"
    fewest = min(map(len, others))
    if len(last) < fewest:
        if delimiter == " " or line.count(delimiter) + 1 < fewest:
            beside = _side_by_side(header, len(last))
            said = f"{row} has {len(last)} of {fewest} fields ({end}): {asked}"
            return None if beside else CutOff(said, True)
        if len(last) + 1 == fewest:
            return CutOff(f"{row} has a blank last field ({end}) as no other row has: was it cut off?", False)
        return None
    if any(len(other) != len(last) for other in others):
        return None
    for count, what in (_decimals, "decimals"), (_exponent_digits, "digits of an exponent"):
        if count(last[-1]) < min(count(other[-1]) for other in others):
            return CutOff(f"{row} ends with fewer {what} than all others ({end}): {asked}", True)
    return None


def _side_by_side(header: Sequence[str], there: int) -> bool:
    """True if headings beyond a column repeat a quantity before it: tests of unequal length stand there."""
    found = [meaning(heading_of(text)) for text in header]
    before, beyond = ({means.quantity for means in part if means} for part in (found[:there], found[there:]))
    return bool(before & beyond)


def _decimals(text: str) -> int:
    """Number of decimals of a field; 0 of one without a decimal mark, or of any other text."""
    found = _DECIMALS.fullmatch(text)
    return len(found[1]) if found else 0


def _exponent_digits(text: str) -> int:
    """Number of digits of a field's exponent; 0 of one without an exponent, or of any other text."""
    found = _EXPONENT.fullmatch(text)
    return len(found[1]) if found else 0
