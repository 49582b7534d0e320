"""Notices about rows and cells that a table leaves aside, and reasons to refuse one."""

import re
from collections.abc import Sequence

from pneusma_jax.errors import counted

from .headers import Rows, has_units, names_quantities, numbered
from .lines import Lines
from .numerals import like_a_number
from .separators import LEAST_ROWS
from .spelling import may_be_unit, parse_heading, same_unit

_CHANGES = re.compile(
    r"\b(?:re-?)?(?:zero(?:ed|ing)?|tared?|balanc(?:ed|ing)|range|gain|scale|units?|calibrat\w*|offset|"
    r"tariert|nullabgleich|messbereich)\b",
    re.IGNORECASE,
)
"""Words of a remark after which the numbers below it may count otherwise."""
NO_NUMBERS = "numbers and"
"""Part of the notice on rows of text below the headings, `are not numbers and were dropped`. Other modules
know the notice by it."""
_LISTED = 3
"""Number of left-out rows that a notice shows."""
_WIDTH = 40
"""Maximum number of letters of a row that a notice shows."""


def _examples(fields: Rows | dict[int, list[str]], rows: list[int]) -> str:
    """First words of some rows, or their first field, with the number of the row.

    A row without numbers is a remark: its commas may be those of a sentence, so it is shown as a whole.
    """
    texts = []
    for i in rows[:_LISTED]:
        filled = [text for text in fields[i] if text] or fields[i]
        words = [text for text in filled if not like_a_number(text)]
        shown = (words or filled)[0] if len(words) < len(filled) else ", ".join(words)
        texts.append(f"{shown[:_WIDTH]!r} (row {i + 1})")
    return ", ".join(texts) + (", ..." if len(rows) > _LISTED else "")


def rows_between(fields: Rows, remarks: Sequence[int]) -> list[str]:
    """A notice about rows between the headings and the numbers, which were left aside."""
    if not remarks:
        return []
    telling = {i: numbered(fields[i]) or fields[i] for i in remarks}
    asked = any(numbered(row) or names_quantities(row) for row in telling.values())
    return [
        f"{'check: ' if asked else ''}rows between the headings and the numbers were left aside:"
        f" {_examples(telling, [*remarks])}{'; a factor in them is not applied' if asked else ''}"
    ]


def statistics_told(lines: Lines, begin: int, top: int, end: int) -> list[str]:
    """Notices about labelled rows of statistics, which were left out of a table or stand above its headings.

    Args:
        lines: the page.
        begin: first row that belongs to the table, of headings or above them.
        top: first row of numbers.
        end: row behind the last one.
    """
    notices = []
    if told := [i for i in lines.statistics if top <= i < end]:
        notices.append(
            f"check: {counted(len(told), 'row of statistics was', 'rows of statistics were')} left out:"
            f" {_examples(lines.statistics, told)}"
        )
    if above := [i for i in lines.statistics if begin <= i < top]:
        what = counted(len(above), "row of statistics", "rows of statistics")
        notices.append(f"{what} above the headings left aside: {_examples(lines.statistics, above)}")
    return notices


def label_of(row: list[str]) -> str:
    """First word of a row, such as `Overall`; empty where there is none."""
    return next((text for text in row if re.search(r"[^\W\d_]{2}", text) and not like_a_number(text)), "")


def statistics_by_numbers(rows: dict[int, str], labels: dict[int, str], sure: bool) -> str:
    """Warning about rows that were told as statistics by their numbers alone.

    Args:
        rows: name of the statistic by row.
        labels: label by row that has one, which no known word is.
        sure: true if the rows were left out.
    """
    label = {i: f", labelled {text!r}" for i, text in labels.items()}
    named = ", ".join(f"{name} (row {i + 1}{label.get(i, '')})" for i, name in rows.items())
    which = "" if labels else " without a label"
    if not sure:
        may = counted(len(rows), f"row{which}", f"rows{which}")
        return f"check: {may} may be statistics of all others, but were read as measurements: {named}"
    are = counted(len(rows), f"row{which} is a statistic", f"rows{which} are statistics")
    were = "was" if len(rows) == 1 else "were"
    return f"check: {are} of all others and {were} left out: {named}"


def dropped_rows(lines: Lines, keep: list[int], dropped: list[int], width: int) -> list[str]:
    """Notices about rows below the header that were not read: remarks, rows of numbers with words or too
    many fields."""
    fields = lines.fields
    wider = [i for i in dropped if len(lines.parsed[i] or []) > width]
    rest = [i for i in dropped if i not in wider]
    mixed = [i for i in rest if len(fields[i]) > 1 and any(map(like_a_number, fields[i]))]
    remarks = [i for i in rest if i not in mixed]
    notices = []
    if wider:
        notices.append(
            f"check: {counted(len(wider), 'row has', 'rows have')} more fields than the {width} columns and"
            f" {'was' if len(wider) == 1 else 'were'} dropped:"
            f" {_examples(fields, wider)}"
        )
    inside = [i for i in remarks if i < keep[-1] and _CHANGES.search(" ".join(fields[i]))]
    remarks_mark = "check: " if inside else ""
    for rows, mark in ((remarks, remarks_mark), (mixed, "check: ")):
        if rows:
            what = "row below the header is not", "rows below the header are not"
            count = counted(len(rows), *what)
            were = "was" if len(rows) == 1 else "were"
            notices.append(f"{mark}{count} {NO_NUMBERS} {were} dropped: {_examples(fields, rows)}")
    below = [i for i in keep if remarks and i > remarks[-1]]
    if 0 < len(below) < LEAST_ROWS:
        numbers = ", ".join(str(i + 1) for i in below)
        notices.append(
            f"check: the rows below {_examples(fields, remarks[-1:])} were read as measurements (row"
            f" {numbers}); delete them in the file if they sum up the others"
        )
    return notices


def other_units(fields: Rows, header: list[str], keep: list[int], dropped: list[int]) -> str:
    """Reason to refuse a table with a row of units among its numbers that are not those of the headings."""
    for i in dropped:
        if not keep[0] < i < keep[-1] or not has_units(fields[i]):
            continue
        for heading, text in zip(header, fields[i], strict=False):
            unit, own = text.strip("()[] "), parse_heading(heading).unit
            if own is not None and unit and may_be_unit(unit) and not same_unit(own, unit):
                return (
                    f"row {i + 1} among the numbers states the unit {unit!r}, and the heading {heading!r}"
                    " another one. Write all rows in one unit, or a table with headings of its own below"
                )
    return ""


def longer_rows(fields: Rows, longer: list[int], stated: int) -> str:
    """Warning where a few rows have more fields than there are headings. A surplus comma shifts numbers."""
    row, count = longer[0], len(longer)
    return (
        f"check: {counted(count, 'row has', 'rows have')} more fields than the {stated} headings (row"
        f" {row + 1}: {len(fields[row])} fields). If a mark too many moved its numbers, mend it in the file"
    )


def all_longer(lines: Lines, longer: list[int], rows: int, stated: int) -> str:
    """Reason to refuse a table most of whose rows have more fields than there are headings."""
    row, fields = longer[0], lines.fields
    said = (
        f"{len(longer)} of {rows} rows have more fields than the {stated} headings (row {row + 1}:"
        f" {len(fields[row])} fields, {lines.delimiter.join(fields[row])[:40]!r})"
    )
    if lines.delimiter == "," and not any("." in text for i in longer for text in fields[i]):
        return (
            f"{said}: commas both separate the fields and mark decimals; export the file with semicolons or"
            " tabs between the fields, or with decimal points"
        )
    return f"{said}, so no column is known to belong to its heading; write a heading above every column"
