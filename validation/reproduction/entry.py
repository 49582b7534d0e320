"""A figure of the source as data: its content, our drawing, and the statements of the text."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from .bench import Bench
from .statement import Statement


@dataclass(frozen=True)
class Entry:
    """One figure of the source.

    Attributes:
        number: number in the source, such as `"2.5"`.
        title: content, in our words.
        where: section of the source.
        draw: function that makes our figure.
        caption: caption of our drawing.
        lost: part of the source's figure that cannot be compared, because only its text has survived; or
            empty.
        statements: statements about it.
    """

    number: str
    title: str
    where: str
    draw: Callable[[Bench], Figure]
    caption: str
    lost: str
    statements: tuple[Statement, ...]

    def __post_init__(self) -> None:
        for statement in self.statements:
            if statement.number.rpartition("-")[0] != self.number:
                raise ValueError(
                    f"A statement of figure {self.number} must be numbered {self.number}-..., "
                    f"but it is {statement.number!r}."
                )

    @property
    def file_name(self) -> str:
        """File name of the picture."""
        return f"figure_{self.number.replace('.', '_')}.png"
