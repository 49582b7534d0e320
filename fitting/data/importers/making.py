"""State of an import while the columns of one test become a recording."""

from dataclasses import dataclass, field

import numpy as np

from .options import Options
from .row_ranges import RowRange, option_to_keep
from .sizes import Sizes


@dataclass(frozen=True)
class Channel:
    """One quantity of a raw file.

    Attributes:
        values: numbers, shape (rows,), NaN where blank.
        unit: unit that the file or the user states; None if neither does.
        label: name or number of the raw column.
        zero: reference of a pressure: `"absolute"`, `"gauge"`, or empty where unstated.
        trouble: reason why its numbers are doubtful, a sentence; empty where there is none.
        two_units: the two units that its heading states; empty for one.
        made: derivation from other quantities, in words; empty for a column of the file.
        by_row: true if the file stated its unit row by row.
        column: position of its column in the table, from 0; -1 for a derived channel.
    """

    values: np.ndarray
    unit: str | None
    label: str
    zero: str = ""
    trouble: str = ""
    two_units: tuple[str, ...] = ()
    made: str = ""
    by_row: bool = False
    column: int = -1


@dataclass
class Making:
    """The state of an import.

    Attributes:
        channels: channels by quantity; derived ones are added.
        kind: kind of recording to make.
        options: instructions of the user.
        sizes: dimensions of the specimen that the file states.
        place: name of the file (and test) in messages.
        notices: notices so far.
        sources: quantities that others were derived from.
        raw: quantities that the file itself has.
        zero: standard deviations of the zeros that every fit is to find, by canonical column.
        unrecognised: words about columns of the file that no quantity takes; empty if there are none.
        unread: lines around the table that may state a size and are not read as one.
        clock_counts_rows: true if the file has no clock and nobody states the time between rows.
        called: name of the test, where several are imported at once; else empty.
        kept: rows that the user chose; empty for all.
    """

    channels: dict[str, Channel]
    kind: str
    options: Options
    sizes: Sizes
    place: str
    notices: list[str]
    sources: set[str] = field(default_factory=set)
    raw: frozenset[str] = frozenset()
    zero: dict[str, float] = field(default_factory=dict)
    unrecognised: str = ""
    clock_counts_rows: bool = False
    unread: tuple[str, ...] = ()
    called: str = ""
    kept: tuple[RowRange, ...] = ()

    @property
    def may_state_sizes(self) -> str:
        """The lines that may state a size and are not read as one, as the end of a refusal; else empty."""
        lines = ", ".join(map(repr, self.unread))
        return f"; not read, though they may state a size: {lines}" if lines else ""

    def keep_rows(self, first: int, last: int | None) -> str:
        """The option that keeps the rows of this test from one to another, or to the end."""
        return option_to_keep(self.called, self.kept, first, last)

    def say(self, text: str) -> None:
        """Add a notice about the interpretation."""
        self.notices.append(text)

    def warn(self, text: str) -> None:
        """Add a notice that the user should check."""
        self.notices.append(f"check: {text}")

    def use(self, option: str, name: str = "") -> None:
        """Record that a stated option was used."""
        self.options.used.names.add((option, name))
