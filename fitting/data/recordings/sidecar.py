"""The TOML half of a recording, and `campaign.toml`: keys, words, numbers and units are checked, then
merged."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pneusma_jax.calibration import examples
from pneusma_jax.calibration.plausible import implausible, unusual
from pneusma_jax.documents import parse_toml
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import dimension_of

from . import schema
from .columns import convert, written_unit
from .table import unusable

COMMAND_LINE = "command line"
BOTH_WAYS = {
    "real": ("measured", "simulated"),
    "noise_includes_rounding": ("nothing is added to [noise]", "rounding may be added to it"),
}
"""Keys that are true or false, with the meanings of both."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file without checks of its content.

    Raises:
        InputError: if it cannot be read, is not UTF-8, or is not TOML (with the line).
    """
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise unusable(path, f"the file cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise unusable(path, "this is not UTF-8 text; save it as UTF-8") from None
    return parse_toml(text, path)


def check_settings(
    settings: Mapping[str, Any], where: Path | str, allowed: tuple[str, ...]
) -> dict[str, Any]:
    """Check the settings of a sidecar, a campaign or the command line.

    Args:
        settings: settings by key, as in a sidecar.
        where: file (or the words "command line") that messages name.
        allowed: permitted top-level keys.

    Returns:
        The same with canonical keys, floats for numbers, lengths in mm. Only `check_noise` checks `noise`,
        because its keys depend on the kind.

    Raises:
        InputError: for an unknown key, word or unit, a value of the wrong type, or an impossible number.
    """
    for key in settings:
        if key not in allowed:
            table = _owner_of(settings[key]) if isinstance(settings[key], Mapping) else _owner_of([key])
            close = nearest(key, allowed)
            said = close if close.startswith("did you mean") else _in_a_table(table) or close
            raise unusable(where, f"unknown key {key!r}, {said}")
    checked = {key: settings[key] for key in ("title", "specimen") if key in settings}
    for key, value in checked.items():
        if not isinstance(value, str) or not value.strip():
            raise unusable(where, f"{key} = {value!r} must be a text in quotes")
    for key, words in (("kind", schema.KINDS), ("role", schema.ROLES)):
        if key in settings:
            checked[key] = _word(settings[key], words, key, where)
    for key, (yes, no) in BOTH_WAYS.items():
        if key in settings:
            if not isinstance(settings[key], bool):
                raise unusable(where, f"{key} = {settings[key]!r} must be true ({yes}) or false ({no})")
            checked[key] = settings[key]
    tables = {
        "source": _check_source,
        "geometry": _check_geometry,
        "tolerance": _check_tolerance,
        "noise": _check_noise_alone,
        "constant": _check_constant,
        "zero": _check_zero,
    }
    for key, check in tables.items():
        if key in settings:
            if not isinstance(settings[key], Mapping):
                raise unusable(where, f"{key} must be a table, [{key}] with one key a line")
            checked[key] = check(settings[key], where)
    return checked


def _word(value: Any, words: tuple[str, ...], key: str, where: Path | str) -> str:
    if value not in words:
        raise unusable(where, f"{key} = {value!r} is not known, {nearest(str(value), words)}")
    return value


def finite_number(value: Any, key: str, where: Path | str) -> float:
    """A number of a TOML as a float.

    Raises:
        InputError: if it is none, or not finite.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise unusable(where, f"{key} = {value!r} must be a finite number")
    return float(value)


def _check_source(table: Mapping[str, Any], where: Path | str) -> dict[str, Any]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            raise unusable(where, f"[source] {key} must be a text, not a table")
    return dict(table)


def canonical_geometry_key(
    key: str, section: str, where: Path | str, known: tuple[str, ...]
) -> tuple[str, str]:
    """Canonical key and written unit of a number of [geometry] or [tolerance] (`wall_thickness_in`: inches).

    Raises:
        InputError: if there is no such key, or its unit is unknown or of another dimension.
    """
    if key in known:
        return key, schema.geometry_unit(key) if key in schema.GEOMETRY_NUMBERS else "1"
    for canonical in schema.GEOMETRY_NUMBERS:
        if canonical in schema.GEOMETRY_WITHOUT_UNIT:
            continue
        if schema.names_quantity(key, canonical):
            try:
                return canonical, written_unit(key, canonical)
            except InputError as error:
                raise unusable(where, f"[{section}] {key}: {error}") from None
    own = _in_a_table(_owner_of([key])) if section == "geometry" else ""
    raise unusable(where, f"unknown key {key!r} in [{section}], {own or nearest(key, known)}")


def _owner_of(names: Iterable[str]) -> str:
    """Kind of table, `alloy` or `material`, that has some of the constants; empty for others."""
    own = {"alloy": schema.ALLOY_PARAMETERS, "material": schema.MATERIAL_PARAMETERS}
    names = [name.rpartition("_")[0] if name.endswith(_MODULUS_UNITS) else name for name in names]
    return next((key for key, known in own.items() if any(name in known for name in names)), "")


_MODULUS_UNITS = ("_Pa", "_kPa", "_MPa", "_GPa")


def _in_a_table(kind: str) -> str:
    """Words on where a constant of a law is stated; empty without a kind of table."""
    return kind and (
        f'a constant of a law stands in a table of constants, which {kind} = "FILE.toml" under [geometry]'
        " names. `pneusma characterise` writes one, and docs/files.md shows one"
    )


