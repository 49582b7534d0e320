"""Closed-loop control as text, figures and files."""

import json

import numpy as np
from matplotlib.figure import Figure

from fitting.control.loop import Run
from fitting.control.sweep import HOLD, STEP, Sweep
from fitting.data.csv_text import csv_text
from fitting.report.figures import BLUE, GREEN, GREY, VERMILION, legend_above, png, style
from fitting.report.render import plain
from fitting.report.table import Table, table_text

SINCE = 10.0
"""Time from which errors count [s]: five seconds after the step."""


def _cell(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "does not"


def rows(result: Sweep) -> list[list[str]]:
    """Table rows, one for every case."""
    found = []
    for case in result.cases:
        cells = [case.name]
        for run in (case.without, case.known):
            if run is None:
                cells += ["", "", ""]
                continue
            cells += [
                f"{run.rmse(SINCE):.2f}",
                _cell(run.settling(STEP, HOLD)),
                f"{run.rmse(SINCE, observer=True):.2f}",
            ]
        found.append(cells)
    return found


HEADER = (
    "concealed", "RMSE [1/m]", "settles in [s]", "observer [1/m]", "told: RMSE [1/m]", "settles in [s]",
    "observer [1/m]",
)  # fmt: skip


def text(result: Sweep) -> str:
    """The table and the conclusions."""
    known = [c for c in result.cases if c.known is not None]
    worst = max(known, key=lambda c: c.without.rmse(SINCE))
    gain = max(known, key=lambda c: c.without.rmse(SINCE) - c.known.rmse(SINCE))
    return "\n".join([
        f"Curvature is spoilt most by {worst.name}: {worst.without.rmse(SINCE):.2f} 1/m root mean square.",
        f"Knowing it gives back most for {gain.name}: {gain.known.rmse(SINCE):.2f} instead of "
        f"{gain.without.rmse(SINCE):.2f} 1/m.",
        "",
        table_text(Table(HEADER, rows(result)), indent=0),
    ])  # fmt: skip


def course_figure(result: Sweep) -> Figure:
    """Figure of target and actual curvature of every case."""
    cases, count = result.cases, len(result.cases)
    with style():
        figure = Figure(figsize=(11.0, 1.0 + 2.1 * ((count + 1) // 2)), layout="constrained")
        panels = figure.subplots((count + 1) // 2, 2, sharex=True, sharey=True, squeeze=False).ravel()
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
            axes.set_visible(False)
        for axes in panels[::2]:
            axes.set_ylabel("curvature [1/m]")
        for axes in panels[-2:]:
            axes.set_xlabel("time [s]")
        handles, labels = panels[1 if count > 1 else 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3)
    return figure


def step_figure(run: Run) -> Figure:
    """Figure of the step of one run: curvature, resistances, currents, phases."""
    rows_of = run.time <= HOLD
    time = run.time[rows_of]
    with style():
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
    with style():
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


def documents(result: Sweep) -> dict[str, str | bytes]:
    """Files of a sweep."""
    summary = [
        {
            "concealed": case.name,
            **{
                label: None if run is None else {
                    "rmse_1pm": run.rmse(SINCE), "settling_s": run.settling(STEP, HOLD),
                    "observer_rmse_1pm": run.rmse(SINCE, observer=True),
                }
                for label, run in (("without", case.without), ("known", case.known))
            },
        }
        for case in result.cases
    ]  # fmt: skip
    first = result.cases[0].without
    columns = {"time_s": first.time, "wanted_1pm": first.wanted}
    for case in result.cases:
        name = case.name.replace(" ", "_")
        columns[f"{name}_1pm"] = case.without.curvature
        if case.known is not None:
            columns[f"{name}_known_1pm"] = case.known.curvature
    return {
        "control.csv": csv_text(columns),
        "control.txt": text_or_table(result) + "\n",
        "course.png": png(course_figure(result)),
        "rmse.png": png(rmse_figure(result)),
        "step.png": png(step_figure(first)),
        "report.json": json.dumps(plain({"schema": "pneusma-control/1", "cases": summary}), indent=1) + "\n",
    }


def text_or_table(result: Sweep) -> str:
    """The whole text where a conclusion is possible, the table alone elsewhere."""
    return (
        text(result)
        if any(c.known is not None for c in result.cases)
        else table_text(Table(HEADER, rows(result)), indent=0)
    )
