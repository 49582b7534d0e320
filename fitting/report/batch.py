"""The report of a batch: one table over specimens, what they say together, which of them failed."""

import json
import math
from typing import Any

from matplotlib.figure import Figure

from fitting.calibrate.batch import Batch
from fitting.calibrate.pooling import Pooled
from fitting.inference.parameters import format_estimate

from . import figures as house
from . import html
from .elastomer.json_report import plain
from .elastomer.tables import TextTable, csv_text
from .report import Section, numbered

SCHEMA = "pneusma-characterisation-batch/1"
UNALIKE = 0.01
"""p-value below which specimens are said to differ by more than their error bars."""
MOST_PANELS = 12


def verdict(batch: Batch) -> list[str]:
    """The few sentences to read if nothing else is read."""
    failed = [member for member in batch.members if member.result is None]
    said = [f"{len(batch.done)} of {len(batch.members)} campaigns were characterised."]
    said += [f"{member.name} was not: {member.problem}" for member in failed]
    said += [f"{member.name}: {member.problem}" for member in batch.done if member.problem]
    unlike = [name for name, p in batch.pooled.items() if p.differ < UNALIKE]
    if unlike:
        said.append(
            f"Specimens differ by more than their error bars in {', '.join(unlike)}: take the spread, not "
            "the error "
            "of the mean, for a further specimen."
        )
    elif batch.pooled:
        said.append(
            "The specimens are alike within their error bars in every constant that two or more inform."
        )
    return said


def specimen_table(batch: Batch) -> TextTable:
    """Every estimate of every campaign."""
    names = list(dict.fromkeys(n for member in batch.done for n in member.result.parameters))
    rows = []
    for member in batch.members:
        if member.result is None:
            rows.append([member.name, member.kind, "failed", *("" for _ in names)])
            continue
        cells = []
        for name in names:
            e = member.result.parameters.get(name)
            known = e is not None and math.isfinite(e.sd) and e.sd > 0.0
            text = "" if e is None else format_estimate(e.value, e.sd if known else None).replace("+/-", "±")
            cells.append(text)
        rows.append([member.name, member.kind, "fitted", *cells])
    units = {n: e.unit for member in batch.done for n, e in member.result.parameters.items()}
    header = [n if units[n] == "1" else f"{n} [{units[n]}]" for n in names]
    return TextTable(["campaign", "kind", "", *header], rows)


def pooled_table(batch: Batch) -> TextTable:
    """Every constant across specimens."""
    rows = []
    for name, p in batch.pooled.items():
        mean = format_estimate(p.mean, p.mean_sd).replace("+/-", "±")
        ends = f"{numbered(p.next_low)} to {numbered(p.next_high)}"
        label = name if p.unit == "1" else f"{name} [{p.unit}]"
        rows.append([label, str(len(p.values)), mean, numbered(p.spread), ends, numbered(p.differ)])
    header = ["constant", "specimens", "mean", "spread (sd)", "a further specimen, 90 %", "p of being alike"]
    return TextTable(header, rows)


NOTE = (
    "Normal-normal random effects, spread by restricted maximum likelihood; the common priors of the fits "
    "were taken out of each specimen's estimates first, all at once, so that none counts once for each "
    "specimen. What is left of them is what the figure shows in grey, so it is wider than in the table above."
)


def _sections(batch: Batch) -> list[Section]:
    sections = [Section("Specimens", table=specimen_table(batch), note="± one standard error.")]
    if batch.pooled:
        sections.append(Section("Across specimens", (NOTE,), pooled_table(batch), figures=("specimens",)))
    if batch.left_out:
        sections.append(Section("Estimates left out of that", batch.left_out))
    return sections


def text(batch: Batch) -> str:
    """The whole report as plain text."""
    parts = [Section("Verdict", tuple(verdict(batch))), *_sections(batch)]
    return "\n\n".join(part.text for part in parts)


