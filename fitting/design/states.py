"""The tables `[state.NAME]` of a study: pressures and fractions, given or free."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from pneusma_jax.documents import finite_number
from pneusma_jax.errors import InputError, nearest

from . import fields
from .bodies import Plan
from .study import Bound, Free, State

PRESSURES = (-100e3, 1000e3)
"""Range of gauge pressures [Pa], as `simulate` takes them."""
_FRACTION = re.compile(r"xi0_(\d+)")
_SEGMENT = re.compile(r"segment_(\d+)")


def read_states(table: Any, plans: Sequence[Plan], path: str) -> tuple[dict[str, State], list[Free]]:
    """States by name, and the drives that are free.

    Raises:
        InputError: one line, for a spring that no design has, an impossible pressure or fraction.
    """
    reader, states = _Reader(plans), {}
    for name, entry in fields.table_of(table, f"{path}: [state]").items():
        where = f"{path}: [state.{name}]"
        if not re.fullmatch(r"[A-Za-z_]\w*", name):
            raise InputError(f"{where}: a state's name is made of letters, digits and underscores")
        states[name] = reader.state(name, fields.table_of(entry, where), where)
    return states, reader.free


@dataclass(frozen=True)
class _Reader:
    """Reader of states, which collects the drives that are free.

    Attributes:
        plans: designs of the study.
        free: free drives so far.
    """

    plans: Sequence[Plan]
    free: list[Free] = field(default_factory=list)

    def state(self, name: str, entry: fields.Table, where: str) -> State:
        """One state."""
        if "pressure" not in entry:
            raise InputError(f"{where}: 'pressure' is missing")
        pressure = self._pressure(name, entry["pressure"], where)
        fractions: dict[tuple[int, int], float | None] = {}
        for key, value in entry.items():
            if key == "pressure":
                continue
            if found := _SEGMENT.fullmatch(key):
                at = f"{where} {key}"
                inner = fields.table_of(value, at)
                fractions |= dict(self._fraction(name, own, x, int(found[1]), at) for own, x in inner.items())
            else:
                spring, fraction = self._fraction(name, key, value, 0, where)
                fractions[spring] = fraction
        return State(name, pressure, fractions)

    def _pressure(self, name: str, value: Any, where: str) -> float | None:
        """Gauge pressure [Pa]; None where it is free."""
        free = isinstance(value, dict) and "from" in value
        if free:
            low, high, unit = fields.span(value, "pressure", f"{where} pressure")
            self.free.append(Free(f"{name}.pressure", "continuous", Bound(low), Bound(high), (), unit))
        else:
            low, _ = fields.quantity(value, "pressure", f"{where} pressure")
            high = low
        if not PRESSURES[0] < low <= high < PRESSURES[1]:
            raise InputError(f"{where} pressure must be a gauge pressure between -100 and 1000 kPa")
        return None if free else low

    def _fraction(
        self, name: str, key: str, value: Any, segment: int, where: str
    ) -> tuple[tuple[int, int], float | None]:
        """Segment (0 for every one) and number of a spring, and its fraction [1]; None where it is free."""
        found = _FRACTION.fullmatch(key)
        if found is None:
            raise InputError(
                f"{where}: unknown key {key!r}, {nearest(key, ('pressure', 'xi0_1', 'xi0_2', 'segment_1'))}"
            )
        number = int(found[1])
        springs = {pair for plan in self.plans for pair in plan.springs}
        if not any(n == number and segment in (0, k) for k, n in springs):
            raise InputError(
                f"{where}: no design has a spring {number}" + (f" in segment {segment}" if segment else "")
            )
        if isinstance(value, dict):
            low, high, _ = fields.span(value, "number", f"{where} {key}")
            own = f"{segment}." if segment else ""
            self.free.append(
                Free(f"{name}.xi0_{own}{number}", "continuous", Bound(low), Bound(high), (), "1")
            )
        else:
            low = high = finite_number(value, f"{where} {key}")
        if not 0.0 <= low <= high <= 1.0:
            raise InputError(f"{where} {key} must be a martensite fraction from 0 (hot) to 1 (cold)")
        return (segment, number), None if isinstance(value, dict) else low
