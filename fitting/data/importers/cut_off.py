"""The last row of a text that ends in the middle of a row, as a copy or a crashed logger leaves it."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .numerals import to_number
from .raw import Page
from .separators import LEAST_ROWS
from .words import meaning_of

RECENT = 8
"""Number of rows above the last one that tell what it may be."""
NEAR, FAR = 2.0, 4.0
"""Distances from the row above, in the largest step of those rows, within which a number goes on and beyond
which it does not."""
HARMLESS = 1e-6
"""Maximum error of a number by missing digits, as part of its column's largest one, that spoils nothing. No
instrument here resolves as much."""
_PLAIN = re.compile(r"[+-]?(\d+)(?:\.(\d*))?")
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
    page: Page,
    fields: Sequence[list[str]],
    keep: Sequence[int],
    delimiter: str,
    header: Sequence[str],
    decimal: str = ".",
) -> CutOff | None:
    """Find a last row that ends earlier than every other one; None if there is none.

    It has fewer fields than all others, or fewer decimals in its last field, or fewer digits in an exponent
    that all others have. Where no end of a line follows, its last number may also be the first digits of the
    one that the rows above lead to expect. A last field that is blank here alone spoils nothing, but is said.

    Args:
        page: the page; the cells of a sheet are never cut off.
        fields: fields of each row of the page, without the blank ones at their ends.
        keep: indices of the rows of a table.
        delimiter: character between the fields.
        header: headings of the columns; empty if there are none.
        decimal: decimal mark.
    """
    if page.is_sheet or len(keep) <= LEAST_ROWS:
        return None
    if any(fields[i] for i in range(keep[-1] + 1, len(fields))) or any(fields[keep[-2] + 1 : keep[-1]]):
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
        counts = {count(other[-1]) for other in others}
        if what == "decimals" and len(counts) > 1 and _PLAIN.fullmatch(last[-1]) and "." not in last[-1]:
            if page.lines[keep[-1] + 1 :]:
                continue  # `95` after `94.75` and `93.5`, as programs write whole numbers
        if what == "decimals" and len(counts) > 1 and _all_but_whole(last[-1], others, decimal):
            continue  # `6.11319080989976` below numbers of all 17 digits, as programs write them
        if count(last[-1]) < min(counts):
            keep_it = f"; if it is whole, write it with as many {what}"
            return CutOff(f"{row} ends with fewer {what} than all others ({end}): {asked}{keep_it}", True)
    above = [to_number(other[-1], decimal) for other in others[-RECENT:]]
    if not page.lines[keep[-1] + 1 :] and _first_digits(last[-1], above, decimal):
        said = f"{row} ends without an end of line in {last[-1]!r}, and the rows above it lead to expect more"
        keep_it = "; if it is whole, end the file with an end of line"
        return CutOff(f"{said} digits ({end}): {asked}{keep_it}", True)
    return None


def _all_but_whole(text: str, others: Sequence[list[str]], decimal: str) -> bool:
    """True if the digits that a number may lack change nothing: numbers of full precision vary in length.

    Args:
        text: last field of a file.
        others: rows above it.
        decimal: decimal mark.
    """
    values = [x for row in others if (x := to_number(row[-1], decimal)) is not None and np.isfinite(x)]
    reach = max(map(abs, values), default=0.0)
    return _decimals(text) > 0 and 10.0 ** -_decimals(text) <= HARMLESS * reach


def _first_digits(text: str, above: Sequence[float | None], decimal: str) -> bool:
    """True if a number is far from those above it, and may be the first digits of one that is near them.

    Args:
        text: last field of a file.
        above: numbers of the same column in the rows above it, in order.
        decimal: decimal mark.
    """
    found = _PLAIN.fullmatch(text.replace(decimal, "."))
    before = np.array([x for x in above if x is not None and np.isfinite(x)])
    if found is None or before.size < LEAST_ROWS:
        return False
    value, last, step = abs(float(found[0])), before[-1], float(np.abs(np.diff(before)).max())
    sign = -1.0 if text.startswith("-") else 1.0
    if abs(sign * value - last) <= FAR * step:
        return False
    low, high = sorted((sign * (last - NEAR * step), sign * (last + NEAR * step)))
    if found[2] is not None:  # decimals may be missing alone
        ranges = [(value, value + 10.0 ** -len(found[2]))]
    else:
        longer = range(1 + (len(f"{abs(last):.0f}") if value else 0))
        ranges = [(10.0**k * value, 10.0**k * (value + 1.0)) for k in longer]
    return any(begin <= high and low < end for begin, end in ranges)


def _side_by_side(header: Sequence[str], there: int) -> bool:
    """True if headings beyond a column repeat a quantity before it: tests of unequal length stand there."""
    found = [meaning_of(text) for text in header]
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
