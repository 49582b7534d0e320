"""Judge every statement and draw every figure: what `pneusma reproduce` does, without files."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from fitting.data.publish import publish
from fitting.report.figures import png

from .bench import Bench
from .entry import Entry
from .expectation import Verdict
from .registry import ENTRIES
from .statement import Judged, judge


@dataclass(frozen=True)
class Reproduction:
    """The statements of the source with our numbers and verdicts, and our figures.

    Attributes:
        entries: the figures that were considered, in the source's order.
        judged: of every statement, in the same order.
        figures: our drawings by number of the source's figure.
    """

    entries: tuple[Entry, ...]
    judged: tuple[Judged, ...]
    figures: dict[str, Figure]

    def about(self, entry: Entry) -> list[Judged]:
        """What was found on the statements of one figure."""
        return [j for j in self.judged if j.statement in entry.statements]

    def counts(self, stated: bool = True) -> dict[Verdict, int]:
        """How many statements got each verdict.

        Args:
            stated: count the source's own statements, or the expectations that we add.
        """
        found = Counter(j.verdict for j in self.judged if j.statement.stated is stated)
        return {verdict: found[verdict] for verdict in Verdict}

    def documents(self) -> dict[str, str | bytes]:
        """The files by name: report.html, statements.csv, report.json and the figures."""
        from .page import html_page
        from .tables import report_json, statements_csv

        texts = {
            "report.html": html_page(self),
            "statements.csv": statements_csv(self),
            "report.json": report_json(self),
        }
        drawn = {entry.file_name: png(self.figures[entry.number]) for entry in self.entries}
        return texts | drawn

    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write the files, all of them or none.

        Raises:
            InputError: if the folder cannot take them.
        """
        return publish(folder, self.documents, force)


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
