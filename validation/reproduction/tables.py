"""A reproduction as CSV and as JSON."""

import csv
import io
import json
import math
from importlib.metadata import version

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
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for judged in result.judged:
        cells = row(judged) | {"ours": repr(float(judged.found.value))}
        writer.writerow(
            {name: str(cell).lower() if isinstance(cell, bool) else cell for name, cell in cells.items()}
        )
    return stream.getvalue()


def report_json(result: Reproduction) -> str:
    """Counts, statements and figures; bounds as numbers."""
    document = {
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
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _bounds(expected: Near | Interval) -> dict[str, float | None]:
    """What agrees and what agrees in part, as numbers; None where there is no bound."""
    if isinstance(expected, Near):
        return {"value": expected.value, "within": expected.within, "partly": expected.partly}
    bounds = {name: value for name, value in vars(expected).items() if name != "quoted"}
    return {name: value if math.isfinite(value) else None for name, value in bounds.items()}
