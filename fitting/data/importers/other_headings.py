"""Headings that no list of words has: recognised by a word and their unit, or named in refusals."""

import re
import shlex
from collections.abc import Collection, Sequence

from .spelling import Heading, dimension
from .words import SPECIMEN_WORDS, meaning

_DIMENSIONS = {
    "time": ("time",), "strain": ("number",), "stress": ("pressure",), "stretch": ("number",),
    "true_strain": ("number",), "true_stress": ("pressure",), "length": ("length",), "cycle": ("number",),
    "voltage": ("voltage",),
    "force": ("force", "mass"), "elongation": ("length",), "resistance": ("resistance",),
    "temperature": ("temperature",), "current": ("current",), "pressure": ("pressure",),
    "curvature": ("curvature",), "bend_angle": ("angle",),
}  # fmt: skip
_WORD = {
    "force": r"force|load|kraft|fuerza|kracht",
    "elongation": r"extension|elongation|displacement|deflection|verlängerung|allongement",
    "resistance": r"resistance|widerstand|résistance",
    "temperature": r"temperature|temp|temperatur|température",
    "current": r"current|strom|courant",
    "pressure": r"pressure|(?:luft|innen|schlauch|kammer|mess|eingangs|ist)?druck|pression",
    "length": (
        r"(?:schlauch|rohr|proben?|muskel|aktor|ist)?(?:länge|laenge)|length|longueur|longitud|lunghezza"
    ),
    "curvature": r"curvature|krümmung|courbure",
    "bend_angle": r"(?:bend(?:ing)?|tip|deflection|flexion) angle|angle of bend(?:ing)?|biegewinkel",
}
_LENGTHS = re.compile(r"länge|laenge|length|longueur|longitud|lunghezza|长度|長さ|길이|длина")
"""Words for a length that may be part of a longer one: `Schlauchlänge`, `管长度`."""
_NOT_A_LENGTH = re.compile(
    r"\b(?:rest|free|gauge|gage|wave\w*|cable|arm|stroke|step|clamped|initiale?|iniziale|inicial|repos|riposo|"
    r"reposo|ruhe\w*|anfangs\w*|ausgangs\w*|mess\w*|einspann\w*|klemm\w*|kabel\w*|wellen\w*|over|per|diameter|"
    r"durchmesser|diamètre|diametro|diámetro|\w*radius|rayon|raggio|radio|[xyz]|position|coordinate|thickness|"
    r"width|wanddicke|breite)\b|/|初始|原始"
)
"""Words for a length that is no reading of a tube's: a size, a wave's, a cable's, a place."""
_RADIUS = re.compile(
    r"\bradius of (?:curvature|bend(?:ing)?)\b|\b(?:curvature|bend(?:ing)?) radius\b|"
    r"\b(?:krümmungs|kruemmungs|biege)radius\b|"
    r"\brayon de courbure\b|\braggio di curvatura\b|\bradio de curvatura\b"
)
"""Words for one over the curvature."""
_A_SIZE = re.compile(
    r"\b(?:gau?ge|thickness|width|height|depth|diameter|radius|gap|grain|wave\w*|dicke|breite|höhe|durchmesser|"
    r"spalt|korn\w*|épaisseur|largeur|diamètre)\b"
)
"""Words for a length that is a size, or grows as the specimen gets shorter, and no elongation."""
_GAP = re.compile(r"\b(?:gap|spalt|plattenabstand)\b")
"""Words for the gap between the plates of a rheometer, which is the length of the specimen between them."""
_NO_BEND = re.compile(r"\bphase\b|\btwist\b|\btorsion\b|\brotation\b|\bazimuth\b")
"""Words for an angle that is none of bending."""
_NO_TEST = re.compile(r"\b(?:post|anneal\w*|treatment|irradiation|aging|ageing|sinter\w*|curing|cure)\b")
"""Words for a temperature at which a specimen was made."""
_OF_THE_ROOM = re.compile(r"\bluftdruck\b|\bair pressure\b")
"""Words for a pressure that is as often that of the room."""
_OF_A_STRAIGHT_PULL = frozenset({"force", "stress", "true_stress", "strain", "stretch", "true_strain"})
"""Quantities beside which a length is a size or a change of length, and a pressure may be a stress."""
_OF_A_STRESS = ("MPa", "GPa")
"""Units of a pressure in which a heading that says no more is rather a stress."""
_SHAPES = frozenset({"length", "curvature", "bend_angle"})
"""Quantities that a pressure makes."""
_NUMBERED = ("resistance_", "current_")
"""Beginnings of quantities of one spring of several: `R2`, `I1`. Their names mean hardly anything else."""
_SYMBOL = {"r": "resistance", "f": "force", "t": "temperature", "i": "current"}
"""Symbols that stand for a quantity before a further word, in its unit: `R_spring (ohm)`, `F pull [N]`."""
_WITH_UNIT = ("pressure", "length", "curvature", "bend_angle")
"""Quantities whose words count only beside a unit that fits."""
_OF_SPECIMEN = ("temperature", "current")
"""Quantities that other parts of a rig have as often as the specimen, so that a word must name it."""
_SPECIMEN = re.compile(rf"\b(?:{'|'.join(SPECIMEN_WORDS)}|spring|coil|wire|sma|nitinol|niti|feder|draht)\b")
_NOT_MEASURED = re.compile(
    r"\b(?:set ?point|set|sp|target|command(?:ed)?|cmd|demand(?:ed)?|desired|des|nominal|reference|ref|"
    r"soll\w*|ziel|vorgabe|consigne|goal|wanted|required|planned|programmed|control|input|rated|"
    r"limit|lim|threshold|trigger|alarm|tolerance|capacity|resolution|upper|lower|high|low|full scale|"
    r"f?max(?:imum|imale?r?)?|f?min(?:imum|imale?r?)?|grenz\w*|mittel\w*|peak|break(?:ing)?|"
    r"failure|yield|mean|average|avg|rms|amplitude|std|sd|"
    r"error|uncertainty|deviation|drift|bias|offset|zero|tare|change|difference|delta|increment|step|"
    r"cumulative|relative|remaining|residual|permanent|plastic|recovered|normali[sz]ed|ratio|"
    r"uncorrected|old|last|start|frame|normal|side|"
    r"previous|initial|pre ?load|pre|rate|speed|velocity|range|lateral|transverse|shear|radial|friction|"
    r"fric|noise|model(?:led)?|predict(?:ed|ion)|theor(?:y|etical)|simulated|calculated|fit(?:ted)?|"
    r"expected|contact|lead|shunt|series|"
    r"tank|line|regulator|source|vacuum|atmospheric|barometric|hydraulic|compressor|reservoir|"
    r"sense|thermal|motor|heater|supply|internal|ambient|room|valve|grip|clamp|cell)\b"
)
"""Words for what was wished, reduced or measured elsewhere."""
_COMPUTED = re.compile(r"[*×·/]\s*\d|\d\s*[*×·]|\^|\bx ?\d|\b(?:log|log10|ln|lg|sqrt|squared?|inverse|1/)\b")
"""Signs of a factor or a function, so that the numbers are not the quantity itself: `Load*10`, `log load`."""
_EXAMPLES = {
    "force": "Force (N)", "elongation": "Extension (mm)", "resistance": "Resistance (ohm)",
    "temperature": "Temperature (degC)", "current": "Current (A)", "curvature": "Curvature (1/m)",
    "bend_angle": "Bend angle (deg)", "length": "Length (mm)", "pressure": "Pressure (kPa)",
    "stress": "Stress (MPa)", "strain": "Strain (%)",
}  # fmt: skip
_ANOTHER = {"elongation": _A_SIZE, "bend_angle": _NO_BEND, "temperature": _NO_TEST}
"""Words of headings in a quantity's unit that are about something else."""
_BY_DIMENSION = {
    one: quantity
    for quantity in _EXAMPLES
    if quantity not in ("length", "pressure", "stress", "strain")
    for one in _DIMENSIONS[quantity]
}


