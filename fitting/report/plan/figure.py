"""The figure of a plan: expected uncertainty of each constant after each test."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.plan.plan import Plan
from fitting.report.figures import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, style

PANELS = {
    "detwinning of martensite": ("beta_1", "beta_2", "beta_3"),
    "stress-induced martensite": ("ka_1", "ka_2", "ka_3"),
    "resistance of martensite": ("km_1", "km_2", "km_3", "rho_mean", "rho_span"),
    "resistance of austenite, mixture": ("alpha_1", "alpha_2", "a", "b"),
    "moduli": ("G_m", "G_a", "gamma_L"),
    "residual strain": ("gR_amplitude", "gR_slope", "gR_shift", "gR_decay"),
}
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE)
CLOSE = 0.055  # Minimum distance of labels at the right edge, as part of the axis
TOP = 1.25
NOTE = (
    "tests done, repeats counted\n"
    "circle: after the published campaign's seven tests; shaded: known at most ten times better than before"
)


def plan_figure(plan: Plan) -> Figure:
    """Expected standard deviation of every constant over the number of tests, in units of the prior's."""
    bottom = 10.0 ** np.floor(np.log10(min(plan.sd.min(), plan.published_sd.min())))
    with style():
        figure = Figure(figsize=(12.0, 7.6), layout="constrained")
        panels = figure.subplots(2, 3, sharex=True, sharey=True)
        for axes, (title, names) in zip(panels.flat, PANELS.items(), strict=True):
            _panel(axes, plan, names, float(bottom))
            axes.set_title(title, loc="left")
        for axes in panels[:, 0]:
            axes.set_ylabel("expected sd / prior sd [1]")
        figure.supxlabel(NOTE, fontsize=10)
    return figure


def _panel(axes: Axes, plan: Plan, names: tuple[str, ...], bottom: float) -> None:
    last = len(plan.sd) - 1
    axes.set_yscale("log")
    axes.set_ylim(bottom, TOP)
    axes.axhspan(0.1, TOP, color=SKY, alpha=0.12, linewidth=0)
    axes.set_xlim(0.0, 1.4 * last + 0.7)
    axes.set_xticks(range(last + 1))
    axes.axvline(last + 0.7, color=GREY, linewidth=0.6)
    heights, colours = {}, dict(zip(names, COLOURS, strict=False))
    for name, colour in colours.items():
        k = plan.knowledge.names.index(name)
        axes.plot(plan.sd[:, k], "o-", color=colour, markersize=3.5)
        axes.plot(last + 0.35, plan.published_sd[k], "o", color=colour, markerfacecolor="none")
        heights[name] = float(np.log(plan.sd[-1, k] / bottom) / np.log(TOP / bottom))
    for name, height in _spread(heights).items():
        axes.text(
            last + 0.8,
            bottom * (TOP / bottom) ** height,
            name,
            color=colours[name],
            va="center",
            fontsize=8.5,
            weight="bold" if name in plan.wanted else "normal",
        )


def _spread(heights: dict[str, float]) -> dict[str, float]:
    """Heights of labels, as shares of the axis, moved as little as keeps them apart and inside."""
    names = sorted(heights, key=heights.__getitem__)
    wished = [heights[name] for name in names]
    up, down = wished.copy(), wished.copy()
    for k in range(1, len(names)):
        up[k] = max(up[k], up[k - 1] + CLOSE)
        down[-1 - k] = min(down[-1 - k], down[-k] - CLOSE)
    middle = [0.5 * (a + b) for a, b in zip(up, down, strict=True)]
    low, high = min(middle[0], 0.0), max(middle[-1] - 1.0 + 0.5 * CLOSE, 0.0)
    return {name: height - low - high for name, height in zip(names, middle, strict=True)}
