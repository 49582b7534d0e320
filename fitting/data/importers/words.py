"""Vocabulary of headings: words of machines and laboratories for quantities, and for specimens."""

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache

from .spelling import Heading, dimension, is_unit, parse_heading, plain, unit_name


def _of_spring(quantity: str, symbol: str, number: int) -> list[str]:
    """Headings of a quantity of one of several springs, in the order in which they are preferred."""
    symbols = [f"{symbol}{number}", f"{symbol} {number}"] if symbol else []
    names = [quantity, *([symbol] if symbol else [])]
    springs = [f"{spring} {number}" for spring in ("spring", "sma")]
    return [
        f"{quantity} {number}",
        *symbols,
        *(f"{name} {spring}" for name in names for spring in springs),
        *(f"{spring} {name}" for name in names for spring in springs),
        *(f"{quantity} of {spring}" for spring in springs),
    ]


# Headings that name a quantity, in lower case, without their unit. The first of several is taken.
WORDS: dict[str, tuple[str, ...]] = {
    "time": (
        "time", "elapsed time", "test time", "total time", "t", "time elapsed", "running time", "run time",
        "timestamp", "elapsed", "duration",
        "time stamp", "zeit", "prüfzeit", "temps", "tiempo", "tijd", "时间", "試験時間", "时刻", "date time",
        "datetime", "clock",
        "tempo", "tid", "czas", "aika", "時間", "시간", "время",
    ),
    "strain": (
        "engineering strain", "eng. strain", "eng strain", "engg strain", "nominal strain", "tensile strain",
        "compressive strain",
        "compression strain", "axial strain", "strain", "strain extensometer", "extensometer strain",
        "strain dic",
        "tensile strain digital strain 1", "tensile strain digital strain",
        "compressive strain digital strain 1", "compressive strain digital strain",
        "tensile strain displacement", "tensile strain extension", "tensile strain strain 1",
        "compressive strain displacement",
        "compressive strain extension", "compressive strain strain 1", "technical strain", "dehnung",
        "nenndehnung",
        "déformation", "deformation strain", "ε", "eps", "epsilon", "应变", "ひずみ", "stroke strain",
        "standard strain", "video strain", "video extensometer", "video axial strain", "ave", "ave2",
        "ave 2",
        "deformazione", "deformación", "deformação", "rek", "töjning", "odkształcenie", "변형률",
        "деформация",
    ),
    "stress": (
        "engineering stress", "eng. stress", "eng stress", "engg stress", "nominal stress", "tensile stress",
        "compressive stress",
        "compression stress", "axial stress", "stress", "first piola-kirchhoff stress", "pk1 stress",
        "spannung",
        "nennspannung", "contrainte", "σ", "sigma", "应力", "応力", "standard stress",
        "sforzo", "tensione", "spanning", "esfuerzo", "tensión", "tensão", "spänning", "naprężenie",
        "응력", "напряжение",
    ),
    "true_strain": ("true strain", "logarithmic strain", "log strain", "hencky strain", "true axial strain"),
    "true_stress": ("true stress", "cauchy stress", "true axial stress"),
    "stretch": ("stretch", "stretch ratio", "lambda", "λ", "extension ratio", "elongation ratio"),
    "elongation": (
        "extension", "elongation", "displacement", "tensile extension", "tensile displacement",
        "compressive extension",
        "compressive displacement", "compression", "compression displacement", "standard travel",
        "machine extension",
        "crosshead displacement", "crosshead extension", "crosshead travel", "axial displacement",
        "actuator displacement",
        "deflection", "disp", "disp.", "stroke", "travel", "crosshead", "crosshead position", "position",
        "weg", "stauchung", "kolbenweg", "prüfweg", "maschinenweg",
        "standardweg", "traversenweg",
        "course traverse", "course", "verlängerung", "course standard", "allongement", "déplacement",
        "deplacement",
        "verplaatsing", "位移", "变形", "変位", "ストローク", "extensometer", "ext", "dl", "delta l", "δl",
        "displ", "displ.", "pos", "length change", "längenänderung", "change in length",
        "change of length", "length variation", "variation of length", "elongation δl", "elongation dl",
        "lvdt", "lvdt displacement", "laser displacement", "dial gauge", "dial indicator",
        "spostamento", "allungamento", "corsa", "desplazamiento", "alargamiento", "elongación",
        "deslocamento", "alongamento", "förskjutning", "förlängning", "przemieszczenie", "wydłużenie",
        "verlenging", "uitrekking", "déplacement traverse", "伸长", "伸长量", "변위", "перемещение",
        "удлинение",
    ),
    "force": (
        "load", "force", "druckkraft", "zugkraft", "prüfkraft",
        "tensile force", "tensile load", "compressive load", "compressive force",
        "compression force",
        "compression load", "standard force", "axial force", "axial load", "load cell", "loadcell",
        "load cell force", "f", "kraft",
        "standardkraft", "force standard", "charge", "kracht", "力", "荷重",
        "試験力", "载荷", "负荷",
        "weight", "hung mass", "hanging mass", "suspended mass", "applied mass", "hung weight",
        "hanging weight", "suspended weight", "applied weight", "dead weight", "applied load",
        "forza", "carico", "fuerza", "carga", "força", "siła", "试验力", "力值", "하중", "сила", "усилие",
        "нагрузка",
    ),
    "temperature": (
        "temperature", "specimen temperature", "sample temperature", "wire temperature", "temp", "temp.",
        "temperature chamber",
        "chamber temperature", "oven temperature", "bath temperature", "thermocouple", "temperatur",
        "probentemperatur",
        "température", "temperatura", "温度",
        "temperatuur", "lämpötila", "온도", "температура",
    ),
    "resistance": ("resistance", "r", "electrical resistance", "widerstand", "résistance", "ohms", "电阻",
        "res", "fres",
        "resistenza", "resistencia", "resistência", "weerstand", "抵抗", "저항", "сопротивление",
    ),
    "current": ("current", "i", "strom", "courant", "heating current",
        "corrente", "corriente", "stroom", "电流", "電流", "전류", "ток",
    ),
    "pressure": (
        "pressure", "gauge pressure", "gage pressure", "absolute pressure", "pressure absolute",
        "pressure abs", "abs pressure", "pressure gauge", "applied pressure", "internal pressure",
        "air pressure", "supply pressure", "druck", "überdruck", "pression", "压力", "chamber pressure",
        "absolutdruck", "absoluter druck", "relativdruck",
        "input pressure", "pressure measured", "measured pressure", "p", "p abs", "p gauge", "p rel",
        "p ch", "pch", "p chamber", "p in", "p int", "p internal", "p actuator",
        "pressione", "druk", "presión", "pressão", "tryck", "ciśnienie", "圧力", "압력", "давление",
    ),
    "length": (
        "length", "actuator length", "tube length", "länge", "longueur", "长度", "長さ", "길이", "длина",
        "lunghezza", "longitud", "schlauchlänge", "centreline length", "centerline length",
        "length centreline", "length centerline", "length of centreline", "length of centerline",
        "arc length",
    ),
    "curvature": ("curvature", "kappa", "κ", "krümmung", "courbure"),
    "bend_angle": (
        "bend angle", "bending angle", "tip angle", "deflection angle", "biegewinkel", "bend", "angle",
        "theta", "θ", "winkel",
    ),
    "bend_direction": ("bend direction", "bending direction", "direction of bending", "biegerichtung"),
    "cycle": (
        "cycle", "cycle number", "cycle count", "total cycle count", "total cycles", "cycle no",
        "cycle no.",
        "cycles", "zyklus",
    ),
    "voltage": (
        "voltage", "output voltage", "v out", "vout", "spring voltage", "voltage drop", "wire voltage",
        "u", "v",
    ),
    **{
        f"{quantity}_{k}": tuple(_of_spring(quantity, symbol, k))
        for quantity, symbol in (("voltage", ""), ("resistance", "r"), ("current", "i"))
        for k in (1, 2, 3)
    },
}  # fmt: skip
# Symbols and words that may be anything: recognised with a unit that fits only.
_NEEDS_UNIT = {
    "f": "force", "charge": "force", "weight": "force", "t": "time", "clock": "time",
    **{
        words: quantity
        for quantity, symbol in (("resistance", "r"), ("current", "i"))
        for number in (1, 2, 3)
        for words in (f"{symbol}{number}", *_of_spring(symbol, "", number))
    },
    "stroke": "length", "travel": "length", "ext": "length", "dl": "length", "delta l": "length",
    "δl": "length", "bend": "angle", "angle": "angle", "theta": "angle", "θ": "angle",
    "compression": "length", "p": "pressure", "p abs": "pressure", "p gauge": "pressure",
    "p rel": "pressure", "r": "resistance", "i": "current",
    **dict.fromkeys(("p ch", "pch", "p chamber", "p in", "p int", "p internal", "p actuator"), "pressure"),
    "tid": "time", "carga": "force", "corsa": "length", "rek": "number",
    "ave": "number", "ave2": "number", "ave 2": "number",
    "pos": "length", "winkel": "angle", "u": "voltage", "v": "voltage",
    "res": "resistance", "fres": "resistance",
    "lvdt": "length", "dial gauge": "length", "dial indicator": "length", "duration": "time",
}  # fmt: skip
_QUANTITY = {word: (quantity, rank) for quantity, words in WORDS.items() for rank, word in enumerate(words)}
_SYMBOL = re.compile(r"[^\W\d_]\d?")
"""A letter, or one with a number. `T` may be a time or a temperature, so it reads like neither."""
_OF_SENSORS = ("voltage", "current", "resistance")
"""What sensors put out for a quantity. In any other unit a symbol stands for something else: `P (W)` is a
power, `P (N)` a load, `r (mm)` a radius, `R2 (-)` a coefficient of determination."""
# Quantity from the unit where the word disagrees: `Elongation (%)` is a strain, `Stress (N)` a force.
_BY_UNIT = {
    ("elongation", "number"): "strain", ("strain", "length"): "elongation", ("stress", "force"): "force",
    ("force", "pressure"): "stress", ("stress", "voltage"): "voltage", ("length", "number"): "stretch",
    ("stretch", "length"): "length", ("cycle", "time"): "time",
    ("time", "temperature"): "temperature",
}  # fmt: skip

