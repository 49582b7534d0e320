"""Spelling of units and headings by instruments and people: `Load (N)`, `Strain %`, `Druck / bar abs`."""

import re
import unicodedata
from dataclasses import dataclass, replace

from pneusma_jax.units import UNITS, find_unit

# Spellings of units, in lower case, that differ from the package's names in more than capitals.
_SPELLINGS = {
    "": "1", "-": "1", "–": "1", "/": "1", "--": "1", "[-]": "1", "none": "1", "mm/mm": "1", "m/m": "1",
    "in/in": "1",
    "unitless": "1", "dimensionless": "1", "dimensionslos": "1",
    "in./in.": "1", "ratio": "1", "abs": "1", "pct": "percent", "%": "percent", "percentage": "percent",
    "prozent": "percent",
    "‰": "permille", "ue": "microstrain", "uε": "microstrain", "με": "microstrain", "ustrain": "microstrain",
    "µstrain": "microstrain", "\u00b5ε": "microstrain", "mε": "millistrain", "µe": "microstrain",
    "µm/m": "microstrain", "um/m": "microstrain", "µin/in": "microstrain", "mm/m": "millistrain",
    "c": "degC", "°c": "degC", "ºc": "degC", "deg c": "degC", "deg. c": "degC", "degrees c": "degC",
    "degree c": "degC", "grad c": "degC", "oc": "degC",
    "celsius": "degC",
    "f": "degF", "°f": "degF", "ºf": "degF", "deg f": "degF", "deg. f": "degF",
    "degrees f": "degF", "kelvin": "K", "°k": "K", "ºk": "K",
    "deg k": "K", "degk": "K",
    "sec": "s", "sec.": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms",
    "milliseconds": "ms", "millis": "ms", "micros": "us", "microseconds": "us", "sekunden": "s",
    "secondes": "s", "segundos": "s", "minuten": "min",
    "с": "s", "мс": "ms", "мин": "min", "ч": "h", "мм": "mm", "см": "cm", "н": "N", "кн": "kN",
    "Па": "Pa", "кПа": "kPa", "МПа": "MPa", "Ом": "ohm", "°с": "degC", "а": "A", "ма": "mA",
    "µs": "us", "mins": "min", "minutes": "min", "hr": "h", "hrs": "h", "hours": "h", "sek": "s", "std": "h",
    "inch": "in", "inches": "in", "in.": "in", '"': "in", "''": "in", "′′": "in", "”": "in",
    "feet": "ft", "foot": "ft", "thou": "mil",
    "mils": "mil",
    "millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "millimetres": "mm", "µm": "um",
    "micron": "um",
    "microns": "um", "micrometer": "um", "meter": "m", "metre": "m",
    "newton": "N", "newtons": "N", "lb": "lbf", "lbs": "lbf", "lbsf": "lbf", "pounds": "lbf", "oz": "ozf",
    "ounces": "ozf",
    "grams": "g", "gram": "g", "gr": "g", "gmf": "gf", "kgs": "kg", "kp": "kgf", "µn": "uN",
    "µv": "uV", "µa": "uA",
    "pascal": "Pa", "pascals": "Pa", "n/m^2": "N/m2", "n/mm^2": "N/mm2", "kg/cm2": "kgf/cm2",
    "kg/mm2": "kgf/mm2",
    "kp/cm2": "kgf/cm2", "at": "kgf/cm2", "g/cm2": "gf/cm2", "g/mm2": "gf/mm2", "lb/in2": "psi",
    "lbf/in2": "psi",
    "lbs/in2": "psi", "lbf/sq in": "psi", "lb/sq in": "psi", "pounds per square inch": "psi",
    "kips/in2": "ksi",
    "millibar": "mbar", "bars": "bar", "kg/cm^2": "kgf/cm2", "kgf/cm^2": "kgf/cm2", "g/mm^2": "gf/mm2",
    "g/cm^2": "gf/cm2",
    "in h2o": "inH2O", "inwc": "inH2O", "in wc": "inH2O", "inches of water": "inH2O", "iwc": "inH2O",
    "mm h2o": "mmH2O",
    "in.h2o": "inH2O", "in. h2o": "inH2O", "inwg": "inH2O", "in wg": "inH2O", "in.wc": "inH2O",
    "in. wc": "inH2O", '"h2o': "inH2O", '"wc': "inH2O", '"wg': "inH2O",
    "m h2o": "mH2O", "mwc": "mH2O", "m wc": "mH2O", "mwg": "mH2O", "mca": "mH2O", "mce": "mH2O",
    "mmwc": "mmH2O", "mmws": "mmH2O", "mm wc": "mmH2O", "mmwg": "mmH2O", "mm wg": "mmH2O", "mmce": "mmH2O",
    "cm h2o": "cmH2O", "cmwc": "cmH2O", "cm wc": "cmH2O", "cmws": "cmH2O", "cmwg": "cmH2O", "cm wg": "cmH2O",
    "mm hg": "mmHg", "in hg": "inHg", "in.hg": "inHg", "in. hg": "inHg", '"hg': "inHg",
    "kilopascal": "kPa",
    "ω": "ohm", "Ω": "ohm", "ohms": "ohm", "mω": "mohm", "milliohm": "mohm", "milliohms": "mohm",
    "kω": "kohm", "°": "deg",
    "º": "deg",
    "degrees": "deg", "degree": "deg", "grad": "deg", "radians": "rad", "amps": "A", "amp": "A",
    "ampere": "A",
    "volts": "V", "volt": "V", "mm^2": "mm2", "cm^2": "cm2", "m^2": "m2", "in^2": "in2", "sq mm": "mm2",
    "sq. mm": "mm2",
    "sq in": "in2", "square mm": "mm2", "m-1": "1/m", "m^-1": "1/m", "cm-1": "1/cm", "cm^-1": "1/cm",
    "mm-1": "1/mm", "mm^-1": "1/mm", "in-1": "1/in", "in^-1": "1/in", "1/inch": "1/in",
}  # fmt: skip
_FOLDED: dict[str, set[str]] = {}
for _known in UNITS:
    _FOLDED.setdefault(_known.casefold(), set()).add(_known)

