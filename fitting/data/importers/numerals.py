"""Parser of numbers in the notations of instruments and spreadsheets: decimal marks, thousands separators,
blanks, clocks."""

import math
import re
from datetime import datetime

_BLANK = re.compile(r"\*+|-+|n\.?/?a\.?|nan|null|none|#n/?a|#n/?v|#value!|#div/0!", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
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
_SPACED = re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:[ \u00a0\u2009\u202f]\d{{3}})+([.,]\d*)?{_EXPONENT}")
_SPACES = re.compile(r"[ \u00a0\u2009\u202f]")
# Numbers with one comma, which is the decimal mark where commas are.
_ONLY_COMMA = re.compile(r"[+-]?(\d*,\d+)([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?[\d.,'’ \u00a0\u2009\u202f]*\d[\d.,'’ \u00a0\u2009\u202f]*([eE][+-]?\d+)?")

_LIKE_A_CLOCK = re.compile(
    r"\d{1,4}[-:/.]\d{1,2}[-:/.]\d{1,4}([ T]\d{1,2}:\d{2}(:\d{2})?([.,]\d+)?Z?)?([.,]\d+)?( [AaPp][Mm])?"
)
_CLOCK = re.compile(r"(?:(\d+)\s*[d:]\s*)?(\d{1,3}):(\d{2}):(\d{2})(?:[.,](\d+))?")
_SHORT_CLOCK = re.compile(r"(\d{1,4}):(\d{2})[.,](\d+)")
_DATES = (
    "%Y-%m-%d %H:%M:%S", "%Y/%m/%d %H:%M:%S", "%d.%m.%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S",
    "%d-%m-%Y %H:%M:%S", "%m/%d/%Y %I:%M:%S %p", "%d.%m.%y %H:%M:%S", "%Y%m%d %H:%M:%S",
)  # fmt: skip


def to_number(text: str, decimal: str, spaced: str = "any") -> float | None:
    """Number of a field; NaN if it is blank (`****`, `-`, `NaN`, `N/A`, nothing), None if it is text.

    Args:
        text: field without surrounding spaces.
        decimal: decimal mark, `"."` or `","`; the other one may group thousands, as may `'` and spaces.
        spaced: numbers in which spaces may group thousands: `"any"`, or those with a decimal `"point"`.
    """
    if _NUMBER.fullmatch(text) and (decimal == "." or "." not in text):
        return _float(text)
    if not text or _BLANK.fullmatch(text):
        return math.nan
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
    if decimal == "," and _ONLY_COMMA.fullmatch(text):
        return _float(text.replace(",", "."))
    return None


def _float(text: str) -> float:
    return float(text.replace("d", "e").replace("D", "e"))


def decimal_evidence(text: str) -> str | None:
    """Decimal mark that a field proves, or None where either mark is possible (`1,234`)."""
    if to_number(text, ".") is None and to_number(text, ",") is not None:
        return ","
    if to_number(text, ",") is None and to_number(text, ".") is not None:
        return "."
    return None


def like_a_number(text: str) -> bool:
    """True if a field consists of digits and marks alone, whatever number it may be."""
    return bool(_LIKE_A_NUMBER.fullmatch(text.strip()))


def like_a_clock(text: str) -> bool:
    """True if a field consists of the digits and marks of a date or a time of day."""
    return bool(_LIKE_A_CLOCK.fullmatch(text.strip()))


def clock_seconds(texts: list[str]) -> list[float] | None:
    """Seconds of a column of clock readings (`0:01:05.2`, `2023-05-01 12:00:01`), blanks as NaN.

    Returns:
        Seconds since midnight of the first day or of the clock's own zero, or None where a field is neither
        blank nor a clock.
    """
    found: list[float] = []
    first: datetime | None = None
    filled = 0
    for text in texts:
        text = text.strip().strip('"')
        if not text or _BLANK.fullmatch(text):
            found.append(math.nan)
            continue
        filled += 1
        seconds = _of_clock(text)
        if seconds is None:
            moment = _of_date(text)
            if moment is None:
                return None
            first = first or moment
            seconds = (moment - first).total_seconds()
        elif first is not None:
            return None
        found.append(seconds)
    return found if filled else None


def _of_clock(text: str) -> float | None:
    found = _CLOCK.fullmatch(text)
    if found:
        days, hours, minutes, seconds, part = found.groups()
        whole = 86400 * int(days or 0) + 3600 * int(hours) + 60 * int(minutes) + int(seconds)
        return whole + (float(f"0.{part}") if part else 0.0)
    found = _SHORT_CLOCK.fullmatch(text)
    if found:
        return 60 * int(found[1]) + int(found[2]) + float(f"0.{found[3]}")
    return None


def _of_date(text: str) -> datetime | None:
    text = re.sub(r"(?<=\d)T(?=\d)", " ", text).removesuffix("Z")
    head, _, part = text.partition(".") if re.search(r":\d{2}\.\d+", text) else (text, "", "")
    if re.search(r"\.\d+ [AaPp][Mm]$", text):
        head, part = re.sub(r"\.\d+(?= )", "", text), ""
    if re.search(r":\d{2}\.\d+", text) and "." in text[:10]:  # 01.05.2023 12:00:01.5
        head, _, part = text.rpartition(".")
    for form in _DATES:
        try:
            moment = datetime.strptime(head.strip(), form)
        except ValueError:
            continue
        return moment.replace(microsecond=int(float(f"0.{part}") * 1e6)) if part.isdigit() else moment
    return None
