"""The account of the lines around a table: each is used and quoted, asked about, or named as kept."""

import itertools
import re
from collections.abc import Iterable, Sequence

from ..recordings import schema
from .grid import Grid
from .labview import STATED
from .making import Making
from .parts import Sample
from .size_names import may_name_a_size, size_named
from .sizes import (
    CONSTANTS,
    LONGEST,
    Size,
    filled_cells,
    heading_of_a_size,
    sizes_read,
    statements,
    states_a_size_among_others,
)
from .specimen_sizes import ROUNDING, repeats_an_option
from .spelling import dimension, narrow
from .table_notices import NO_NUMBERS

HEADER, FOOTER, SHEETS = "header", "footer", "other_sheets"
"""Keys of `[source]` that hold the lines above and below a table, and on sheets without a test."""
MOST_SHOWN = 12
"""Maximum number of kept lines that a notice quotes, so that it stays readable."""
MOST_ASKED = 6
"""Maximum number of lines that are asked about one by one, or quoted by a refusal."""
MOST_KEPT = 200
"""Maximum number of lines that go into the sidecar. The longest header of 31 measured files has 16."""
_WIDTH = 60
"""Maximum number of letters of a quoted line."""
_SURE = 8
"""Minimum number of letters of a line that a notice may hold without quoting it."""
_STRAIGHT = ("gauge_length_mm", "area_mm2", "diameter_mm", "width_mm", "thickness_mm")
_OF_A_DESIGN = {"length": "length_mm", **{key: key for key in schema.GEOMETRY_NUMBERS}}
"""Sizes of an actuator that a file may state, with their names in `--dimension`."""
_AMOUNT = re.compile(r"\d\s*[)\]]?\s*(?P<unit>[^\W\d_]+[²2]?)(?![\w/²])")
"""A number in a text with a word behind it that may be its unit."""
_FREE_NUMBER = re.compile(r"(?<![\w.,])\d+(?:[.,]\d+)?")
"""A number in a text that is no part of a word."""
_INCHES = re.compile(r"\d\s*(?:\"|''|″)")
"""A number with the mark of inches."""
_COUNT = re.compile(r"\d\s*(?P<words>(?:[^\W\d_]+\s+)?[^\W\d_]+)")
"""A number with up to two words behind it, such as `45 active coils`."""
_LIKELY_WORDS = ("in", "m", "ft", "thou", "mil", "mils")
"""Units of length that stand in a text more often as words: `no. 5 in tray`."""
_BEGINS = re.compile(r"\W*(?:(?:ca|approx|circa|about|etwa|env)\b\.?)?\W*\d", re.IGNORECASE)
"""Begin of a value that is a number, if with a sign or a word before it."""
_STATED = re.compile(r"[:=]\s*\S")
_STATES = re.compile(r"[:=]\s*\S|\s\d")
"""Mark before a value in a text, and a text that states a value."""
_NAMED = re.compile(r"^(?P<name>[^:=]*[^\W\d_][^:=]*?)\s*[:=]\s*(?P<value>.*)$")


def say_header(sample: Sample, making: Making) -> dict[str, list[str]]:
    """Notices on each line around a table that no other notice quotes.

    A line that may state a size of the specimen is asked about. All others are named.

    Args:
        sample: test with its lines above and below the table, and those of sheets without a test.
        making: state of the import after all other notices.

    Returns:
        Lines for `[source]`, by the keys above; nothing where there is none.
    """
    grid = sample.require_grid()
    above, below = [[c for row in rows if (c := filled_cells(row))] for rows in (grid.preamble, grid.below)]
    elsewhere = [cells for row in sample.elsewhere if (cells := filled_cells(row))]
    around = [*above, *below, *elsewhere]
    told = _QuotedLines((text for text in making.notices if NO_NUMBERS not in text), around)
    unread: dict[str, str] = {}
    perhaps: list[str] = []
    offered: dict[str, str] = {}
    spare: list[str] = []
    kept: list[str] = []
    agreed: list[str] = []
    for cells in around:
        for part in told.rest(cells):
            size, sizes = _size_in(part), sizes_read(part)
            if sizes and all(_repeats(one, making, told) for one in sizes):
                continue
            if all(repeats_an_option(*one, making) for one in sizes) if sizes else _is_answered(part, making):
                agreed.append(shown(part))
                continue
            contradicts = any(_contradicts(one, making, told) for one in sizes)
            if not contradicts and _is_of_no_account(size, bool(sizes), making):
                if sizes:
                    spare.append(shown(part))
                elif cells[0] not in STATED and re.search(r"\w", " ".join(part)):
                    kept.append(shown(part))
            elif size and not sizes:
                unread[shown(part)] = size
            elif making.kind == "actuator" and {name for name, _ in sizes} & {*_OF_A_DESIGN}:
                offered |= {shown(part): " ".join(_option(*one) for one in sizes if one[0] in _OF_A_DESIGN)}
            else:
                perhaps.append(shown(part))
    _ask(unread, perhaps, offered, making)
    if agreed:
        making.say(f"as --dimension states: {_some(agreed)}")
    if spare:
        making.say(f"stated, but not needed for kind {making.kind}: {_some(spare)}")
    if kept:
        making.say(f"other lines around the table, kept in the sidecar under [source]: {_some(kept)}")
    done = {}
    for key, rows in ((HEADER, above), (FOOTER, below), (SHEETS, elsewhere)):
        if len(rows) > MOST_KEPT:
            making.warn(f"of {len(rows)} lines ({key}) the first {MOST_KEPT} are kept in the sidecar")
        if rows:
            done[key] = [_line(cells) for cells in rows[:MOST_KEPT]]
    return done


