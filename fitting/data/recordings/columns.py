"""Conversion of a CSV file's columns to the canonical ones of a kind, and inference of an unstated kind."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneusma_jax.errors import InputError
from pneusma_jax.units import UNITS, dimension_of, find_unit, from_si, suggested_unit, to_si

from . import schema
from .table import Table, numbers, unusable


def _quantity_of(name: str) -> str:
    """Quantity of a column name, for any unit."""
    quantity, underscore, unit = name.rpartition("_")
    return quantity if underscore and not unit.isdigit() and unit not in schema.PLAIN else name


def infer_kind(table: Table, constant: Iterable[str] = ()) -> tuple[str, str]:
    """Kind of a recording whose sidecar does not state it, from its columns.

    Args:
        table: text of the CSV.
        constant: names of the quantities that the sidecar states as constant.

    Returns:
        The kind, and the reason in a few words.

    Raises:
        InputError: if the columns fit no kind; the nearest kind's missing columns are named.
    """
    header = _Header(table, frozenset(_quantity_of(name) for name in (*table.header, *constant)))
    for kind in schema.KINDS.values():
        reason = kind.evidence_of(header)
        if reason:
            return kind.name, reason
    raise unusable(
        table.path,
        f"the kind of recording cannot be told from the columns {', '.join(table.header)}. "
        "Bring a laboratory's file in with `pneusma import`, or state in the sidecar: kind = "
        + " | ".join(f'"{kind}"' for kind in schema.KINDS),
    )


@dataclass(frozen=True)
class _Header:
    """Evidence of a header about its kind, see `schema.FileEvidence`."""

    table: Table
    held: frozenset[str]

    def unit(self, quantity: str) -> str:
        """Unit, see `schema.FileEvidence`."""
        name = self._column(quantity)
        return "" if name is None else name.rpartition("_")[2]

    def largest(self, quantity: str) -> float:
        """Largest magnitude, see `schema.FileEvidence`."""
        name = self._column(quantity)
        return 0.0 if name is None else float(np.nanmax(np.abs(numbers(self.table, name)), initial=0.0))

    def _column(self, quantity: str) -> str | None:
        return next((name for name in self.table.header if _quantity_of(name) == quantity), None)


def canonical_columns(
    table: Table, kind: str, constant: Mapping[str, float] | None = None
) -> tuple[dict[str, np.ndarray], list[str], dict[str, str]]:
    """Known columns by canonical name in canonical units, then the others unchanged.

    Args:
        table: text of the CSV.
        kind: kind of the recording, which decides which columns are known.
        constant: value of constant columns that the table lacks, by canonical name.

    Returns:
        The columns, each of shape (rows,); notices about conversions and ignored columns; and the unit in
        which the table states each known column, by canonical name.

    Raises:
        InputError: for an unknown or wrong unit, two columns of one quantity, a missing required column, or a
            field that is not a number.
    """
    assigned, unknown, doubtful = _assign(table, kind)
    for name, problem in doubtful.items():
        if _canonical_of(name, kind) not in assigned:
            raise problem
        unknown.append(name)
    constant = constant or {}
    _check_present(table, kind, {*assigned, *constant}, unknown)
    columns: dict[str, np.ndarray] = {}
    notices: list[str] = []
    for name in table.header:
        canonical = next((c for c, (written, _) in assigned.items() if written == name), None)
        if canonical is None:
            continue
        unit = assigned[canonical][1]
        columns[canonical] = convert(numbers(table, name), unit, schema.quantity_and_unit(canonical)[1])
        if name != canonical:
            notices.append(f"column {name} converted to {canonical}")
    for name, value in constant.items():
        columns[name] = np.full(len(table.rows), value)
        notices.append(f"{name} is {value:g} in every row, as [constant] states")
    for name in (name for name in table.header if name in unknown):
        columns[name] = _keep(table, name)
        notices.append(f"column {name} is not one that a recording of kind {kind} has: {schema.IGNORED}")
    return columns, notices, {canonical: unit for canonical, (_, unit) in assigned.items()}


def held_by(table: Table, kind: str, canonical: str) -> bool:
    """True if a table has a column of a canonical one's quantity, in any unit."""
    return any(_canonical_of(name, kind) == canonical for name in table.header)


def convert(values: np.ndarray, unit: str, wanted: str, difference: bool = False) -> np.ndarray:
    """Values in another unit of the same dimension; bit-identical where the unit is the same.

    A number that is too large for the other unit becomes infinite, which `checks.check_recording` refuses.
    """
    if unit == wanted or find_unit(unit) == find_unit(wanted):
        return values
    with np.errstate(over="ignore"):
        return from_si(to_si(values, unit, difference), wanted, difference)


