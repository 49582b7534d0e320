"""Questions about lines around a table that contradict or complete what the recording takes for granted.

Every such line is named in any case. One that bears on the numbers is a question. It may state a zero or a
factor that nothing applies, a unit that is not that of the headings, or a rate where there is no clock. It
may name a material, or what the specimen had seen.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pneusma_jax.units import dimension_of, find_unit

from ..recordings import Recording, schema
from .grid import Grid
from .header_lines import shown
from .making import Making
from .numerals import to_number
from .parts import Sample
from .sizes import filled_cells
from .spelling import is_unit, narrow, unit_name

_NUMBER = r"[+-]?(?:\d[\d.,]*\d|\d)(?:[eE][+-]?\d+)?"
_CORRECTION = re.compile(
    r"(?<!yield )\b(?:offsets?(?! yield)|tare[ds]?|tara|zeroed|"
    r"zero (?:offset|error|point|reading|value|drift|shift)|"
    r"(?:lead|contact|wiring|cable) (?:resistance|wires?)|"
    r"zuleitung\w*|kabelwiderstand|nullpunkt\w*|nullwert\w*|versatz|"
    r"(?<!safety )(?<!gauge )(?<!gage )factor|multiplier|"
    r"faktor|korrektur\w*|umrechnungs\w*|facteur|décalage|not applied|uncorrected|"
    r"drift\w*)\b|(?<!\w)[x×] ?10+\b",
    re.IGNORECASE,
)
"""Words of a line by whose number readings may have to be changed."""
_MOMENT = re.compile(r"\b\d{1,4}([-./])\d{1,2}\1\d{1,4}(?!\d)|\b\d{1,2}(?::\d{2}){1,2}(?:[.,]\d+)?")
"""A date or a time of day, such as that at which a load cell was set to zero."""
_NEUTRAL = re.compile(r"[+-]?(?:0+(?:[.,]0*)?|1(?:[.,]0*)?)")
"""Numbers that change nothing, as an offset or as a factor."""
_UNITS = re.compile(r"\b(?:units?|einheit(?:en)?|unités?|unidad(?:es)?|unità)\b", re.IGNORECASE)
_IN = re.compile(
    r"\b(?:are|is|all|now|values?|readings?|alle|werte)\b.*?\bin (?P<unit>[^\W\d]\S*)", re.IGNORECASE
)
"""A remark on the unit of some columns: `All displacements in cm`."""
_SEVERAL = re.compile(
    r"\b(?:parallel|layers|plies|lagen|schichten|number of (?:specimens|wires|springs)|"
    r"(?:specimens|samples|wires|springs) (?:per test|at once))\b",
    re.IGNORECASE,
)
"""Words for several specimens that bear one load."""
_RATE = re.compile(
    r"\b(?:sampl(?:e|es|ing)|scan|log(?:ging)?|record(?:ing)?|acquisition|acq|daq|data|mess|aufzeichnungs|frame|bild)"
    r"[ _-]*(?:rate|freq(?:uency)?|interval|period|(?:time )?step|frequenz|intervall|takt)\b|"
    r"\babtast\w*|\bsampling\b",
    re.IGNORECASE,
)
"""Names of the rate at which rows were written, or of the time between them."""
_A_SECOND = ("fps", "sps", "samples/s", "frames/s", "pts/s", "s/s", "bilder/s")
"""Units of a rate beside Hz."""
_COUNT = re.compile(
    r"(?:frame|sample|index|point|scan|bild|no|nr|number)(?: (?:no|nr|number|count|index))?\.?"
)
"""Headings of a column that counts samples or pictures."""
_OF_MATERIAL = re.compile(
    r"\b(?:materials?|werkstoff|matériau|materiale?|silicones?|silikon|elastomer|rubber|compound|polymer)\b",
    re.IGNORECASE,
)
_OF_ALLOY = re.compile(
    r"\b(?:materials?|werkstoff|alloys?|legierung|alliage|lega|wire type|sma|ni-?ti|nitinol|flexinol)\b",
    re.IGNORECASE,
)
_ORIENTATION = re.compile(r"\b(?:orientation|orientierung|ausrichtung|mounting|einbaulage)\b", re.IGNORECASE)
_PAST = {
    "cycles_before": re.compile(
        r"\bcycles? (?:before|seen|so far|already)|"
        r"\b(?:previous|prior|earlier|conditioning|training) cycles?|\bpre-?(?:cycl\w*|conditioning cycles?)|"
        r"\bvorzyklen|\bzyklen (?:vorher|zuvor)",
        re.IGNORECASE,
    ),
    "prestrain": re.compile(r"\bpre-?strain|\bvordehnung|\bpré-?déformation", re.IGNORECASE),
}
"""What a specimen may have seen, by its key of `[geometry]`."""


def question_lines(sample: Sample, recording: Recording, making: Making) -> None:
    """Ask about lines around a table that bear on its numbers and that nothing uses.

    Args:
        sample: test with the lines around its table.
        recording: recording that was made of it.
        making: state of the import; questions are added to its notices.
    """
    told = "\n".join(text for text in making.notices if text.startswith("check:"))
    for line, name, value in _lines(sample):
        if repr(line) in told:
            continue
        asked = (
            _of_units(line, making)
            or _of_rate(sample.require_grid(), name, value, recording, making)
            or _of_past(line, recording)
            or _of_law(line, name, value, recording)
            or _of_several(line, value, making)
            or _of_correction(line, value, making)
        )
        if asked:
            making.warn(f"{line!r} {asked}")


def _lines(sample: Sample) -> Iterator[tuple[str, str, str]]:
    """Lines above and below the table: as messages quote them, their names, and their values."""
    grid = sample.require_grid()
    for row in (*grid.preamble, *grid.below, *sample.elsewhere):
        cells = filled_cells(row)
        if not cells:
            continue
        text = narrow(" ".join(cells)).strip("#%!/* ")
        name, mark, value = text.partition(":") if ":" in text else text.partition("=")
        if not mark and len(cells) > 1:
            name, value = narrow(cells[0]).strip("#%!/* "), narrow(" ".join(cells[1:]))
        yield shown(cells), name.strip(), value.strip()


def _of_correction(line: str, value: str, making: Making) -> str:
    """Question about a zero or a factor that nothing applies; empty for any other line."""
    options = making.options
    if not _CORRECTION.search(line) or options.scales or options.subtracted or options.circuit:
        return ""
    numbers = re.findall(_NUMBER, _MOMENT.sub(" ", value or line))
    if not numbers or all(map(_NEUTRAL.fullmatch, numbers)):
        return ""
    return (
        "speaks of a zero or a factor, and nothing applies it: if the numbers of the table need it, state it"
        " with --subtract QUANTITY_UNIT=... or --scale QUANTITY=..."
    )


def _of_units(line: str, making: Making) -> str:
    """Question about a line of units of which one is not that of its column's heading."""
    remark = _IN.search(narrow(line))
    if not _UNITS.search(line) and not remark:
        return ""
    text = remark["unit"] if remark else _UNITS.sub(" ", narrow(line))
    words = re.split(r"[\s,;:=|()\[\]]+", text)
    stated: dict[str, list[str]] = {}
    for word in words:
        if word and is_unit(word) and (len(word) > 1 or word in "NsKAV"):
            stated.setdefault(dimension_of(unit_name(word)), []).append(unit_name(word))
    for quantity, channel in making.channels.items():
        if channel.unit is None or channel.made or channel.column < 0 or not is_unit(channel.unit):
            continue
        unit = unit_name(channel.unit)
        others = stated.get(find_unit(unit).dimension, [])
        if others and all(find_unit(other) != find_unit(unit) for other in others):
            return (
                f"states {others[0]}, and {channel.label!r} is in {unit}: {unit} was taken (--unit"
                f" {quantity}={others[0]} takes the other)"
            )
    return ""


