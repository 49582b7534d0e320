"""Questions about rows that a column of the file marks as no readings: `Status`, `Valid`, `Flag`."""

import re
from collections import Counter

from pneusma_jax.errors import counted

from .grid import Grid
from .making import Making

_NAMES = re.compile(
    r"(?:\w+ )?(?:status|valid(?:ity)?|flags?|errors?|err|quality|ok|good|alarm|overload|overrange|"
    r"gültig|fehler|fehlercode|statut|erreur|stato|errore)(?: code| flag| bit)?"
)
"""Headings of a column that marks rows."""
RARE = 0.25
"""Maximum share of the rows under another mark, to ask about these. More are phases of a test."""
MOST_ROWS = 5
"""Maximum number of rows that a question lists."""


def question_status(grid: Grid, making: Making) -> None:
    """Ask about rows that a column of marks sets apart from most others.

    Args:
        grid: table of the test.
        making: state of the import; questions are added to its notices.
    """
    taken = {channel.column for channel in making.channels.values()}
    for column, heading in enumerate(grid.headings):
        if column in taken or heading.unit is not None or not _NAMES.fullmatch(heading.name):
            continue
        marks = [text.strip() for text in grid.texts(column)]
        (usual, _), *others = Counter(marks).most_common()
        rows = [row for row, mark in zip(grid.rows, marks, strict=True) if mark != usual]
        if not others or len(rows) > RARE * len(marks):
            continue
        words = ", ".join(repr(mark) for mark, _ in others[:3])
        listed = ", ".join(map(str, rows[:MOST_ROWS])) + (", ..." if len(rows) > MOST_ROWS else "")
        making.warn(
            f"{heading.text!r} is {words} in {counted(len(rows), 'row')} ({listed}), and {usual!r} in all"
            " others: are these no readings? They were kept; --rows leaves them out"
        )