# A clock by its first word and its unit, where nothing better is there: `Time T (s)`, `Time of test [min]`.
_CLOCK = re.compile(r"(?:time|zeit|temps|tiempo)[\s_:,\-]+(?P<tag>.+)$")
COMPRESS = re.compile(r"\bcompress|\bdruckversuch|\bdruckprüf|\bstauch", re.IGNORECASE)
SPECIMEN_WORDS = ("specimen", "sample", "coupon", "probe", "échantillon", "éprouvette", "dumbbell", "dogbone")
TEST_WORDS = (
    "test",
    "run",
    "trial",
    "replicate",
    "repeat",
    "rep",
    "versuch",
    "essai",
    "no",
    "nr",
    "cycle test",
)
# What else heads a column that tells specimens apart.
LOT_WORDS = ("material", "batch", "lot", "prüfling", "prüfkörper", "probekörper", "muster", "lot de matière")
_TAGGED = "|".join((*SPECIMEN_WORDS, *(rf"(?:{word})(?![a-z]{{2}})" for word in TEST_WORDS)))  # no `normal`
_TAG_PATTERNS = (
    re.compile(r"^(?P<tag>\d{1,4}) ?<(?P<name>[a-z]+)>$"),  # `101 <RES>`, a channel of a data logger
    # `Stress Specimen 2`, `Stress - sample B`, `Stress_test_3`, `Stress #2`
    re.compile(rf"^(?P<name>.+?)[\s\-:,_]+(?P<tag>(?:{_TAGGED})[\s.#_]*(?:no\.?|nr\.?)?\s*[\w.]{{1,12}})$"),
    re.compile(rf"^(?P<tag>(?:{_TAGGED})[\s.#_]*(?:no\.?|nr\.?)?\s*[\w.]{{1,12}}?)[\s\-:,_]+(?P<name>.+)$"),
    re.compile(r"^(?P<tag>(?!x ?10)[a-z]{1,3} ?\d{1,3})[\s\-:,_]+(?P<name>.+)$"),  # `s1 stress`, `C_1_Force`
    re.compile(r"^(?P<name>.+?)[\s\-:,_]+(?P<tag>(?!x10)[a-z]{1,3}\d{1,3})$"),  # `stress s1`, no `stress x10`
    re.compile(r"^(?P<name>.+?)\s*[#.\s\-_]\s*(?P<tag>\d{1,3})$"),  # `stress 2`, `stress.1`, `stress #2`
    re.compile(r"^(?P<name>[^\d\s]{3,}?)(?P<tag>\d{1,3})$"),  # `stress2`
    re.compile(r"^(?P<name>.+?)[\s\-:,_]+(?P<tag>[a-h])$"),  # `stress a`
)  # fmt: skip

