"""What is said about a result, as data: text, page and files are all made from one `Report`.

A new type of result needs one function `report_of(result) -> Report`; `render.py` does the rest.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from matplotlib.figure import Figure

from .figures import style
from .table import Table


@dataclass(frozen=True)
class Picture:
    """A figure, drawn when it is first needed: a report as text draws nothing.

    Attributes:
        name: of its PNG file, without the ending.
        caption: what it shows.
        draw: makes it.
    """

    name: str
    caption: str
    draw: Callable[[], Figure]

    @cached_property
    def figure(self) -> Figure:
        """The drawing, in the style of all figures."""
        with style():
            return self.draw()


@dataclass(frozen=True)
class Points:
    """A list of sentences.

    Attributes:
        items: the sentences.
    """

    items: Sequence[str]


@dataclass(frozen=True)
class Code:
    """Text to copy, such as a command.

    Attributes:
        text: the text, its lines kept.
    """

    text: str


@dataclass(frozen=True)
class Section:
    """A part of a report under a heading; a section inside another has a smaller heading.

    Attributes:
        title: the heading; a section without one continues the part before it.
        blocks: what stands below it, in order; a string is a paragraph.
    """

    title: str
    blocks: "Sequence[Block]"

    @property
    def empty(self) -> bool:
        """Whether there is nothing to show: only empty lists, tables without rows, empty sections."""
        return all(map(_is_empty, self.blocks))


Block = str | Points | Table | Picture | Code | Section
"""What a section is made of."""


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
    """Everything that is said about a result.

    Attributes:
        title: of what was studied; the heading.
        subtitle: what was done with it.
        verdict: the few sentences to read if nothing else is read.
        sections: the rest, in order.
        warnings: what to be careful about.
        real: measured (True), simulated (False), or nobody said (None).
        window: title of the browser's window; the report's title by default.
        footer: what made the report.
        page_name: file of the page.
        content: makes the content of `report.json`.
        files: makes further files by name: constants that other commands load, CSV.
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
        """Every picture, in order; nothing is drawn."""
        return [picture for section in self.sections for picture in _pictures(section)]


def _pictures(section: Section) -> Iterator[Picture]:
    for block in section.blocks:
        if isinstance(block, Picture):
            yield block
        elif isinstance(block, Section):
            yield from _pictures(block)
