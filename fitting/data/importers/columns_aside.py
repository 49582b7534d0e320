"""Notices about columns of a file that the import leaves aside.

A column may be left aside because another one was taken for the same quantity. Then both are compared. It may
be in a unit of another quantity, or be a clock that nothing says to be one. All others are only named.
"""

import shlex

import numpy as np

from pneusma_jax.units import UNITS

from .dates import in_order, may_be_clock, names_a_unit_of_time, since_1970
from .grid import Grid
from .making import Channel
from .other_headings import quantity_of_other_unit
from .spelling import dimension, unit_name
from .words import meaning

OF_SEVERAL_THINGS = ("time", "cycle", "temperature")
"""Quantities of which a file often has columns about different things."""
_STRAINS = frozenset({"strain", "stretch", "true_strain"})
LAST_DIGITS = 1.5
"""Maximum difference between two columns of one measurement, in units of their last written digit [1]. A
program rounds each by itself, so that they differ by one."""
ROUNDING = 0.005
"""Maximum difference between one measurement in two units, as part of its largest value [1]."""


def notices_of_columns_aside(grid: Grid, channels: dict[str, Channel]) -> list[str]:
    """Notices about the columns that no channel takes.

    A column whose heading names the same as that of a taken one is compared with it. One without a heading is
    named by its number, unless it holds no number.

    Args:
        grid: the table of the file.
        channels: channels by quantity.
    """
    taken = {channel.column: quantity for quantity, channel in channels.items() if channel.column >= 0}
    notices, aside, bare = [], [], []
    for column in range(grid.values.shape[1]):
        holds_units = column - 1 in grid.by_row  # of the column before it
        if column in taken or column in grid.read_along or holds_units:
            continue
        if not grid.headings or not grid.headings[column].text.strip():
            bare += [column] if np.isfinite(grid.values[:, column]).any() else []
            continue
        if (twin := next((one for one in taken if _same_name(grid, column, one)), None)) is not None:
            notices.append(_compared(grid, column, twin, taken[twin]))
        elif (other := next((one for one in taken if _named_alike(grid, column, one)), None)) is not None:
            unused = taken[other] == "elongation" and not _STRAINS.isdisjoint(channels)
            if unused:  # strain has a column of its own, so that no elongation makes it
                aside.append(column)
            else:
                notices.append(_one_of_two(grid, column, other, taken[other]))
        elif notice := _of_other_unit(grid, column, channels):
            notices.append(notice)
        else:
            aside.append(column)
    clocks = {} if "time" in channels else {c: notice for c in aside if (notice := _perhaps_clock(grid, c))}
    notices += clocks.values()
    unused = [c for c in bare if c in grid.clocks and "time" not in channels]
    several = f"it is one of {len(unused)}"
    alone = "its heading is missing" if grid.headings else "--interval states the time between rows"
    why = several if unused[1:] else alone
    notices += [
        f"check: column {c + 1} was read as a clock and left aside, as {why}: --map time={c + 1} takes it"
        for c in unused
    ]
    bare = [c for c in bare if c not in unused]
    heats = [c for c in aside if "pressure" in channels and _is_of_a_spring(grid, c)]
    if heats and not any(name.startswith("resistance") for name in channels):
        labels = ", ".join(repr(grid.headings[c].text) for c in heats)
        notices.append(
            f"check: {labels} may be of springs, but of which is not said, so that these are taken as cold:"
            " --map resistance_1=... --map resistance_2=..., of the spring at side 1 and of the other"
        )
        aside = [c for c in aside if c not in heats]
    rest = [repr(grid.headings[c].text) for c in aside if c not in clocks]
    rest += [f"column {c + 1}, which has no heading" if grid.headings else f"column {c + 1}" for c in bare]
    if rest:
        notices.append(f"columns left aside: {', '.join(rest)} (--map QUANTITY=COLUMN takes one)")
    return notices


def _of_other_unit(grid: Grid, column: int, channels: dict[str, Channel]) -> str:
    """Notice about a column that is named like a quantity and in a unit of another one; empty otherwise."""
    heading = grid.headings[column]
    quantity = quantity_of_other_unit(heading)
    if quantity is None or np.isnan(grid.values[:, column]).all():
        return ""
    measured, taken = dimension(heading.unit), channels.get(quantity)
    if taken is not None and measured is None:
        return ""
    if heading.unit is None:
        unit = "it states no unit"
    else:
        unit = f"{heading.unit} is " + (f"a unit of {measured}" if measured else "not a known unit")
    option = f"--map {quantity}={shlex.quote(heading.text)} --unit {quantity}=..."
    other = f", and {taken.label!r} taken" if taken else f". If it is {quantity}: {option}"
    return f"check: {heading.text!r} reads like {quantity}, but {unit}: it was left aside{other}"


def _is_of_a_spring(grid: Grid, column: int) -> bool:
    """True if a column left aside is in a unit of resistance and holds numbers."""
    values = grid.values[:, column]
    return dimension(grid.headings[column].unit) == "resistance" and bool(np.isfinite(values).any())


