"""Tables of the fit of an elastomer, as texts: the same rows for the terminal, the page and CSV files."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates
from fitting.inference.parameters import format_estimate


@dataclass(frozen=True)
class TextTable:
    """Rows of texts under a header.

    Attributes:
        header: names of the columns.
        rows: cells.
        chosen: row to emphasise, or None.
    """

    header: list[str]
    rows: list[list[str]]
    chosen: int | None = None

    def text(self) -> str:
        """Aligned columns, the first to the left, the chosen row marked."""
        lines = [self.header, *self.rows]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.header))]
        texts = []
        for k, line in enumerate(lines):
            cells = [
                c.ljust(w) if i == 0 else c.rjust(w)
                for i, (c, w) in enumerate(zip(line, widths, strict=True))
            ]
            texts.append(("* " if k - 1 == self.chosen else "  ") + "  ".join(cells).rstrip())
        return "\n".join(texts)


def _kilopascal(value: float | None) -> str:
    return "" if value is None else f"{value / 1e3:.3g}"


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.3g}"


def parameter_table(result: ElastomerCharacterisation) -> TextTable:
    """Constants of the law that was taken, for the whole range and for an actuator's."""
    rows = []
    pairs = [("whole range", result.whole)]
    if result.actuator is not result.whole:
        pairs.append(("actuator's range", result.actuator))
    for where, analysis in pairs:
        for name, estimate in estimates(analysis.best).items():
            error = estimate.sd if math.isfinite(estimate.sd) else None
            text = format_estimate(estimate.value, error).replace("+/-", "±")
            relative = f"{100 * abs(estimate.sd / estimate.value):.2g} %" if error and estimate.value else ""
            bound = "at bound" if estimate.at_bound else ""
            rows.append([name, text, estimate.unit, relative, analysis.best.law.label, where, bound])
    return TextTable(["constant", "value", "unit", "relative error", "law", "fitted to", ""], rows)


def law_table(analysis: Analysis) -> TextTable:
    """Every law with its errors, best first."""
    validation = any(held.validation for held in analysis.held.values())
    recordings = any(held.recordings for held in analysis.held.values())
    header = ["law", "free", "fit kPa", "gaps kPa", "gaps %", "next %"]
    header += ["other pull kPa"] * recordings + ["validation kPa"] * validation
    header += ["dAICc", "dBIC", "monotone"]
    rows = []
    for ranked in analysis.choice.ranked:
        held = analysis.held[ranked.name]
        gaps = held.interpolation
        row = [
            analysis.fits[ranked.name].law.label,
            str(ranked.constants),
            _kilopascal(held.ranges[-1].inside.rmse),
        ]
        row += [_kilopascal(gaps and gaps.rmse), _percent(gaps and gaps.rpd), _percent(held.extrapolation)]
        for wanted, transfers in ((recordings, held.recordings), (validation, held.validation)):
            if wanted:
                squares = [t.score.rmse**2 for t in transfers.values()]
                row.append(_kilopascal(float(np.sqrt(np.mean(squares))) if squares else None))
        row += [
            f"{ranked.aicc:.1f}" if ranked.aicc is not None else "",
            f"{ranked.bic:.1f}" if ranked.bic is not None else "",
        ]
        rows.append([*row, "yes" if ranked.usable else "NO"])
    names = [ranked.name for ranked in analysis.choice.ranked]
    return TextTable(header, rows, names.index(analysis.choice.chosen))


def drift_table(analysis: Analysis) -> TextTable:
    """Shear modulus at rest, and error past the range, of every law over the range it was fitted to."""
    reaches = [r.reach for r in next(iter(analysis.held.values())).ranges]
    header = ["law", *(f"to stretch {reach:.3g}" for reach in reaches), "largest drift"]
    rows = []
    for ranked in analysis.choice.ranked:
        cells = []
        for r in analysis.held[ranked.name].ranges:
            modulus, sd = r.fit.shear_modulus()
            text = format_estimate(modulus / 1e3, sd / 1e3) if sd > 0.0 else f"{modulus / 1e3:.3g}"
            cells.append(text.replace("+/-", "±"))
        moving = [d for d in analysis.drifts[ranked.name] if d.drifts]
        worst = max(moving, key=lambda d: d.errors, default=None)
        remark = f"{worst.constant} {worst.errors:.0f} sd" if worst else "none"
        rows.append([analysis.fits[ranked.name].law.label, *cells, remark])
    return TextTable(header, rows)


def csv_text(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Comma-separated text; a number that is not finite is an empty field."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([[_cell(value) for value in row] for row in rows])
    return stream.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, float | np.floating):
        return f"{float(value):.10g}" if math.isfinite(value) else ""
    return value
