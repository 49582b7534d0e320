"""Columns of a file that become no quantity: named one by one, and compared where they have one heading."""

import numpy as np

from .grid import Grid
from .making import Channel
from .words import meaning


def say_aside(grid: Grid, channels: dict[str, Channel]) -> list[str]:
    """Notices about the columns that no channel takes.

    A column whose heading names the same as that of a taken one is compared with it.
    """
    taken = {channel.column: quantity for quantity, channel in channels.items()}
    notices, aside = [], []
    for column, heading in enumerate(grid.headings):
        if column in taken or column - 1 in grid.by_row or not heading.text.strip():
            continue
        twin = next((other for other in taken if other >= 0 and _same_name(grid, column, other)), None)
        if twin is None:
            aside.append(repr(heading.text))
        else:
            notices.append(_compared(grid, column, twin, taken[twin]))
    if aside:
        notices.append(f"columns left aside: {', '.join(aside)} (--map QUANTITY=COLUMN takes one)")
    return notices


def _same_name(grid: Grid, column: int, other: int) -> bool:
    first, second = grid.headings[other], grid.headings[column]
    if first.text.casefold() == second.text.casefold():
        return True
    means = meaning(first), meaning(second)
    return None not in means and means[0] == means[1] and first.unit == second.unit


def _compared(grid: Grid, column: int, other: int, quantity: str) -> str:
    """Notice about two columns with one heading."""
    first, second = grid.values[:, other], grid.values[:, column]
    both = f"{grid.headings[column].text!r} (column {column + 1}) is named as column {other + 1}"
    there = np.isfinite(first) & np.isfinite(second)
    if not np.isfinite(second).any():
        return f"{both}, but has no number in it, and was left aside"
    apart = float(np.abs(first - second)[there].max()) if there.any() else float("nan")
    if apart == 0.0 and np.array_equal(np.isfinite(first), np.isfinite(second)):
        return f"{both} and repeats it: left aside"
    how = f"differs from it by up to {apart:.4g}" if there.any() else "is filled in other rows"
    return (
        f"check: {both} and {how}: column {other + 1} was taken; --map {quantity}={column + 1} takes the"
        " other"
    )
