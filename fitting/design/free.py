"""The table `[free]` of a study: which dimensions are free, and how they are made."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pneusma_jax.calibration.keys import POSITIVE, QUANTITIES
from pneusma_jax.documents import check_keys, finite_number
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import from_si, to_si

from . import fields
from .bodies import Plan
from .study import CHOICES, Bound, Free

MADE = {
    "continuous": ("from", "to"),
    "steps": ("from", "to", "step"),
    "catalogue": ("values",),
    "integer": ("from", "to"),
}
"""Ways of making a parameter, and the keys of each."""
MOST_VALUES = 10_000


def read_free(table: Any, plans: Sequence[Plan], path: str) -> tuple[Free, ...]:
    """Free dimensions in the order of the file.

    Args:
        table: the table `[free]` as read from TOML.
        plans: plans of every combination of choices; a dimension must belong to all of them.
        path: path of the file, for messages.

    Raises:
        InputError: one line, for a dimension that is not there, crossed bounds, an unknown way of making it.
    """
    table = fields.table_of(table, f"{path}: [free]")
    return tuple(_free(name, entry, table, plans, path) for name, entry in table.items())


def _free(name: str, entry: Any, table: fields.Table, plans: Sequence[Plan], path: str) -> Free:
    where = f"{path}: [free] {name}"
    dimension = _dimension(name, plans, where)
    entry = fields.table_of(entry, where)
    made = fields.word(entry, "made", MADE, where, "continuous")
    check_keys(entry, ("made", "unit", *MADE[made]), where)
    unit = fields.unit_of(entry, dimension, where)
    for key in MADE[made]:
        if key not in entry:
            raise InputError(f"{where}: {key!r} is missing; {made} needs {', '.join(MADE[made])}")
    if made == "catalogue":
        values = _catalogue(entry["values"], where)
    else:
        if made != "continuous" and any(isinstance(entry[k], dict) for k in ("from", "to")):
            raise InputError(
                f"{where}: only a continuous parameter can have a bound that depends on another one"
            )
        low, high = (_bound(entry[key], unit, table, f"{where}: {key}") for key in ("from", "to"))
        values = _values(made, entry, where)
    if made == "catalogue":
        low, high = (Bound(to_si(x, unit)) for x in (values[0], values[-1]))
    if low.parameter is None and high.parameter is None:
        fields.check_ascending(*(from_si(end.value, unit) for end in (low, high)), unit, where)
    plain = _plain(name)
    if (
        (plain in POSITIVE or plain == "connector")
        and low.parameter is None
        and low.value < (plain in POSITIVE) * 1e-12
    ):
        raise InputError(f"{where}: must be positive, but it begins at {from_si(low.value, unit):g} {unit}")
    return Free(name, made, low, high, tuple(to_si(x, unit) for x in values), unit)


def _plain(name: str) -> str:
    """A dimension without its segment."""
    first, _, rest = name.partition(".")
    return rest if first.isdecimal() else name


def _dimension(name: str, plans: Sequence[Plan], where: str) -> str:
    """Kind of quantity of a parameter that all plans have."""
    if name in CHOICES or name == "layout":
        key = "design" if name == "layout" else name
        raise InputError(f'{where}: a choice stands above [free], as {key} = ["..", ".."]')
    plain, known = _plain(name), set.intersection(*(plan.dimensions() for plan in plans))
    chained = all(plan.chain is not None for plan in plans)
    if name == "connector" and chained:
        if any(len(plan.tables) < 2 for plan in plans):
            raise InputError(f"{where}: a chain of one segment has no connector")
        return "length"
    if plain not in known:
        more = ["connector"] if chained else []
        raise InputError(f"{where}: no such dimension of all designs, {nearest(plain, [*known, *more])}")
    if plain != name:
        number = int(name.partition(".")[0])
        if any(not 1 <= number <= len(plan.tables) for plan in plans):
            raise InputError(f"{where}: there is no segment {number} in every design")
    return QUANTITIES["actuator"][plain]


def _bound(value: Any, unit: str, table: fields.Table, where: str) -> Bound:
    if not isinstance(value, dict):
        return Bound(to_si(finite_number(value, where), unit))
    check_keys(value, ("parameter", "times", "plus"), where)
    other = value.get("parameter")
    if not isinstance(other, str) or other not in table:
        raise InputError(f"{where}: parameter {other!r} is not free, {nearest(str(other), table)}")
    times = finite_number(value.get("times", 1.0), f"{where}: times")
    return Bound(to_si(finite_number(value.get("plus", 0.0), f"{where}: plus"), unit), other, times)


def _catalogue(values: Any, where: str) -> list[float]:
    if not isinstance(values, list) or len(values) < 2:
        raise InputError(f"{where}: values must be a list of at least two numbers, but it is {values!r}")
    numbers = sorted(finite_number(x, f"{where}: values") for x in values)
    if any(a == b for a, b in zip(numbers, numbers[1:], strict=False)):
        raise InputError(f"{where}: values has a number twice")
    return numbers


def _values(made: str, entry: fields.Table, where: str) -> list[float]:
    """Values that can be made, in the unit of the file; nothing for a continuous parameter."""
    if made == "continuous":
        return []
    low, high = (finite_number(entry[key], f"{where}: {key}") for key in ("from", "to"))
    step = 1.0 if made == "integer" else finite_number(entry["step"], f"{where}: step")
    if made == "integer" and (low % 1.0 or high % 1.0):
        raise InputError(f"{where}: an integer needs whole bounds, but they are {low:g} and {high:g}")
    if step <= 0.0:
        raise InputError(f"{where}: step must be positive, but it is {step:g}")
    if low < high and (high - low) < step * (1.0 - 1e-9):
        raise InputError(f"{where}: step {step:g} is longer than the range from {low:g} to {high:g}")
    count = int(np.floor((high - low) / step + 1e-9)) + 1
    if count > MOST_VALUES:
        raise InputError(f"{where}: {count} values are too many; take a longer step, or make it continuous")
    return [round(low + k * step, 12) for k in range(max(count, 0))]
