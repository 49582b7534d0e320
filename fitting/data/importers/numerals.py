"""Parser of numbers in the notations of instruments and spreadsheets: decimal marks, thousands separators,
blanks."""

import math
import re

_ERROR = re.compile(r"#n/?[av]!?|#[^\W\d_][^\s,;]{1,14}[!?]|#¡[^\s,;]{2,14}!", re.IGNORECASE)
"""Errors that spreadsheets write in the place of a number: `#DIV/0!`, `#N/A`, `#WERT!`, `#NAME?`."""
_BLANK = re.compile(rf"\*+|-+|n\.?/?a\.?|nan|null|none|{_ERROR.pattern}", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
# Negative numbers as accountants and some databases write them: `(12.30)`, `12.30-`. A whole number in
# parentheses, `(1)`, is the number of a column.
_NEGATIVE = re.compile(r"\((\d[\d.,'’ ]*[.,]\d+)\)|(\d[\d.,'’ ]*[.,]\d+)-")
_EXPONENT = r"([eEdD][+-]?\d+)?"
# Thousands in groups of three, by the decimal mark that goes with them. A group never begins with 0.
_GROUPED = {
    ".": re.compile(
        rf"[+-]?[1-9]\d{{0,2}}(?:(,)\d{{3}}(?:,\d{{3}})*|(['’])\d{{3}}(?:['’]\d{{3}})*)(\.\d*)?{_EXPONENT}"
    ),
    ",": re.compile(
        rf"[+-]?[1-9]\d{{0,2}}(?:(\.)\d{{3}}(?:\.\d{{3}})*|(['’])\d{{3}}(?:['’]\d{{3}})*)(,\d*)?{_EXPONENT}"
    ),
}
_INDIAN = re.compile(rf"[+-]?[1-9]\d?(?:,\d{{2}})+,\d{{3}}(\.\d*)?{_EXPONENT}")
"""Lakhs and crores: `1,23,456.7`."""
_POWER = re.compile(r"(?P<number>[+-]?[\d.,]*\d)\s*[x×*·]\s*10\s*(?:\^|\*\*)?\s*\(?(?P<power>[+-]?\d+)\)?")
"""A number times a power of ten: `1.2x10^-3`, `1.2 · 10⁻³`."""
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_SPACED = re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:[ \u00a0\u2009\u202f]\d{{3}})+([.,]\d*)?{_EXPONENT}")
_SPACES = re.compile(r"[ \u00a0\u2009\u202f]")
# Numbers with a decimal comma, without thousands.
_DECIMAL_COMMA = re.compile(r"[+-]?(\d*,\d+)([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?[\d.,'’ \u00a0\u2009\u202f]*\d[\d.,'’ \u00a0\u2009\u202f]*([eE][+-]?\d+)?")


class CellNumber(str):
    """A number of a workbook's cell as text. A point marks its decimals, whatever the cells of text use."""

    __slots__ = ()


def to_number(text: str, decimal: str, spaced: str = "any") -> float | None:
    """Number of a field.

    Args:
        text: field without surrounding spaces. A percent sign at its end is left out: `5 %` is 5.
        decimal: decimal mark, `"."` or `","`; the other one may group thousands, as may `'` and spaces.
        spaced: `"any"` if spaces may group the thousands of all numbers; `"point"` if only of numbers with a
            decimal point.

    Returns:
        The number; NaN if the field is blank (`****`, `-`, `NaN`, `N/A`, nothing), None if it is text.
    """
    if isinstance(text, CellNumber):
        return float(text.removesuffix("%"))
    if _NUMBER.fullmatch(text) and (decimal == "." or "." not in text):
        return _float(text)
    if not text or _BLANK.fullmatch(text):
        return math.nan
    if text[0] in "+-" and text[1:2] == " ":  # a sign in a column of its own, as some loggers write it
        return to_number(text[0] + text[1:].lstrip(), decimal, spaced)
    if (negative := _NEGATIVE.fullmatch(text)) is not None:
        value = to_number(negative[1] or negative[2], decimal, spaced)
        return None if value is None else -value
    if text.endswith("%"):
        return to_number(text[:-1].rstrip(), decimal, spaced) if len(text) > 1 else None
    if "\u2212" in text:  # a minus sign as typesetters write it
        return to_number(text.replace("\u2212", "-"), decimal, spaced)
    if _GROUPED[decimal].fullmatch(text):
        other = "," if decimal == "." else "."
        return _float(re.sub(rf"['’{re.escape(other)}]", "", text).replace(",", "."))
    if (
        (spaced == "any" or "." in text)
        and _SPACED.fullmatch(text)
        and ("," if decimal == "." else ".") not in text
    ):
        return _float(_SPACES.sub("", text).replace(",", "."))
    if decimal == "," and _DECIMAL_COMMA.fullmatch(text):
        return _float(text.replace(",", "."))
    if decimal == "." and _INDIAN.fullmatch(text):
        return _float(text.replace(",", ""))
    if "10" in text and (power := _POWER.fullmatch(text.translate(_RAISED))) is not None:
        value = to_number(power["number"], decimal, spaced)
        return None if value is None else float(f"{value!r}e{power['power']}")
    return None


def _float(text: str) -> float:
    """A number whose exponent may be marked by `d`, as Fortran writes it."""
    return float(text.replace("d", "e").replace("D", "e"))


def decimal_evidence(text: str) -> str | None:
    """Decimal mark that a field proves, or None where either mark is possible (`1,234`)."""
    if to_number(text, ".") is None and to_number(text, ",") is not None:
        return ","
    if to_number(text, ",") is None and to_number(text, ".") is not None:
        return "."
    return None


def like_a_number(text: str) -> bool:
    """True if a field consists of digits, marks and an exponent alone, even if it is no number: `1.2.3`."""
    return bool(_LIKE_A_NUMBER.fullmatch(re.sub(r"^([+-]) +", r"\1", text.strip())))


def is_blank(text: str) -> bool:
    """True if a field is written to be blank: `****`, `-`, `NaN`, `N/A`."""
    return bool(_BLANK.fullmatch(text))


def is_spreadsheet_error(text: str) -> bool:
    """True for an error that a spreadsheet writes in the place of a number: `#DIV/0!`, `#N/A`."""
    return bool(_ERROR.fullmatch(text))
