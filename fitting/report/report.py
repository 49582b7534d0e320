"""The interface of reports: a `Report` is data, from which text, page and files are made.

A new type of result needs one function `report_of(result) -> Report`; `render.py` does the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from .figures import as_written, laid_out, style
from .table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Picture:
    """A figure that is drawn on first use, so that a report as text draws nothing.

    Attributes:
        name: name of its PNG file, without the ending.
        caption: caption of the figure.
        draw: function that makes the figure.
    """

    name: str
    caption: str
    draw: Callable[[], Figure]

    @cached_property
    def figure(self) -> Figure:
        """The drawing, in the style of all figures and laid out."""
        with style():
            return laid_out(as_written(self.draw()))


@dataclass(frozen=True)
class Points:
    """A list of sentences.

    Attributes:
        items: sentences.
    """

    items: Sequence[str]


@dataclass(frozen=True)
class Code:
    """Text to copy, such as a command.

    Attributes:
        text: text with its lines.
    """

    text: str


@dataclass(frozen=True)
class Section:
    """A part of a report under a heading; a section inside another has a smaller heading.

    Attributes:
        title: heading; a section without one continues the part before it.
        blocks: content below the heading, in order; a string is a paragraph.

    Raises:
        TypeError: if something else is among the blocks.
    """

    title: str
    blocks: Sequence[Block]

    def __post_init__(self) -> None:
        for block in self.blocks:
            if not isinstance(block, Block):
                raise TypeError(f"Argument `blocks` must hold blocks of a report, but one is {block!r}.")

    @property
    def empty(self) -> bool:
        """True if there is nothing to show: only empty lists, tables without rows, empty sections."""
        return all(map(_is_empty, self.blocks))


Block = str | Points | Table | Picture | Code | Section
"""Building block of a section."""


def _is_empty(block: Block) -> bool:
    if isinstance(block, str):
        return not block
    if isinstance(block, Points):
        return not block.items
    if isinstance(block, Table):
        return not block.rows
    return block.empty if isinstance(block, Section) else False


def _nothing() -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Report:
    """The report of a result.

    Attributes:
        title: name of the subject; the heading.
        subtitle: method and data.
        verdict: the few most important sentences.
        sections: further content, in order.
        warnings: sentences of caution.
        real: true if measured, false if simulated, None if unstated.
        window: title of the browser's window; the report's title by default.
        footer: program and version.
        page_name: file name of the page.
        content: function that makes the content of `report.json`.
        files: function that makes further files by name: constants for other commands, CSV.
    """

    title: str
    subtitle: str
    verdict: Sequence[str]
    sections: Sequence[Section]
    warnings: Sequence[str] = ()
    real: bool | None = None
    window: str = ""
    footer: str = ""
    page_name: str = "report.html"
    content: Callable[[], Mapping[str, Any]] = _nothing
    files: Callable[[], Mapping[str, str | bytes]] = field(default=_nothing)

    @property
    def shown(self) -> list[Section]:
        """Sections that have something to show."""
        return [section for section in self.sections if not section.empty]

    def pictures(self) -> list[Picture]:
        """Every picture, in order, not drawn yet."""
        return [picture for section in self.sections for picture in _pictures(section)]


def _pictures(section: Section) -> Iterator[Picture]:
    for block in section.blocks:
        if isinstance(block, Picture):
            yield block
        elif isinstance(block, Section):
            yield from _pictures(block)
