"""A table of constants in memory: numbers in internal units that know their unit, origin and uncertainty."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from .keys import other_alloy


@dataclass(frozen=True)
class Prior:
    """Gaussian knowledge of a quantity, cut at `min` and `max`; internal units."""

    mean: float
    sd: float
    min: float = -math.inf
    max: float = math.inf


@dataclass(frozen=True)
class Quantity:
    """One number of a table.

    Attributes:
        name: key in the file; a number in a nested table has a dotted name.
        value: value in the internal unit of its dimension (SI; degC for temperatures).
        unit: the unit of the file, in which it is also written.
        status: `printed` (as published), `corrected` (published wrong, see `docs/corrections.md`),
            `reconstructed` (not published, inferred from what is), `assumed` or `fitted`.
        source: origin of the number.
        prior: uncertainty of the number, or None if it is taken to be exact.
        interval90: ends of the interval that holds it with 90 %, asymmetric where it is; None if nobody says.
    """

    name: str
    value: float
    unit: str
    status: str
    source: str
    prior: Prior | None = None
    interval90: tuple[float, float] | None = None


@dataclass(frozen=True)
class Line:
    """A closed line of vertices.

    Attributes:
        name: key in the file.
        points: the vertices (x, y), counter-clockwise [m].
        unit: unit of length in the file.
        status, source: same as those of a `Quantity`.
    """

    name: str
    points: tuple[tuple[float, float], ...]
    unit: str
    status: str
    source: str


@dataclass(frozen=True)
class Calibration:
    """A table of quantities.

    Attributes:
        name: the name that other files use.
        kind: `alloy`, `silicone` or `actuator`.
        description: one sentence.
        path: path of its file, or None if it was made in memory; equality ignores it.
        quantities: quantities by name, in the file's order.
        text: the other strings: `citation`; `caution`, why its numbers are not to be trusted; `law` of a
            silicone; `material`, `alloy`, `side_1`, ... of a design.
        lines: closed lines by name: `outer_line` and `bore_line` of a design.
    """

    name: str
    kind: str
    description: str
    path: Path | None = field(compare=False)
    quantities: dict[str, Quantity]
    text: dict[str, str] = field(default_factory=dict)
    lines: dict[str, Line] = field(default_factory=dict)

    def values(self) -> dict[str, float]:
        """All values by name, in internal units (SI; degC for temperatures)."""
        return {name: quantity.value for name, quantity in self.quantities.items()}

    def table(self, prefix: str) -> dict[str, float]:
        """Values of one nested table, without its name: `table("standard_tension")["p_1"]`."""
        dotted = prefix + "."
        return {name.removeprefix(dotted): v for name, v in self.values().items() if name.startswith(dotted)}

    def require(self, names: Iterable[str]) -> dict[str, float]:
        """Values of the named quantities.

        Raises:
            InputError: if one of them is not in the table.
        """
        names = list(names)
        for name in names:
            if name not in self.quantities:
                why = other_alloy(name, self.quantities) if self.kind == "alloy" else None
                why = why or f"key {name!r} is needed here, but it is missing"
                raise InputError(f"{self.path or self.name}: {why}")
        return {name: self.quantities[name].value for name in names}
