"""Judgement of every statement and drawing of every figure: `pneusma reproduce` without files."""

from collections.abc import Callable, Sequence

from fitting.inference.results import register_presenter
from fitting.report.results import presenter

from .bench import Bench
from .entry import Entry
from .registry import ENTRIES
from .report import report_of
from .results import Reproduction
from .statement import judge


def reproduce(
    bench: Bench | None = None,
    entries: Sequence[Entry] = ENTRIES,
    progress: Callable[[str], None] = lambda label: None,
) -> Reproduction:
    """Judge the statements of some figures and draw them.

    Args:
        bench: specimens; as shipped if None.
        entries: figures to consider; all by default.
        progress: function that is called with a figure's number once it is done.

    Raises:
        RuntimeError: if a statement has no finite number.
    """
    bench = Bench() if bench is None else bench
    judged, figures = [], {}
    for entry in entries:
        judged += [judge(statement, bench) for statement in entry.statements]
        figures[entry.number] = entry.draw(bench)
        progress(f"figure {entry.number}")
    return Reproduction(tuple(entries), tuple(judged), figures)


register_presenter(Reproduction, presenter(report_of))
