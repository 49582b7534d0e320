"""Tables of a sidecar about columns: constant columns, noise, zeros that a fit finds."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneusma_jax.errors import InputError, nearest

from . import schema
from .columns import convert, written_unit
from .recording import Recording
from .sidecar import finite_number
from .table import unusable


def zeros(table: Mapping[str, float], kind: str, where: Path | str, strict: bool = True) -> dict[str, float]:
    """Standard deviations of zeros that a fit is to find, by canonical column in its unit.

    Args:
        table: standard deviation by column, in any unit of that column's dimension.
        kind: kind of the recording, which decides which columns are known.
        where: file that messages name.
        strict: true to refuse a kind whose zeros no fit finds; false to return none.

    Raises:
        InputError: for an unknown column or unit, a repeated one, or a kind without such zeros.
    """
    columns = schema.KINDS[kind].zeros
    if not columns and table and strict:
        raise unusable(
            where, f"[zero] is for recordings of kind {', '.join(schema.with_zeros())}; of kind {kind} take a"
            " zero off on import, with --subtract",
        )  # fmt: skip
    found: dict[str, float] = {}
    for key, value in table.items() if columns else ():
        canonical, unit = _column_of(key, columns, "zero", where)
        if canonical in found:
            raise unusable(where, f"[zero] {key} is there twice, in two units; keep one")
        wanted = schema.quantity_and_unit(canonical)[1]
        found[canonical] = float(convert(value, unit, wanted, difference=True))
    return found


def constants(
    table: Mapping[str, float], kind: str, where: Path | str, shared: Mapping[str, float]
) -> dict[str, float]:
    """Values of constant columns, by canonical column in its unit.

    Args:
        table: value by column, from the recording's sidecar, in any unit of that column's dimension.
        kind: kind of the recording, which decides which columns are known.
        where: file that messages name.
        shared: table of the campaign; columns that the kind does not have are ignored.

    Raises:
        InputError: for an unknown column or unit, or a column that is there twice.
    """
    found: dict[str, float] = {}
    for source, strict in ((shared, False), (table, True)):
        seen = set()
        for key, value in source.items():
            columns = schema.KINDS[kind].columns.known
            if not strict and not any(key.startswith(schema.quantity_and_unit(name)[0]) for name in columns):
                continue
            canonical, unit = _column_of(key, columns, "constant", where)
            if canonical in seen:
                raise unusable(where, f"[constant] {key} is there twice, in two units; keep one")
            seen.add(canonical)
            found[canonical] = float(convert(value, unit, schema.quantity_and_unit(canonical)[1]))
    return found


def check_shared(campaign: Mapping[str, Any], where: Path | str) -> None:
    """Check that [constant], [noise] and [zero] of a campaign name columns that some kind of recording has.

    Args:
        campaign: checked settings of a campaign.
        where: file that messages name.

    Raises:
        InputError: for a column that no kind has, a unit that is not its own, a column that is there twice,
            or a noise that is no number above zero. An input of some kind may be exact.
    """
    kinds = schema.KINDS.values()
    columns = tuple(dict.fromkeys(name for kind in kinds for name in kind.columns.known))
    for key, value in campaign.get("noise", {}).items():
        exact = any(
            schema.names_quantity(key, name)
            for kind in kinds
            for name in kind.columns.known
            if name not in kind.columns.outputs
        )
        _positive_noise(key, value, where, or_zero=exact)
    known = {
        "constant": columns,
        "noise": columns,
        "zero": tuple(dict.fromkeys(name for kind in kinds for name in kind.zeros)),
    }
    for section, names in known.items():
        seen = set()
        for key in campaign.get(section, {}):
            canonical, _ = _column_of(key, names, section, where)
            if canonical in seen:
                raise unusable(where, f"[{section}] {key} is there twice, in two units; keep one")
            seen.add(canonical)


def unused(campaign: Mapping[str, Any], recordings: Sequence[Recording]) -> list[str]:
    """Sentences about [constant], [noise] and [zero] of a campaign that none of its recordings uses.

    Args:
        campaign: checked settings of a campaign.
        recordings: recordings of the campaign, read with these settings.
    """
    said = []
    for key, value in campaign.get("constant", {}).items():
        if not any(_is_constant(recording, key, value) for recording in recordings):
            said.append(
                f"[constant] {key}: no recording uses it; each has a column of it, or is of a kind without"
            )
    for key, value in campaign.get("noise", {}).items():
        if not any(_is_noise(recording, key, value) for recording in recordings):
            said.append(f"[noise] {key}: no recording uses it; each states its own, or has no such column")
    for key in campaign.get("zero", {}):
        if not any(
            key == name or key.startswith(f"{schema.quantity_and_unit(name)[0]}_")
            or key == schema.quantity_and_unit(name)[0]
            for recording in recordings
            for name in recording.zero
        ):  # fmt: skip
            kinds = ", ".join(schema.with_zeros())
            said.append(f"[zero] {key}: no recording uses it; fits find zeros of recordings of kind {kinds}")
    return said


def _is_constant(recording: Recording, key: str, value: float) -> bool:
    """True if a recording has a column with this stated value in every row."""
    found = constants({}, recording.kind, recording.name, {key: value})
    return any(
        name in recording.columns and np.all(recording.columns[name] == stated)
        for name, stated in found.items()
    )


def shared_noise(
    table: Mapping[str, float], kind: str, present: Iterable[str], where: Path | str
) -> dict[str, float]:
    """Standard deviations that a campaign states for columns that a recording has, by canonical column.

    Args:
        table: checked [noise] of the campaign.
        kind: kind of the recording.
        present: columns of the recording.
        where: file that messages name.
    """
    present = set(present)
    columns = tuple(name for name in schema.KINDS[kind].columns.known if name in present)
    own = {
        key: value
        for key, value in table.items()
        if any(schema.names_quantity(key, name) for name in columns)
    }
    return check_noise(own, kind, [], where)


def _is_noise(recording: Recording, key: str, value: float) -> bool:
    """True if a recording has this stated noise of a campaign."""
    found = shared_noise({key: value}, recording.kind, recording.columns, recording.name)
    return any(recording.noise.get(name) == stated for name, stated in found.items())


def _column_of(key: str, columns: tuple[str, ...], section: str, where: Path | str) -> tuple[str, str]:
    """Canonical column and written unit of a key of a section."""
    for canonical in columns:
        if schema.names_quantity(key, canonical):
            try:
                return canonical, written_unit(key, canonical)
            except InputError as error:
                raise unusable(where, f"[{section}] {key}: {error}") from None
    raise unusable(where, f"unknown column {key!r} in [{section}], {nearest(key, columns)}")


def _positive_noise(key: str, value: Any, where: Path | str, or_zero: bool = False) -> float:
    """A standard deviation of a [noise] table."""
    number = finite_number(value, f"[noise] {key}", where)
    if number < 0.0 or (number == 0.0 and not or_zero):
        raise unusable(
            where, f"[noise] {key} = {number:g} must be more than 0; leave it out to have it estimated"
        )
    return number


def check_noise(table: Mapping[str, Any], kind: str, extra: list[str], where: Path | str) -> dict[str, float]:
    """Check the [noise] table of a recording of a known kind.

    Args:
        table: standard deviation by column, in any unit of that column's dimension.
        kind: kind of the recording, which decides which columns are known.
        extra: columns of the file that the kind does not know; their noise is kept unchanged.
        where: file that messages name.

    Returns:
        Standard deviation by canonical column, in its unit.

    Raises:
        InputError: for an unknown column or unit, or a number that is not more than zero (an input may have
            zero).
    """
    rules = schema.KINDS[kind].columns
    checked: dict[str, float] = {}
    for key, value in table.items():
        canonical, unit = (key, "1") if key in extra else _noise_column(key, rules.known, where)
        number = _positive_noise(key, value, where, or_zero=canonical not in rules.outputs)
        if canonical in checked:
            raise unusable(where, f"[noise] {key} is there twice, in two units; keep one")
        wanted = "1" if key in extra else schema.quantity_and_unit(canonical)[1]
        checked[canonical] = convert(number, unit, wanted, difference=True)
    return checked


def _noise_column(key: str, columns: tuple[str, ...], where: Path | str) -> tuple[str, str]:
    if key in columns:
        return key, schema.quantity_and_unit(key)[1]
    quantity = key.rpartition("_")[0]
    for canonical in columns:
        expected, _ = schema.quantity_and_unit(canonical)
        if key == expected or quantity == expected:
            try:
                return canonical, written_unit(key, canonical)
            except InputError as error:
                raise unusable(where, f"[noise] {key}: {error}") from None
    raise unusable(where, f"unknown column {key!r} in [noise], {nearest(key, columns)}")
