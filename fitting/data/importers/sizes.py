"""Dimensions of a specimen that a file states line by line: in a preamble or a sheet of parameters."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pneusma_jax.errors import InputError
from pneusma_jax.units import find_unit

from ..recordings.columns import convert
from .numerals import decimal_evidence, to_number
from .rounding import shortest
from .size_names import names_a_specimen, size_named
from .spelling import Heading, is_unit, may_be_unit, narrow, parse_heading, plain, unit_name

_ALSO = {"wire_diameter_mm": "diameter_mm"}
"""Size of a straight specimen that a size of its own name is as well."""
_COUNTED = re.compile(r"(coils?|turns?|windungen|spires?|pcs|圈|匝|巻き?|회|-|1)?", re.IGNORECASE)
"""Words behind a number of coils."""
CONSTANTS = ("temperature_degC", "stress_MPa")
"""What a file may state of a test; no size of the specimen."""
_NUMBER = r"[+-]?(?:\d[\d.,'’ ]*\d|\d|\.\d+)(?:[eE][+-]?\d+)?"
_IN_ONE = re.compile(
    rf"^(?P<name>[^\d:=][^:=]*?)\s*(?P<mark>[:=]|\s)\s*(?P<number>{_NUMBER})\s*(?P<unit>[^\d\s].*)?$"
)
_PREFIX = re.compile(
    r"^[#%!/*\s]*(?:(?:dimensions?|geometry|specimen parameters?|parameters?)\s*[:\-]\s*)?", re.IGNORECASE
)
_TOLERANCE = re.compile(rf"(?P<before>\S)\s*(?:±|\+/-|\+-)\s*{_NUMBER}\s*(?P<unit>.*)$")
"""Tolerance behind a size, with the unit behind it: `0.25 ± 0.01 mm`, `0.25 mm ± 0.01 mm`."""
_BETWEEN_SIZES = re.compile(r"\s*[;,](?!\d)\s*")
"""Mark between several sizes in one line: `d = 0.25 mm, n = 45`."""
_INCHES = re.compile(r'\d\s*"$')
"""Mark of inches behind a number."""
_STATED = re.compile(r"[:=]\s*\S")
"""Value behind its mark in a field."""
_SYMBOL = re.compile(r"^[^\W\d_]\w{0,2}\s*=\s*\d")
"""Number of a symbol that names no size by itself, in a list with sizes: `d_wire = 0.25 mm, n = 45`."""
_LABELLED = re.compile(r"^(?P<label>[^:=]+):\s*(?P<rest>\D.*)$")
"""Label before the first of several sizes: `Spring A7: wire diameter 0.25 mm, coils 45`."""
_NUMBER_UNIT = re.compile(rf"^(?P<number>{_NUMBER})\s*(?P<unit>[^\d\s].*)?$")


LONGEST = 200
"""Maximum number of letters of a text that states a size."""
SAME = 0.02
"""Maximum relative difference of two statements of one size that agree. Calipers read to a percent or two."""


@dataclass(frozen=True)
class Size:
    """One dimension that a file states.

    Attributes:
        value: number in the unit of its key.
        said: original text, for messages.
        assumed: true if its unit was not stated.
        others: original texts that state another number for the same.
        grouped: value if the one mark of its number groups thousands (`25.000`); 0 where that is no doubt.
        divided: true if the comma in its number may as well separate two (`6,7 mm` among commas).
    """

    value: float
    said: str
    assumed: bool = False
    others: tuple[str, ...] = ()
    grouped: float = 0.0
    divided: bool = False

    def beside(self, other: "Size") -> "Size":
        """This dimension, with the text of another statement if that gives another number."""
        if abs(other.value - self.value) <= SAME * abs(self.value):
            return self
        return replace(self, others=(*self.others, other.said))


Sizes = dict[str, Size]


def beside(sizes: Sizes, others: Sizes) -> Sizes:
    """Sizes, each with the text of its other statement if that gives another number."""
    return {key: size.beside(others[key]) if key in others else size for key, size in sizes.items()}


def sizes_in(rows: Sequence[Sequence[str]], decimal: str = ".") -> Sizes:
    """Dimensions in the lines before a table or on a sheet: `Width;6;mm`, `Gauge length (mm)  50`, `d = 2
    mm`.

    Args:
        rows: fields of the lines.
        decimal: decimal mark of the table, for numbers that either mark makes (`1,150 mm`). Other numbers in
            these lines may prove another one.

    Returns:
        Dimensions by the name of `--dimension` (or of `--constant` for a temperature or a dead-weight
        stress). Some have names of their own, since `--dimension` takes what follows from them. A length
        that may be the whole specimen's is under `length`. A spring's coil is under `coil_diameter_mm` or
        `coil_outer_diameter_mm`, and a tube's bore under `inner_diameter_mm`.
    """
    found: Sizes = {}
    mark = _mark_of(rows, decimal)
    for row in rows:
        for key, size in _of_row(filled_cells(row), mark):
            for name in names_of(key):
                found[name] = found[name].beside(size) if name in found else size
    return found


def filled_cells(row: Sequence[str]) -> list[str]:
    """The filled fields of a line, without quotation marks and repeated spaces.

    The mark behind a number is that of inches (`0.010"`) where all marks of the line stand so.
    """
    inches = all(_INCHES.search(cell[: mark.end()]) for cell in row for mark in re.finditer('"', cell))
    texts = (" ".join(cell.split()) for cell in row)
    return [text for cell in texts if (text := cell if inches else cell.strip('"'))]


def statements(cells: Sequence[str]) -> list[str]:
    """Parts of a line that may each state something: its fields, divided where one holds several."""
    return [part for cell in cells for part in _BETWEEN_SIZES.split(cell) if part]


def sizes_read(cells: Sequence[str]) -> list[tuple[str, Size]]:
    """Sizes that a line states, by their names in `--dimension`; none for any other line."""
    return _of_row(list(cells), ".")


def _mark_of(rows: Sequence[Sequence[str]], decimal: str) -> str:
    """Decimal mark that the numbers of some lines prove, if all agree; else that of the table."""
    numbers = (found for row in rows for cell in row for found in re.findall(_NUMBER, cell))
    proven = {decimal_evidence(number.strip()) for number in numbers} - {None}
    return proven.pop() if len(proven) == 1 else decimal


def _of_row(cells: list[str], mark: str) -> list[tuple[str, Size]]:
    """Sizes in a line: one in the whole of it, else those in its parts.

    A comma behind the digits of a stated value is in its number: `# pitch: 1,05 mm` in a table with commas.
    Parts are read only if each states a size or the number of a symbol, but for a label at the begin.
    Other lines are prose, and may speak of clamps or of another specimen.
    """
    if not cells:
        return []
    if not _STATED.search(narrow(cells[0])) and (of_cells := _of_cells(cells, mark)) is not None:
        return [of_cells]
    if (whole := _of_text(",".join(cells), mark)) is not None:
        key, size = whole
        divided = len(cells) > 1 and _divides(cells[0], cells[1]) and not size.grouped
        return [(key, replace(size, divided=divided))]
    if (of_cells := _of_cells(cells, mark)) is not None:
        return [of_cells]
    for width in (2, 3):
        groups = [cells[k : k + width] for k in range(0, len(cells), width)]
        pairs = [_of_cells(group, mark) for group in groups]
        if len(groups) > 1 and all(pair is not None for pair in pairs):
            return [pair for pair in pairs if pair is not None]
    parts = statements(cells)
    if len(parts) < 2 or not all(re.match(r"[^\d]*[^\W\d]", part) for part in parts):
        return []  # such as three readings of one width
    read = _of_parts(parts, mark)
    first = len(parts) - len(read)
    others = (part for part, size in zip(parts[first:], read, strict=True) if size is None)
    return [size for size in read if size is not None] if all(map(_SYMBOL.match, others)) else []


def _divides(before: str, after: str) -> bool:
    """True if a comma between two fields may separate numbers. One behind a 0 marks decimals: `0,25`."""
    return before[-1].isdigit() and after[0].isdigit() and re.search(r"(?<!\d)0$", before) is None


def _of_parts(parts: Sequence[str], mark: str) -> list[tuple[str, Size] | None]:
    """Size in each part of a line, None for a part without one. A label at the begin of the line is none."""
    first = _PREFIX.sub("", narrow(parts[0]))
    if names_a_specimen(first):
        return [_of_text(part, mark) for part in parts[1:]]
    labelled = _LABELLED.match(first)
    text = labelled["rest"] if labelled and names_a_specimen(labelled["label"]) else parts[0]
    return [_of_text(text, mark, parts[0]), *(_of_text(part, mark) for part in parts[1:])]


def states_a_size_among_others(cells: Sequence[str]) -> bool:
    """True if a part of a line of several states a size, whatever the other parts say."""
    parts = statements(cells)
    return len(parts) > 1 and any(_of_parts(parts, "."))


def names_of(key: str) -> tuple[str, ...]:
    """Keys under which a size is found."""
    return (key, _ALSO[key]) if key in _ALSO else (key,)


def _of_cells(cells: list[str], mark: str) -> tuple[str, Size] | None:
    """Dimensions in cells: `Width (mm) | 6`, `Width | 6 | mm`, `Width: | 6 mm`."""
    if len(cells) not in (2, 3):
        return None
    heading = heading_of_a_size(_PREFIX.sub("", narrow(cells[0]).rstrip(":= ")))
    inside = _NUMBER_UNIT.match(_without_tolerance(cells[1]))
    if inside is None:
        return None
    unit = _bare(cells[2] if len(cells) == 3 else inside["unit"])
    return _size(heading.name, inside["number"], unit or heading.unit, " ".join(cells), mark)


def _of_text(text: str, mark: str, said: str = "") -> tuple[str, Size] | None:
    """Dimensions in one cell or line: `Cylinder Diameter: 50mm`, or `mandrel 20 mm` with its unit.

    Args:
        text: cell or line.
        mark: decimal mark.
        said: text for messages, where it is more than `text`.
    """
    if len(text) > LONGEST:
        return None
    found = _IN_ONE.match(_without_tolerance(_PREFIX.sub("", narrow(text).rstrip("; ,"))))
    if found is None:
        return None
    heading = heading_of_a_size(_PREFIX.sub("", found["name"]))
    unit = _bare(found["unit"]) or heading.unit
    read = _size(heading.name, found["number"], unit, (said or text).rstrip("; "), mark)
    return None if read is None or (not found["mark"].strip() and read[1].assumed) else read


def is_amount(text: str) -> bool:
    """True for a number with a known unit, such as `8.0 mm`."""
    found = _NUMBER_UNIT.match(narrow(text))
    return found is not None and is_unit((found["unit"] or "?").strip("()[] "))


def heading_of_a_size(text: str) -> Heading:
    """Name and unit of a size. A word in brackets that is no unit is of the name: `Windungen (aktiv)`.

    A 1 is a number, and no unit, but for a count's in brackets or behind a slash: `coils / 1`.
    """
    heading = parse_heading(text)
    known = heading.unit is None or may_be_unit(heading.unit)
    if re.search(r"1\W*$", text) and heading.unit == "1":
        known = size_named(heading.name) == "active_coils" and not re.search(r"[,;:=]\s*1\s*$", text)
    return heading if known else Heading(text, plain(text), None)


def _without_tolerance(text: str) -> str:
    """A text without the tolerance of its number."""
    found = _TOLERANCE.search(text)
    if found is None or not re.search(r"\d", text[: found.end("before")]):
        return text
    before = text[: found.end("before")]
    return before if re.search(r"[^\W\d]$|[)\]°]$", before) else f"{before} {found['unit']}".rstrip()


def _size(name: str, number: str, unit: str | None, said: str, mark: str = ".") -> tuple[str, Size] | None:
    """The size that a heading names, with its key; None where it names none. Arguments as of `size_of`."""
    key = size_named(name)
    if key is None or (plain(name).split()[-1:] == ["id"] and not unit):
        return None  # no size, or the name of a specimen: `Tube ID: 8`
    return size_of(key, number, unit, said, mark)


def size_of(
    key: str, number: str, unit: str | None, said: str, mark: str = "."
) -> tuple[str, Size] | None:
    """A size in the unit of its key, with that key; None where number and unit cannot be those of one.

    Args:
        key: name of `--dimension` or `--constant`. It ends in the unit, but for `length` [mm] and coils.
        number: the number as text.
        unit: the unit as text; None or empty where none is stated. One of area makes a thickness an area.
        said: original text, for messages.
        mark: decimal mark.
    """
    value, grouped = _amount(number.strip(), mark)
    if math.isnan(value):
        return None
    if key == "active_coils":
        counts = value > 0.0 and _COUNTED.fullmatch((unit or "").strip()) is not None
        return (key, Size(value, said, grouped=grouped)) if counts else None
    wanted = "mm" if key == "length" else key.rpartition("_")[2]
    if unit is None or not unit:
        if key in CONSTANTS:
            return None  # a bare number beside the word may be a set point, a channel, anything
        return (key, Size(value, said, assumed=True, grouped=grouped)) if value > 0.0 else None
    try:
        stated = find_unit(unit_name(unit)).dimension
        if key == "thickness_mm" and stated == "area":  # a0 is a thickness here, an area there
            key, wanted = "area_mm2", "mm2"
        if stated != find_unit(wanted).dimension:
            return None
    except InputError:
        return None
    # a conversion between units of temperature adds up to 273.15, whose rounding error stays
    converted, other = (
        float(shortest(convert(number, unit_name(unit), wanted), 273.15 * (key in CONSTANTS)))
        for number in (value, grouped)
    )
    grouped = other if grouped else 0.0
    return (key, Size(converted, said, grouped=grouped)) if converted > 0.0 or key in CONSTANTS else None


def _bare(unit: str | None) -> str:
    """A unit without brackets, and without a word in brackets behind it: `um (nominal)`.

    A number in such brackets stays, since it may be the one that counts.
    """
    found = re.fullmatch(r"(?P<unit>[^()]*?)\s*\((?P<remark>[^()\d]+)\)", unit or "")
    remark = found is not None and not may_be_unit(found["remark"])
    return (found["unit"] if remark else unit or "").strip("()[];, ")


def _amount(number: str, mark: str) -> tuple[float, float]:
    """Number of a size, and the one if its mark groups thousands and that is in doubt; 0 for no doubt.

    No specimen is so large that `25.000` or `1,150` were thousands. They are decimals, whatever the table's
    mark is; a `mark` that contradicts this is a doubt. NaN where there is no number.
    """
    read = {decimal: to_number(number, decimal) for decimal in (mark, *({".", ","} - {mark}))}
    found = [value for value in read.values() if value is not None and not math.isnan(value)]
    if not found:
        return math.nan, 0.0
    value = min(found, key=abs)
    return value, found[0] if found[0] != value else 0.0


def sizes_in_a_name(name: str) -> Sizes:
    """Stress and temperature in the name of a sheet or file: `200 MPa`, `pull_22C`."""
    found: Sizes = {}
    for key, unit in (("stress_MPa", "MPa"), ("temperature_degC", "(?:°|deg)? ?C")):
        read = re.search(rf"(?<![\w.])(\d+(?:\.\d+)?)[ _]?{unit}(?![\w²])", name.replace("_", " "))
        if read:
            found[key] = Size(float(read[1]), name)
    return found