def quantity_by_word(heading: Heading) -> str | None:
    """Quantity that one of a heading's words names, if its unit is absent or fits; None if that is uncertain.

    `Pull force (N)`, `Spring resistance`, `Bending curvature [1/cm]` and `R_spring (ohm)` name one. A
    heading of a set point, a limit or another part of the rig names none.
    """
    if meaning(heading) is not None:
        return None
    first, _, rest = heading.name.partition(" ")
    symbol = _SYMBOL.get(first)
    if symbol and re.fullmatch(r"[^\W\d]{3,}", rest) and _fits(symbol, heading):
        return symbol if _may_be(symbol, heading) else None
    named = _named_by_word(heading)
    if named is None or (heading.unit is None and named in _WITH_UNIT):
        return None
    return named if heading.unit is None or _fits(named, heading) else None


def quantity_of_other_unit(heading: Heading) -> str | None:
    """Quantity that a heading reads like, though its unit is none of that quantity; None where it fits.

    `R2 [mV]`, `Spring resistance (V)` and `Load (mm)` read like one. So does a numbered symbol in a unit that
    is not known, or without one: `R2`. A unit of another meaning of a symbol gives none: `P (W)`.
    """
    means = meaning(heading, any_unit=True)
    quantity = means.quantity if means else _named_by_word(heading)
    if quantity is None or _fits(quantity, heading):
        return None
    stated = dimension(heading.unit) is not None
    return quantity if stated or quantity.startswith(_NUMBERED) else None


