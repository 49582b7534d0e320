"""Numbers with a prefix and no unit, as instruments display and people write them: `1.2k`, `750m`, `3R32`."""

import re
from collections.abc import Sequence
from decimal import Decimal

from .marks import LONGEST_QUOTED
from .numerals import CellNumber, is_blank, to_number
from .raw import Page
from .spelling import dimension, parse_heading
from .words import meaning_of

_POWERS = {"G": 9, "M": 6, "k": 3, "K": 3, "R": 0, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9}
"""Power of ten by prefix. `R` marks the decimals of a resistance."""
_BEHIND = re.compile(r"(?P<number>[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s?(?P<prefix>[GMkKmuµμn])")
_WITHIN = re.compile(r"(?P<whole>[+-]?\d+)(?P<prefix>[GMkKRmuµμn])(?P<part>\d+)")
_MAY_BE = re.compile(r"\d\s?[GMkKRmuµμn](?=\d|[\s,;|\"']|$)", re.MULTILINE)
_NOT_IN = ("time", "length", "temperature")
"""Dimensions in which a letter alone is a unit: `3m` are minutes of a time and metres of a length, and `295K`
are kelvins."""


def may_have_prefixes(page: Page) -> bool:
    """True if a page has a number with a letter behind it that may be a prefix."""
    if page.rows is None:
        return _MAY_BE.search("\n".join(page.lines)) is not None
    return any(_power(text) is not None for row in page.rows for text in row)


def without_prefixes(texts: Sequence[str], heading: str, decimal: str) -> list[str] | None:
    """Fields of a column as plain numbers; None where it has no prefixes, or letters of another meaning.

    Args:
        texts: fields below the heading.
        heading: text of the heading. It must name a quantity of which no letter alone is a unit.
        decimal: decimal mark.
    """
    means, unit = meaning_of(heading), parse_heading(heading).unit
    if means is None or means.quantity in _NOT_IN or dimension(unit) in _NOT_IN:
        return None
    done, count = [], 0
    for text in texts:
        found = _power(text)
        if found is not None:
            done.append(_shifted(*found, decimal))
            count += 1
        elif not text or is_blank(text) or to_number(text, decimal) is not None:
            done.append(text)
        else:
            return None
    return done if count else None


def said(heading: str, texts: Sequence[str], plain: Sequence[str], rows: Sequence[int]) -> str:
    """Notice about a column whose fields have prefixes, with the first of them.

    Args:
        heading: text of the heading.
        texts: fields as written.
        plain: the same as plain numbers.
        rows: number of the row of each field.
    """
    changed = [k for k, (one, other) in enumerate(zip(texts, plain, strict=True)) if one != other]
    k = changed[0]
    return (
        f"check: fields of {heading!r} have a prefix and no unit ({len(changed)}):"
        f" {texts[k][:LONGEST_QUOTED]!r} in row {rows[k]} was read as {plain[k]}"
    )


def _power(text: str) -> tuple[str, int] | None:
    """The number of a field with a prefix, and the prefix's power of ten; None for another field."""
    if isinstance(text, CellNumber):
        return None
    if (behind := _BEHIND.fullmatch(text)) is not None:
        return behind["number"], _POWERS[behind["prefix"]]
    if (within := _WITHIN.fullmatch(text)) is not None:
        return f"{within['whole']}.{within['part']}", _POWERS[within["prefix"]]
    return None


def _shifted(number: str, power: int, decimal: str) -> str:
    """A number times a power of ten, with all its digits and a decimal mark."""
    return format(Decimal(number.replace(",", ".")).scaleb(power), "f").replace(".", decimal)
