"""Tables of constants as TOML text: parsing with every check, and writing text that parses back equal."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .. import units
from ..documents import finite_number, parse_toml, word_of
from ..errors import InputError, nearest
from ..late import tomlkit
from . import keys
from .actuator import check_actuator
from .plausible import implausible
from .records import Calibration, Line, Prior, Quantity

SCHEMA = "pneusma-calibration/1"
_SHAPE = "{value, unit, status, source}"
_LINE_SHAPE = "{points = [[x, y], ...], unit, status, source}"


OTHER_FILES = {
    "pneusma-study/1": "a study, which `pneusma design` or `pneusma propagate` takes",
    "pneusma-chain/1": "a chain of actuators",
}
"""Files that are no tables of constants, by schema."""
WANTED = "a table of constants, such as that of a single actuator,"


def parse_calibration(text: str, path: str | Path) -> Calibration:
    """Read and check a table.

    Args:
        text: the TOML text.
        path: path of the text's file, for messages.

    Raises:
        InputError: one line with file and key, if anything is unknown, missing, of the wrong dimension or
            outside its own prior.
    """
    path = Path(path)
    document = parse_toml(text, path)
    strings = {key: entry for key, entry in document.items() if not isinstance(entry, dict)}
    kind = _check_text(strings, path)
    tables = {key: entry for key, entry in document.items() if isinstance(entry, dict)}
    lines = {key: _line(key, tables.pop(key), path) for key in keys.OUTLINES[kind] if key in tables}
    quantities = {name: _quantity(name, entry, kind, path) for name, entry in _flatten(tables, kind)}
    for name in keys.required_quantities(kind, quantities, strings):
        if name not in quantities:
            raise InputError(f"{path}: key {name!r} is missing, and this {kind} cannot do without it")
    for name, (beside, value, unit, source) in keys.DEFAULTS.items():
        if beside in quantities and name not in quantities:
            quantities[name] = Quantity(name, value, unit, "assumed", source)
    if kind == "actuator":
        check_actuator(strings, quantities, lines, path)
    other = [key for key in strings if key not in (*keys.REQUIRED_TEXT, "description")]
    return Calibration(
        name=strings["name"],
        kind=kind,
        description=strings.get("description", ""),
        path=path,
        quantities=quantities,
        text={key: strings[key] for key in other},
        lines=lines,
    )


def _check_text(strings: dict[str, Any], path: Path) -> str:
    """Check everything at the top level that is not a number, and return the kind."""
    if (other := OTHER_FILES.get(str(strings.get("schema")))) is not None:
        raise InputError(f"{path}: this is {other}, but {WANTED} is wanted here")
    for key in keys.REQUIRED_TEXT:
        if key not in strings:
            raise InputError(f"{path}: key {key!r} is missing")
    if strings["schema"] != SCHEMA:
        raise InputError(f"{path}: schema is {strings['schema']!r}, but this version reads {SCHEMA!r}")
    word_of(strings["kind"], keys.KINDS, f"{path}: kind")
    kind = strings["kind"]
    for key, entry in strings.items():
        if key in (*keys.QUANTITIES[kind], *keys.OUTLINES[kind]):
            shape = _LINE_SHAPE if key in keys.OUTLINES[kind] else _SHAPE
            raise InputError(f"{path}: key {key!r} must be {shape}, but it is {entry!r}")
        if key not in keys.TEXT[kind]:
            known = [*keys.TEXT[kind], *keys.QUANTITIES[kind], *keys.OUTLINES[kind]]
            raise InputError(f"{path}: unknown key {key!r}, {nearest(key, known)}")
        if not isinstance(entry, str):
            raise InputError(f"{path}: key {key!r} must be text, but it is {entry!r}")
    choices = {"law": keys.LAWS} if kind == "silicone" else keys.WORDS.get(kind, {})
    needed = {"silicone": ("law",), "actuator": keys.SIDES[:2]}.get(kind, ())
    for key, words in choices.items():
        if key in needed and key not in strings:
            raise InputError(f"{path}: key {key!r} is missing; it must be one of {', '.join(words)}")
        if key in strings:
            word_of(strings[key], words, f"{path}: {key}")
    return kind


def _flatten(numbers: dict[str, dict], kind: str) -> Iterator[tuple[str, Any]]:
    for key, entry in numbers.items():
        if key in keys.nested_tables(kind):
            yield from ((f"{key}.{inner}", inner_entry) for inner, inner_entry in entry.items())
        else:
            yield key, entry


def _quantity(name: str, entry: Any, kind: str, path: Path) -> Quantity:
    if name not in keys.QUANTITIES[kind]:
        known = [*keys.QUANTITIES[kind], *keys.OUTLINES[kind]]
        known = [key for key in known if key.count(".") == name.count(".")]
        raise InputError(f"{path}: unknown key {name!r}, {nearest(name, known)}")
    return read_plausible(name, entry, keys.QUANTITIES[kind][name], f"{path}: key {name!r}")


def read_plausible(name: str, entry: Any, dimension: str, where: str) -> Quantity:
    """As `read_quantity`, for a constant or a dimension of a table. Its magnitude is checked, too.

    A number that was fitted is not checked: no person wrote it.

    Raises:
        InputError: as `read_quantity`, and for a magnitude that is that of another unit.
    """
    quantity = read_quantity(name, entry, dimension, where)
    wrong = implausible(name, dimension, float(entry["value"]), quantity.unit)
    if wrong and quantity.status != "fitted":
        raise InputError(f"{where}: {wrong}")
    return quantity


def read_quantity(name: str, entry: Any, dimension: str, where: str) -> Quantity:
    """Check one number of a file and convert it.

    Args:
        name: name of the quantity.
        entry: entry of the file, `{value, unit, status, source}` and perhaps a `prior` and `interval90`.
        dimension: dimension that its unit must have.
        where: file and key, for messages.

    Raises:
        InputError: one line, for a missing or unknown field, an unusable unit or a number that cannot be.
    """
    if not isinstance(entry, dict):
        raise InputError(f"{where} must be {_SHAPE}, but it is {entry!r}")
    _check_fields(entry, ("value", "unit", "status", "source"), ("prior", "interval90"), where)
    difference = _check_unit(entry["unit"], dimension, where)
    value = finite_number(entry["value"], f"{where}: value")
    if name in keys.POSITIVE and value <= 0.0:
        raise InputError(f"{where}: value must be positive, but it is {value:g}")
    _check_origin(entry, where)
    return Quantity(
        name=name,
        value=units.to_si(value, entry["unit"], difference),
        unit=entry["unit"],
        status=entry["status"],
        source=entry["source"],
        prior=_prior(entry["prior"], value, entry["unit"], difference, where) if "prior" in entry else None,
        interval90=_interval(entry["interval90"], entry["unit"], difference, where)
        if "interval90" in entry
        else None,
    )


def _interval(entry: Any, unit: str, difference: bool, where: str) -> tuple[float, float]:
    """Check an interval in the file's unit, then convert it."""
    where = f"{where}: interval90"
    if not isinstance(entry, list) or len(entry) != 2:
        raise InputError(f"{where} must be [low, high], but it is {entry!r}")
    low, high = (finite_number(end, where) for end in entry)
    if low > high:
        raise InputError(f"{where} begins at {low:g}, above its end {high:g}")
    return units.to_si(low, unit, difference), units.to_si(high, unit, difference)


