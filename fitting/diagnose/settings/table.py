"""The numbers as Markdown tables, one per kind, for `docs/thresholds.md`."""

import re
from pathlib import Path
from typing import Any

from .threshold import thresholds_of

BEGIN, END = "<!-- thresholds -->", "<!-- /thresholds -->"


def table(settings: Any, categories: dict[str, tuple[str, ...]]) -> str:
    """A heading with the count and a table for every kind of number.

    Each row has name, value, unit, sentence, and the measurement that the number rests on.

    Args:
        settings: a dataclass whose fields are groups of thresholds.
        categories: names of the groups of each kind.
    """
    return "\n\n".join(_of_kind(settings, kind, groups) for kind, groups in categories.items())


def _of_kind(settings: Any, kind: str, groups: tuple[str, ...]) -> str:
    members = [one for one in thresholds_of(settings) if one.name.partition(".")[0] in groups]
    lines = [
        f"### {kind}: {len(members)}",
        "",
        "| Threshold | Value | Unit | Meaning | Rests on |",
        "|---|---|---|---|---|",
    ]
    for one in members:
        cells = f"`{one.name}`", _written(one.value), one.unit, one.sentence, one.basis
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def replaced(text: str, settings: Any, categories: dict[str, tuple[str, ...]]) -> str:
    """A document whose part between the two marks is the tables.

    Raises:
        ValueError: if the document does not have both marks.
    """
    if BEGIN not in text or END not in text:
        raise ValueError(f"the document needs the marks {BEGIN} and {END}")
    between = re.compile(f"{re.escape(BEGIN)}.*?{re.escape(END)}", re.DOTALL)
    return between.sub(lambda _: f"{BEGIN}\n{table(settings, categories)}\n{END}", text)


def rewrite(path: Path, settings: Any, categories: dict[str, tuple[str, ...]]) -> None:
    """Bring the tables of a document up to date; `replaced` says what it raises."""
    path.write_text(replaced(path.read_text(encoding="utf-8"), settings, categories), encoding="utf-8")


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(_written(inner) if not isinstance(inner, str) else inner for inner in value)
    return f"{value:g}"