def _of_rate(grid: Grid, name: str, value: str, recording: Recording, making: Making) -> str:
    """Question about a rate or an interval of the rows, where the file has no clock."""
    has_clock = "time_s" in recording.columns and not making.clock_counts_rows
    if has_clock or making.options.interval_s is not None or not _RATE.search(name):
        return ""
    found = re.match(rf"(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d][\w/]*)?", value)
    unit = unit_name((found and found["unit"]) or re.sub(r".*[(\[](.*)[)\]].*", r"\1", name))
    unit = "Hz" if unit.casefold() in _A_SECOND else unit
    number = None if found is None else to_number(found["number"], "." if "." in found["number"] else ",")
    if number is None or not number > 0.0 or not is_unit(unit):
        return ""
    if dimension_of(unit) == "time":
        step = number * find_unit(unit).factor
    elif dimension_of(unit) in ("rate", "frequency"):
        step = 1.0 / (number * find_unit(unit).factor)
    else:
        return ""
    step *= _steps_of_a_count(grid)
    return f"may state the time between rows, and the file has no clock: --interval {step:.6g} makes one"


def _steps_of_a_count(grid: Grid) -> float:
    """Samples or pictures from row to row, by a column that counts them in even steps; 1 without one."""
    for column, heading in enumerate(grid.headings):
        steps = np.diff(grid.values[:, column])
        even = steps.size and np.isfinite(steps).all() and float(np.ptp(steps)) == 0.0 and steps[0] >= 1.0
        if _COUNT.fullmatch(heading.name) and even and steps[0] % 1.0 == 0.0:
            return float(steps[0])
    return 1.0


