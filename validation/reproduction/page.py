"""The page of a reproduction: the verdict first, then figure by figure, with nothing to fetch."""

from html import escape

from fitting.report import html

from . import text
from .entry import Entry
from .expectation import Verdict, number_text
from .results import Reproduction
from .statement import Judged

CSS = """
<style>
table.statements { width: 100%; table-layout: fixed; }
table.statements td, table.statements th { white-space: normal; text-align: left; vertical-align: top;
  padding: .28rem .45rem; }
table.statements .number { width: 3.3rem; white-space: nowrap; }
table.statements .value { width: 6.4rem; text-align: right; }
table.statements .mark { width: 4.9rem; }
table.statements .remark { width: 31%; }
table.statements small { color: #5b6475; display: block; }
.agrees { color: #00664a; font-weight: 600; } .partly { color: #8a5a00; font-weight: 600; }
.disagrees { color: #a33b00; font-weight: 600; }
.own td { background: #f7f8fa; }
</style>
"""
HEADER = (("number", "no."), ("", "what the source says"), ("value", "source, or bound"), ("value", "ours"), (
"mark", "verdict"),
          ("remark", "remark"))  # fmt: skip


def html_page(result: Reproduction) -> str:
    """The whole page."""
    title = "Reproduction of the published figures and statements"
    parts = [CSS, html.heading(title, 1)]
    parts += [
        html.paragraph(
            "E. A. Allen, PhD dissertation, Washington State University: Chapters 2 and 3", "subtitle"
        )
    ]
    parts += [html.verdict(text.verdict_sentences(result))]
    parts += [html.paragraph(text.LOST), html.paragraph(text.TOLERANCES)]
    parts += [html.heading("At a glance"), _summary(result)]
    against = [j for j in result.judged if j.verdict is Verdict.disagrees]
    if against:
        parts += [html.heading("Where we disagree"), _statements(against)]
    for entry in result.entries:
        parts += _section(result, entry)
    return html.page(title, parts, "pneusma reproduce. Corrections are listed in docs/corrections.md.")


def _section(result: Reproduction, entry: Entry) -> list[str]:
    """One figure: drawing, what is lost, statements."""
    lost = [html.paragraph(f"Not comparable: {entry.lost}")] if entry.lost else []
    return [
        html.heading(f"Figure {entry.number}: {entry.title}"),
        html.paragraph(entry.where, "subtitle"),
        html.figure(result.figures[entry.number], entry.caption),
        *lost,
        _statements(result.about(entry)),
    ]


def _summary(result: Reproduction) -> str:
    """Verdicts counted figure by figure."""
    rows = []
    for entry in result.entries:
        verdicts = [j.verdict for j in result.about(entry)]
        counts = [str(verdicts.count(verdict) or "") for verdict in Verdict]
        rows.append([f"{entry.number}  {entry.title}", *counts])
    return html.table(["figure", *(verdict.value for verdict in Verdict)], rows,
                      "Statements by verdict; those that the text does not state are included "
                      "here.")  # fmt: skip


def _statements(judged: list[Judged]) -> str:
    """A table of statements; sentences wrap, so it is no `html.table`."""
    head = "".join(f'<th class="{css}">{escape(name)}</th>' for css, name in HEADER)
    return (
        f'<table class="statements"><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(_row(j) for j in judged)}</tbody></table>"
    )


def _row(judged: Judged) -> str:
    statement, expected = judged.statement, judged.statement.expected
    unit = "" if statement.unit == "1" else f" {statement.unit}"
    bound = expected.tolerance if expected.quoted else f"our bound; {expected.tolerance}"
    css = "" if statement.stated else ' class="own"'
    return (
        f'<tr{css}><td class="number">{escape(statement.number)}</td>'
        f"<td>{escape(statement.says)}<small>{escape(statement.where)}</small></td>"
        f'<td class="value">{escape(expected.source + unit)}<small>{escape(bound)}</small></td>'
        f'<td class="value">{escape(number_text(judged.found.value) + unit)}</td>'
        f'<td class="mark"><span class="{judged.verdict.name}">{judged.verdict.value}</span></td>'
        f'<td class="remark">{escape(text.remark(judged))}</td></tr>'
    )
