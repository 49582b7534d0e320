"""What microcontrollers print: a clock before every line, or a label before every number."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from pneusma_jax.errors import counted

from .headers import names_quantities
from .raw import Page, split_line
from .separators import LEAST_ROWS
from .spelling import is_unit

LOGGED = "Logged_at"
"""Heading of the clock before the lines."""
_CLOCK = r"\d{1,2}:\d\d:\d\d(?:[.,]\d+)?"
_BEFORE = re.compile(rf"(?:(?P<arrow>{_CLOCK})\s*->|\[(?P<brackets>{_CLOCK})\])\s?(?P<rest>.*)")
_LABELLED = re.compile(
    r"\s*(?P<label>[^\W\d][^:=,;|\t]*?)\s*[:=]\s*(?P<number>[+-]?\d*\.?\d+(?:[eE][+-]?\d+)?)"
    r"(?:\s*(?P<unit>[^\s\d,;|:=.+-][^\s,;|:=]*)(?=[\s,;|]|$)(?!\s*[:=]))?\s*(?:[,;|]\s*|\s+|$)"
)
_CLOCKS_SAID = "a clock stands before every line, in brackets or before an arrow: taken as a column"
Field = tuple[str, str, str]


def as_table(page: Page) -> tuple[Page, list[str]]:
    """A page on which a clock before every line is a column, and labels of numbers are headings.

    Returns:
        The page, unchanged where it has neither, and notices.
    """
    if page.is_sheet:
        return page, []
    found = [_BEFORE.fullmatch(line) for line in page.lines]
    rests = [one["rest"] for one in found if one]
    if len(rests) < LEAST_ROWS or 2 * len(rests) <= sum(bool(line.strip()) for line in page.lines):
        return _without_labels(page, {})
    bare = replace(page, lines=[one["rest"] if one else page.lines[k] for k, one in enumerate(found)])
    clocks = {k: one["arrow"] or one["brackets"] for k, one in enumerate(found) if one}
    table, labels = _without_labels(bare, clocks)
    if labels:
        return table, [_CLOCKS_SAID, *labels]
    page, said = _without_clocks(page, found, rests)
    table, labels = _without_labels(page, {})
    return table, [*said, *labels]


def _without_clocks(
    page: Page, found: list[re.Match[str] | None], rests: list[str]
) -> tuple[Page, list[str]]:
    """A page on which the clock before its lines is a column.

    Args:
        page: the page.
        found: clock and rest of each line, None where it has no clock.
        rests: rests of the lines that have one.
    """
    marks = Counter(mark for rest in rests for mark in ("\t", ";", ",") if mark in rest)
    mark = marks.most_common(1)[0][0] if marks else " "
    width = Counter(len(split_line(rest, mark)) for rest in rests).most_common(1)[0][0]
    lines = list(page.lines)
    for k, one in enumerate(found):
        fields = split_line(one["rest"] if one else lines[k], mark)
        if names_quantities(fields) > 0 and (one or len(fields) == width > 1):
            lines[k] = f"{LOGGED}{mark}{one['rest'] if one else lines[k]}"
        elif one:
            clock = one["arrow"] or one["brackets"]
            lines[k] = f"{clock.replace(',', '.') if mark == ',' else clock}{mark}{one['rest']}"
    return replace(page, lines=lines), [_CLOCKS_SAID]


def _without_labels(page: Page, clocks: dict[int, str]) -> tuple[Page, list[str]]:
    """A page on which the labels before its numbers are headings.

    Args:
        page: the page.
        clocks: clock that stood before a line, by line; a column, where every line of numbers has one.
    """
    labelled = ((k, line) for k, line in enumerate(page.lines) if ":" in line or "=" in line)
    fields = {k: row for k, line in labelled if (row := [*_fields(line)])}
    kinds = Counter(tuple((label, unit) for label, _, unit in row) for row in fields.values())
    if not kinds:
        return page, []
    most, count = kinds.most_common(1)[0]
    if count < LEAST_ROWS or len(most) < 2 or 2 * count <= sum(bool(line.strip()) for line in page.lines):
        return page, []
    rows = [[line] if line.strip() else [] for line in page.lines]
    chosen = [k for k, row in fields.items() if tuple((label, unit) for label, _, unit in row) == most]
    for k in chosen:
        rows[k] = [number for _, number, _ in fields[k]]
    header = [f"{label} ({unit})" if unit else label for label, unit in most]
    if clocks:
        header = [LOGGED, *header]
        for k in chosen:
            rows[k] = [clocks.get(k, ""), *rows[k]]
    rows.insert(chosen[0], header)
    labels = [label for label, _ in most]
    others = [k + 1 for k in sorted({*fields} - {*chosen}) if [label for label, *_ in fields[k]] == labels]
    said = f"a label stands before every number: {', '.join(map(repr, header))}; these count as a row"
    if others:
        said = f"check: {said}; {counted(len(others), 'line')} with other units left aside (line {others[0]})"
    return replace(page, lines=[], rows=rows), [said]


def _fields(line: str) -> Iterator[Field]:
    """Label, number and unit of every field of a line that consists of such fields; none of another line.

    A word behind a number that is no unit begins the label of the next one.
    """
    found, at = [], 0
    while at < len(line):
        field = _LABELLED.match(line, at)
        if field is None:
            return
        unit = field["unit"] if field["unit"] and is_unit(field["unit"]) else ""
        found.append((field["label"], field["number"], unit))
        at = field.end() if unit or not field["unit"] else field.end("number")
    yield from found
