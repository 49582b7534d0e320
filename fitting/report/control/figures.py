"""Figures of closed loops: time histories of all cases, the step of one, errors of all cases."""

import numpy as np
from matplotlib.figure import Figure

from fitting.control.loop import Run
from fitting.control.sweep import HOLD, Sweep

from ..figures import BLUE, GREEN, GREY, VERMILION, legend_above
from .words import SINCE


def course_figure(result: Sweep) -> Figure:
    """Figure of target and actual curvature of every case."""
    cases, count = result.cases, len(result.cases)
    columns, rows = min(count, 2), (count + 1) // 2
    figure = Figure(figsize=(11.0 if columns == 2 else 7.2, 1.0 + 2.1 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, case in zip(panels, cases, strict=False):
        axes.plot(case.without.time, case.without.wanted, color=GREY, label="wanted")
        axes.plot(
            case.without.time,
            case.without.curvature,
            color=VERMILION,
            linewidth=1.2,
            label="base model in the controller",
        )
        if case.known is not None:
            axes.plot(
                case.known.time,
                case.known.curvature,
                color=BLUE,
                linewidth=1.2,
                label="with the found physics",
            )
        axes.set_title(case.name.replace("_", " "), fontsize=10, loc="left")
    for axes in panels[count:]:
        axes.remove()
    for axes in panels[:count:2]:
        axes.set_ylabel("curvature [1/m]")
    for axes in panels[max(count - 2, 0) : count]:  # the lowest of each column
        axes.set_xlabel("time [s]")
        axes.xaxis.label.set_visible(True)
        axes.tick_params(labelbottom=True)
    handles, labels = panels[1 if count > 1 else 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=3)
    return figure


def step_figure(run: Run) -> Figure:
    """Figure of the step of one run: curvature, resistances, currents, phases."""
    rows_of = run.time <= HOLD
    time = run.time[rows_of]
    figure = Figure(figsize=(7.2, 8.4), layout="constrained")
    top, second, third, last = figure.subplots(4, 1, sharex=True)
    top.plot(time, run.wanted[rows_of], color=GREY, label="wanted")
    top.plot(time, run.curvature[rows_of], color=VERMILION, label="plant")
    top.plot(time, run.observed[rows_of], "--", color=BLUE, label="observer")
    top.set_ylabel("curvature [1/m]")
    legend_above(top)
    names = ("spring 1", "spring 2")
    for axes, values, label in (
        (second, run.resistances, "resistance [ohm]"), (third, run.currents, "current [A]"),
        (last, run.fractions, "martensite fraction [1]"),
    ):  # fmt: skip
        for k, colour in ((0, GREEN), (1, VERMILION)):
            axes.plot(time, values[rows_of, k], color=colour, label=names[k])
        axes.set_ylabel(label)
    legend_above(second)
    last.set_xlabel("time [s]")
    return figure


def rmse_figure(result: Sweep) -> Figure:
    """Figure of the errors of all cases."""
    figure = Figure(figsize=(7.2, 1.2 + 0.5 * len(result.cases)), layout="constrained")
    axes = figure.subplots()
    at = np.arange(len(result.cases))
    axes.barh(
        at - 0.18,
        [c.without.rmse(SINCE) for c in result.cases],
        0.34,
        color=VERMILION,
        label="base model in the controller",
    )
    known = [np.nan if c.known is None else c.known.rmse(SINCE) for c in result.cases]
    axes.barh(at + 0.18, known, 0.34, color=BLUE, label="with the found physics")
    axes.set(
        yticks=at,
        yticklabels=[c.name.replace("_", " ") for c in result.cases],
        xlabel="error of the curvature, root mean square [1/m]",
    )
    axes.invert_yaxis()
    legend_above(axes, 2)
    return figure
