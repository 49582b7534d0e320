"""Rendering of a `Report`: text for a terminal, a page for a browser, JSON, files for a folder."""

import base64
import html
import json
import math
import re
import textwrap
from collections import Counter
from collections.abc import Mapping
from functools import cache, partial, singledispatch
from typing import Any

import jinja2
import numpy as np

from fitting.data.publish import MARK

from .figures import png, svg
from .report import Code, Picture, Points, Report, Section
from .table import WIDTH, Cell, Table, numeric_columns, table_text

LONGEST_UNBROKEN = 40
"""Maximum number of characters of a page's cell that stays on one line."""


def text(report: Report) -> str:
    """The whole report as plain text; figures and the footer are left out.

    Sentences are wrapped at `WIDTH` columns, before a section inside another one is indented by two.
    """
    label = " (SIMULATED data, not measured)" if report.real is False else ""
    heading = [f"{report.title}{label}", *_filled(report.subtitle, "")]
    parts = ["\n".join(heading), _section_text(Section("Verdict", tuple(report.verdict)))]
    if report.warnings:
        parts.append(_section_text(Section("Warnings", (Points(report.warnings),))))
    parts += [_section_text(section) for section in report.shown]
    return "\n\n".join(part for part in parts if part)


def _section_text(section: Section) -> str:
    """A section's heading and blocks; nothing where no block has a text."""
    texts = [found for block in section.blocks if (found := _block_text(block))]
    return "\n".join([*([section.title] if section.title else []), *texts]) if texts else ""


@singledispatch
def _block_text(block: str) -> str:
    return "\n".join(_filled(block, "  "))


@_block_text.register
def _(block: Points) -> str:
    return "\n".join(line for item in block.items for line in _filled(item, "  - ", "    "))


@_block_text.register
def _(block: Table) -> str:
    note = _filled(block.note, "  ") if block.note and block.rows else []
    return "\n".join([table_text(block), *note]) if block.rows else ""


@_block_text.register
def _(block: Code) -> str:
    return textwrap.indent(block.text, "  ")


@_block_text.register
def _(block: Picture) -> str:
    return ""


@_block_text.register
def _(block: Section) -> str:
    return textwrap.indent(_section_text(block), "  ")


def _filled(sentence: str, first: str, others: str | None = None) -> list[str]:
    indents = {"initial_indent": first, "subsequent_indent": first if others is None else others}
    return textwrap.wrap(sentence, WIDTH, break_long_words=False, break_on_hyphens=False, **indents)


def page(report: Report) -> str:
    """The whole report as one HTML page that fetches nothing; every text is escaped."""
    return _templates().get_template("page.html").render(report=report)


@cache
def _templates() -> jinja2.Environment:
    """Templates of this package. They escape every text."""
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("fitting.report"), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    kinds = {
        "paragraph": str, "points": Points, "table": Table, "picture": Picture, "code": Code,
        "section": Section, "cell": Cell,
    }  # fmt: skip
    templates.tests |= {name: partial(_is, kind) for name, kind in kinds.items()}
    templates.filters |= {"data_uri": data_uri, "numeric_columns": numeric_columns, "typed": typed}
    templates.globals |= {"LONGEST_UNBROKEN": LONGEST_UNBROKEN}
    return templates


def _is(kind: type, block: object) -> bool:
    return isinstance(block, kind)


def typed(sentence: str) -> str:
    """A sentence as HTML, escaped here; what stands between backticks is set as what one types."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(sentence))


def data_uri(picture: Picture) -> str:
    """A picture as a vector image that a page holds itself."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg(picture.figure, True)).decode('ascii')}"


def json_text(content: Mapping[str, Any]) -> str:
    """The content of `report.json` as in the file, with null for numbers that are not finite."""
    return json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Nested content in JSON types: lists for arrays, Python's numbers, null where one is not finite."""
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def documents(report: Report) -> dict[str, str | bytes]:
    """Content of every file of a report, by file name: `report.json`, the page, figures, further files.

    Raises:
        ValueError: if two of them have one name, so that one would be lost.
    """
    files = report.files()
    pictures = {id(picture): picture for picture in report.pictures()}.values()
    names = Counter([*files, MARK, report.page_name, *(f"{picture.name}.png" for picture in pictures)])
    if twice := [name for name, count in names.items() if count > 1]:
        raise ValueError(f"Argument `report` must name every file once, but two are called {twice[0]!r}.")
    return {
        **files,
        MARK: json_text(report.content()),
        report.page_name: page(report),
        **{f"{picture.name}.png": png(picture.figure, True) for picture in pictures},
    }
