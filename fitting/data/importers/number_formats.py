"""How a workbook displays the number of a cell: in percent, in thousands, with a unit behind it."""

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

from .numerals import CellNumber
from .spelling import is_unit, unit_name

_LITERAL = re.compile(r'"([^"]*)"')
_ASIDE = re.compile(r"\[[^\]]*\]|\\.|_.|\*.")  # colours and conditions, single characters, widths, fillings
_CONDITION = re.compile(r"\[\s*[<>=]")
_THOUSANDS = re.compile(r"[0#?](,+)(?=\.|[^0#?,]|$)")
"""Commas behind the last digit, or before the decimal point: each divides what is displayed by a thousand."""
_MULTIPLE = re.compile(r"k|m|mn|mio\.?|tsd\.?|t", re.IGNORECASE)


class Display(NamedTuple):
    """The way a number is displayed.

    Attributes:
        factor: displayed number per number of the cell.
        percent: true if a percent sign stands behind it.
        unit: unit that stands behind it; empty without one.
    """

    factor: float = 1.0
    percent: bool = False
    unit: str = ""


@lru_cache(maxsize=1024)
def display_of(number_format: str) -> Display:
    """The way in which a number format displays positive numbers (its first section).

    A format with a condition, such as `[>=1000]0.0,;0.0`, displays each number in its own way: it tells none.
    """
    if _CONDITION.search(_LITERAL.sub(" ", number_format)):
        return Display()
    bare = _ASIDE.sub(" ", _LITERAL.sub(" ", number_format)).split(";")[0]
    literals = [text.strip() for text in _LITERAL.findall(number_format.split(";")[0])]
    if "%" in bare:
        return Display(100.0, percent=True)
    thousands = _THOUSANDS.search(bare)
    if thousands and any(_MULTIPLE.fullmatch(text) for text in literals):
        return Display()  # `20.8k` is the number itself
    factor = 1e-3 ** len(thousands[1]) if thousands else 1.0
    unit = next((text for text in literals if text and is_unit(text)), "")
    if unit_name(unit) == "percent":
        return Display(factor, percent=True)
    return Display(factor, unit=unit if any(c.isalpha() for c in unit) else "")


def times(text: CellNumber, factor: float) -> CellNumber:
    """A number of a cell with a factor, with all its digits."""
    sign = "%" if text.endswith("%") else ""
    return CellNumber(f"{factor * float(text.removesuffix('%')):.15g}{sign}")


def as_text(value: float, display: Display) -> CellNumber:
    """A number as text, with all its digits; as it is displayed in percent, but not in thousands."""
    text = CellNumber(str(value))
    if not display.percent:
        return text
    return CellNumber(f"{times(text, display.factor if display.factor > 1.0 else 1.0)}%")


def one_unit(displays: Iterable[Display]) -> str:
    """The unit with which all of some cells are displayed; empty where one has none, or another."""
    units = {display.unit for display in displays}
    return units.pop() if len(units) == 1 else ""