_REMARK = re.compile(
    r"\s+(filtered|raw|corrected|measured|meas|absolute|absolut|gauge|abs|ave|ist|actual|act)$"
)
"""Words behind a name that leave it the same quantity."""
_DIFFERENCE = re.compile(r"(?P<name>\w+) ?[-/\u2212] ?(?P=name)[_ ]?(?:0|o|ref|init|initial|amb|rt|base)$")
"""A quantity less its first value, or over it: `T-T0`, `R/R0`."""
_LETTERS = re.compile(r"[^\W\d_]+")
_CAPITAL = re.compile(r"(?<=[a-z])(?=[A-Z])")
"""Place of a capital that begins a word within another: `BendAngle`."""
_DIGIT_FIRST = re.compile(r"[+-]?[.,]?\d")
_FIRST_WORDS = {
    f"{_LETTERS.findall(word)[0]}{ending}"
    for word in (*_QUANTITY, "microstrain", "millistrain")
    for ending in ("", "s", "es")
}
CACHED = 4096
"""Number of texts whose meaning is kept."""


@dataclass(frozen=True)
class Meaning:
    """Meaning of a heading.

    Attributes:
        quantity: quantity, one of `WORDS`.
        rank: position of its word among those of the quantity; the lowest wins.
        tag: text that distinguishes it from others of the same word (`"specimen 2"`), or empty.
    """

    quantity: str
    rank: int
    tag: str = ""