def _named_by_word(heading: Heading) -> str | None:
    """The one quantity that the words of a heading name, whatever its unit is."""
    named = [quantity for quantity, words in _WORD.items() if re.search(rf"\b(?:{words})\b", heading.name)]
    if len(named) > 1 and "length" in named:
        named.remove("length")  # `Extension over length` is no length
    return named[0] if len(named) == 1 and _may_be(named[0], heading) else None


def _may_be(quantity: str, heading: Heading) -> bool:
    """True if a heading's other words leave open that the specimen's quantity was measured."""
    name = heading.name
    if _NOT_MEASURED.search(name) or _COMPUTED.search(name):
        return False
    if quantity == "length":
        return not _NOT_A_LENGTH.search(name)
    return quantity not in _OF_SPECIMEN or bool(_SPECIMEN.search(name))


def _fits(quantity: str, heading: Heading) -> bool:
    """True if a heading's unit is one of a quantity."""
    return dimension(heading.unit) in _DIMENSIONS[re.sub(r"_\d$", "", quantity)]


def columns_by_word(headings: Sequence[Heading], found: Collection[str]) -> dict[str, int]:
    """Columns of quantities that one of their words names, where no other column has a better name.

    Args:
        headings: headings of the columns.
        found: quantities that have a column already.

    Returns:
        Column by quantity; without those that several headings name.
    """
    columns: dict[str, list[int]] = {}
    for column, heading in enumerate(headings):
        quantity = quantity_by_word(heading)
        if quantity is not None and quantity not in found:
            columns.setdefault(quantity, []).append(column)
    straight = bool(_OF_A_STRAIGHT_PULL & {*found, *columns})
    pressures = columns.get("pressure", [])
    inside = [column for column in pressures if not _OF_THE_ROOM.search(headings[column].name)]
    if straight or inside:
        columns["pressure"] = inside
    by_word = {quantity: hits[0] for quantity, hits in columns.items() if len(hits) == 1}
    by_word |= _by_symbol(headings, {*by_word, *found})
    known = {*by_word, *found}
    if "pressure" not in known or straight:
        by_word.pop("length", None)  # of a tube, beside its pressure, and of nothing else
    return by_word


def _by_symbol(headings: Sequence[Heading], known: Collection[str]) -> dict[str, int]:
    """The one length under the symbol of a way beside a force (`x (mm)`), or of a length beside a pressure.

    None where a column has the symbol of another direction, such as `y (mm)`, or the quantity is known.
    """
    lengths = {c: h.name for c, h in enumerate(headings) if dimension(h.unit) == "length"}
    if {*lengths.values()} & {"y", "z"}:
        return {}
    if {"force"} & {*known} and not {*known} & {"elongation", "strain", "stretch", "true_strain", "pressure"}:
        quantity, symbols = "elongation", ("x", "s", "u", "dx", "δx", "δ")
    elif "pressure" in known and not {*known} & {"force", "stress", "elongation", *_SHAPES}:
        quantity, symbols = "length", ("l", "ℓ")
    else:
        return {}
    hits = [column for column, name in lengths.items() if name in symbols]
    return {quantity: hits[0]} if len(hits) == 1 else {}


def unrecognised(headings: Sequence[Heading], taken: Collection[int], found: Collection[str]) -> str:
    """Words about the columns that were not recognised, and the ways to name them; empty if there are none.

    Args:
        headings: headings of the columns.
        taken: columns that were recognised.
        found: quantities that were recognised.
    """
    others = _others(headings, taken)
    if not others:
        return ""
    advice = advised(headings, taken, found)
    return f"not recognised: {', '.join(repr(h.text) for h in others)}" + (f"; {advice}" if advice else "")