def _check_origin(entry: dict, where: str) -> None:
    word_of(entry["status"], keys.STATUSES, f"{where}: status")
    if not isinstance(entry["source"], str) or not entry["source"].strip():
        raise InputError(f"{where}: source must say where the number comes from, in words")


def _line(name: str, entry: dict, path: Path) -> Line:
    where = f"{path}: key {name!r}"
    _check_fields(entry, ("points", "unit", "status", "source"), (), where)
    _check_unit(entry["unit"], "length", where)
    _check_origin(entry, where)
    points = entry["points"]
    if not isinstance(points, list) or len(points) < 3:
        raise InputError(f"{where}: points must be a list of at least three [x, y], but it is {points!r}")
    read = []
    for number, point in enumerate(points, 1):
        if not isinstance(point, list) or len(point) != 2:
            raise InputError(f"{where}: point {number} must be [x, y], but it is {point!r}")
        at = f"{where}: point {number}"
        read.append(tuple(units.to_si(finite_number(part, at), entry["unit"]) for part in point))
    return Line(name, tuple(read), entry["unit"], entry["status"], entry["source"])


def _check_fields(entry: dict, needed: tuple[str, ...], optional: tuple[str, ...], where: str) -> None:
    for key in entry:
        if key not in needed + optional:
            raise InputError(f"{where}: unknown field {key!r}, {nearest(key, needed + optional)}")
    for key in needed:
        if key not in entry:
            raise InputError(f"{where}: field {key!r} is missing")


