"""The tables `[state.NAME]` of a study: pressures and fractions, given or free."""

import re
from collections.abc import Sequence
from typing import Any

from pneusma_jax.documents import finite_number
from pneusma_jax.errors import InputError, nearest

from . import fields
from .bodies import Plan
from .study import Bound, Free, State

PRESSURES = (-100e3, 1000e3)  # Pa, as `simulate` takes them
_FRACTION = re.compile(r"xi0_(\d+)")
_SEGMENT = re.compile(r"segment_(\d+)")


def read_states(table: Any, plans: Sequence[Plan], path: str) -> tuple[dict[str, State], list[Free]]:
    """States by name, and the drives that are free.

    Raises:
        InputError: one line, for a spring that no design has, an impossible pressure or fraction.
    """
    states, free = {}, []
    for name, entry in fields.table_of(table, f"{path}: [state]").items():
        where = f"{path}: [state.{name}]"
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            raise InputError(f"{where}: a state's name is made of letters, digits and underscores")
        states[name] = _state(name, fields.table_of(entry, where), plans, where, free)
    return states, free


def _state(name: str, entry: fields.Table, plans: Sequence[Plan], where: str, free: list[Free]) -> State:
    if "pressure" not in entry:
        raise InputError(f"{where}: 'pressure' is missing")
    pressure = _pressure(name, entry["pressure"], where, free)
    fractions: dict[tuple[int, int], float | None] = {}
    for key, value in entry.items():
        if key == "pressure":
            continue
        if found := _SEGMENT.fullmatch(key):
            inner = fields.table_of(value, f"{where} {key}")
            for own, x in inner.items():
                _fraction(name, own, x, int(found[1]), plans, f"{where} {key}", fractions, free)
            continue
        _fraction(name, key, value, 0, plans, where, fractions, free)
    return State(name, pressure, fractions)


def _pressure(name: str, value: Any, where: str, free: list[Free]) -> float | None:
    if isinstance(value, dict) and "from" in value:
        low, high, unit = fields.span(value, "pressure", f"{where} pressure")
        free.append(Free(f"{name}.pressure", "continuous", Bound(low), Bound(high), (), unit))
        ends = (low, high)
    else:
        pressure, _ = fields.quantity(value, "pressure", f"{where} pressure")
        ends = (pressure, pressure)
    if not PRESSURES[0] < ends[0] <= ends[1] < PRESSURES[1]:
        raise InputError(f"{where} pressure must be a gauge pressure between -100 and 1000 kPa")
    return None if isinstance(value, dict) and "from" in value else ends[0]


def _fraction(
    name: str, key: str, value: Any, segment: int, plans: Sequence[Plan], where: str,
    fractions: dict[tuple[int, int], float | None], free: list[Free],
) -> None:  # fmt: skip
    found = _FRACTION.fullmatch(key)
    if found is None:
        raise InputError(
            f"{where}: unknown key {key!r}, {nearest(key, ('pressure', 'xi0_1', 'xi0_2', 'segment_1'))}"
        )
    number = int(found[1])
    springs = {pair for plan in plans for pair in plan.springs}
    if not any(n == number and segment in (0, k) for k, n in springs):
        raise InputError(
            f"{where}: no design has a spring {number}" + (f" in segment {segment}" if segment else "")
        )
    own = f"{segment}." if segment else ""
    if isinstance(value, dict):
        low, high, _ = fields.span(value, "number", f"{where} {key}")
        free.append(Free(f"{name}.xi0_{own}{number}", "continuous", Bound(low), Bound(high), (), "1"))
    else:
        low = high = finite_number(value, f"{where} {key}")
    if not 0.0 <= low <= high <= 1.0:
        raise InputError(f"{where} {key} must be a martensite fraction from 0 (hot) to 1 (cold)")
    fractions[segment, number] = None if isinstance(value, dict) else low