def _perhaps_clock(grid: Grid, column: int) -> str:
    """Notice about a column that may be the missing clock, by its heading or its numbers; empty otherwise."""
    heading, values = grid.headings[column], grid.values[:, column]
    epoch = since_1970(values)
    epoch = epoch if epoch is not None and in_order(values) else None
    unit_in_name = unit_name(heading.name) if names_a_unit_of_time(heading) else ""
    if not epoch and not unit_in_name and not may_be_clock(heading):
        return ""
    likely = unit_name(epoch[1]) if epoch else unit_in_name
    unit = f" --unit time={likely}" if likely in UNITS and heading.unit is None else ""
    counts = f" (its numbers may count {epoch[1]} since 1970)" if epoch else ""
    return (
        f"check: {heading.text!r} was left aside, and nothing else is a clock{counts}: if it is one, --map"
        f" time={shlex.quote(heading.text)}{unit}"
    )


def _same_name(grid: Grid, column: int, other: int) -> bool:
    """True if two headings are the same, or mean the same in units of one dimension."""
    first, second = grid.headings[other], grid.headings[column]
    if first.text.casefold() == second.text.casefold():
        return True
    means = meaning(first), meaning(second)
    if None in means or means[0] != means[1]:
        return False
    return first.unit == second.unit or _factor(first.unit, second.unit) is not None


def _named_alike(grid: Grid, column: int, other: int) -> bool:
    """True if two headings name one quantity, and differ by a number (`Strain 1`, `Strain 2`) or by a word.

    Clocks, cycles and temperatures whose names have further words are about different things, as in `Step
    time` and `Oven temperature`. They are not alike.
    """
    one, two = (meaning(grid.headings[c]) for c in (column, other))
    if one is None or two is None or one.quantity != two.quantity or np.isnan(grid.values[:, column]).all():
        return False
    units = [grid.headings[c].unit for c in (other, column)]
    same = units[0] == units[1] or _factor(*units) is not None
    return same and (one.rank == two.rank or one.quantity not in OF_SEVERAL_THINGS)


def _one_of_two(grid: Grid, column: int, other: int, quantity: str) -> str:
    """Notice about a column whose heading differs by a number or a word from that of a taken one.

    Args:
        grid: the table.
        column: position of the column that is left aside.
        other: position of the taken one.
        quantity: what it is taken for.
    """
    first, second = grid.values[:, other], grid.values[:, column]
    units = [grid.headings[c].unit for c in (other, column)]
    second = second if units[0] == units[1] else (_factor(*units) or 1.0) * second
    there = np.isfinite(first) & np.isfinite(second)
    labels = [repr(grid.headings[c].text) for c in (column, other)]
    largest = np.abs(first - second)[there].max() if there.any() else np.nan
    rounded = min(LAST_DIGITS * max(map(_last_digit, (first, second))), ROUNDING * np.nanmax(np.abs(first)))
    if largest <= rounded:
        return f"{labels[0]} agrees with {labels[1]} to the last written digit, and was left aside"
    differs = f", from which it differs by up to {largest:.4g}" if there.any() else ""
    return (
        f"check: {labels[0]} was left aside, and {labels[1]} taken{differs}. --map {quantity}={column + 1}"
        " takes the other. A mean of both needs a column of its own"
    )


def _last_digit(values: np.ndarray) -> float:
    """One unit of the last written digit of a column, by its smallest step; 0 where all numbers are equal."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(steps.min()) if steps.size else 0.0


def _factor(unit: str | None, other: str | None) -> float | None:
    """Factor by which a value in `other` becomes one in `unit`; None if there is no such factor."""
    names = [unit_name(text or "?") for text in (other, unit)]
    units = [UNITS.get(name) for name in names]
    if None in units or units[0].dimension != units[1].dimension or units[0].dimension == "temperature":
        return None
    return units[0].factor / units[1].factor


def _compared(grid: Grid, column: int, other: int, quantity: str) -> str:
    """Notice about two columns with one heading; arguments as for `_one_of_two`."""
    first, second = grid.values[:, other], grid.values[:, column]
    units = [grid.headings[c].unit for c in (other, column)]
    both = f"{grid.headings[column].text!r} (column {column + 1}) is named as column {other + 1}"
    there = np.isfinite(first) & np.isfinite(second)
    if not np.isfinite(second).any():
        return f"{both}, but has no number in it, and was left aside"
    took = f"column {other + 1} was taken; --map {quantity}={column + 1} takes the other"
    factor = 1.0 if units[0] == units[1] else _factor(*units)
    if factor is None:
        stated = [f"column {c + 1} is in {u}" if u else f"column {c + 1} states no unit"
                  for c, u in zip((other, column), units, strict=True)]  # fmt: skip
        return f"check: {both} and was not compared, since {' and '.join(stated)}: {took}"
    second = factor * second
    largest = float(np.abs(first - second)[there].max()) if there.any() else float("nan")
    rounding = ROUNDING * float(np.abs(first[there]).max()) if there.any() and units[0] != units[1] else 0.0
    if largest <= rounding and np.array_equal(np.isfinite(first), np.isfinite(second)):
        return f"{both} and repeats it: left aside"
    how = f"differs from it by up to {largest:.4g}" if there.any() else "is filled in other rows"
    return f"check: {both} and {how}: {took}"