def advised(headings: Sequence[Heading], taken: Collection[int], found: Collection[str]) -> str:
    """Ways to name the columns that were not recognised, as far as their units tell; empty without any.

    Args:
        headings: headings of the columns.
        taken: columns that were recognised.
        found: quantities that were recognised.
    """
    advice: dict[str, str] = {}
    unitless: set[str] = set()
    gaps: dict[str, str] = {}  # no heading names them
    others = _others(headings, taken)
    means = _BY_DIMENSION | _of_a_tube(others, found)
    for heading in sorted(others, key=lambda heading: not _LENGTHS.search(heading.name)):
        quantity = means.get(str(dimension(heading.unit)))
        if quantity == "pressure" and heading.unit in _OF_A_STRESS:
            continue
        if quantity is None and heading.unit is None:
            quantity = _by_its_name(heading)
        if quantity == "length" and _NOT_A_LENGTH.search(heading.name):
            continue
        if (another := _ANOTHER.get(str(quantity))) and another.search(heading.name):
            if _GAP.search(heading.name) and {*found} & {"force", "stress"} and "elongation" not in found:
                gaps.setdefault("length", f"--map length={shlex.quote(heading.text)}")
            continue
        if quantity and quantity not in found and not _NOT_MEASURED.search(heading.name):
            option = f"--map {quantity}={shlex.quote(heading.text)}"
            unitless |= {option} if heading.unit is None else set()
            advice.setdefault(quantity, option)
    for quantity, heading in _stress_and_strain(others, found).items():
        advice.setdefault(quantity, f"--map {quantity}={shlex.quote(heading.text)}")
    names = ", ".join(repr(_EXAMPLES[quantity]) for quantity in advice)
    by = "units or names" if set(advice.values()) & unitless else "units"
    head = f", or head them {names}" if advice else ""
    perhaps = [*advice.values(), *gaps.values()]
    said = [f"by their {by} perhaps {' '.join(perhaps)}{head}"] if perhaps else []
    if not {*found} & _SHAPES:
        said += [
            f"{h.text!r} is one over the curvature: write that into a column headed 'Curvature (1/m)'"
            for h in others if _RADIUS.search(h.name)
        ]  # fmt: skip
    return "; ".join(said)


def _stress_and_strain(others: Sequence[Heading], found: Collection[str]) -> dict[str, Heading]:
    """The one column in a unit that only stresses have, and beside it the one in percent.

    Args:
        others: headings of the columns that were not recognised.
        found: quantities that were recognised.
    """
    open_ones = [h for h in others if not _NOT_MEASURED.search(h.name) and "strength" not in h.name]
    stresses = [h for h in open_ones if h.unit in _OF_A_STRESS]
    strains = [h for h in open_ones if h.unit == "percent"]
    known = {*found} & {"stress", "true_stress", "pressure"}
    stress = {"stress": stresses[0]} if len(stresses) == 1 and not known else {}
    pulled = stress or {*found} & {"stress", "true_stress"}
    shown = {*found} & {"strain", "true_strain", "stretch"}
    return stress | ({"strain": strains[0]} if len(strains) == 1 and pulled and not shown else {})


def _by_its_name(heading: Heading) -> str | None:
    """Quantity whose word needs a unit, and states none: `angle`; None for a symbol, which says nothing."""
    means = meaning(heading, any_unit=True)
    return means.quantity if means and len(heading.name) > 2 and means.quantity in _EXAMPLES else None


def _of_a_tube(others: Sequence[Heading], found: Collection[str]) -> dict[str, str]:
    """Quantities by the dimension of a unit, where a pressure makes a tube longer or bends an actuator.

    Args:
        others: headings of the columns that were not recognised.
        found: quantities that were recognised.
    """
    units = {dimension(heading.unit) for heading in others if heading.unit not in _OF_A_STRESS}
    if _OF_A_STRAIGHT_PULL & {*found} or {"force", "mass"} & units:
        return {}
    pressed = "pressure" in found or "pressure" in units
    shaped = bool(_SHAPES & {*found}) or bool({"length", "curvature", "angle"} & units)
    length = {"length": "length"} if pressed and "elongation" not in found else {}
    return length | ({"pressure": "pressure"} if shaped or "elongation" in found else {})


def _others(headings: Sequence[Heading], taken: Collection[int]) -> list[Heading]:
    return [h for column, h in enumerate(headings) if column not in taken and h.text.strip()]
