"""A question about the unit of a column, and its largest reading."""

from typing import NamedTuple

import numpy as np

MANY_ROWS = 50
"""Minimum number of rows of a test whose clock, or whose low pressure, is asked about."""


class Question(NamedTuple):
    """A question about the unit of a column.

    Attributes:
        quantity: quantity whose stated unit answers the question; empty where none does.
        text: the question, with the unit that fits.
    """

    quantity: str
    text: str


def largest(values: np.ndarray) -> float:
    """Largest reading of a column by size, without gaps."""
    return float(np.nanmax(np.abs(values)))