def _ask(unread: dict[str, str], perhaps: list[str], offered: dict[str, str], making: Making) -> None:
    """Ask about lines that may state sizes and were not used.

    Args:
        unread: lines that name a size without one number, with the size.
        perhaps: lines that may state a size.
        offered: lines that state a size which is not taken by itself, with the options that take it.
        making: state of the import.
    """
    for text, size in [*unread.items()][:MOST_ASKED]:
        option = size if size in (*_STRAIGHT, *schema.GEOMETRY_NUMBERS) else "NAME"
        making.warn(
            f"{text!r} names a size, but not by one number with a unit of it, and was not used; --dimension"
            f" {option}=... states it"
        )
    if len(unread) > MOST_ASKED:
        making.warn(f"{len(unread) - MOST_ASKED} more lines name sizes without one number")
    if offered:
        options = " ".join(dict.fromkeys(offered.values()))
        making.warn(f"sizes of an {making.kind} are its design's; {_some(offered)}: {options} takes them")
    if perhaps:
        straight = schema.KINDS[making.kind].strained
        names = _STRAIGHT if straight else schema.KINDS[making.kind].sizes or tuple(schema.GEOMETRY_NUMBERS)
        one = len({*perhaps}) == 1
        making.warn(
            f"{_some(perhaps)} may state {'a size' if one else 'sizes'} of the specimen, and"
            f" {'was' if one else 'were'} not used; --dimension NAME=... states one of {', '.join(names)}"
        )


def _option(key: str, size: Size) -> str:
    """The option that takes a size of an actuator."""
    return f"--dimension {_OF_A_DESIGN[key]}={size.value:.6g}"


def _repeats(one: tuple[str, Size], making: Making, told: "_QuotedLines") -> bool:
    """True if a size is one that a notice tells by another line."""
    key, size = one
    taken = making.sizes.get(key)
    return taken is not None and told.quoted(taken.said) and taken.beside(size) is taken


def _contradicts(one: tuple[str, Size], making: Making, told: "_QuotedLines") -> bool:
    """True if a size is another one than that of its name which was used."""
    key, size = one
    taken = making.sizes.get(key)
    return taken is not None and told.quoted(taken.said) and taken.beside(size) is not taken


def _is_answered(part: list[str], making: Making) -> bool:
    """True for prose in mm whose every number is one that `--dimension` states."""
    text = narrow(" ".join(part))
    units = {found["unit"] for found in _AMOUNT.finditer(text)}
    stated = making.options.dimensions.values()
    numbers = [float(number.replace(",", ".")) for number in _FREE_NUMBER.findall(text)]
    return {unit for unit in units if dimension(unit) in ("length", "area")} == {"mm"} and all(
        any(abs(number - one) <= ROUNDING * abs(one) for one in stated) for number in numbers
    )


def _is_of_no_account(size: str | None, read: bool, making: Making) -> bool:
    """True if a line states no size, or one that the kind does not need.

    Args:
        size: size that the line names, empty for one that it may state; None for none.
        read: true if its number was read.
        making: state of the import.
    """
    if size is None or size in CONSTANTS:
        return True
    if not schema.KINDS[making.kind].strained:
        return False
    return read or not making.sources & {"elongation", "force"}  # strain and stress are the file's own


def _some(texts: Iterable[str]) -> str:
    """The first of some texts, quoted, and the number of the others."""
    texts = list(dict.fromkeys(texts))
    more = f" and {len(texts) - MOST_SHOWN} more" if len(texts) > MOST_SHOWN else ""
    return ", ".join(map(repr, texts[:MOST_SHOWN])) + more