_BRACKETS = re.compile(r"[(\[{<]([^()\[\]{}<>]*)[)\]}>]")
# A letter or number that may name a specimen, not a unit: `Specimen (A) strain (%)`, `Stress S (MPa)`.
_TAG = re.compile(r"[(\[{]\s*[a-hA-H\d]\s*[)\]}](?=.*\w)|(?<![\s,;:/])[\s_]+[^\W_]$|[(\[{]\s*\d\s*[)\]}]$")
_LAST_LETTER = re.compile(r"(?<=[^\W\d])[\s_]+([^\W\d_])$")  # `Temperature_F`, `Temp K`
# A letter that is one where the unit behind it is of another dimension: `Strain (A) (%)`, not `Temp (C) (K)`.
_LETTER_LAST = re.compile(r"[(\[{]\s*[a-hA-H]\s*[)\]}]$")
# Symbols with which m is milli and M is mega. A unit that differs in its prefix alone is another one.
_PREFIXED = re.compile(r"[mM](?=(?:Pa|N|V|A|W|gf?|s|m|rad|bar|ohm|H2O)(?![A-Za-oq-z0-9]))")
# Spellings in which capitals tell units apart.
_EXACT = {"Nm": "N m", "Nmm": "N mm", "oF": "degF", "mWS": "mH2O"}
# A pressure's zero, written with its unit: `psia`, `bar(g)`, `kPa abs`.
_REFERENCE = re.compile(
    r"^(?P<unit>k?pa|mpa|hpa|m?bar|psi|torr|kgf/cm2|atm|(?:mm|in)hg|(?:m|cm|mm|in)h2o)\s*[-_."
    r" ]?\(?(?P<zero>a|abs|abs\.|absolute|absolut|g|ga|gauge|gage|rel|rel\.|relative?|ü)\)?$",
    re.IGNORECASE,
)
# The same in brackets of its own, and a bracket behind it: `Pressure (bar(g))`, `Pressure [kPa (abs)]`.
_NESTED = re.compile(r"[(\[]\s*([^()\[\]]+\([^()\[\]]+\))\s*[)\]]\s*$")
# A quotient as a product with a negative power: `N mm-2`, `kN·m^-2`.
_POWER = re.compile(
    r"(?P<over>[^\W\d_]+)\s*[\s·⋅.*]\s*(?P<under>[^\W\d_]+)(?:\^|\*\*)?[-\u2212\u2013](?P<power>[12])$"
)
# A unit with a mark of division behind a space. `Weg 1/mm` is the first displacement in mm, and no curvature.
_DIVIDED = re.compile(
    r"^(?P<name>.+[^\s,;:/])\s+(?P<unit>[^\W\d]\w*/\S+|(?<=curvature )1/\S+|(?<=krümmung )1/\S+)$",
    re.IGNORECASE,
)
# A name that its channel repeats: `Position(Linear:Position) (mm)`.
_OF_CHANNEL = re.compile(r"^([^\W\d_]{2,20}) ?\([^():]{1,30}: ?\1\)", re.IGNORECASE)
# Marks as wide as Chinese and Japanese letters.
_WIDE = str.maketrans("（）［］｛｝【】〔〕／，：；＝％", "()[]{}[][]/,:;=%")
# Words of statistics that are units of time, too: `Load min (N)`, `Load std (N)`.
_STATISTICS = ("min", "std")
# Masses that stand for forces, as many load cells display them.
WEIGHTS = {"g": "gf", "kg": "kgf", "mg": "mgf"}
_GARBLED = {"Â°": "°", "Âµ": "µ", "Î¼": "µ", "Î©": "Ω", "â„¦": "Ω", "Â²": "²", "Îµ": "ε", "Ïƒ": "σ"}
"""Letters of UTF-8 that were read as Latin ones."""
# Words and letters that end a heading more often as a name than as a unit.
_LETTERS = frozenset(
    {"a", "h", "m", "g", "k", "c", "f", "v", "1", "in", "strain", "ratio", "abs", "none", "at"}
)


