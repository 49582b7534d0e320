"""Tables of constants on disk: each number with its unit, where it comes from and how well it is known.

A table describes an alloy, a silicone or an actuator design. It is a TOML file in which every number is

    G_m = {value = 3.0, unit = "GPa", status = "fitted", source = "...", prior = {mean = 3.0, sd = 0.9}}

Values are converted once, at reading, to the internal units of `pneusma_jax.units`. Nothing here needs JAX.
The records are in `calibration/records.py`, the known keys in `calibration/keys.py`, the text in
`calibration/toml.py`; this module finds, reads and writes files.
"""

import functools
import os
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from ..documents import read_text, shipped_names
from ..errors import InputError, nearest, warn_of
from ..files import write_whole
from .records import Calibration, Line, Prior, Quantity
from .toml import SCHEMA, WANTED, parse_calibration, render_calibration

_USUAL = {"material": "dragon_skin_10_fast", "alloy": "krl35"}
_EXAMPLES = resources.files("calibration_data").joinpath("examples", "designs")
_CHAINS = resources.files("calibration_data").joinpath("examples", "chains")
_UNKNOWN = resources.files("calibration_data").joinpath("unknown")

__all__ = [
    "SCHEMA", "Calibration", "Line", "Prior", "Quantity", "available", "examples", "load_calibration",
    "named_table", "unknown", "write_calibration",
]  # fmt: skip


def available(kind: str | None = None) -> list[str]:
    """Names of the tables that come with the package, sorted; those of one kind, or all if it is None."""
    names = shipped_names(resources.files("calibration_data"))
    return [name for name in names if kind is None or load_calibration(name).kind == kind]


def unknown() -> list[str]:
    """Names of alloys that nobody has characterised, sorted: wide priors to identify one from, by name."""
    return shipped_names(_UNKNOWN)


def examples() -> list[str]:
    """Names of the example actuators that come with the package, sorted; to be loaded by name and copied."""
    return shipped_names(_EXAMPLES)


def load_calibration(name_or_path: str | Path | Calibration, kind: str | None = None) -> Calibration:
    """Read and check a table.

    Args:
        name_or_path: name of a table or example of the package (`"krl35"`), or a path. A `Path`, and any text
            that ends in `.toml` or contains a path separator, is a path. A table in memory is taken as it is.
        kind: the kind that is wanted, or None for any.

    Returns:
        The table, with values in internal units.

    Warns:
        Distrusted: if the file has a `caution`, which a characterisation writes whose law does not fit.

    Raises:
        InputError: if the table cannot be found or read, or is of another kind. Also if an entry is unknown,
            missing, of the wrong dimension or outside its own prior. One line: file, key, remedy.
    """
    table = name_or_path if isinstance(name_or_path, Calibration) else _read(name_or_path, kind)
    if kind is not None and table.kind != kind:
        raise InputError(
            f"{table.path or table.name}: kind is {table.kind!r}, but a table of kind {kind!r} is needed here"
        )
    return table


def _read(name_or_path: str | Path, kind: str | None) -> Calibration:
    path, place = _locate(name_or_path, kind)
    table = _parsed(read_text(place, path), path)
    warn_of(path, table.text.get("caution", ""))
    return replace(  # which the caller may change
        table, quantities=dict(table.quantities), text=dict(table.text), lines=dict(table.lines)
    )


@functools.lru_cache(maxsize=64)
def _parsed(text: str, path: Path) -> Calibration:
    """Table of a text, which a process reads many times: a diagnosis does for every trial of other units."""
    return parse_calibration(text, path)


def named_table(table: Calibration, key: str) -> str:
    """Name or path of the alloy or material of an actuator; a relative path counts from the file it is in.

    Args:
        table: table of kind actuator.
        key: `"alloy"` or `"material"`; the source's own where the table names none.

    Raises:
        InputError: if there is no such table or file; the error says which actuator's file names it.
    """
    name = table.text.get(key, _USUAL[key])
    where = f"{table.path or table.name}: {key} = {name!r}"
    if name.endswith(".toml"):
        beside = (table.path or Path()).parent / name
        if not beside.exists():
            raise InputError(f"{where}: there is no file {beside}")
        return str(beside)
    try:
        _locate(name, {"material": "silicone"}.get(key, key))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return name


def write_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write a table that `load_calibration` reads back equal; the file appears whole or not at all.

    Args:
        calibration: the table; quantities are written in their own `unit`.
        path: file to write or replace.

    Raises:
        InputError: if the table would be refused when read back, or the place cannot be written.
    """
    path = Path(path)
    text = render_calibration(calibration)
    parse_calibration(text, path)
    write_whole(path, text)


def _locate(name_or_path: str | Path, kind: str | None) -> tuple[Path, Any]:
    """Path to show in messages, and the place to read: a file, or a resource of the installed package."""
    name = str(name_or_path)
    if isinstance(name_or_path, Path) or name.endswith(".toml") or "/" in name or os.sep in name:
        return Path(name), Path(name)
    if name in examples():
        file = f"{name}.toml"
        return Path("calibration_data", "examples", "designs", file), _EXAMPLES.joinpath(file)
    if name in unknown():
        file = f"{name}.toml"
        return Path("calibration_data", "unknown", file), _UNKNOWN.joinpath(file)
    if name not in available():
        if name in shipped_names(_CHAINS):
            raise InputError(f"{name} is a chain of actuators, but {WANTED} is wanted here")
        alloys = unknown() if kind in (None, "alloy") else []
        known = available(kind) + alloys + (examples() if kind in (None, "actuator") else [])
        offered = nearest(name, known)
        if kind is not None and offered.endswith("?"):  # a list of all tables is long
            offered += f" Known of kind {kind}: {', '.join(sorted(known))}"
        raise InputError(f"no table of constants is called {name!r}, {offered}")
    file = f"{name}.toml"
    return Path("calibration_data", file), resources.files("calibration_data").joinpath(file)
