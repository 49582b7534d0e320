"""Figures of inverse problems: targets and results of the model, and chains in lumens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.invert.goals import GOALS
from fitting.invert.passage import Passage
from fitting.invert.result import Inversion
from pneusma_jax.late import Late
from pneusma_jax.units import from_si, unit_of_column

from ..figures import (
    BLUE,
    GREY,
    VERMILION,
    axis_label,
    draw_tube,
    legend_above,
    legend_over,
    new,
    series,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ticker = Late("matplotlib.ticker")

MOST_PANELS = 3
FEW = 12
"""Maximum number of targets that each have a tick."""


def targets_figure(result: Inversion, time: np.ndarray | None = None) -> Figure:
    """Figure of target and actual values of every goal, and the drives."""
    x = np.arange(1, result.met.size + 1) if time is None else time
    label = "target" if time is None else "time [s]"
    dots = "o" if time is None else "-"
    goal_of = {column: goal for goal in result.goals for column in GOALS[goal].columns}
    names = list(goal_of)[:MOST_PANELS]
    figure = new.Figure(figsize=(7.2, 2.1 * (len(names) + 2)), layout="constrained")
    panels = figure.subplots(len(names) + 2, 1, sharex=True)
    for k, (axes, name) in enumerate(zip(panels, names, strict=False)):
        unit = "1" if name.startswith("direction") else unit_of_column(name)[1]
        axes.plot(
            x,
            from_si(result.wanted[:, k], unit),
            "o" if time is None else "-",
            color=GREY,
            label="wanted",
            markersize=6,
        )
        axes.plot(
            x,
            from_si(result.values[:, k], unit),
            "." if time is None else "--",
            color=VERMILION,
            label="model",
        )
        if not result.met.all():
            missed = ~result.met
            axes.plot(x[missed], from_si(result.values[missed, k], unit), "x", color=BLUE, label="missed")
        axes.set_ylabel(axis_label(name))
        _widen(axes, from_si(2.0 * GOALS[goal_of[name]].tolerance, unit))
        legend_above(axes)
    panels[-2].plot(x, from_si(result.pressure, "kPa"), dots, color=BLUE, markersize=3)
    panels[-2].set_ylabel("gauge pressure [kPa]")
    _widen(panels[-2], 1.0)
    if time is None:
        count = result.met.size
        panels[-1].set_xlim(0.5, count + 0.5)
        places = ticker.FixedLocator(x) if count <= FEW else ticker.MaxNLocator(integer=True)
        panels[-1].xaxis.set_major_locator(places)
    for k in range(len(result.springs)):
        look = series(k, points=time is None)
        panels[-1].plot(x, result.fractions[:, k], markersize=4, label=f"xi0_{result.spring_name(k)}", **look)
    panels[-1].set(ylabel="martensite fraction [1]", xlabel=label, ylim=(-0.05, 1.05))
    legend_above(panels[-1], 4)
    return figure


def _widen(axes: Axes, least: float) -> None:
    """A vertical axis that spans at least so much, so that rounding errors do not fill it."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def passage_figure(results: Sequence[Passage]) -> Figure:
    """Figure of bodies in their lumens, each from two sides."""
    figure = new.Figure(figsize=(3.6 * len(results), 7.6), layout="constrained")
    panels = figure.subplots(2, len(results), squeeze=False)
    for (above, below), one in zip(panels.T, results, strict=True):
        for axes, axis in ((above, 0), (below, 1)):
            tube = 1e3 * one.lumen.points[:, [axis, 2]], 500.0 * one.lumen.diameter
            draw_tube(axes, *tube, GREY, "lumen", 0.3)
            radius = 1e3 * max(float(s.section.radius) for s in one.solved.body.segments)
            body = "actuator" if one.alone else "chain"
            draw_tube(axes, 1e3 * one.line[:, [axis, 2]], radius, VERMILION, body, 0.3)
            # limits grow until the scales are equal: a panel as narrow as a tube has no room for its ticks
            axes.set(xlabel=f"position {'xy'[axis]} [mm]", ylabel="position z [mm]")
            axes.set_aspect("equal", adjustable="datalim")
        gap = from_si(one.clearance, "mm")
        room = f"{gap:.1f} mm free" if gap >= 0.0 else f"{-gap:.1f} mm of overlap"
        above.set_title(f"{one.lumen.name}\ntortuosity {one.lumen.tortuosity:.2f}, {room}", fontsize=10)
    legend_over(figure, panels[0, 0].get_legend_handles_labels()[0], place="outside lower center")
    return figure
