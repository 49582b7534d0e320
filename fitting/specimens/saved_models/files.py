"""Reading and writing of models as TOML, with every check.

    schema = "pneusma-model/1"

    [base]
    alloy = "krl35"
    G_m = {value = 3.1, unit = "GPa", status = "fitted", source = "...", prior = {mean = 3.1, sd = 0.05}}
    wall_thickness = {value = 1.02, unit = "mm", status = "fitted", source = "..."}

    [[effect]]
    slug = "opposing_spring_heating"
    [effect.parameters]
    gain = {value = 0.21, unit = "1", status = "fitted", source = "...", prior = {mean = 0.21, sd = 0.02}}

A parameter of `[base]` replaces a number of a table: of the alloy, the silicone or the actuator. Its name and
unit tell which. Where several tables have such a number, the kind comes first: `"silicone.density"`.
`[specimen."NAME"]` holds parameters of one specimen alone.
The module `discrepancy` handles the effect `unmodelled`.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pneusma_jax.calibration.keys import KINDS, QUANTITIES
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.calibration.toml import quantity_entry, read_plausible, read_quantity
from pneusma_jax.documents import check_keys, parse_toml, read_document
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError, nearest, warn_of
from pneusma_jax.files import write_whole
from pneusma_jax.late import tomlkit
from pneusma_jax.pipeline import Effect
from pneusma_jax.units import TEMPERATURE, TEMPERATURE_DIFFERENCE, UNITS

from .discrepancy import SLUG, AddedDiscrepancy, read_remainder, remainder_entry
from .model import (
    AddedEffect,
    AugmentedModel,
    Base,
    check_bounds,
    dimension_of_parameter,
    option_names,
    parameter_of,
)

SCHEMA = "pneusma-model/1"
TABLES = ("design", "alloy", "material")
TOP = ("schema", "name", "description", "caution", "base", "specimen", "effect")
PLAIN = "1"
"""Unit that stands in for one that only an effect has, such as `1/N`, while a number is read or written."""


def load_model(path: str | Path) -> AugmentedModel:
    """Read and check a model.

    Args:
        path: TOML file with schema `pneusma-model/1`.

    Returns:
        The model, its values in SI. Relative paths of tables count from the file's folder.

    Warns:
        Distrusted: if the file has a `caution`.

    Raises:
        InputError: one line with file, key and remedy, for anything unknown, missing or impossible.
    """
    path = Path(path)
    document = _read(path)
    base = document.get("base", {})
    if not isinstance(base, dict):
        raise InputError(f"{path}: base must be a table, [base], but it is {base!r}")
    words = {key: base[key] for key in TABLES if key in base}
    for key, word in words.items():
        if not isinstance(word, str) or not word.strip():
            raise InputError(f"{path}: [base] {key} must be the name or path of a table, but it is {word!r}")
    specimens = document.get("specimen", {})
    if not isinstance(specimens, dict) or not all(isinstance(own, dict) for own in specimens.values()):
        raise InputError(f'{path}: specimen must be tables, [specimen."NAME"], one for each')
    numbers = {key: entry for key, entry in base.items() if key not in TABLES}
    caution = document.get("caution", "")
    warn_of(path, caution)
    return AugmentedModel(
        base=_base(numbers, f"{path}: [base]"),
        added=tuple(_effects(document.get("effect", []), path)),
        tables={key: _located(word, path) for key, word in words.items()},
        specimens={name: _base(own, f"{path}: [specimen.{name}]") for name, own in specimens.items()},
        name=document.get("name", path.stem),
        description=document.get("description", ""),
        path=path,
        caution=caution,
    )


def is_model(path: str | Path) -> bool:
    """True if a file declares itself a model; false for a name or an unreadable file."""
    try:
        document = parse_toml(Path(path).read_text(encoding="utf-8"), path)
    except (OSError, ValueError):
        return False
    return document.get("schema") == SCHEMA


def _read(path: Path) -> dict[str, Any]:
    document = read_document(path, path, "a model", SCHEMA, TOP)
    for key in ("name", "description", "caution"):
        if not isinstance(document.get(key, ""), str):
            raise InputError(f"{path}: {key} must be text, but it is {document[key]!r}")
    return document


def _located(word: str, path: Path) -> str:
    """Name of a shipped table, or a path counted from the model's folder."""
    return str(path.parent / word) if word.endswith(".toml") else word


def _base(entries: Mapping[str, Any], where: str) -> Base:
    """Numbers by kind of table and name."""
    base: dict[str, dict[str, Quantity]] = {}
    for key, entry in entries.items():
        kind, name = _owner(key, entry, where)
        if name in base.get(kind, {}):
            raise InputError(f"{where} {key}: this number of the {kind} is there twice; keep one")
        quantity = read_plausible(name, entry, QUANTITIES[kind][name], f"{where} {key}")
        base.setdefault(kind, {})[name] = quantity
    return base


