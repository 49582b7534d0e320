"""The thresholds as a Markdown table, for `docs/diagnosis.md`."""

import re
from pathlib import Path
from typing import Any

from .threshold import thresholds_of

BEGIN, END = "<!-- thresholds -->", "<!-- /thresholds -->"


def table(settings: Any) -> str:
    """A row for every threshold: name, value, unit, sentence, and the measurement that it rests on."""
    lines = ["| Threshold | Value | Unit | Meaning | Rests on |", "|---|---|---|---|---|"]
    for one in thresholds_of(settings):
        cells = f"`{one.name}`", _written(one.value), one.unit, one.sentence, one.basis
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def replaced(text: str, settings: Any) -> str:
    """A document whose part between the two marks is the table.

    Raises:
        ValueError: if the document does not have both marks.
    """
    if BEGIN not in text or END not in text:
        raise ValueError(f"the document needs the marks {BEGIN} and {END}")
    between = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.DOTALL)
    return between.sub(lambda _: f"{BEGIN}\n{table(settings)}\n{END}", text)


def rewrite(path: Path, settings: Any) -> None:
    """Bring the table of a document up to date; `replaced` says what it raises."""
    path.write_text(replaced(path.read_text(encoding="utf-8"), settings), encoding="utf-8")


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(_written(inner) if not isinstance(inner, str) else inner for inner in value)
    return f"{value:g}"
