"""Columns without a number and rows without a reading, which an import leaves out."""

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import schema
from ..recordings.table import unusable
from .making import Making
from .texts import MOST_LISTED


def without_empty_rows(
    columns: dict[str, np.ndarray], rows: np.ndarray, making: Making
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns that have numbers, without rows that have the clock alone, and numbers of the other rows.

    Args:
        columns: columns in canonical units; one without any number is removed from them.
        rows: their rows in the file.
        making: the recording that is made.

    Raises:
        InputError: if a required column has no number, or no row is left.
    """
    notices = making.notices
    needed = schema.KINDS[making.kind].columns.required
    for name in [name for name, values in columns.items() if np.isnan(values).all()]:
        if name in needed:
            raise unusable(making.place, f"{name} has no number in it; name its column with --map")
        notices.append(f"{name} has no number in it and was left out")
        del columns[name]
    data = [values for name, values in columns.items() if name != "time_s"]
    empty = np.all([np.isnan(values) for values in data], axis=0)
    if "time_s" in columns:
        untimed = np.isnan(columns["time_s"]) & ~empty
        if 2 * untimed.sum() > untimed.size:
            making.warn(
                f"{untimed.sum()} of {untimed.size} rows have readings and no time, and were left out: fill "
                "the clock in, or take its column out and state the seconds between rows with --interval"
            )
        empty = empty | np.isnan(columns["time_s"])
    if empty.all():
        raise unusable(
            making.place, "no row has a time and a value; is a column named that holds no numbers?"
        )
    if empty.any():
        notices.append(
            f"{counted(int(empty.sum()), 'row')} without a time or without any value left out"
            f" ({_row_numbers(rows[empty])})"
        )
    return {name: values[~empty] for name, values in columns.items()}, rows[~empty]


def _row_numbers(rows: np.ndarray) -> str:
    """Numbers of rows in words: all of a few, else the first ones."""
    numbers = [str(row) for row in rows[:MOST_LISTED]]
    more = f" and {len(rows) - MOST_LISTED} more" if len(rows) > MOST_LISTED else ""
    return f"row{'s' * (len(rows) > 1)} {', '.join(numbers)}{more}"