def _check_unit(unit: Any, wanted: str, where: str) -> bool:
    """Refuse a unit of the wrong dimension; say whether the quantity is a difference of temperatures."""
    try:
        dimension = units.dimension_of(unit)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    difference = wanted == units.TEMPERATURE_DIFFERENCE
    if dimension != (units.TEMPERATURE if difference else wanted):
        raise InputError(
            f"{where}: unit {unit!r} measures a {dimension}, but a {wanted} is needed, "
            f"for example in {units.INTERNAL_UNITS[wanted]!r}"
        )
    return difference


def _prior(entry: Any, value: float, unit: str, difference: bool, where: str) -> Prior:
    """Check a prior in the file's unit, then convert it."""
    where = f"{where}: prior"
    if not isinstance(entry, dict):
        raise InputError(f"{where} must be {{mean, sd, min, max}}, but it is {entry!r}")
    _check_fields(entry, ("mean", "sd"), ("min", "max"), where)
    numbers = {key: finite_number(number, f"{where} {key}") for key, number in entry.items()}
    low, high = numbers.get("min", -math.inf), numbers.get("max", math.inf)
    if numbers["sd"] <= 0.0:
        raise InputError(f"{where} sd must be positive, but it is {numbers['sd']:g}")
    if low > high:
        raise InputError(f"{where} min is {low:g}, above its max of {high:g}")
    for label, number in (("mean", numbers["mean"]), ("value", value)):
        if not low <= number <= high:
            raise InputError(f"{where}: the {label} {number:g} is outside min {low:g} to max {high:g}")
    converted = {key: units.to_si(numbers[key], unit, difference or key == "sd") for key in numbers}
    return Prior(**converted)


def render_calibration(calibration: Calibration) -> str:
    """TOML text of a table, each quantity in its own unit; `parse_calibration` reads it back equal."""
    document = tomlkit.document()
    header = {"schema": SCHEMA, "name": calibration.name, "kind": calibration.kind}
    for key, text in {**header, "description": calibration.description, **calibration.text}.items():
        document[key] = text
    nested: dict[str, Any] = {}
    for name, quantity in calibration.quantities.items():
        table, _, key = name.rpartition(".")
        entry = quantity_entry(quantity, keys.QUANTITIES[calibration.kind].get(name))
        if table:
            nested.setdefault(table, tomlkit.table())[key] = entry
        else:
            document[key] = entry
    for name, line in calibration.lines.items():
        document[name] = _line_entry(line)
    for key, table in nested.items():
        document[key] = table
    return tomlkit.dumps(document)


def quantity_entry(quantity: Quantity, dimension: str | None) -> Any:
    """A quantity as the inline table of the file, in its own unit; `read_quantity` reads it back equal."""
    difference = dimension == units.TEMPERATURE_DIFFERENCE
    entry = tomlkit.inline_table()
    entry["value"] = _digits(quantity.value, quantity.unit, difference)
    entry["unit"] = quantity.unit
    entry["status"] = quantity.status
    entry["source"] = quantity.source
    if quantity.prior is not None:
        prior = tomlkit.inline_table()
        for key in ("mean", "sd", "min", "max"):
            number = getattr(quantity.prior, key)
            if math.isfinite(number):
                prior[key] = _digits(number, quantity.unit, difference or key == "sd")
        entry["prior"] = prior
    if quantity.interval90 is not None:
        entry["interval90"] = [_digits(end, quantity.unit, difference) for end in quantity.interval90]
    return entry


def _line_entry(line: Line) -> Any:
    """A closed line as the inline table of the file, in its own unit."""
    entry = tomlkit.inline_table()
    entry["points"] = [[_digits(part, line.unit, False) for part in point] for point in line.points]
    entry["unit"], entry["status"], entry["source"] = line.unit, line.status, line.source
    return entry


def _digits(value: float, unit: str, difference: bool) -> float:
    """The shortest number in `unit` that reads back as `value`, so that 1 mm is not 0.9999999999999999."""
    exact = float(units.from_si(value, unit, difference))
    for digits in range(1, 18):
        short = float(f"{exact:.{digits}g}")
        if units.to_si(short, unit, difference) == value:
            return short
    return exact
