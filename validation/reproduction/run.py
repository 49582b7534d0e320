"""Judge every statement and draw every figure: what `pneusma reproduce` does, without files."""

from collections.abc import Callable, Sequence

from fitting.inference.results import Presenter, register_presenter
from fitting.report.figures import png

from .bench import Bench
from .entry import Entry
from .page import html_page
from .registry import ENTRIES
from .results import Reproduction
from .statement import judge
from .tables import report_json, statements_csv
from .text import verdict_sentences


def reproduce(
    bench: Bench | None = None,
    entries: Sequence[Entry] = ENTRIES,
    progress: Callable[[str], None] = lambda label: None,
) -> Reproduction:
    """Judge the statements of some figures and draw them.

    Args:
        bench: specimens; as shipped if None.
        entries: figures to consider; all by default.
        progress: called with a figure's number once it is done.

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


def documents(result: Reproduction) -> dict[str, str | bytes]:
    """The files by name: report.html, statements.csv, report.json and the figures."""
    texts = {
        "report.html": html_page(result),
        "statements.csv": statements_csv(result),
        "report.json": report_json(result),
    }
    drawn = {entry.file_name: png(result.figures[entry.number]) for entry in result.entries}
    return texts | drawn


register_presenter(
    Reproduction,
    Presenter(
        verdict_sentences,
        lambda result: "\n".join(verdict_sentences(result)),
        lambda result: result.figures,
        documents,
    ),
)
