"""Figures of a diagnosis: recordings against both models, residuals, probabilities."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.data.recordings import Recording, schema
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.inference.driven import STEADIER, driver_and_output
from fitting.inference.notes import joined
from fitting.report.figures import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    axis_label,
    legend_over,
    measured_marks,
    residual_over_noise,
    style,
)
from fitting.specimens import specimen_of
from pneusma_jax.errors import counted
from pneusma_jax.units import from_si

MOST_SHOWN = 6
MOST_BARS = 8
"""Maximum number of candidates with a bar of their own; the others share one."""
BASE, AFTER, APART = VERMILION, BLUE, GREY


def recordings_figure(conclusion: Conclusion) -> Figure:
    """Each recording with the refitted base model and the final one, and the residuals of both below.

    A kind with several outputs has two strips of residuals: of the output that is drawn, and of the other one
    that the base model misses most.
    """
    shown = shown_recordings(conclusion)
    other = _other_output(conclusion)
    strips = 1 if other is None else 2
    with style():
        columns = min(3, len(shown))
        rows, high = -(-len(shown) // columns), 1 + strips
        figure = Figure(figsize=(4.2 * columns, (2.6 + strips) * rows), layout="constrained")
        ratios = [2.2, *([1.0] * strips)] * rows
        axes = figure.subplots(high * rows, columns, squeeze=False, gridspec_kw={"height_ratios": ratios})
        for place in range(rows * columns):
            panels = axes[high * (place // columns) : high * (place // columns + 1), place % columns]
            if place < len(shown):
                _one(conclusion, shown[place], panels, other)
            else:
                for panel in panels:
                    panel.axis("off")
        known = {}
        for panel in axes[::high].flat:
            known |= {text: line for line, text in zip(*panel.get_legend_handles_labels(), strict=True)}
        legend_over(figure, known.values(), known, len(known))
    return figure


def _other_output(conclusion: Conclusion) -> str | None:
    """Quantity that the base model misses most, of those that are not drawn; None if there is one output."""
    x = conclusion.explanation
    square: dict[str, float] = {}
    for k, channels in enumerate(x.program.channels):
        for j, channel in enumerate(channels[1:], start=1):
            missed = (x.base.evaluation.predicted[k][j] - channel.measured) / channel.sigma
            square[channel.quantity] = square.get(channel.quantity, 0.0) + float(np.nansum(missed**2))
    return max(square, key=square.get, default=None)


def outputs_not_drawn(conclusion: Conclusion) -> list[str]:
    """Outputs of the recordings whose residuals the figure leaves out, in words."""
    drawn = _other_output(conclusion)
    others = (c.quantity for channels in conclusion.explanation.program.channels for c in channels[1:])
    return [name.replace("_", " ") for name in dict.fromkeys(others) if name != drawn]


def shown_recordings(conclusion: Conclusion) -> list[int]:
    """Recordings to draw: validation ones first, then those with most misfit."""
    x = conclusion.explanation
    order = sorted(
        range(len(x.program.recordings)),
        key=lambda k: (x.program.fitted[k], -float(np.sum(x.base.evaluation.misfit[k] ** 2))),
    )
    return sorted(order[:MOST_SHOWN])


def _one(conclusion: Conclusion, k: int, panels: Sequence[Axes], other: str | None) -> None:
    """One recording: an output in the first panel, residuals in the others.

    Args:
        conclusion: conclusion of a diagnosis.
        k: number of the recording.
        panels: for the first output, its residuals and, if there is another output, that one's residuals.
        other: the other output.
    """
    x = conclusion.explanation
    recording, channels = x.program.recordings[k], x.program.channels[k]
    top, below = panels[:2]
    channel = channels[0]
    column = schema.column_of(recording.kind, channel.quantity)
    unit = schema.quantity_and_unit(column)[1]
    counted = np.isfinite(channel.sigma)
    time = np.asarray(x.program.stacked.time)[k]
    show = lambda values: from_si(np.asarray(values)[counted], unit)  # noqa: E731
    base, after = x.base.evaluation.predicted[k][0], conclusion.shown.predicted[k][0]
    marks = measured_marks(int(np.sum(counted)))
    top.plot(time[counted], show(channel.measured), label="measured", **marks)
    begun = specimen_of(recording.kind).set_apart(recording)
    if begun is not None:
        clock = recording.si("time") if recording.has("time") else np.arange(len(recording))
        first = recording.columns[column][: begun.rows]
        top.plot(clock[: begun.rows], first, "x", ms=2.5, color=APART, label="first heating, set apart")
    top.plot(time[counted], show(base), color=BASE, ls="--", lw=1.3, label="base model, refitted")
    if conclusion.changed:
        terms = ["what was found"] if conclusion.model[1].slugs else []
        terms += ["a smooth term, unexplained"] if conclusion.remainder is not None else []
        top.plot(time[counted], show(after), color=AFTER, lw=1.3, label=f"with {joined(terms)}")
    role = "" if x.program.fitted[k] else " (validation)"
    top.set_title(f"{recording.name}{role}{_driven(recording)}", fontsize=9)
    top.set_ylabel(axis_label(column), fontsize=8)
    _residuals(conclusion, k, 0, below)
    if other is not None:
        below.set_ylabel(residual_over_noise(channel.quantity.replace("_", " ")), fontsize=7)
        second = [j for j, more in enumerate(channels) if j > 0 and more.quantity == other]
        for j in second:
            _residuals(conclusion, k, j, panels[2])
        if second:
            panels[2].set_ylabel(residual_over_noise(other.replace("_", " ")), fontsize=7)
        else:
            panels[2].axis("off")
            panels = panels[:2]
    rows = conclusion.place.rows
    if conclusion.mismatch and rows is not None and rows[0] == recording.name:
        for axes in panels:
            axes.axvspan(time[rows[1] - 1], time[rows[2] - 1], color=ORANGE, alpha=0.2, lw=0)
    panels[-1].set_xlabel(axis_label("time_s"), fontsize=8)
    for axes in panels:
        axes.set_xlim(top.get_xlim())
        axes.tick_params(labelsize=7)


def _driven(recording: Recording) -> str:
    """Words below the name of a wire's recording: the quantity that is drawn, and the one that drives it."""
    pair = driver_and_output(recording)
    return "" if pair is None else f"\n{pair[1]} drawn, {pair[0]} drives the model"