def _owner(key: str, entry: Any, where: str) -> tuple[str, str]:
    """Kind of table that a parameter belongs to, and its name there."""
    kind, _, rest = key.partition(".")
    if kind in KINDS and rest:
        if rest not in QUANTITIES[kind]:
            raise InputError(f"{where} {key}: unknown key, {nearest(rest, QUANTITIES[kind])}")
        return kind, rest
    owners = [kind for kind in KINDS if key in QUANTITIES[kind]]
    if not owners:
        names = {name for kind in KINDS for name in QUANTITIES[kind]} | set(TABLES)
        raise InputError(f"{where} {key}: unknown key, {nearest(key, names)}")
    unit = entry.get("unit") if isinstance(entry, dict) else None
    if unit in UNITS:
        fitting = [kind for kind in owners if _measures(QUANTITIES[kind][key], unit)]
        owners = fitting or owners[:1]
    if len(owners) > 1 and unit in UNITS:
        choices = " or ".join(f"'\"{kind}.{key}\"'" for kind in owners)
        raise InputError(f"{where} {key}: tables of several kinds have such a number; write {choices}")
    return owners[0], key


def _measures(dimension: str, unit: str) -> bool:
    return UNITS[unit].dimension == (TEMPERATURE if dimension == TEMPERATURE_DIFFERENCE else dimension)


def _effects(entries: Any, path: Path) -> Iterable[AddedEffect | AddedDiscrepancy]:
    if not isinstance(entries, list):
        raise InputError(f"{path}: effect must be a list of tables, [[effect]], one for each effect")
    for number, entry in enumerate(entries, 1):
        where = f"{path}: effect {number}"
        if not isinstance(entry, dict) or not isinstance(entry.get("slug"), str):
            raise InputError(f"{where} has no slug, the name of an effect")
        if entry["slug"] == SLUG:
            yield read_remainder(entry, f"{where} ({SLUG})")
            continue
        try:
            effect = find_effect(entry["slug"])
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        yield _effect(effect, entry, f"{where} ({effect.slug})")


def _effect(effect: type[Effect], entry: dict[str, Any], where: str) -> AddedEffect:
    allowed = ("slug", "parameters", *option_names(effect))
    check_keys(entry, allowed, where)
    parameters = entry.get("parameters", {})
    if not isinstance(parameters, dict):
        raise InputError(f"{where}: parameters must be a table, [effect.parameters]")
    read = {}
    for name, number in parameters.items():
        stem = parameter_of(effect, name)
        if stem is None:
            raise InputError(f"{where}: unknown parameter {name!r}, {nearest(name, effect.specs)}")
        read[name] = _parameter(name, number, effect.specs[stem].unit, f"{where}: {name}")
        check_bounds(effect.slug, name, read[name].value, where)
    options = {name: _option(effect, name, entry[name], where) for name in allowed[2:] if name in entry}
    return AddedEffect(effect.slug, read, options)


def _parameter(name: str, entry: Any, unit: str, where: str) -> Quantity:
    dimension = dimension_of_parameter(unit)
    if dimension is not None:
        return read_quantity(name, entry, dimension, where)
    if isinstance(entry, dict) and entry.get("unit", unit) != unit:
        raise InputError(f"{where}: unit must be {unit!r}, but it is {entry['unit']!r}")
    plain = {**entry, "unit": PLAIN} if isinstance(entry, dict) and "unit" in entry else entry
    return dataclasses.replace(read_quantity(name, plain, "number", where), unit=unit)


def _option(effect: type[Effect], name: str, value: Any, where: str) -> Any:
    """An option, converted to the type of the effect's default."""
    usual = getattr(effect(), name)
    if type(value) is not type(usual):
        raise InputError(f"{where}: {name} must be like {usual!r}, but it is {value!r}")
    return value


def save_model(model: AugmentedModel, path: str | Path) -> Path:
    """Write a model that `load_model` reads back equal. The file appears whole or not at all.

    Args:
        model: model to write; paths of its tables are written as they are.
        path: file to write or replace.

    Raises:
        InputError: if the place cannot be written.
    """
    return write_whole(path, render_model(model))


def render_model(model: AugmentedModel) -> str:
    """TOML text of a model."""
    document = tomlkit.document()
    document["schema"], document["name"] = SCHEMA, model.name
    if model.description:
        document["description"] = model.description
    if model.caution:
        document["caution"] = model.caution
    base = tomlkit.table()
    for key, word in model.tables.items():
        base[key] = word
    _write_numbers(base, model.base)
    document["base"] = base
    if model.specimens:
        document["specimen"] = tomlkit.table(is_super_table=True)
        for name, own in model.specimens.items():
            table = tomlkit.table()
            _write_numbers(table, own)
            document["specimen"][name] = table
    if model.added:
        document["effect"] = tomlkit.aot()
    for added in model.added:
        document["effect"].append(_effect_entry(added))
    return tomlkit.dumps(document)


def _write_numbers(table: Any, base: Base) -> None:
    for kind, quantities in base.items():
        for name, quantity in quantities.items():
            dimension = QUANTITIES[kind][name]
            shared = [other for other in KINDS if QUANTITIES[other].get(name) == dimension]
            key = name if len(shared) == 1 else f"{kind}.{name}"
            table[key] = quantity_entry(quantity, dimension)


def _effect_entry(added: AddedEffect | AddedDiscrepancy) -> Any:
    if isinstance(added, AddedDiscrepancy):
        return remainder_entry(added)
    entry = tomlkit.table()
    entry["slug"] = added.slug
    for name, choice in added.options.items():
        entry[name] = choice
    parameters = tomlkit.table()
    for name, quantity in added.parameters.items():
        dimension = dimension_of_parameter(quantity.unit)
        known = dimension is not None
        number = quantity_entry(quantity if known else dataclasses.replace(quantity, unit=PLAIN), dimension)
        number["unit"] = quantity.unit
        parameters[name] = number
    entry["parameters"] = parameters
    return entry