@dataclass(frozen=True)
class Heading:
    """A column's name and unit as its header gives them.

    Attributes:
        text: original text.
        name: name without its unit, in lower case, without brackets and repeated spaces.
        unit: unit in the header; None where it has none.
        zero: reference of a pressure: `"absolute"`, `"gauge"`, or empty where the header is silent.
        written: unit as the header writes it, where it names the zero (`MPaa`); else empty.
    """

    text: str
    name: str
    unit: str | None
    zero: str = ""
    written: str = ""


def unit_name(text: str) -> str:
    """The package's name of a unit that an instrument spells differently; unchanged if unknown.

    Capitals count where they tell milli from mega: `mPa` is not known, and no `MPa`.
    """
    text = text.strip()
    if text in UNITS and text.casefold() not in _SPELLINGS:
        return text
    exact = re.sub("Ω|Ohms?", "ohm", unicodedata.normalize("NFKC", text))
    if exact in _EXACT or _has_other_prefix(exact):
        return _EXACT.get(exact, exact)
    folded = _normalised(text)
    for written in (
        text, folded, folded.replace("^", "").replace("**", ""), folded.replace(" ", ""),
        folded.replace("_", " "),
    ):  # fmt: skip
        if written in _SPELLINGS:
            return _SPELLINGS[written]
        if written in UNITS:
            return written
        known = _FOLDED.get(written.casefold(), set())
        if len(known) == 1:
            return next(iter(known))
    with_zero = _REFERENCE.match(exact)
    if with_zero:
        return unit_name(with_zero["unit"])
    divided = _POWER.match(exact)
    quotient = f"{divided['over']}/{divided['under']}{divided['power'].strip('1')}" if divided else text
    return unit_name(quotient) if divided and is_unit(quotient) else text