def drawn_outputs(recordings: Sequence[Recording]) -> str:
    """Sentence on which of a wire's strain and stress is drawn, and why; empty for other kinds."""
    names: dict[tuple[str, str], list[str]] = {}
    for recording in recordings:
        if (pair := driver_and_output(recording)) is not None:
            names.setdefault(pair, []).append(recording.name)
    if not names:
        return ""
    parts = [
        f"{output} of {joined(of)}, driven by {driver}" for (driver, output), of in names.items()
    ]
    return (
        f"Drawn is what the model predicts of a wire: {'; '.join(parts)}. Stress drives it where it varies"
        f" less than {STEADIER:.0%} as much as strain, over their largest values; elsewhere strain does."
    ).replace("%", " %")


def _residuals(conclusion: Conclusion, k: int, j: int, axes: Axes) -> None:
    """Residuals of one output of one recording under both models, in standard deviations of its noise.

    A residual is measured less model.
    """
    x = conclusion.explanation
    channel = x.program.channels[k][j]
    counted = np.isfinite(channel.sigma)
    time, sigma = np.asarray(x.program.stacked.time)[k][counted], channel.sigma[counted]
    models = [(x.base.evaluation, BASE), *([(conclusion.shown, AFTER)] if conclusion.changed else [])]
    for evaluation, colour in models:
        missed = (channel.measured - np.asarray(evaluation.predicted[k][j]))[counted]
        axes.plot(time, missed / sigma, color=colour, lw=0.9)
    axes.axhspan(-2, 2, color=SKY, alpha=0.25, lw=0)
    axes.set_ylabel(residual_over_noise(), fontsize=7)


def probability_figure(conclusion: Conclusion) -> Figure:
    """The likeliest explanations as bars, with `unknown` and `nothing missing`."""
    pool = {slug: p for slug, (p, _) in conclusion.candidates.items()}
    every = sorted(pool, key=lambda s: -pool[s])
    ranked, rest = every[:MOST_BARS], every[MOST_BARS:]
    names, values = list(ranked), [pool[s] for s in ranked]
    colours = [AFTER] * len(ranked)
    if rest:
        names.append(f"{counted(len(rest), 'further candidate')} together")
        values.append(sum(pool[s] for s in rest))
        colours.append(SKY)
    names += ["unmodelled: none of these", "nothing is missing"]
    values += [conclusion.unknown, conclusion.nothing]
    colours += [GREY, GREEN]
    with style():
        figure = Figure(figsize=(6.4, 0.34 * len(names) + 0.9), layout="constrained")
        axes = figure.subplots()
        axes.barh(range(len(names)), values, color=colours)
        axes.set_yticks(range(len(names)), [n.replace("_", " ") for n in names], fontsize=8)
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel("probability of being the strongest explanation [1]")
    return figure
