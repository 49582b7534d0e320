"""One report for any characterised specimen: the same content as text, page, JSON and figures."""

import json
import math
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

from fitting.calibrate.result import SCHEMA, Estimate
from fitting.inference.parameters import format_estimate
from pneusma_jax.calibration.records import Calibration
from pneusma_jax.calibration.toml import render_calibration

from . import html
from .elastomer.json_report import plain
from .elastomer.tables import TextTable, csv_text
from .figures import png

WIDTH = 100


@dataclass(frozen=True)
class Section:
    """A part of a report.

    Attributes:
        title: its heading.
        sentences: in words.
        table: beside them, or None.
        note: under the table.
        figures: names of drawings that belong here.
    """

    title: str
    sentences: tuple[str, ...] = ()
    table: TextTable | None = None
    note: str = ""
    figures: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The part as plain text."""
        lines = [
            textwrap.fill(s, WIDTH, initial_indent="  ", subsequent_indent="  ") for s in self.sentences
        ]
        return "\n".join([self.title, *lines, *([self.table.text()] if self.table else [])])


@dataclass(frozen=True)
class Report:
    """Everything that is said about a result.

    Attributes:
        title: of the campaign; subtitle: what was fitted.
        kind: of the recordings.
        real: measured (True), simulated (False), or nobody said (None).
        verdict: the few sentences to read if nothing else is read.
        warnings: what to be careful about.
        parameters: by name, in the unit of files.
        sections: the rest, in order.
        tables: constants that simulations load, by file name.
        more: further content of `report.json`.
        draw: makes the figures, each with its caption, by name.
        seed: of what was drawn.
    """

    title: str
    subtitle: str
    kind: str
    real: bool | None
    verdict: list[str]
    warnings: list[str]
    parameters: Mapping[str, Estimate]
    sections: list[Section]
    tables: Mapping[str, Calibration]
    more: Mapping[str, Any]
    draw: Callable[[], dict[str, tuple[Figure, str]]]
    seed: int = 0
    csv: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The whole report as plain text."""
        label = " (SIMULATED data, not measured)" if self.real is False else ""
        parts = [Section("Verdict", tuple(self.verdict))]
        parts += [Section("Warnings", tuple(self.warnings))] if self.warnings else []
        parts += [s for s in self.sections if s.sentences or s.table]
        return "\n\n".join([f"{self.title}{label}", *(part.text for part in parts)])

    def page(self, drawn: Mapping[str, tuple[Figure, str]]) -> str:
        """The whole report as one page.

        Args:
            drawn: what `draw` made.
        """
        parts = [html.paragraph("simulated data, not measured", "label")] if self.real is False else []
        parts += [html.heading(self.title, 1), html.paragraph(self.subtitle, "subtitle")]
        parts += [html.verdict(self.verdict)]
        parts += [html.paragraph(sentence, "warning") for sentence in self.warnings]
        for section in self.sections:
            if not (section.sentences or section.table or section.figures):
                continue
            parts += [html.heading(section.title), html.bullets(section.sentences)]
            if section.table:
                table = section.table
                parts += [html.table(table.header, table.rows, section.note, table.chosen)]
            parts += [html.figure(*drawn[name]) for name in section.figures if name in drawn]
        footer = f"pneusma characterise, seed {self.seed}"
        return html.page(f"{self.title}: characterisation", parts, footer)

    def json(self) -> dict[str, Any]:
        """The content of `report.json`."""
        return {
            "schema": SCHEMA,
            "kind": self.kind,
            "title": self.title,
            "real": self.real,
            "verdict": self.verdict,
            "parameters": {
                name: {"value": e.value, "sd": e.sd, "unit": e.unit, "at_bound": e.at_bound}
                for name, e in self.parameters.items()
            },
            "warnings": self.warnings,
            **self.more,
            "seed": self.seed,
        }

    def documents(self) -> dict[str, str | bytes]:
        """Content of every file of the result, by file name."""
        drawn = self.draw()
        rows = [[n, e.value, e.sd, e.unit, "yes" if e.at_bound else "no"] for n, e in self.parameters.items()]
        content = json.dumps(plain(self.json()), indent=1, ensure_ascii=False, allow_nan=False)
        return {
            **{name: render_calibration(table) for name, table in self.tables.items()},
            "report.json": content + "\n",
            "report.html": self.page(drawn),
            "parameters.csv": csv_text(["parameter", "value", "sd", "unit", "at_bound"], rows),
            **self.csv,
            **{f"{name}.png": png(figure) for name, (figure, _) in drawn.items()},
        }


def parameter_rows(
    parameters: Mapping[str, Estimate], start: Mapping[str, float], share: Mapping[str, float | None]
) -> TextTable:
    """Parameters with their errors.

    Args:
        parameters: by name.
        start: where each began, in the unit of files.
        share: standard error over the prior's 1-sigma, where there is one.
    """
    rows = []
    for name, e in parameters.items():
        known = math.isfinite(e.sd) and e.sd > 0.0
        text = format_estimate(e.value, e.sd if known else None).replace("+/-", "±")
        relative = f"{100.0 * abs(e.sd / e.value):.2g} %" if known and e.value else ""
        of_prior = share.get(name)
        told = "" if of_prior is None else f"{100.0 * of_prior:.2g} %"
        begun = f"{start[name]:.4g}" if name in start else ""
        rows.append([name, text, e.unit, relative, told, begun, "at bound" if e.at_bound else ""])
    header = ["parameter", "value", "unit", "relative error", "of prior's sd", "start", ""]
    return TextTable(header, rows)


def numbered(value: float) -> str:
    """A number with three digits; nothing where there is none."""
    return f"{value:.3g}" if math.isfinite(value) else ""