def _has_other_prefix(text: str) -> bool:
    """True for a unit that is unknown, but known with milli in place of mega, or the reverse: `mPa`, `MN`."""
    return bool(_PREFIXED.match(text)) and text not in UNITS and text[0].swapcase() + text[1:] in UNITS


def may_be_unit(text: str) -> bool:
    """True if a text names a unit, or one that differs from it in its prefix alone."""
    return is_unit(text) or _has_other_prefix(unit_name(text))


def same_unit(one: str, other: str) -> bool:
    """True if two written units are one, or differ in spelling alone; a mass stands for its weight."""
    names = [unit_name(text) for text in (one, other)]
    units = [UNITS.get(WEIGHTS.get(name, name)) for name in names]
    return names[0] == names[1] or (units[0] is not None and units[0] == units[1])


def _normalised(text: str) -> str:
    """Lower case, with powers and compatibility characters in plain form (`mm²` is `mm2`, `℃` is `°c`)."""
    for garbled, meant in _GARBLED.items():
        text = text.replace(garbled, meant)
    plain = unicodedata.normalize("NFKC", text).replace("μ", "µ").replace("⁄", "/").replace("\u2212", "-")
    return re.sub(r"\s+", " ", plain).strip().lower()


def is_unit(text: str) -> bool:
    """True if a text names a unit."""
    return unit_name(text) in UNITS


def pressure_zero(text: str) -> str:
    """Reference of a pressure, from its unit or heading: `"absolute"`, `"gauge"` or empty."""
    found = _REFERENCE.match(_normalised(text))
    if found:
        return (
            "absolute" if found["zero"].lower().startswith("abs") or found["zero"].lower() == "a" else "gauge"
        )
    words = set(re.findall(r"[a-zü]+", text.lower()))
    if words & {"absolute", "abs", "absolutdruck", "absoluter"}:
        return "absolute"
    return "gauge" if words & {"gauge", "gage", "relative", "überdruck", "relativdruck"} else ""


def narrow(text: str) -> str:
    """A text whose brackets and marks are as wide as those of Latin letters."""
    return text.translate(_WIDE)


def parse_heading(text: str) -> Heading:
    """Split `Load (N)`, `Strain [-]`, `Force / kN`, `Strain %`, `Load, N`, `force_mN` into name and unit."""
    plainly = re.sub(r"\s{2,}", " ", narrow(text))  # the patterns below take long over a run of spaces
    plainly = _OF_CHANNEL.sub(r"\1", plainly)
    if plainly != text:
        return replace(parse_heading(plainly), text=text)
    nested = _NESTED.search(text)
    if nested and _REFERENCE.match(_normalised(nested[1])):
        return _heading(text, text[: nested.start()], nested[1])
    brackets = list(_BRACKETS.finditer(text))
    several = sum(may_be_unit(found[1].strip()) for found in brackets) > 1
    for found in reversed(brackets):
        content = found[1].strip()
        if may_be_unit(content) and not (several and content.isdigit()):  # `Strain (%) (1)` counts columns
            rest = text[: found.start()] + " " + text[found.end() :]
            before = first_unit(text)
            return _heading(text, rest if before is None else before.name, content)
    divided = _DIVIDED.match(text)
    if divided and is_unit(divided["unit"]):
        return _heading(text, divided["name"], divided["unit"])
    for pattern in (r"^(.+?)\s*[,;:]\s*(\S.*)$", r"^(.+?)\s+(?:/|in)\s+(\S.*)$", r"^(.+?)\s*/\s*(\S+)$"):
        found = re.match(pattern, text)
        if found and not _closed(found[1]):  # `Load (N/kg)`: the mark stands within the brackets
            continue
        if found and found[2].strip() and may_be_unit(found[2].strip(" ()[]")):
            unit = found[2].strip(" ()[]")
            return _heading(text, found[1], unit)
    stem, underscore, suffix = text.rpartition("_")
    if underscore and stem and (suffix in UNITS or _has_other_prefix(suffix)) and not suffix.isdigit():
        return Heading(text, plain(stem), suffix, pressure_zero(stem))
    if underscore and stem and _is_spelt_out(suffix):
        return Heading(text, plain(stem), unit_name(suffix), pressure_zero(suffix) or pressure_zero(stem))
    stem, _, suffix = text.rpartition(" ")
    if (
        stem.strip()
        and may_be_unit(suffix)
        and suffix.lower() not in _LETTERS
        and any(c.isalpha() or c == "%" for c in suffix)
    ):
        return _heading(text, stem, suffix)
    if brackets and brackets[-1].end() == len(text.rstrip()) and _like_a_unit(brackets[-1][1]):
        # A unit that is not known: the name without it, and the error about it when the column is needed.
        return Heading(text, plain(text[: brackets[-1].start()]), brackets[-1][1].strip())
    return Heading(text, plain(text), None, pressure_zero(text))


