"""A reproduction as CSV and as JSON."""

import math
from importlib.metadata import version
from typing import Any

from fitting.data.csv_text import csv_rows

from .expectation import Interval, Near
from .results import Reproduction
from .statement import Judged

SCHEMA = "pneusma-reproduction/1"
COLUMNS = (
    "number", "figure", "where", "statement", "unit", "source", "quoted", "ours", "verdict", "tolerance",
    "detail", "reason", "rests_on", "contradicted", "stated",
)  # fmt: skip


def row(judged: Judged) -> dict[str, object]:
    """One statement with the names of `COLUMNS`."""
    statement = judged.statement
    return {
        "number": statement.number,
        "figure": statement.number.rpartition("-")[0],
        "where": statement.where,
        "statement": statement.says,
        "unit": statement.unit,
        "source": statement.expected.source,
        "quoted": statement.expected.quoted,
        "ours": judged.found.value,
        "verdict": judged.verdict.name,
        "tolerance": statement.expected.tolerance,
        "detail": judged.found.detail,
        "reason": judged.reason,
        "rests_on": statement.rests_on,
        "contradicted": statement.contradicted,
        "stated": statement.stated,
    }


def statements_csv(result: Reproduction) -> str:
    """All statements, one a row; our number with all its digits."""
    rows = [row(judged) | {"ours": repr(float(judged.found.value))} for judged in result.judged]
    return csv_rows(COLUMNS, [[_cell(cells[name]) for name in COLUMNS] for cells in rows])


def _cell(value: object) -> object:
    return str(value).lower() if isinstance(value, bool) else value


def content(result: Reproduction) -> dict[str, Any]:
    """The content of `report.json`: counts, statements and figures; bounds as numbers."""
    return {
        "schema": SCHEMA,
        "version": version("pneusma-jax"),
        "counts": {verdict.name: count for verdict, count in result.counts().items()},
        "counts_of_added": {verdict.name: count for verdict, count in result.counts(stated=False).items()},
        "figures": [
            {
                "number": entry.number, "title": entry.title, "where": entry.where, "file": entry.file_name,
                "caption": entry.caption, "lost": entry.lost,
                "statements": [judged.statement.number for judged in result.about(entry)],
            }
            for entry in result.entries
        ],
        "statements": [row(j) | {"expected": _bounds(j.statement.expected)} for j in result.judged],
    }  # fmt: skip


def _bounds(expected: Near | Interval) -> dict[str, float | None]:
    """Bounds of agreement and of partial agreement, as numbers; None where there is no bound."""
    if isinstance(expected, Near):
        return {"value": expected.value, "within": expected.within, "partly": expected.partly}
    bounds = {name: value for name, value in vars(expected).items() if name != "quoted"}
    return {name: value if math.isfinite(value) else None for name, value in bounds.items()}
