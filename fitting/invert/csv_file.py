"""CSV files of targets and lumens: rows, and numbers that name their place when they are none."""

import csv
from pathlib import Path

import numpy as np

from pneusma_jax.errors import InputError, counted
from pneusma_jax.units import from_si, unit_of_column

LARGEST = float(1.0 / np.sqrt(np.finfo(float).eps))
"""Largest distance from the origin, in sizes that count as one [1]. Beyond it, 67 km for a tip, one size's
square is lost in double precision beside the square of the distance."""

OTHER_MARKS = {";": "semicolons", "\t": "tabs", "|": "bars"}
"""Marks with which other programs separate columns, and their names."""


def columns_of(path: Path) -> dict[str, np.ndarray]:
    """Columns of numbers by the names of their header; lines that are all blank are left out.

    Raises:
        InputError: one line with file, row and column, if the file cannot be read or is no text, or a name is
            there twice or missing. The same if a row is longer than the header, or a field is no finite
            number.
    """
    rows = [(k, row) for k, row in enumerate(_rows(path), 1) if any(field.strip() for field in row)]
    if not rows:
        return {}
    header = [name.strip() for name in rows[0][1]]
    for mark, words in OTHER_MARKS.items():
        if len(header) == 1 and mark in header[0]:
            raise InputError(
                f"{path}, row {rows[0][0]}: {words} separate the columns; separate them by commas, and write"
                " decimals with a point"
            )
    for name in header:
        if not name:
            raise InputError(f"{path}: a column of the header has no name")
        if header.count(name) > 1:
            raise InputError(f"{path}: column {name} is there twice")
    for line, row in rows[1:]:
        if len(row) > len(header):
            fields = counted(len(row), "field")
            raise InputError(f"{path}: row {line} has {fields}, but the header has {len(header)}")
    return {
        name: np.array(
            [number(row[k] if k < len(row) else "", f"{path}: row {n}, column {name}") for n, row in rows[1:]]
        )
        for k, name in enumerate(header)
    }


def unit_of(column: str, where: str) -> str:
    """The unit that a column's name states.

    Raises:
        InputError: if it is not known; begins with `where`, the file.
    """
    try:
        return unit_of_column(column)[1]
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def check_sizes(values: np.ndarray, size: float, column: str, where: str) -> None:
    """Refuse lengths and curvatures whose squares leave no digits for a state of the body.

    Args:
        values: [SI]; size: what counts as one [SI].
        column: name of the column, for messages; where: the file.

    Raises:
        InputError: naming the column and the largest value that can be told.
    """
    if np.any(np.abs(values) > LARGEST * size):
        most = from_si(LARGEST * size, unit_of(column, where))
        raise InputError(
            f"{where}: column {column} must lie within {most:.2g} of 0; farther away no state can be told "
            "from another"
        )


def _rows(path: Path) -> list[list[str]]:
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            return list(csv.reader(file))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read as a text file") from None
    except csv.Error as error:  # such as a field of more than a hundred thousand letters
        raise InputError(f"{path}: cannot be read as a CSV file ({error})") from None


def number(text: str | None, where: str) -> float:
    """A finite number.

    Args:
        text: text of the field; None where the row is too short.
        where: file, row and column.

    Raises:
        InputError: if it is no number, or not finite.
    """
    try:
        value = float(text)
    except (TypeError, ValueError):
        raise InputError(f"{where} must be a number, but it is {text!r}") from None
    if not np.isfinite(value):
        raise InputError(f"{where} must be finite, but it is {text!r}")
    return value
