"""Dimensions of specimens in a table with one specimen a line."""

from collections.abc import Mapping, Sequence

from .size_names import size_named
from .sizes import CONSTANTS, Sizes, names_of, size_of
from .spelling import is_unit, parse_heading
from .words import SPECIMEN_WORDS, meaning_of

_MOST_ROWS = 60
"""Maximum number of specimens in a table of dimensions, and of lines above its headings."""
_LABELS = ("id", "name", "no", "nr", "label", "designation")
"""Headings of the specimens' names that have no word for a specimen in them."""


def count_of_sizes(header: Sequence[str]) -> int:
    """Number of sizes of a specimen that some headings name."""
    keys = {size_named(parse_heading(text).name) for text in header if text}
    return len(keys - {None, *CONSTANTS})


def may_hold_sizes(rows: int) -> bool:
    """True if a table is short enough to have one specimen a line."""
    return rows <= _MOST_ROWS


def table_of_sizes(rows: Sequence[Sequence[str]]) -> dict[str, Sizes]:
    """Dimensions by specimen, from a table with one specimen a line: headings of dimensions, possibly units,
    then lines.

    Returns:
        Dimensions by the specimen's name (or its number where no column names it); empty for any other table.
    """
    filled = [[cell.strip().strip('"') for cell in row] for row in rows if any(cell.strip() for cell in row)]
    for at, header in enumerate(filled[:_MOST_ROWS]):
        names = [parse_heading(text) for text in header]
        keys = [size_named(heading.name) for heading in names]
        sized = [c for c, key in enumerate(keys) if key is not None and key not in CONSTANTS]
        labels = [c for c, h in enumerate(names) if h.name and keys[c] is None and _names_specimens(h.name)]
        if len(header) < 2 or not sized or (len(sized) < 2 and not labels):
            continue
        if any(_is_pressure(text) for text in header):
            return {}  # such as a tube under pressure, its length or diameter measured row by row
        body, units = filled[at + 1 :], [heading.unit for heading in names]
        if body and (below := _units_of(body[0], len(header))):
            units = [own or unit for own, unit in zip(below, units, strict=True)]
            body = body[1:]
        return _by_specimen(body, labels, {c: (str(keys[c]), units[c], header[c]) for c in sized})
    return {}


def _units_of(row: Sequence[str], columns: int) -> list[str]:
    """Units in a row below the headings, empty where a column has none; no units for any other row.

    Args:
        row: fields.
        columns: number of headings.
    """
    texts = [text.strip("()[]") for text in row]
    if not any(texts) or not all(not text or is_unit(text) for text in texts):
        return []
    return [*texts, *[""] * (columns - len(texts))][:columns]


def _is_pressure(heading: str) -> bool:
    """True if a heading names a pressure."""
    found = meaning_of(heading)
    return found is not None and found.quantity == "pressure"


def _by_specimen(
    body: list[list[str]], labels: list[int], sized: Mapping[int, tuple[str, str | None, str]]
) -> dict[str, Sizes]:
    """Sizes by specimen, up to the first row without one.

    Args:
        body: fields of the rows, one specimen each.
        labels: columns that may name the specimen; the first filled one does. Else it is the row's number.
        sized: key, unit and heading of each column of sizes, by its index.
    """
    found: dict[str, Sizes] = {}
    for number, row in enumerate(body, start=1):
        sizes: Sizes = {}
        for column, (key, unit, written) in sized.items():
            text = row[column] if column < len(row) else ""
            read = size_of(key, text, unit, f"{written} {text}") if text else None
            if read is not None:
                name, size = read
                sizes |= dict.fromkeys(names_of(name), size)
        named = next((row[c] for c in labels if c < len(row) and row[c]), "")
        if not sizes:
            break
        found[named or str(number)] = sizes
    return found


def _names_specimens(name: str) -> bool:
    """True if a heading is that of the specimens' names."""
    return any(word in name for word in SPECIMEN_WORDS) or name in _LABELS
