"""Every figure of the source that the model can draw, in the source's order."""

from . import (
    configurations,
    detwinning,
    heating,
    isoresistive,
    loading,
    pneuflex,
    pressure_sweeps,
    reach,
    residual,
    resistances,
    resistivity,
    silicone_laws,
    silicone_tests,
    spring_strain,
    stretched,
)
from .entry import Entry
from .statement import Statement

_THEMES = (
    spring_strain,
    resistivity,
    stretched,
    detwinning,
    isoresistive,
    loading,
    residual,
    silicone_tests,
    silicone_laws,
    configurations,
    pneuflex,
    resistances,
    heating,
    pressure_sweeps,
    reach,
)


def _order(number: str) -> tuple[int, ...]:
    """Chapter and running number."""
    return tuple(int(part) for part in number.split("."))


ENTRIES: tuple[Entry, ...] = tuple(
    sorted((entry for theme in _THEMES for entry in theme.ENTRIES), key=lambda entry: _order(entry.number))
)


def statements() -> list[Statement]:
    """All statements, figure by figure."""
    return [statement for entry in ENTRIES for statement in entry.statements]


def _check() -> None:
    """Check that each number names one figure or one statement.

    Raises:
        ValueError: if it names two.
    """
    for numbers in ([e.number for e in ENTRIES], [s.number for s in statements()]):
        twice = sorted({n for n in numbers if numbers.count(n) > 1})
        if twice:
            raise ValueError(f"Numbers of figures and statements must be unique, but {twice} are not.")


_check()
