"""Figures of a design study: shapes to one scale, the workspace, sensitivities, the Pareto front,
failures."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.design.bodies import Solved
from fitting.design.result import DesignResult
from fitting.report.figures import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    draw_tube,
    legend_above,
    style,
)  # fmt: skip
from fitting.report.report import Picture
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.kinematics import arc_points
from pneusma_jax.units import from_si

from .words import label_of, sensitivities, step_of, whose

COLOURS = (VERMILION, BLUE, GREEN, ORANGE, PURPLE, SKY)
MOST_SHAPES = 6
POINTS = 241
"""Points of a centre line: one every 6 degrees of a body that winds four times. With 60 it was a polygon."""
PAD = 0.08
"""Free height above and below panels [inch], twice matplotlib's. With that of matplotlib a label was cut."""
_centre_line = stored_jit()(arc_points)


def pictures(result: DesignResult) -> dict[str, Picture]:
    """Figures by name."""
    found = [
        Picture(
            "shapes",
            f"Shapes to one scale. Grey: {whose(result)} own dimensions; colours: the design, by state.",
            lambda: shapes_figure(result),
        ),
        Picture(
            "sensitivities",
            "What a small step of each parameter changes.",
            lambda: sensitivity_figure(result),
        ),
    ]
    if result.model.states.sweeps:
        caption = "Places that the tip can reach in its plane."
        found.append(Picture("workspace", caption, lambda: workspace_figure(result)))
    if result.front is not None:
        found.append(
            Picture("front", "The front. Ringed: the design of this report.", lambda: front_figure(result))
        )
    if result.chances:
        found.append(
            Picture(
                "chances",
                "The first objective over fresh draws, with how often each fails.",
                lambda: chance_figure(result),
            )
        )
    return {picture.name: picture for picture in found}


def _states_shown(result: DesignResult) -> list[int]:
    """Indices of states to draw: the named ones, else corners of the first sweep."""
    states = result.model.states
    named = [k for k, name in enumerate(states.names) if "/" not in name]
    if named:
        return named[:MOST_SHAPES]
    first, last = next(iter(states.sweeps.values()))
    return list(np.unique(np.linspace(first, last - 1, MOST_SHAPES).astype(int)))


def centre_line(solved: Solved) -> tuple[np.ndarray, float]:
    """Points of the centre line [mm], shape (points, 3), and the tube's radius [mm]."""
    radius = 1e3 * float(solved.body.segments[0].section.radius)
    if solved.chain is not None:
        return 1e3 * np.asarray(solved.chain.shape.polyline()), radius
    one = solved.segments[0]
    return 1e3 * np.asarray(_centre_line(one.bend, one.length, np.linspace(0.0, 1.0, POINTS))), radius


def _titled(figure: Figure, title: str) -> None:
    """Give a figure a title, and room for it: panels of equal scales leave labels less than is laid out."""
    figure.suptitle(title)
    figure.get_layout_engine().set(h_pad=PAD)


def shapes_figure(result: DesignResult) -> Figure:
    """Figure of the design's shapes and those of the original tables, state by state, to one scale."""
    model, shown = result.model, _states_shown(result)
    flat = model.plan.chain is None and all(
        s.planar for s in model.solve_states(result.made.evaluation.place)[0].segments
    )
    views = [("y", 1)] if flat else [("x", 0), ("y", 1)]
    with style():
        figure = Figure(figsize=(5.2 * len(views) + 1.4, 5.2), layout="constrained")
        panels = figure.subplots(1, len(views), squeeze=False)[0]
        for axes, (name, axis) in zip(panels, views, strict=True):
            for design, colours in ((result.base, [GREY] * MOST_SHAPES), (result.made, COLOURS)):
                if design is None:
                    continue
                _, states = model.solve_states(design.evaluation.place)
                for k, colour in zip(shown, colours, strict=False):
                    line, radius = centre_line(states[k])
                    own = design is result.made
                    label = _state_words(result, k) if own else ("tables' own" if k == shown[0] else "")
                    draw_tube(axes, line[:, [axis, 2]], radius, colour, label or "_", 0.3 if own else 0.15)
            _draw_wanted_tips(axes, result, axis, shown)
            axes.set(xlabel=f"position {name} [mm]", ylabel="position z along the tube [mm]", aspect="equal")
        _titled(figure, "Shapes of the design, to one scale")
        legend_above(panels[0], 2)
    return figure


def _draw_wanted_tips(axes: Axes, result: DesignResult, axis: int, shown: list[int]) -> None:
    """Crosses where tips are to be, in the colours of their states."""
    poses = [pose for one in result.study.objectives for pose in one.poses]
    names = [result.model.states.names[k] for k in shown]
    label = "wanted tips"
    for pose in poses:
        if pose.state in names:
            x, z = 1e3 * pose.tip[axis], 1e3 * pose.tip[2]
            colour = COLOURS[names.index(pose.state)]
            axes.plot(x, z, "x", color=colour, markersize=9, markeredgewidth=2.5, label=label, zorder=5)
            label = "_"


