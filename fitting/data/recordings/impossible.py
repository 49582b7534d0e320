"""Refusal of the first value of a column that cannot be, with the unit that may be meant."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneusma_jax.units import amount, find_unit

from . import schema
from .columns import convert
from .recording import Recording
from .table import unusable


def refuse_first(
    bad: np.ndarray, recording: Recording, right: str, place: Path | str, rows: Sequence[int], name: str,
    ends: tuple[float, float] | None = None,
) -> None:  # fmt: skip
    """Refuse the first bad value of a column, as the file has it. A unit that may be meant is asked about.

    Args:
        bad: true for values that cannot be, shape (rows,).
        recording: recording that has the column.
        right: what would be right, in words.
        place, rows, name: file, line number of each sample, and canonical column.
        ends: least and largest number that can be; None where no unit is to be asked about.

    Raises:
        InputError: if there is a bad value; with row and column.
    """
    found = np.flatnonzero(bad)
    if found.size:
        i = int(found[0])
        value = float(recording.columns[name][i])
        asked = "" if ends is None else f"; {_right_unit(name, value, ends)}"
        told = _as_written(recording, name, value)
        raise unusable(place, f"{told} cannot be: {right}{asked}", rows[i], name)


def _as_written(recording: Recording, name: str, value: float) -> str:
    """A value as the file has it, with the canonical one where that is another."""
    unit, off = recording.written.get(name, ("", 0.0))
    own = schema.quantity_and_unit(name)[1]
    if not unit or not np.isfinite(value) or (find_unit(unit) == find_unit(own) and not off):
        return f"{value:g}"
    number = convert(np.array(value + off), unit=own, wanted=unit)
    less = f" less {amount(f'{off:g}', own)}" if off else ""
    return f"{amount(f'{float(number):.6g}', unit)}{less}, that is {amount(f'{value:g}', own)},"


MEANT = {
    "A": ("mA", "uA"), "ohm": ("mohm", "kohm"), "N": ("mN", "kN", "gf", "uN"), "mm": ("um", "cm", "in", "m"),
}  # fmt: skip
"""Units that a column's numbers may rather be in, by the unit of the column, the most usual first."""


def _right_unit(name: str, value: float, ends: tuple[float, float]) -> str:
    """Question after a magnitude that cannot be, with a unit in which it could be, if there is one."""
    quantity, unit = schema.quantity_and_unit(name)
    size = {other: value * find_unit(other).factor / find_unit(unit).factor for other in MEANT.get(unit, ())}
    other = next((one for one, number in size.items() if ends[0] <= number <= ends[1]), None)
    sizes = "" if unit == "A" else ", are the sizes"
    example = f" (such as {other}: {quantity}_{other} heads the column, or on import --unit"
    example += f" {quantity}={other})"
    return f"is its unit right{example if other else ''}{sizes}?"


def refuse_beyond(
    recording: Recording, name: str, ends: tuple[float, float], right: str, place: Path | str,
    rows: Sequence[int],
) -> None:  # fmt: skip
    """Refuse the first value of a column beyond its ends, if the recording has this column."""
    if name in recording.columns:
        values = recording.columns[name]
        refuse_first((values < ends[0]) | (values > ends[1]), recording, right, place, rows, name, ends)
