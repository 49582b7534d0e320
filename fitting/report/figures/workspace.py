"""Figures of workspaces: computed states in the form of the source's Fig. 3.25, and reach of chains."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fitting.simulate.workspace import ChainReach, Workspace
from pneusma_jax.units import from_si

from . import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, legend_over, style

LOOKS = {
    "pneuflex_s": ("PneuFLEX s", GREEN),
    "pneusma1": ("PneuSMA1", ORANGE),
    "pneusma2": ("PneuSMA2", BLUE),
}
OTHERS = (PURPLE, VERMILION, SKY)  # Colours in turn for designs that are not the source's
MOST_TICKS = 5
BAR_MM = 20.0
"""Length of the bar that tells the scale of shapes [mm]; an actuator is some three times as long."""


def workspace_figure(workspaces: Sequence[Workspace]) -> Figure:
    """Reachable curvature and bend angle over pressure, and the most and least bent shape of each design.

    A design with springs reaches a shaded region, because its activation can be chosen. One without springs
    reaches a line.

    Args:
        workspaces: workspaces with one or more solved states each.
    """
    with style():
        figure = Figure(figsize=(11.0, 8.6), layout="constrained")
        count = len(workspaces)
        mosaic = [["curvature"] * count + ["bend"] * count]
        mosaic.append([name for k in range(count) for name in (f"shape {k}", f"shape {k}")])
        panels = figure.subplot_mosaic(mosaic, height_ratios=(1.0, 1.05))
        for workspace in workspaces:
            _reach(panels["curvature"], workspace, workspace.curvature)
            _reach(panels["bend"], workspace, from_si(workspace.bend, "deg"))
        panels["curvature"].set_ylabel("curvature [1/m]")
        panels["bend"].set_ylabel("bend angle [deg]")
        for name in ("curvature", "bend"):
            panels[name].set_xlabel("gauge pressure [kPa]")
            panels[name].margins(x=0.0)
            panels[name].axhline(0.0, color="black", linewidth=0.8)
        handles, labels = panels["curvature"].get_legend_handles_labels()
        legend_over(figure, handles, labels, count)
        views = [panels[f"shape {k}"] for k in range(count)]
        for axes, workspace in zip(views, workspaces, strict=True):
            _shapes(axes, workspace)
        _same_scale(views)
        _scale_bar(views[0])
        figure.text(
            0.5,
            0.005,
            "solid red: heated spring; dashed grey: cold spring; xi0: martensite fraction; to one scale",
            ha="center",
            va="bottom",
        )
    return figure


def activation_figure(workspaces: Sequence[Workspace], levels: int = 4) -> Figure:
    """Curvature and bend angle over the martensite fraction of the heated spring, at a few pressures.

    Args:
        workspaces: workspaces of designs with springs.
        levels: number of pressures to show.
    """
    with style():
        figure = Figure(figsize=(1.0 + 4.6 * len(workspaces), 7.0), layout="constrained")
        panels = figure.subplots(2, len(workspaces), sharex=True, sharey="row", squeeze=False)
        for (above, below), workspace in zip(panels.T, workspaces, strict=True):
            shown = np.unique(np.linspace(0, len(workspace.pressure) - 1, levels).round().astype(int))
            for colour, k in zip(
                colormaps["viridis"](np.linspace(0.0, 0.85, len(shown))), shown, strict=True
            ):
                label = f"{from_si(workspace.pressure[k], 'kPa'):g} kPa"
                for branch in np.flatnonzero(workspace.heated):
                    mark = {"color": colour, "label": label if branch == 0 else None}
                    above.plot(workspace.xi0, workspace.curvature[branch, :, k], **mark)
                    below.plot(workspace.xi0, from_si(workspace.bend[branch, :, k], "deg"), **mark)
            several = len(workspace.heated) > 1
            side = "; heating spring 1 bends the other way" if several else ""
            side = side if workspace.planar else "; one spring heated at a time"
            above.set_title(f"{_tag(workspace.design)[0]}{side}", fontsize=10)
            below.set_xlabel("martensite fraction xi0 of the heated spring [1]")
        panels[0, 0].invert_xaxis()  # the axes are shared: from cold to hot
        panels[0, 0].set_ylabel("curvature [1/m]")
        panels[1, 0].set_ylabel("bend angle [deg]")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        legend_over(figure, handles, labels, levels)
    return figure


def _same_scale(views: Sequence[Axes]) -> None:
    """Give all views one scale and one ground line."""
    width = max(np.ptp(view.get_xlim()) for view in views)
    low = min(view.get_ylim()[0] for view in views)
    high = max(view.get_ylim()[1] for view in views)
    for view in views:
        middle = float(np.mean(view.get_xlim()))
        view.set_xlim(middle - 0.5 * width, middle + 0.5 * width)
        view.set_ylim(low, high)


def _scale_bar(view: Axes) -> None:
    """A bar of `BAR_MM` with its length, in the lower left corner of a view in mm."""
    left, low = view.get_xlim()[0], view.get_ylim()[0]
    view.plot([left, left + BAR_MM], [low, low], color="black", linewidth=2.0, clip_on=False)
    view.text(left + 0.5 * BAR_MM, low + 1.5, f"{BAR_MM:g} mm", ha="center", va="bottom", fontsize=8.5)


def direction_figure(workspaces: Sequence[Workspace]) -> Figure:
    """Figure of bend angle over its direction, for designs that bend freely; every solved state is a point.

    Args:
        workspaces: workspaces of such designs, with one or more states each.
    """
    with style():
        figure = Figure(figsize=(1.2 + 5.0 * len(workspaces), 5.2), layout="constrained")
        panels = figure.subplots(1, len(workspaces), subplot_kw={"projection": "polar"}, squeeze=False)[0]
        most = max(float(np.nanmax(from_si(w.bend, "deg"))) for w in workspaces)
        for axes, workspace in zip(panels, workspaces, strict=True):
            pressure = np.broadcast_to(from_si(workspace.pressure, "kPa"), workspace.bend.shape)
            where, far = workspace.direction.ravel(), from_si(workspace.bend, "deg").ravel()
            points = axes.scatter(where, far, c=pressure.ravel(), s=5, cmap="viridis", linewidths=0)
            axes.set_title(f"{_tag(workspace.design)[0]}: bend angle [deg] over bend direction", fontsize=10)
            axes.set_rmax(1.05 * most)
            axes.set_rlabel_position(15.0)
            axes.yaxis.set_major_locator(MaxNLocator(MOST_TICKS))
        figure.colorbar(points, ax=list(panels), shrink=0.75, label="gauge pressure [kPa]")
    return figure


def reach_figure(reach: ChainReach) -> Figure:
    """Figure of a chain's tip positions in two views.

    Args:
        reach: reach with one or more solved states.
    """
    tips, pressure = from_si(reach.tip, "mm"), from_si(reach.pressure, "kPa")
    with style():
        figure = Figure(figsize=(11.0, 5.6), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for axes, across in zip(panels, (0, 1), strict=True):
            points = axes.scatter(tips[:, across], tips[:, 2], c=pressure, s=3, cmap="viridis", linewidths=0)
            axes.plot(0.0, 0.0, "ks", markersize=7)
            axes.set_xlabel(f"position {'xy'[across]} of the tip [mm]")
            axes.set_aspect("equal", adjustable="datalim")
        panels[0].set_ylabel("position z of the tip [mm]")
        figure.suptitle(f"{reach.name}: places of the tip; the square is the base", fontsize=12)
        figure.colorbar(points, ax=list(panels), shrink=0.8, label="gauge pressure [kPa]")
    return figure


def _tag(design: str) -> tuple[str, str]:
    """Name and colour of a design. The same name gets the same colour in every figure."""
    return LOOKS.get(design) or (design, OTHERS[sum(map(ord, design)) % len(OTHERS)])


def _reach(axes: Axes, workspace: Workspace, values: np.ndarray) -> None:
    name, colour = _tag(workspace.design)
    pressure = from_si(workspace.pressure, "kPa")
    if not workspace.springs:
        axes.plot(pressure, values[0, 0], color=colour, linewidth=2.6, label=name, zorder=3)
        return
    reached = np.isfinite(values).any(axis=(0, 1))
    least = np.nanmin(values[..., reached], axis=(0, 1))
    most = np.nanmax(values[..., reached], axis=(0, 1))
    hottest = f"{name}, heated to xi0 = {workspace.xi0.min():g}"
    axes.fill_between(pressure[reached], least, most, color=colour, alpha=0.28, linewidth=0, label=hottest)
    for edge in (least, most):
        axes.plot(pressure[reached], edge, color=colour, linewidth=1.4)


def _shapes(axes: Axes, workspace: Workspace) -> None:
    """Draw a side view of the least and the most bent state, each standing on its clamp, with its numbers
    below."""
    name, colour = _tag(workspace.design)
    radius = 0.5 * from_si(workspace.outer_diameter, "mm")
    left = 0.0
    places = []
    for largest in (False, True):
        index = workspace.extreme(largest)
        length, bend = from_si(float(workspace.length[index]), "mm"), float(workspace.bend[index])
        activation = workspace.activation_of(index)
        sides = [side_line(length, bend, offset) for offset in (radius, -radius)]
        width = np.ptp(np.concatenate([x for x, _ in sides]))
        shift = left - min(x.min() for x, _ in sides)
        outline = np.concatenate([np.stack(sides[0]), np.stack(sides[1])[:, ::-1]], axis=1)
        axes.fill(outline[0] + shift, outline[1], color=colour, alpha=0.35, linewidth=0)
        for number, (x, y) in zip((1, 2), sides, strict=True):
            hot = workspace.planar and activation.get(number, 1.0) < 1.0
            spring = workspace.planar and number in activation
            axes.plot(
                x + shift, y, color=VERMILION if hot else GREY, linewidth=2.6 if spring else 0.8,
                linestyle="-" if hot or not spring else (0, (2, 1)),
            )  # fmt: skip
        axes.plot([shift - 1.6 * radius, shift + 1.6 * radius], [0.0, 0.0], color="black", linewidth=3.0)
        places.append((left + 0.5 * width, _words(workspace, index)))
        left += width + 7.0 * radius
    low, high = axes.get_ylim()
    axes.set_ylim(low - 36.0, high)  # a strip for the text
    for x, words in places:
        axes.text(x, low - 4.0, words, ha="center", va="top", fontsize=8.5)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(f"{name}: smallest and largest curvature", fontsize=10)


def _words(workspace: Workspace, index: tuple[int, int, int]) -> str:
    bend = round(float(from_si(workspace.bend[index], "deg"))) + 0
    lines = [f"{round(float(workspace.curvature[index]), 1) + 0.0:g} 1/m, {bend:d} deg"]
    lines.append(f"at {from_si(workspace.pressure[index[2]], 'kPa'):g} kPa")
    lines += [f"xi0 of spring {n}: {value:g}" for n, value in workspace.activation_of(index).items()]
    if abs(bend) > workspace.touching_deg:
        lines.append("(contact is not modelled)")
    return "\n".join(lines)


def side_line(length: float, bend: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """A line along the bent actuator, which stands at the origin, points up and bends to the right.

    Args:
        length: length of the centre line.
        bend: bend angle [rad].
        offset: offset of the line from the centre line towards side 1, which is on the left.

    Returns:
        Coordinates of 90 points, each of shape (90,).
    """
    if abs(bend) < 1e-6:
        return np.full(90, -offset), np.linspace(0.0, length, 90)
    turned, radius = np.linspace(0.0, bend, 90), length / bend
    return radius - (radius + offset) * np.cos(turned), (radius + offset) * np.sin(turned)
