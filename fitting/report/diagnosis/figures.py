"""Figures of a diagnosis: recordings against both models, residuals, probabilities."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.data.recordings import schema
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.inference.notes import joined
from fitting.report.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    axis_label,
    legend_over,
    style,
)
from fitting.specimens import specimen_of
from pneusma_jax.units import from_si

MOST_SHOWN = 6
BASE, AFTER, DATA, APART = VERMILION, BLUE, BLACK, GREY


def recordings_figure(conclusion: Conclusion) -> Figure:
    """Each recording with the refitted base model and the final one, and the residuals of both below."""
    shown = _shown(conclusion)
    with style():
        columns = min(3, len(shown))
        rows = -(-len(shown) // columns)
        figure = Figure(figsize=(4.2 * columns, 3.6 * rows), layout="constrained")
        axes = figure.subplots(
            2 * rows, columns, squeeze=False, gridspec_kw={"height_ratios": [2.2, 1.0] * rows}
        )
        for place, k in enumerate(shown):
            top, below = (
                axes[2 * (place // columns), place % columns],
                axes[2 * (place // columns) + 1, place % columns],
            )
            _one(conclusion, k, top, below)
        for place in range(len(shown), rows * columns):
            axes[2 * (place // columns), place % columns].axis("off")
            axes[2 * (place // columns) + 1, place % columns].axis("off")
        known = {}
        for panel in axes[::2].flat:
            known |= {text: line for line, text in zip(*panel.get_legend_handles_labels(), strict=True)}
        legend_over(figure, known.values(), known, len(known))
    return figure


def _shown(conclusion: Conclusion) -> list[int]:
    """Recordings to draw: validation ones first, then those with most misfit."""
    x = conclusion.explanation
    order = sorted(
        range(len(x.program.recordings)),
        key=lambda k: (x.program.fitted[k], -float(np.sum(x.base.evaluation.misfit[k] ** 2))),
    )
    return sorted(order[:MOST_SHOWN])


def _one(conclusion: Conclusion, k: int, top: Axes, below: Axes) -> None:
    x = conclusion.explanation
    recording, channel = x.program.recordings[k], x.program.channels[k][0]
    known = schema.KINDS[recording.kind].columns.outputs
    column = next(c for c in known if schema.quantity_and_unit(c)[0] == channel.quantity)
    unit = schema.quantity_and_unit(column)[1]
    counted = np.isfinite(channel.sigma)
    time = np.asarray(x.program.stacked.time)[k][counted]
    show = lambda values: from_si(np.asarray(values)[counted], unit)  # noqa: E731
    base, after = x.base.evaluation.predicted[k][0], conclusion.shown.predicted[k][0]
    top.plot(time, show(channel.measured), ".", ms=2.5, color=DATA, label="measured")
    begun = specimen_of(recording.kind).set_apart(recording)
    if begun is not None:
        clock = recording.si("time") if recording.has("time") else np.arange(len(recording))
        first = recording.columns[column][: begun.rows]
        top.plot(clock[: begun.rows], first, "x", ms=2.5, color=APART, label="first heating, set apart")
    top.plot(time, show(base), color=BASE, lw=1.3, label="base model, refitted")
    changed = conclusion.shown is not x.base.evaluation
    if changed:
        terms = ["what was found"] if conclusion.model[1].slugs else []
        terms += ["a smooth term, unexplained"] if conclusion.remainder is not None else []
        top.plot(time, show(after), color=AFTER, lw=1.3, label=f"with {joined(terms)}")
    role = "" if x.program.fitted[k] else " (validation)"
    top.set_title(f"{recording.name}{role}", fontsize=9)
    top.set_ylabel(axis_label(column), fontsize=8)
    sigma = channel.sigma[counted]
    below.plot(time, (np.asarray(base) - channel.measured)[counted] / sigma, color=BASE, lw=0.9)
    if changed:
        below.plot(time, (np.asarray(after) - channel.measured)[counted] / sigma, color=AFTER, lw=0.9)
    below.axhspan(-2, 2, color=SKY, alpha=0.25, lw=0)
    rows = conclusion.place.rows
    if conclusion.mismatch and rows is not None and rows[0] == recording.name:
        span = np.asarray(x.program.stacked.time)[k]
        for axes in (top, below):
            axes.axvspan(span[rows[1] - 1], span[rows[2] - 1], color=ORANGE, alpha=0.2, lw=0)
    below.set_ylabel("residual\n/ noise [1]", fontsize=8)
    below.set_xlabel(axis_label("time_s"), fontsize=8)
    below.set_xlim(top.get_xlim())
    for axes in (top, below):
        axes.tick_params(labelsize=7)


def probability_figure(conclusion: Conclusion) -> Figure:
    """The likeliest explanations as bars, with `unknown` and `nothing missing`."""
    pool = {slug: p for slug, (p, _) in conclusion.candidates.items()}
    ranked = sorted(pool, key=lambda s: -pool[s])[:8]
    names = [*ranked, "none of these", "nothing is missing"]
    values = [*(pool[s] for s in ranked), conclusion.unknown, conclusion.nothing]
    with style():
        figure = Figure(figsize=(6.4, 0.34 * len(names) + 0.9), layout="constrained")
        axes = figure.subplots()
        colours = [AFTER] * len(ranked) + [GREY, GREEN]
        axes.barh(range(len(names)), values, color=colours)
        axes.set_yticks(range(len(names)), [n.replace("_", " ") for n in names], fontsize=8)
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel("probability of being the strongest explanation [1]")
    return figure
