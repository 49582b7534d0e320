"""Refusal of the first value of a column that cannot be, with the unit that may be meant."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneusma_jax.units import find_unit

from . import schema
from .recording import Recording
from .table import unusable


def refuse_first(
    bad: np.ndarray, values: np.ndarray, right: str, place: Path | str, rows: Sequence[int], name: str,
    ends: tuple[float, float] | None = None,
) -> None:  # fmt: skip
    """Refuse the first bad value. Where its ends are given, a unit that may be meant is asked about."""
    found = np.flatnonzero(bad)
    if found.size:
        i = int(found[0])
        asked = "" if ends is None else f"; {_right_unit(name, float(values[i]), ends)}"
        raise unusable(place, f"{values[i]:g} cannot be: {right}{asked}", rows[i], name)


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
        refuse_first((values < ends[0]) | (values > ends[1]), values, right, place, rows, name, ends)