def figures(batch: Batch) -> dict[str, Figure]:
    """Estimates of each constant as measured (grey) and partially pooled (blue)."""
    shown = list(batch.pooled.items())[:MOST_PANELS]
    if not shown:
        return {}
    columns = min(len(shown), 4)
    lines = -(-len(shown) // columns)
    most = max(len(p.values) for _, p in shown)
    with house.style():
        figure = Figure(figsize=(3.2 * columns, lines * (1.2 + 0.25 * most)), layout="constrained")
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for panel, (name, p) in zip(panels, shown, strict=False):
            places = range(len(p.values))
            panel.axvspan(p.next_low, p.next_high, color=house.SKY, alpha=0.25, linewidth=0)
            panel.axvline(p.mean, color=house.BLACK, linewidth=0.8)
            panel.errorbar(p.values, places, xerr=p.sd, fmt="o", color=house.GREY, markersize=4)
            panel.plot(p.shrunk, places, "D", color=house.BLUE, markersize=4)
            panel.set_yticks(list(places), p.names)
            panel.set_ylim(len(p.values) - 0.5, -0.5)
            panel.set_xlabel(f"{name} [{p.unit}]")
        for panel in panels[len(shown) :]:
            panel.set_visible(False)
    return {"specimens": figure}


CAPTION = (
    "Each specimen as measured (grey, one standard error) and drawn towards the mean as far as its error "
    "is wide "
    "(blue); band: where a further specimen lies with 90 % probability."
)


def documents(batch: Batch) -> dict[str, str | bytes]:
    """Content of the files about the whole batch, by file name."""
    drawn = figures(batch)
    parts = [html.heading("Batch", 1), html.verdict(verdict(batch))]
    for section in _sections(batch):
        parts += [html.heading(section.title), html.bullets(section.sentences)]
        if section.table:
            parts.append(html.table(section.table.header, section.table.rows, section.note))
        parts += [html.figure(drawn[name], CAPTION) for name in section.figures if name in drawn]
    content = json.dumps(plain(_json(batch)), indent=1, ensure_ascii=False, allow_nan=False)
    return {
        "report.json": content + "\n",
        "report.html": html.page("Batch: characterisation", parts, "pneusma characterise-batch"),
        "specimens.csv": _specimens_csv(batch),
        "summary.csv": _summary_csv(batch),
        **{f"{name}.png": house.png(figure) for name, figure in drawn.items()},
    }


def _json(batch: Batch) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "verdict": verdict(batch),
        "campaigns": [
            {
                "name": m.name,
                "kind": m.kind,
                "problem": m.problem or None,
                "parameters": None
                if m.result is None
                else {
                    n: {"value": e.value, "sd": e.sd, "unit": e.unit, "at_bound": e.at_bound}
                    for n, e in m.result.parameters.items()
                },
            }
            for m in batch.members
        ],
        "pooled": {
            name: {
                "mean": p.mean,
                "mean_sd": p.mean_sd,
                "spread": p.spread,
                "unit": p.unit,
                "next_90": [p.next_low, p.next_high],
                "p_alike": p.differ,
                "specimens": _own(p),
            }
            for name, p in batch.pooled.items()
        },
        "left_out": list(batch.left_out),
    }


def _own(p: Pooled) -> dict[str, dict[str, float]]:
    rows = zip(p.names, p.values, p.sd, p.shrunk, p.shrunk_sd, strict=True)
    return {n: {"value": v, "sd": s, "pooled": w, "pooled_sd": r} for n, v, s, w, r in rows}


def _specimens_csv(batch: Batch) -> str:
    rows = []
    for m in batch.members:
        if m.result is None:
            rows.append([m.name, m.kind, "", "", "", "", "", m.problem])
            continue
        for name, e in m.result.parameters.items():
            rows.append([m.name, m.kind, name, e.value, e.sd, e.unit, "yes" if e.at_bound else "no", ""])
    return csv_text(["campaign", "kind", "parameter", "value", "sd", "unit", "at_bound", "problem"], rows)


def _summary_csv(batch: Batch) -> str:
    rows = [
        [n, len(p.values), p.mean, p.mean_sd, p.spread, p.next_low, p.next_high, p.differ, p.unit]
        for n, p in batch.pooled.items()
    ]
    header = ["constant", "specimens", "mean", "mean_sd", "spread", "next_low", "next_high", "p_alike"]
    return csv_text([*header, "unit"], rows)