def _state_words(result: DesignResult, k: int) -> str:
    states, name = result.model.states, result.model.states.names[k]
    if "/" not in name:
        return name
    hot = ", ".join(
        f"xi0_{n} {x:.2g}" for (_, n), x in zip(result.model.plan.springs, states.fractions[k], strict=True)
    )
    return f"{1e-3 * states.pressure[k]:.3g} kPa, {hot}"


def workspace_figure(result: DesignResult) -> Figure:
    """Figure of the border of the tip's workspace, for the design and the original tables."""
    first, last = next(iter(result.model.states.sweeps.values()))
    with style():
        figure = Figure(figsize=(5.6, 5.2), layout="constrained")
        axes = figure.subplots()
        for design, colour, label in ((result.base, GREY, "tables' own"), (result.made, VERMILION, "design")):
            if design is None:
                continue
            _, states = result.model.solve_states(design.evaluation.place)
            side = np.asarray(states[0].body.segments[0].side_direction)
            tips = 1e3 * np.array([np.asarray(s.end_pose)[:3, 3] for s in states[first:last]])
            flat = np.stack([tips[:, :2] @ side, tips[:, 2]], axis=1)
            axes.fill(*flat.T, color=colour, alpha=0.3, linewidth=0)
            axes.plot(*np.concatenate([flat, flat[:1]]).T, color=colour, label=label)
        axes.set(xlabel="tip towards side 1 [mm]", ylabel="tip along the straight tube [mm]", aspect="equal")
        _titled(figure, "Places that the tip can reach")
        legend_above(axes)
    return figure


def sensitivity_figure(result: DesignResult) -> Figure:
    """Figure of the change of each objective for a step of each parameter."""
    study, free = result.study, result.model.space.free
    steps = sensitivities(result, result.made)
    labels = [f"{f.name}, {step_of(f)[1]}" for f in free]
    with style():
        figure = Figure(
            figsize=(1.6 + 4.2 * len(study.objectives), 1.4 + 0.38 * len(free)), layout="constrained"
        )
        panels = figure.subplots(1, len(study.objectives), sharey=True, squeeze=False)[0]
        for axes, one, values in zip(panels, study.objectives, steps.T, strict=True):
            shown = [from_si(x, one.unit, difference=True) for x in values]
            axes.barh(range(len(free)), shown, color=[VERMILION if x < 0.0 else BLUE for x in shown])
            axes.axvline(0.0, color="black", linewidth=0.8)
            axes.set(xlabel=f"change of {one.name} [{one.unit}]", yticks=range(len(free)), yticklabels=labels)
        panels[0].invert_yaxis()
        _titled(figure, "Change of each objective for a small step of each parameter")
    return figure


def front_figure(result: DesignResult) -> Figure:
    """Figure of the Pareto front, in every pair of objectives."""
    study = result.study
    pairs = list(itertools.combinations(range(len(study.objectives)), 2))
    values = np.array(
        [
            [o.in_unit(x) for x, o in zip(d.objectives, study.objectives, strict=True)]
            for d in result.front.designs
        ]
    )
    chosen = [d.evaluation is result.made.evaluation for d in result.front.designs]
    with style():
        figure = Figure(figsize=(5.2 * len(pairs), 4.2), layout="constrained")
        for axes, (i, j) in zip(figure.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
            line = "-o" if len(pairs) == 1 else "o"
            axes.plot(values[:, i], values[:, j], line, color=BLUE, markersize=5, label="front")
            axes.plot(
                values[chosen, i],
                values[chosen, j],
                "o",
                color=VERMILION,
                markersize=11,
                fillstyle="none",
                label="design",
            )
            if result.base is not None:
                base = [study.objectives[k].in_unit(result.base.objectives[k]) for k in (i, j)]
                axes.plot(*base, "s", color=GREY, label="tables' own")
            axes.set(
                xlabel=f"{label_of(study.objectives[i])} [{study.objectives[i].unit}]",
                ylabel=f"{label_of(study.objectives[j])} [{study.objectives[j].unit}]",
            )
            legend_above(axes)
        _titled(figure, "Pareto front")
    return figure


def chance_figure(result: DesignResult) -> Figure:
    """Figure of the distribution of the first objective over fresh draws."""
    one = result.study.objectives[0]
    with style():
        figure = Figure(figsize=(6.4, 4.2), layout="constrained")
        axes = figure.subplots()
        for (name, chance), colour in zip(result.chances.items(), (VERMILION, BLUE, GREY), strict=False):
            shown = one.in_unit(chance.values)
            label = f"{name}: fails in {100.0 * chance.probability:.3g} %"
            axes.hist(shown, bins=60, histtype="stepfilled", alpha=0.35, color=colour, label=label)
        draws = next(iter(result.chances.values())).draws
        axes.set(xlabel=f"{label_of(one)} [{one.unit}]", ylabel=f"number of draws, of {draws} [1]")
        _titled(figure, "First objective over fresh draws")
        legend_above(axes, 1)
    return figure
