"""The report of a reproduction: the verdict first, then figure by figure."""

from functools import partial

from fitting.report.report import Block, Picture, Report, Section
from fitting.report.table import Cell, Table

from . import tables, text
from .entry import Entry
from .expectation import Verdict, number_text
from .results import Reproduction
from .statement import Judged

HEADER = ("no.", "what the source says", "source, or bound", "ours", "verdict", "remark")
COUNTS = "Statements by verdict; those that the text does not state are included here."
TONES = {Verdict.agrees: "good", Verdict.partly: "fair", Verdict.disagrees: "bad"}


def report_of(result: Reproduction) -> Report:
    """The report of the reproduction."""
    against = [judged for judged in result.judged if judged.verdict is Verdict.disagrees]
    return Report(
        title="Reproduction of the published figures and statements",
        subtitle="E. A. Allen, PhD dissertation, Washington State University: Chapters 2 and 3",
        verdict=text.verdict_sentences(result),
        sections=[
            Section("", [text.LOST, text.TOLERANCES]),
            Section("At a glance", [_counts(result)]),
            Section("Where we disagree", [_statements(against)]),
            *(_section(result, entry) for entry in result.entries),
        ],
        footer="pneusma reproduce. Corrections are listed in docs/corrections.md.",
        content=lambda: tables.content(result),
        files=lambda: {"statements.csv": tables.statements_csv(result)},
    )


def _section(result: Reproduction, entry: Entry) -> Section:
    """One figure: drawing, lost content, statements."""
    name = entry.file_name.removesuffix(".png")
    blocks: list[Block] = [
        entry.where,
        Picture(name, entry.caption, partial(result.figures.get, entry.number)),
        f"Not comparable: {entry.lost}" if entry.lost else "",
        _statements(result.about(entry)),
    ]
    return Section(f"Figure {entry.number}: {entry.title}", blocks)


def _counts(result: Reproduction) -> Table:
    """Verdicts counted figure by figure."""
    rows = []
    for entry in result.entries:
        verdicts = [judged.verdict for judged in result.about(entry)]
        counts = [str(verdicts.count(verdict) or "") for verdict in Verdict]
        rows.append([f"{entry.number}  {entry.title}", *counts])
    return Table(["figure", *(verdict.value for verdict in Verdict)], rows, COUNTS)


def _statements(found: list[Judged]) -> Table:
    return Table(HEADER, [_row(judged) for judged in found])


def _row(judged: Judged) -> list[str | Cell]:
    """A statement of the source, its number and ours, and the verdict."""
    statement, expected = judged.statement, judged.statement.expected
    unit = "" if statement.unit == "1" else f" {statement.unit}"
    bound = expected.tolerance if expected.quoted else f"our bound; {expected.tolerance}"
    return [
        statement.number,
        Cell(statement.says, statement.where),
        Cell(expected.source + unit, bound),
        number_text(judged.found.value) + unit,
        Cell(judged.verdict.value, tone=TONES[judged.verdict]),
        text.remark(judged),
    ]