def meaning(heading: Heading, any_unit: bool = False) -> Meaning | None:
    """Quantity and specimen that a heading names; None if it names none.

    Args:
        heading: heading of a column.
        any_unit: true to read symbols such as `R2` in units of other dimensions, too.
    """
    if _DIFFERENCE.match(heading.name):
        return None
    direct = _lookup(heading.name, heading, any_unit)
    if direct is not None:
        return Meaning(*direct)
    for pattern in _TAG_PATTERNS:
        found = pattern.match(heading.name)
        if found:
            named = _lookup(found["name"].strip(" -:,_"), heading, any_unit)
            if named is not None:
                return Meaning(*named, tag=" ".join(found["tag"].split()))
    clock = _CLOCK.match(heading.name)
    if clock and dimension(heading.unit) == "time":
        return Meaning("time", len(WORDS["time"]), tag=clock["tag"])
    return None


def meaning_of(text: str) -> Meaning | None:
    """Quantity and specimen that the text of a heading names; None if it names none."""
    return None if not text or _DIGIT_FIRST.match(text) else _meaning_of(text)


@lru_cache(maxsize=CACHED)
def _meaning_of(text: str) -> Meaning | None:
    """As `meaning_of`. Texts in which no name of a quantity begins are told at once."""
    words = _LETTERS.findall(_CAPITAL.sub(" ", unicodedata.normalize("NFKC", text)).lower())
    return None if _FIRST_WORDS.isdisjoint(words) else meaning(heading_of(text))


def _lookup(name: str, heading: Heading, any_unit: bool = False) -> tuple[str, int] | None:
    for written in (
        name,
        name.replace("-", " "),
        _REMARK.sub("", name),
        re.sub(r"^(filtered|raw|corrected)\s+", "", name),
        re.sub(r"\btemp\b\.?", "temperature", name),
        re.sub(r"(?<=ss)es$|(?<=ch)es$|(?<=[^s])s$", "", name),
    ):
        if written in _QUANTITY:
            quantity, rank = _QUANTITY[written]
            quantity = _BY_UNIT.get((quantity, dimension(heading.unit)), quantity)
            stated = dimension(heading.unit)
            if written in _NEEDS_UNIT and stated not in _dimensions(written, quantity):
                if not any_unit or written in ("t", "p in") or (
                    _SYMBOL.fullmatch(written) and stated not in (None, *_OF_SENSORS)
                ):
                    return None
            return quantity, rank
    return None


def _dimensions(written: str, quantity: str) -> tuple[str, ...]:
    """Dimensions that an ambiguous word may have."""
    if quantity == "force":
        return ("force", "mass")
    return (_NEEDS_UNIT[written],) if quantity not in ("temperature", "strain") else ("temperature", "number")


def heading_of(text: str) -> Heading:
    """Heading of a text. A letter at its end is a unit where the rest names a quantity (`Temperature C`)."""
    heading = parse_heading(text)
    if heading.name in _QUANTITY:  # `Extension ratio` is a stretch, and no extension in ratios
        return heading
    if heading.name in ("microstrain", "millistrain"):
        return Heading(text, "strain", heading.unit or heading.name)
    percent = re.match(r"(?:percent|per cent|pct\.?|%)\s+(.+)$", text.strip(), re.IGNORECASE)
    if heading.unit is None and percent and plain(percent[1]) in _QUANTITY:
        return Heading(text, plain(percent[1]), "percent")
    if heading.name not in _QUANTITY and (words := _of_capitals(text)):
        return Heading(text, parse_heading(words).name, parse_heading(words).unit)
    stem, _, suffix = text.rpartition(" ")
    if heading.unit is None and plain(stem) in _QUANTITY and is_unit(suffix) and not suffix.isdigit():
        return Heading(text, plain(stem), unit_name(suffix))
    return heading


def _of_capitals(text: str) -> str:
    """A heading whose first word joins others by capitals, in words: `BendAngle (deg)`; empty for others.

    The name must then be one of a quantity, so that no unit and no symbol is divided.
    """
    first = re.match(r"[^\W\d_]+", text)
    if first is None:
        return ""
    words = _CAPITAL.sub(" ", first[0]) + text[first.end() :]
    return words if words != text and parse_heading(words).name in _QUANTITY else ""
