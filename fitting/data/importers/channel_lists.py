"""Lists of channels above a table, with a unit for each heading, as in exports of TDMS files."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from .grid import Grid
from .numerals import like_a_number
from .spelling import may_be_unit, plain, unit_name

SHOWN = 6
"""Number of channels that a refusal names."""
_CHANNEL_COLUMN = ("channel", "channels", "channel name", "name", "signal", "kanal", "voie", "quantity")
_UNIT_COLUMN = ("unit", "units", "einheit", "unité", "unit string", "unit_string", "unidad")
_AMOUNTS = {
    "value", "values", "limit", "limits", "range", "rating", "rated", "capacity", "scale", "setpoint",
    "wert", "messwert", "grenzwert", "grenze", "messbereich", "bereich", "valeur", "limite", "valor",
}  # fmt: skip
_ENDS = {"min", "max", "minimum", "maximum"}
"""Ends of a range, but in a list with types of data: there they are those of the numbers of the channel."""


def with_listed_units(grids: Sequence[Grid]) -> list[Grid]:
    """Tables whose headings without a unit have the one that a list of channels states above them.

    A table of numbers is a list itself only where each row names another channel, and some are columns of
    another table. It is then left aside, which a notice says.
    """
    lists = {i: names for i, grid in enumerate(grids) if (names := _names_listed(grid, grids))}
    done: list[Grid] = []
    listed: dict[str, str] = {}
    aside: list[str] = []
    for i, grid in enumerate(grids):
        listed |= _units_in(grid.preamble)
        if i in lists:
            listed |= _units_in(_lines_of(grid))
            aside.append(
                f"check: rows {min(grid.rows)} to {max(grid.rows)} are a list of channels, and no test"
                f" ({', '.join(lists[i][:SHOWN])})"
            )
        else:
            done.append(_with_units(grid, listed))
    if not done:
        return list(grids)
    return [replace(done[0], notices=[*done[0].notices, *aside]), *done[1:]]


def _lines_of(grid: Grid) -> list[list[str]]:
    return [[heading.text for heading in grid.headings], *grid.cells]


def _names_listed(grid: Grid, grids: Sequence[Grid]) -> list[str]:
    """Names of the channels that a table of numbers lists; none where it is no list of channels."""
    lines = _lines_of(grid)
    if not (columns := _columns_of_a_list(lines[0])):
        return []
    names = [plain(row[columns[0]]) for row in lines[1:] if len(row) > columns[0]]
    others = {plain(heading.text) for other in grids if other is not grid for heading in other.headings}
    return names if len({*names}) == len(names) and others & {*names} else []


def _with_units(grid: Grid, listed: Mapping[str, str]) -> Grid:
    found = {
        column: listed[plain(heading.text)]
        for column, heading in enumerate(grid.headings)
        if heading.unit is None and plain(heading.text) in listed
    }
    if not found:
        return grid
    headings = [
        replace(heading, unit=unit_name(found[column])) if column in found else heading
        for column, heading in enumerate(grid.headings)
    ]
    said = ", ".join(f"{headings[column].text!r} in {unit}" for column, unit in found.items())
    notice = f"check: units of headings are those of the list of channels above the table: {said}"
    return replace(grid, headings=headings, notices=[*grid.notices, notice])


def _units_in(lines: Sequence[list[str]]) -> dict[str, str]:
    """Units by the names beside them, in rows below one that heads a list of channels."""
    found: dict[str, str] = {}
    for at, header in enumerate(lines):
        if columns := _columns_of_a_list(header):
            name, unit = columns
            rows = [row for row in lines[at + 1 :] if len(row) > unit and may_be_unit(row[unit])]
            found |= {plain(row[name]): row[unit] for row in rows if _is_name(row[name])}
    return found


def _columns_of_a_list(header: Sequence[str]) -> tuple[int, int] | None:
    """Columns of the names and the units of a list of channels; None for other headings.

    A list with values, limits or ranges states the units of those. They need not be those of the columns.
    """
    words = [plain(text) for text in header]
    unit = next((c for c, word in enumerate(words) if word in _UNIT_COLUMN), 0)
    name = next((c for c, word in enumerate(words[:unit]) if word in _CHANNEL_COLUMN), None)
    amounts = _AMOUNTS if {*words} & {"datatype", "data type"} else _AMOUNTS | _ENDS
    stated = {part for word in words for part in word.split()}
    return None if name is None or amounts & stated else (name, unit)


def _is_name(text: str) -> bool:
    return bool(text) and not like_a_number(text)


def one_channel_a_row(grid: Grid) -> str:
    """Reason that each row is a reading of one channel, as buffers of loggers are stored. Empty otherwise."""
    words = [plain(heading.text) for heading in grid.headings]
    channel = next((c for c, word in enumerate(words) if word in _CHANNEL_COLUMN), None)
    if channel is None or not {"reading", "value", "messwert", "measurement"} & {*words}:
        return ""
    names = list(dict.fromkeys(text for text in grid.texts(channel) if text))
    if not 1 < len(names) < len(grid.rows) // 2:
        return ""
    shown = ", ".join(names[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
    return (
        f"every row holds a reading of one channel ({grid.headings[channel].text} {shown}). Write a column"
        " for each, with its quantity and unit above it, and the readings of one moment in one row"
    )