def _is_spelt_out(text: str) -> bool:
    """True for a unit in letters that are no other word: `mOhm`, `seconds`; and not `min`, `strain`."""
    words = (*_LETTERS, *_STATISTICS)
    return len(text) > 2 and text.isalpha() and is_unit(text) and text.lower() not in words


def _closed(text: str) -> bool:
    """True if every bracket that a text opens is closed in it."""
    return all(text.count(opens) <= text.count(closes) for opens, closes in ("()", "[]", "{}"))


def first_unit(text: str) -> Heading | None:
    """The heading before a unit in brackets that states a unit itself: `Strain %` of `Strain % (-)`, or None.

    A single letter or number may be the name of a specimen. It is a unit only where the brackets have one of
    its dimension: `Temperature_F (°C)`.
    """
    text = text.translate(_WIDE)
    last = re.search(r"[(\[{]([^()\[\]{}]*)[)\]}]\s*$", text)
    if last is None or last[1].strip().isdigit() or not may_be_unit(last[1].strip()):
        return None
    rest = text[: last.start()].strip()
    letter = _LAST_LETTER.search(rest)
    if letter and dimension(letter[1]) == dimension(last[1].strip()) is not None:
        return Heading(rest, plain(rest[: letter.start()]), unit_name(letter[1]))
    before = parse_heading(rest)
    if before.unit is None or not may_be_unit(before.unit) or _TAG.search(rest):
        return None
    if rest.lower().endswith(_STATISTICS) and dimension(last[1].strip()) != "time":
        return None
    letter = _LETTER_LAST.search(rest)
    return before if letter is None or dimension(before.unit) == dimension(last[1].strip()) else None


def _heading(text: str, name: str, unit: str) -> Heading:
    """A heading of a name and a unit, either of which may say from which zero a pressure counts."""
    zero = pressure_zero(unit)
    return Heading(text, plain(name), unit_name(unit), zero or pressure_zero(name), unit if zero else "")


def _like_a_unit(text: str) -> bool:
    """True if the content of brackets may be a unit: short, one word, with a letter."""
    text = text.strip()
    return 0 < len(text) <= 8 and " " not in text and any(c.isalpha() for c in text)


def plain(name: str) -> str:
    """A name in lower case. Content of brackets is kept as words; spaces and underscores are single."""
    return re.sub(r"[\s_()\[\]{}]+", " ", unicodedata.normalize("NFKC", name)).strip(" \"'-:,;/.*").lower()


def dimension(unit: str | None) -> str | None:
    """Dimension of a written unit, or None if it is absent or unknown."""
    name = unit_name(unit) if unit is not None else None
    return find_unit(name).dimension if name in UNITS else None