def _check_geometry(table: Mapping[str, Any], where: Path | str) -> dict[str, Any]:
    checked: dict[str, Any] = {}
    for key, value in table.items():
        if key in schema.GEOMETRY_WORDS:
            checked[key] = _geometry_word(key, value, where)
            continue
        canonical, unit = canonical_geometry_key(key, "geometry", where, schema.geometry_keys())
        if canonical in checked:
            raise unusable(where, f"[geometry] {key} is there twice, in two units; keep one")
        number = finite_number(value, f"[geometry] {key}", where)
        least, may_equal = schema.GEOMETRY_NUMBERS[canonical]
        if number < least or (number == least and not may_equal):
            right = f"must be {least:g} or more" if may_equal else f"must be more than {least:g}"
            raise unusable(where, f"[geometry] {key} = {number:g} {right}")
        if wrong := implausible_size(canonical, number, unit):
            raise unusable(where, f"[geometry] {key}: {wrong}")
        checked[canonical] = convert(number, unit, schema.geometry_unit(canonical))
    if checked.get("prestrain", 0.0) >= 1.0:
        raise unusable(
            where, f"[geometry] prestrain = {checked['prestrain']:g} is a shear strain, a fraction below 1"
        )
    return checked


def implausible_size(canonical: str, number: float, unit: str) -> str:
    """Reason why a dimension of a specimen cannot be in its unit, and what would be right; empty otherwise.

    Args:
        canonical: key with its unit, such as `wire_diameter_mm`.
        number: the dimension as it is written.
        unit: its written unit.
    """
    name = schema.quantity_and_unit(canonical)[0]
    return implausible(name, dimension_of(unit), number, unit) if name else ""


def unusual_size(canonical: str, number: float, unit: str) -> str:
    """Question about a dimension that few specimens have, though its unit may be right; empty otherwise.

    Args:
        canonical, number, unit: as in `implausible_size`.
    """
    name = canonical if unit == "1" else schema.quantity_and_unit(canonical)[0]
    return unusual(name, dimension_of(unit), number, unit)


def place_of_word(key: str, where: Path | str) -> str:
    """Words for messages on where the specimen's alloy, material or design is stated, after a file's name.

    Beside a recording that is `[geometry]`. On the command line it is an option, in a study a key of
    `[model]`.
    """
    if where == COMMAND_LINE:
        return f"--{key}"
    return key if str(where).endswith("[model]") else f"[geometry] {key}"


def _geometry_word(key: str, value: Any, where: Path | str) -> str:
    words = schema.GEOMETRY_WORDS[key]
    if key == "design" and not isinstance(where, Path):  # of any actuator, which a recording cannot name
        if isinstance(value, str) and (value.endswith(".toml") or value in examples()):
            return value
        words = (*words, *examples())
    if words is not None:
        return _word(value, words, place_of_word(key, where), where)
    if not isinstance(value, str) or not value.strip():
        place = place_of_word(key, where)
        raise unusable(where, f'{place} = {value!r} must be a name, the path of a TOML, or "fit"')
    return value


def _check_tolerance(table: Mapping[str, Any], where: Path | str) -> dict[str, float]:
    checked: dict[str, float] = {}
    for key, value in table.items():
        canonical, _ = canonical_geometry_key(key, "tolerance", where, schema.tolerance_keys())
        number = finite_number(value, f"[tolerance] {key}", where)
        if number < 0.0:
            raise unusable(where, f"[tolerance] {key} = {number:g} must be 0 (exact) or more")
        if number > 1.0:
            raise unusable(where, f"[tolerance] {key} = {number:g} is relative: 3 percent is 0.03")
        if canonical in checked:
            raise unusable(where, f"[tolerance] {key} is there twice, in two units; keep one")
        checked[canonical] = number
    return checked


def _check_constant(table: Mapping[str, Any], where: Path | str) -> dict[str, float]:
    return {key: finite_number(value, f"[constant] {key}", where) for key, value in table.items()}


def _check_noise_alone(table: Mapping[str, Any], where: Path | str) -> dict[str, Any]:
    for key in BOTH_WAYS:
        if key in table:
            raise unusable(where, f"{key} is no column: move its line above all tables, to the file's top")
    return dict(table)


def _check_zero(table: Mapping[str, Any], where: Path | str) -> dict[str, float]:
    for key, value in table.items():
        if finite_number(value, f"[zero] {key}", where) <= 0.0:
            raise unusable(
                where, f"[zero] {key} = {value:g} must be more than 0: one standard deviation of a zero that"
                " the fit finds. Leave it out where the zero is known",
            )  # fmt: skip
    return {key: float(value) for key, value in table.items()}


def merge(campaign: Mapping, sidecar: Mapping, command_line: Mapping) -> dict[str, Any]:
    """Settings of one recording: those of the campaign, then its sidecar, then the command line, key by key.

    A campaign's [constant] applies to columns that a recording lacks, its [noise] to those that it has, and
    its [zero] to kinds that have one (`stated_columns`). So they are not merged here. A [tolerance] table is
    complete, so a sidecar's replaces the campaign's as a whole. The command line changes the keys that it
    names. The others stay as they are (the defaults, where no table was given).
    """
    shared = ("geometry", "tolerance", "noise_includes_rounding")
    merged: dict[str, Any] = {key: campaign[key] for key in shared if key in campaign}
    for key, value in sidecar.items():
        merged[key] = {**merged.get(key, {}), **value} if key == "geometry" else value
    for key, value in command_line.items():
        if key == "tolerance":
            merged[key] = {**merged.get(key, schema.TOLERANCE_DEFAULTS), **value}
        elif isinstance(value, Mapping):
            merged[key] = {**merged.get(key, {}), **value}
        else:
            merged[key] = value
    return merged