def _canonical_of(name: str, kind: str) -> str | None:
    """Canonical column of this kind with the quantity of a name."""
    for canonical in schema.KINDS[kind].columns.known:
        if schema.names_quantity(name, canonical):
            return canonical
    return None


def _assign(table: Table, kind: str):
    """Written column and unit of each canonical one; unknown columns; columns with a doubtful unit."""
    assigned: dict[str, tuple[str, str]] = {}
    unknown: list[str] = []
    doubtful: dict[str, InputError] = {}
    for name in table.header:
        canonical = _canonical_of(name, kind)
        if canonical is None:
            unknown.append(name)
            continue
        try:
            unit = written_unit(name, canonical)
        except InputError as error:
            doubtful[name] = unusable(table.path, str(error), table.header_row, name)
            continue
        if canonical in assigned:
            raise unusable(
                table.path, f"this is the same quantity as column {assigned[canonical][0]}; keep one of them",
                table.header_row, name,
            )  # fmt: skip
        assigned[canonical] = (name, unit)
    return assigned, unknown, doubtful


def written_unit(name: str, canonical: str) -> str:
    """Unit in which a column (or sidecar key) is written, checked against the canonical one's dimension.

    Args:
        name: written name, e.g. `force_mN`.
        canonical: canonical name, e.g. `force_N`.

    Returns:
        Name of the unit, e.g. `mN`.

    Raises:
        InputError: if the unit is absent, unknown, or of another dimension. The message does not name the
            place.
    """
    quantity, wanted = schema.quantity_and_unit(canonical)
    if name == quantity:
        if wanted == "1":
            return "1"
        raise InputError(f"the unit is missing; write {canonical}")
    unit = name[len(quantity) + 1 :]
    alike = [known for known, meaning in UNITS.items() if meaning.dimension == dimension_of(wanted)]
    if unit not in UNITS:
        absolute = unit[-1:].lower() == "a" and unit[:-1].casefold() in map(str.casefold, alike)
        if absolute and dimension_of(wanted) == "pressure":  # `psia`, `bara`
            raise InputError(
                f"{unit!r} counts from vacuum, and a recording has gauge pressures; take the atmosphere off,"
                " as `pneusma import` does"
            )
        raise InputError(f"unknown unit {unit!r}, {suggested_unit(unit, dimension_of(wanted))}")
    if unit not in alike:
        raise InputError(
            f"{unit!r} is a unit of {dimension_of(unit)}, not of {dimension_of(wanted)}; write {canonical}"
        )
    return unit


def _check_present(table: Table, kind: str, assigned: set[str], unknown: list[str]) -> None:
    rules = schema.KINDS[kind].columns
    for canonical in rules.required:
        if canonical not in assigned:
            raise unusable(
                table.path,
                f"a recording of kind {kind} needs the column {canonical}{_perhaps([canonical], unknown)}"
                f"{_remark(table, kind)}. What did not change may be stated in the sidecar instead:"
                f" [constant] {canonical} = ...",
            )
    if rules.one_of and not any(canonical in assigned for canonical in rules.one_of):
        raise unusable(
            table.path,
            f"a recording of kind {kind} needs one or more of the columns {', '.join(rules.one_of)}"
            f"{_perhaps(rules.one_of, unknown)}",
        )


def _perhaps(lacking: Sequence[str], unknown: Sequence[str]) -> str:
    """Remark that a column may be meant that has a name of its own: one that is spelt alike, else all."""
    close = [name for one in lacking for name in difflib.get_close_matches(one, unknown, n=1, cutoff=0.6)]
    if close:
        hint = f"; perhaps it is the one named {close[0]!r}"
    elif unknown:
        hint = f"; not recognised: {', '.join(map(repr, unknown))}; rename it if it is one of these"
    else:
        return ""
    if any(re.search(r"[\[(/]", name) for name in unknown):
        hint += "; `pneusma import` reads headings with units, and makes a recording of them"
    return hint


def _remark(table: Table, kind: str) -> str:
    """Remark that the columns suggest another kind than the stated one."""
    try:
        other, reason = infer_kind(table)
    except InputError:
        return ""
    return "" if other == kind else f"; its columns look like kind {other} ({reason})"


def _keep(table: Table, name: str) -> np.ndarray:
    try:
        return numbers(table, name)
    except InputError:
        return np.array(table.cells[name])