def shown(cells: Sequence[str]) -> str:
    """A line as a notice quotes it."""
    text = _line(cells)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 3]}..."


def _line(cells: Sequence[str]) -> str:
    """A line as text; a comma may have divided what stands behind its colon."""
    if not _STATED.search(narrow(cells[0])):
        return " ".join(cells)
    text = cells[0]
    for before, cell in itertools.pairwise(cells):
        text += ("," if before[-1].isdigit() and cell[0].isdigit() else ", ") + cell
    return text


class _QuotedLines:
    """Lines that notices quote."""

    def __init__(self, notices: Iterable[str], lines: Iterable[list[str]]) -> None:
        self.notices = "\n".join(notices)
        self.quotes = set(re.findall(r"'([^'\n]*)'", self.notices))
        self.names = {cell for cells in lines for cell in cells if not re.match(r"[+-]?[\d.,]", cell)}

    def rest(self, cells: list[str]) -> list[list[str]]:
        """Parts of a line that no notice quotes: all of it, or some of several statements."""
        if not cells or any(map(self.quoted, (" ".join(cells), ",".join(cells), "; ".join(cells)))):
            return []
        if self._is_of_a_table(cells):
            return []
        parts = statements(cells)
        left = [part for part in parts if not self.quoted(part)]
        apart = len(left) < len(parts) and all(_STATES.search(narrow(part)) for part in parts)
        return [[part] for part in left] if apart else [cells]

    def _is_of_a_table(self, cells: list[str]) -> bool:
        """True for a row of a table of sizes, whose numbers notices quote behind the heading of each."""
        numbers = [cell for cell in cells if cell not in self.names]
        return len(cells) > 1 and bool(numbers) and all(map(self._has_a_heading, numbers))

    def _has_a_heading(self, number: str) -> bool:
        """True if a notice quotes a number behind the text of another field."""
        ends = (quote.removesuffix(f" {number}") for quote in self.quotes if quote.endswith(f" {number}"))
        return any(end in self.names for end in ends)

    def quoted(self, text: str) -> bool:
        """True if a notice quotes a text."""
        text = text.rstrip("; ")
        return repr(text) in self.notices or (len(text) >= _SURE and text in self.notices)


def lines_unread(grid: Grid) -> list[str]:
    """Lines around a table that may state a size and are not read as one, as a message quotes them."""
    lines = [cells for row in (*grid.preamble, *grid.below) if (cells := filled_cells(row))]
    unread = [cells for cells in lines if _size_in(cells) is not None and not sizes_read(cells)]
    return [shown(cells) for cells in unread[:MOST_ASKED]]


def _size_in(cells: list[str]) -> str | None:
    """Size that a line names, empty for one that it may state under another name; None for any other line."""
    name, value = _name_and_value(cells)
    if not re.search(r"[1-9]", value):
        return None
    long = _has_a_length(" ".join(cells)) or states_a_size_among_others(cells)
    if not long and name.split()[-1:] == ["id"]:
        return None  # the name of a specimen: `Coil ID: 3`
    begins = _BEGINS.match(value) is not None
    if begins and (key := size_named(name)) is not None:
        return key
    return "" if long or (begins and may_name_a_size(name) and not _is_of_another_unit(value)) else None


def _name_and_value(cells: list[str]) -> tuple[str, str]:
    """Name and value of a line, from its cells or at its colon or equals sign. Other lines are all value."""
    if len(cells) > 1 and not _STATED.search(narrow(cells[0])):
        return heading_of_a_size(narrow(cells[0]).strip("#%!/* :=")).name, " ".join(cells[1:])
    found = _NAMED.match(narrow(" ".join(cells)[:LONGEST]).strip("#%!/* "))
    return (heading_of_a_size(found["name"]).name, found["value"]) if found else ("", " ".join(cells))


def _is_of_another_unit(value: str) -> bool:
    """True for a number with a unit that no size has: `10 Hz`, `5 mm/min`."""
    unit = re.sub(r"^[\W\d]*\d\W*(?=[^\W\d]|%|$)", "", value)
    return dimension(unit.strip("()[] ")) not in (None, "number", "length", "area")


def _has_a_length(text: str) -> bool:
    """True if a text holds a number with a unit of length or area, or a number of coils."""
    if any(size_named(found["words"]) == "active_coils" for found in _COUNT.finditer(text)):
        return True
    if _INCHES.search(text):
        return True
    units = [found["unit"] for found in _AMOUNT.finditer(narrow(text))]
    return any(dimension(unit) in ("length", "area") for unit in units if unit not in _LIKELY_WORDS)
