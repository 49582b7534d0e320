"""Several clocks in one table: columns that were logged at their own times."""

import itertools
from collections.abc import Mapping, Set

import numpy as np

from pneusma_jax.units import UNITS

from ..recordings.columns import convert
from ..recordings.table import unusable
from .grid import Grid
from .parts import Sample
from .spelling import unit_name
from .words import meaning

COUNTS = ("time", "cycle")
"""Quantities that count moments; they are not measured."""
EVEN = 0.01
"""Maximum variation of the difference of two clocks for a constant one, in steps of the first [1]."""


def refuse_several_clocks(sample: Sample, columns: Mapping[str, int]) -> list[str]:
    """Refuse a table whose columns have clocks of their own, so that a row is of several moments.

    Two clocks with quantities between them belong each to the columns on its right. They may differ by a
    constant, or by less than a step. A clock that stands beside another, as that of a cycle does, is another
    count of one time.

    Args:
        sample: the test.
        columns: column by quantity that the user names, from 0. It is measured, whatever its heading says. A
            clock named here holds for all columns.

    Returns:
        Notices about clocks that differ, by a constant or nearly so.

    Raises:
        InputError: if two clocks run differently.
    """
    grid = sample.require_grid()
    if "time" in columns:
        return []
    notices, named = [], {column for quantity, column in columns.items() if quantity not in COUNTS}
    for first, second in itertools.combinations(_clocks(grid), 2):
        if not _quantities_between(grid, first, second, named):
            continue
        one, other = _seconds(grid, first), _seconds(grid, second)
        there = np.isfinite(one) & np.isfinite(other)
        apart = (other - one)[there]
        steps = np.abs(np.diff(one[there]))
        step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        if apart.size < 2 or float(np.abs(apart).max()) <= 0.5 * step:
            continue
        both = " and ".join(f"{grid.headings[c].text!r} (column {c + 1})" for c in (first, second))
        if float(np.ptp(apart)) > step:
            raise unusable(
                sample.raw.path, f"the clocks {both} run up to {np.abs(apart).max():.4g} s apart, so the"
                " values in a row are not of one moment. Bring them to one clock in the file. If one clock is"
                f" right for all columns, name it: --map time={first + 1}",
            )  # fmt: skip
        usual, varied = float(np.median(apart)), float(np.ptp(apart))
        how = f", by up to {varied:.2g} s more in some rows than in others" if varied > EVEN * step else ""
        notices.append(
            f"check: the clocks {both} differ by {usual:.4g} s{how or ' in every row'}; the values in a"
            " row were taken as measured at one moment"
        )
    return notices


def _clocks(grid: Grid) -> list[int]:
    """Columns that hold a clock: in a unit of time, and called a time or never going back."""
    found = []
    for column, heading in enumerate(grid.headings):
        means, values = meaning(heading), grid.values[:, column]
        values = values[np.isfinite(values)]
        unit = UNITS.get(unit_name(heading.unit or "?"))
        if unit is None or unit.dimension != "time" or len(values) < 2:
            continue
        rises = bool(np.all(np.diff(values) >= 0.0) and np.ptp(values) > 0.0)
        if rises if means is None else means.quantity == "time":
            found.append(column)
    return found


def _quantities_between(grid: Grid, first: int, second: int, named: Set[int]) -> bool:
    """True if a measured quantity stands between two columns, and another one after the second.

    Measured are the columns that the user names, and those whose headings name a quantity.
    """
    measured = [
        column
        for column, heading in enumerate(grid.headings)
        if column in named or ((means := meaning(heading)) is not None and means.quantity not in COUNTS)
    ]
    return any(first < c < second for c in measured) and any(c > second for c in measured)


def _seconds(grid: Grid, column: int) -> np.ndarray:
    return convert(grid.values[:, column], unit_name(str(grid.headings[column].unit)), "s")