def _of_past(line: str, recording: Recording) -> str:
    """Question about what the specimen had seen before, where [geometry] does not hold it."""
    of_coils = (*_PAST,) if recording.kind == "spring" else ()
    keys = {*recording.full_geometry(), *of_coils}
    for key, words in _PAST.items():
        found = words.search(line)
        number = re.search(_NUMBER, line[found.end() :]) if found else None
        if number and key in keys and key not in recording.geometry and not _is_zero(number[0]):
            return f"may state what the specimen had seen, and was not used: --dimension {key}=... states it"
    return ""


def _of_several(line: str, value: str, making: Making) -> str:
    """Question about several specimens that were tested at once; empty for any other line."""
    found = re.match(r"\D*(?P<count>[2-9]|1\d)\b(?![.,]\d)", value or line)
    if making.kind not in ("elastomer", "wire", "spring") or not found or not _SEVERAL.search(line):
        return ""
    if "area_mm2" in making.options.dimensions:
        return ""
    of_one = "the force" if making.kind == "spring" else "the cross-section"
    return (
        f"may say that several were tested at once, and {of_one} is taken as that of one: --dimension"
        " area_mm2=... or --scale force=... states it"
    )


def _is_zero(text: str) -> bool:
    return not re.search(r"[1-9]", text)


def _of_law(line: str, name: str, value: str, recording: Recording) -> str:
    """Question about a material, an alloy or a position that the sidecar takes from the source instead."""
    taken = {key: text for key, text in _assumed(recording).items() if key not in recording.geometry}
    patterns = {"material": _OF_MATERIAL, "alloy": _OF_ALLOY, "orientation": _ORIENTATION}
    for key, text in taken.items():
        named = patterns[key].search(name) and re.search(r"[^\W\d_]", value)
        if not named or _plain(text) in _plain(value):
            continue
        fit = "" if key == "orientation" else ', or "fit" to identify it'
        return f'was not read, and {key} = "{text}" is taken: name yours under [geometry] of the sidecar{fit}'
    return ""


def _assumed(recording: Recording) -> Mapping[str, Any]:
    """Words of [geometry] that a kind of recording takes from the source where nobody states them."""
    nominal = recording.full_geometry()
    return {k: nominal[k] for k in schema.KINDS[recording.kind].assumed if isinstance(nominal.get(k), str)}


def _plain(text: str) -> str:
    return re.sub(r"[^a-z0-9]", "", text.lower())
