"""One field of a study's table at a time, with the line that says what is wrong with it."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pneusma_jax.documents import check_keys, finite_number
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import UNITS, amount, suggested_unit, to_si

Table = Mapping[str, Any]


def table_of(value: Any, where: str) -> Table:
    """A table, or the line that says that it is none."""
    if not isinstance(value, dict):
        raise InputError(f"{where} must be a table, but it is {value!r}")
    return value


def word(table: Table, key: str, words: Iterable[str], where: str, default: str | None = None) -> str:
    """One of several words.

    Raises:
        InputError: if it is missing without a default, or another one.
    """
    value, words = table.get(key, default), list(words)
    if value is None:
        raise InputError(f"{where}: key {key!r} is missing; it must be one of {', '.join(words)}")
    if value not in words:
        raise InputError(f"{where}: {key} is {value!r}, {nearest(str(value), words)}")
    return value


def share(table: Table, key: str, default: float, where: str) -> float:
    """A number between 0 and 1, ends excluded."""
    value = finite_number(table.get(key, default), f"{where}: {key}")
    if not 0.0 < value < 1.0:
        raise InputError(f"{where}: {key} must lie between 0 and 1, but it is {value:g}")
    return value


def whole(table: Table, key: str, default: int, least: int, most: int, where: str) -> int:
    """A whole number of a range."""
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise InputError(f"{where}: {key} must be a whole number from {least} to {most}, but it is {value!r}")
    return value


def unit_of(table: Table, dimension: str, where: str) -> str:
    """The unit that a table states, which must be of a dimension; plain numbers need none.

    Raises:
        InputError: if it is missing or of another dimension.
    """
    unit = table.get("unit", "1" if dimension == "number" else None)
    if unit is None:
        raise InputError(
            f"{where}: unit is missing; a {dimension} needs one, such as {usual_unit(dimension)!r}"
        )
    if not known_unit(unit):
        raise InputError(f"{where}: unknown unit {unit!r}, {suggested_unit(str(unit), dimension)}")
    if UNITS[unit].dimension != dimension:
        raise InputError(
            f"{where}: unit {unit!r} is not of the right kind; a {dimension} needs one such as "
            f"{usual_unit(dimension)!r}"
        )
    return unit


def known_unit(unit: Any) -> bool:
    """True for the name of a unit; a list or a table in its place is none."""
    return isinstance(unit, str) and unit in UNITS


def usual_unit(dimension: str) -> str:
    """A unit that people use for a dimension."""
    usual = {
        "length": "mm",
        "pressure": "kPa",
        "angle": "deg",
        "area": "mm2",
        "force": "mN",
        "curvature": "1/m",
    }
    return usual.get(dimension) or next(name for name, unit in UNITS.items() if unit.dimension == dimension)


def quantity(value: Any, dimension: str, where: str) -> tuple[float, str]:
    """A number with a unit, `{value = 30, unit = "kPa"}` [SI], and its unit; a plain one for plain
    numbers."""
    if dimension == "number" and not isinstance(value, dict):
        return finite_number(value, where), "1"
    if not isinstance(value, dict):
        raise InputError(f'{where} must be {{value = .., unit = ".."}}, but it is {value!r}')
    check_keys(value, ("value", "unit"), where)
    if "value" not in value:
        raise InputError(f"{where}: value is missing")
    unit = unit_of(value, dimension, where)
    return to_si(finite_number(value["value"], f"{where}: value"), unit), unit


def span(value: Any, dimension: str, where: str) -> tuple[float, float, str]:
    """A range, `{from = 0, to = 50, unit = "kPa"}` [SI], ascending, and its unit."""
    table = table_of(value, where)
    check_keys(table, ("from", "to", "unit"), where)
    unit = unit_of(table, dimension, where)
    for key in ("from", "to"):
        if key not in table:
            raise InputError(f"{where}: {key!r} is missing")
    low, high = (finite_number(table[key], f"{where}: {key}") for key in ("from", "to"))
    check_ascending(low, high, unit, where)
    return to_si(low, unit), to_si(high, unit), unit


def check_ascending(low: float, high: float, unit: str, where: str) -> None:
    """Refuse a range whose ends are equal or crossed.

    Args:
        low, high: ends, in the unit.
        unit: unit; where: place in the file, for messages.
    """
    if low == high:
        both = amount(f"{low:g}", unit)
        raise InputError(f"{where}: bounds are equal, so nothing is free: {both}")
    if not low < high:
        ends = amount(f"from {low:g} to {high:g}", unit)
        raise InputError(f"{where}: bounds are crossed: {ends}")


def names_of(value: Any, where: str) -> tuple[str, ...]:
    """One name, or several different ones."""
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(n, str) and n for n in names):
        raise InputError(f"{where} must be a name or a list of names, but it is {value!r}")
    if len(set(names)) != len(names):
        raise InputError(f"{where} names something twice: {', '.join(names)}")
    return tuple(names)


def file_of(table: Table, key: str, folder: Path, where: str) -> Path:
    """Path of a file, from the study's folder if it is relative."""
    value = table.get(key)
    if not isinstance(value, str) or not value:
        raise InputError(f"{where}: {key} must be the path of a file, but it is {value!r}")
    path = folder / value
    if not path.is_file():
        raise InputError(f"{where}: {key} {path}: there is no such file")
    return path


def code_of(table: Table, folder: Path, where: str) -> Path:
    """Path of a Python file, which will be executed: only from the study's own folder or below.

    A study that came from elsewhere runs no more than what came with it.

    Raises:
        InputError: if there is no such file, or it lies elsewhere.
    """
    path = file_of(table, "file", folder, where)
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f"{where}: file {path} is outside the study's folder, so it is not executed; copy it there"
        )
    return path
