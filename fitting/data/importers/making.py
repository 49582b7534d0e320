"""What an import holds while it turns the columns of one test into a recording."""

from dataclasses import dataclass, field

import numpy as np

from .options import Options
from .sizes import Sizes


@dataclass(frozen=True)
class Channel:
    """One quantity of a raw file.

    Attributes:
        values: shape (rows,), NaN where blank.
        unit: as the file or the person states it; None if neither does.
        label: the raw column's own name or number.
        zero: of a pressure: `"absolute"`, `"gauge"`, or nothing where nobody says.
        trouble: why its numbers cannot be trusted, a sentence; empty where they can.
        made: how it was made of others, in words; empty where it is a column of the file.
    """

    values: np.ndarray
    unit: str | None
    label: str
    zero: str = ""
    trouble: str = ""
    made: str = ""


@dataclass
class Making:
    """The state of an import.

    Attributes:
        channels: by quantity; those that are made of others are added.
        kind: of recording to make.
        options: of the person.
        sizes: of the specimen, as the file states them.
        place: file (and test) that messages name.
        notices: what was understood so far.
        sources: quantities that something was made of.
        raw: quantities that the file itself has.
        zero: what every fit is to find of the zeros, one standard deviation by canonical column.
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

    def say(self, text: str) -> None:
        """Add to what was understood."""
        self.notices.append(text)

    def warn(self, text: str) -> None:
        """Add what a person should look at."""
        self.notices.append(f"check: {text}")

    def use(self, option: str, name: str = "") -> None:
        """Record that a stated option was of use."""
        self.options.used.names.add((option, name))
