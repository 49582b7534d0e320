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


def with_listed_units(grids: Sequence[Grid]) -> list[Grid]:
    """Tables whose headings without a unit have the one that a list of channels states above them.

    A list with numbers in it is a table itself. It is left out where it states a unit.
    """
    done: list[Grid] = []
    listed: dict[str, str] = {}
    for grid in grids:
        listed |= _units_in(grid.preamble)
        own = _units_in([[heading.text for heading in grid.headings], *grid.cells])
        listed |= own
        if not own:
            done.append(_with_units(grid, listed))
    return done or list(grids)


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
    notice = f"as the list of channels above the table states: {said}"
    return replace(grid, headings=headings, notices=[*grid.notices, notice])


def _units_in(lines: Sequence[list[str]]) -> dict[str, str]:
    """Units by the names beside them, in rows below one that heads a column of channels and one of units."""
    found: dict[str, str] = {}
    for at, header in enumerate(lines):
        words = [plain(text) for text in header]
        columns = [c for c, word in enumerate(words) if word in _UNIT_COLUMN]
        if not columns or not any(word in _CHANNEL_COLUMN for word in words[: columns[0]]):
            continue
        column = columns[0]
        rows = [row for row in lines[at + 1 :] if len(row) > column and may_be_unit(row[column])]
        found |= {plain(text): row[column] for row in rows for text in row[:column] if _is_name(text)}
    return found


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
        f"every row holds a reading of one channel ({grid.headings[channel].text} {shown}); write a column"
        " for each, with its quantity and unit above it, and the readings of one moment in one row"
    )
