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
FULL = 12
"""Minimum usual number of decimals in a column of full precision, whose numbers vary in length."""
EXPONENTS = range(5, 308)
"""Sizes of the exponents with which programs write numbers of no fixed count of decimals: from 1e-5 down, and
from 1e5 up at the earliest."""
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
    one that the rows above lead to expect, or lack an exponent. Digits that change nothing are not missed
    where the number goes on from the rows above. A last field that is blank here alone spoils nothing, but is
    said.

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
    above = [to_number(other[-1], decimal) for other in others[-RECENT:]]
    ended = bool(page.lines[keep[-1] + 1 :])
    for count, what in (_decimals, "decimals"), (_exponent_digits, "digits of an exponent"):
        counts = {count(other[-1]) for other in others}
        if what == "decimals" and len(counts) > 1 and _PLAIN.fullmatch(last[-1]) and "." not in last[-1]:
            if ended:
                continue  # `95` after `94.75` and `93.5`, as programs write whole numbers
        if what == "decimals" and _EXPONENT.fullmatch(last[-1]):
            continue  # `1.2e-16` below `0.05`
        if what == "decimals" and len(counts) > 1 and _all_but_whole(last[-1], others, decimal):
            if _goes_on(last[-1], above, decimal, FAR if ended else NEAR):
                continue  # `6.11319080989976` below numbers of all 17 digits, as programs write them
        if what == "decimals" and not ended:
            counts = _usual(counts, last[-1], others)
        elif not ended:
            counts = _usual_exponents(counts, last[-1], others)
        if count(last[-1]) < min(counts):
            keep_it = f"; if it is whole, write it with as many {what}"
            return CutOff(f"{row} ends with fewer {what} than all others ({end}): {asked}{keep_it}", True)
    varied = len({_decimals(other[-1]) for other in others}) > 1
    exponents = varied or any(_EXPONENT.fullmatch(other[-1]) for other in others)
    if not ended and _first_digits(last[-1], above, decimal, exponents):
        said = f"{row} ends without an end of line in {last[-1]!r}, and the rows above it lead to expect more"
        keep_it = "; if it is whole, end the file with an end of line"
        return CutOff(f"{said} digits ({end}): {asked}{keep_it}", True)
    return None


def _all_but_whole(text: str, others: Sequence[list[str]], decimal: str) -> bool:
    """True if the digits that a number may lack change nothing: numbers of full precision vary in length.

    Where any number has an exponent, one between 1 and 10 may lack its own.

    Args:
        text: last field of a file.
        others: rows above it.
        decimal: decimal mark.
    """
    values = [x for row in others if (x := to_number(row[-1], decimal)) is not None and np.isfinite(x)]
    reach = max(map(abs, values), default=0.0)
    value = abs(to_number(text, decimal) or 0.0)
    lost = 1.0 <= value < 10.0 and any(_EXPONENT.fullmatch(row[-1]) for row in others)
    return not lost and _decimals(text) > 0 and 10.0 ** -_decimals(text) <= HARMLESS * reach


def _usual(counts: set[int], text: str, others: Sequence[list[str]]) -> set[int]:
    """Numbers of decimals in a column of full precision, without those of exact numbers: `0.0`, `0.5`.

    A last number that stands above as well, or ends in `.0`, may be exact, too.

    Args:
        counts: numbers of decimals that occur.
        text: last field of a file.
        others: rows above it.
    """
    of_rows = [_decimals(row[-1]) for row in others]
    exact = text in {row[-1] for row in others} or re.fullmatch(r".*[.,]0", text)
    if np.median(of_rows) < FULL or exact:
        return counts
    return {count for count in counts if count >= FULL}


def _usual_exponents(counts: set[int], text: str, others: Sequence[list[str]]) -> set[int]:
    """Numbers of digits of the exponents that occur, without numbers that need none.

    Without any, an exponent that is smaller than those that programs write lacks its last digit. Arguments
    are as for `_usual`.
    """
    found = _EXPONENT.fullmatch(text)
    if found is None:
        return counts
    written = {_exponent_digits(row[-1]) for row in others if _EXPONENT.fullmatch(row[-1])}
    return written or ({2} if int(found[1] or 0) < EXPONENTS.start else counts)


def _goes_on(text: str, above: Sequence[float | None], decimal: str, reach: float) -> bool:
    """True if a number is within some steps of the one above it; arguments as for `_first_digits`."""
    value, before = to_number(text, decimal), _known(above)
    if value is None or before.size < LEAST_ROWS:
        return False
    with np.errstate(over="ignore"):  # of numbers up to 1e308
        return bool(abs(value - before[-1]) <= reach * np.abs(np.diff(before)).max())


def _known(above: Sequence[float | None]) -> np.ndarray:
    return np.array([x for x in above if x is not None and np.isfinite(x)])


def _first_digits(text: str, above: Sequence[float | None], decimal: str, exponents: bool) -> bool:
    """True if a number is far from those above it, and may be the first digits of one that is near them.

    Args:
        text: last field of a file.
        above: numbers of the same column in the rows above it, in order.
        decimal: decimal mark.
        exponents: true if the column's numbers may have an exponent.
    """
    text = text.replace(decimal, ".")
    mantissa, _, exponent = text.lower().partition("e")
    found, before = _PLAIN.fullmatch(mantissa), _known(above)
    if found is None or before.size < LEAST_ROWS or (exponent and not exponents):
        return False
    if _goes_on(text, above, ".", FAR):
        return False
    with np.errstate(over="ignore"):
        value, last, step = abs(float(found[0])), before[-1], float(np.abs(np.diff(before)).max())
    sign = -1.0 if text.startswith("-") else 1.0
    low, high = sorted((sign * (last - NEAR * step), sign * (last + NEAR * step)))
    error = 10.0 ** -len(found[2] or "")
    if exponent:
        powers = []
    elif found[2] is not None:  # decimals may be missing alone
        powers = [0]
    else:
        powers = list(range(1 + (len(f"{abs(last):.0f}") if value else 0)))
    if exponents and 1.0 <= value < 10.0:
        signed = [side * k for side in (-1, 1) for k in EXPONENTS]
        powers += [k for k in signed if f"{k:+03d}".startswith(exponent) or f"{k:+d}".startswith(exponent)]
    return any(10.0**k * value <= high and low < 10.0**k * (value + error) for k in powers)


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
