"""The report of a batch: one table over specimens, joint conclusions, and failed specimens."""

from typing import Any

from matplotlib.figure import Figure

from fitting.calibrate.batch import Batch, Member
from fitting.calibrate.pooling import Pooled
from fitting.data.csv_text import csv_rows
from pneusma_jax.errors import counted

from . import figures as house
from .cautions import cautions
from .cells import number, with_error, with_unit
from .characterisation import CSV_DIGITS, ERRORS, estimate_cells, estimate_text, estimates_json
from .report import Picture, Points, Report, Section
from .table import Table

SCHEMA = "pneusma-characterisation-batch/1"
UNALIKE = 0.01
"""Maximum p-value for specimens to be reported as different by more than their error bars."""
MOST_PANELS = 12
"""Maximum number of constants in the figure."""


def _fitted(member: Member) -> str:
    """What became of a member, in a cell of the table."""
    if member.result is None:
        return "failed"
    return "fitted, not to be trusted" if cautions(member.result) else "fitted"


def verdict(batch: Batch) -> list[str]:
    """The few most important sentences."""
    failed = [member for member in batch.members if member.result is None]
    were = "was" if len(batch.done) == 1 else "were"
    sentences = [f"{len(batch.done)} of {counted(len(batch.members), 'campaign')} {were} characterised."]
    sentences += [f"{member.name} was not: {member.problem}" for member in failed]
    sentences += [f"{member.name}: {member.problem}" for member in batch.done if member.problem]
    sentences += [f"{m.name}: {said}" for m in batch.done for said in cautions(m.result)[:1]]
    unlike = [name for name, p in batch.pooled.items() if p.differ < UNALIKE]
    if unlike:
        sentences.append(
            f"Specimens differ by more than their error bars in {', '.join(unlike)}: take the spread, not "
            "the error of the mean, for a further specimen."
        )
    elif batch.pooled:
        sentences.append(
            "The specimens are alike within their error bars in every constant that two or more inform."
        )
    return sentences


def checks(batch: Batch) -> list[str]:
    """Questions that reading the recordings of each campaign raised."""
    return [f"{m.name}: {said}" for m in batch.members for said in m.checks]


def specimen_table(batch: Batch) -> Table:
    """Table of every estimate of every campaign."""
    names = list(dict.fromkeys(n for member in batch.done for n in member.result.parameters))
    rows = []
    for member in batch.members:
        known = {} if member.result is None else member.result.parameters
        cells = [estimate_text(known[name]) if name in known else "" for name in names]
        rows.append([member.name, member.kind, _fitted(member), *cells])
    units = {n: e.unit for member in batch.done for n, e in member.result.parameters.items()}
    return Table(["campaign", "kind", "", *(with_unit(n, units[n]) for n in names)], rows, ERRORS)


def pooled_table(batch: Batch) -> Table:
    """Table of every constant across specimens."""
    rows = []
    for name, p in batch.pooled.items():
        ends = f"{number(p.next_low)} to {number(p.next_high)}"
        mean = with_error(p.mean, p.mean_sd)
        cells = [mean, number(p.spread), ends, number(p.differ)]
        rows.append([with_unit(name, p.unit), str(len(p.values)), *cells])
    header = ["constant", "specimens", "mean", "spread (sd)", "a further specimen, 90 %", "p of being alike"]
    return Table(header, rows)


NOTE = (
    "Normal-normal random effects; the spread is a restricted maximum likelihood estimate. Specimens share "
    "the priors of their fits. These priors were taken out of all estimates first, so that none counts once "
    "for each specimen. The figure shows the estimates without them in grey. They are wider than in the "
    "table above."
)


CAPTION = (
    "Grey: each specimen as measured, with one standard error. Blue: the same drawn towards the mean, the "
    "more the wider its error. Band: 90 % prediction interval of a further specimen."
)


def report_of(batch: Batch) -> Report:
    """The report of the batch."""
    first = house.only_first(MOST_PANELS, len(batch.pooled), "constants")
    across = [NOTE, pooled_table(batch), Picture("specimens", CAPTION + first, lambda: figure(batch))]
    return Report(
        title="Batch",
        subtitle=f"{counted(len(batch.members), 'campaign')}, each characterised by itself, then compared",
        verdict=verdict(batch),
        sections=[
            Section("Specimens", [specimen_table(batch)]),
            *([Section("Across specimens", across)] if batch.pooled else []),
            Section("Estimates left out of that", [Points(batch.left_out)]),
            Section("To check", [Points(checks(batch))]),
        ],
        window="Batch: characterisation",
        footer="pneusma characterise-batch",
        content=lambda: _content(batch),
        files=lambda: {"specimens.csv": _specimens_csv(batch), "summary.csv": _summary_csv(batch)},
    )


def figure(batch: Batch) -> Figure:
    """Estimates of each constant as measured (grey) and partially pooled (blue)."""
    shown = list(batch.pooled.items())[:MOST_PANELS]
    most = max(len(p.values) for _, p in shown)
    drawn, panels = house.panel_grid(len(shown), 3.2, 1.2 + 0.25 * most)
    for panel, (name, p) in zip(panels, shown, strict=True):
        places = range(len(p.values))
        panel.axvspan(p.next_low, p.next_high, color=house.SKY, alpha=0.25, linewidth=0)
        panel.axvline(p.mean, color=house.BLACK, linewidth=0.8)
        panel.errorbar(p.values, places, xerr=p.sd, fmt="o", color=house.GREY, markersize=4)
        panel.plot(p.shrunk, places, "D", color=house.BLUE, markersize=4)
        panel.set_yticks(list(places), [house.literal(name) for name in p.names])
        panel.set_ylim(len(p.values) - 0.5, -0.5)
        panel.set_xlabel(f"{name} [{p.unit}]")
    return drawn


def _content(batch: Batch) -> dict[str, Any]:
    """The content of `report.json`."""
    return {
        "schema": SCHEMA,
        "verdict": verdict(batch),
        "campaigns": [
            {
                "name": m.name,
                "kind": m.kind,
                "problem": m.problem or None,
                "cautions": list(cautions(m.result)),
                "checks": list(m.checks),
                "parameters": None if m.result is None else estimates_json(m.result.parameters),
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
            rows.append([m.name, m.kind, name, *estimate_cells(e), ""])
    header = ["campaign", "kind", "parameter", "value", "sd", "unit", "at_bound", "problem"]
    return csv_rows(header, rows, digits=CSV_DIGITS)


def _summary_csv(batch: Batch) -> str:
    rows = [
        [n, len(p.values), p.mean, p.mean_sd, p.spread, p.next_low, p.next_high, p.differ, p.unit]
        for n, p in batch.pooled.items()
    ]
    header = ["constant", "specimens", "mean", "mean_sd", "spread", "next_low", "next_high", "p_alike"]
    return csv_rows([*header, "unit"], rows, digits=CSV_DIGITS)
