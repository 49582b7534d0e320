"""Figures of a posterior: pairs of parameters, walks of the chains, predicted bands, priors against
posteriors."""

import logging
import re

import corner
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitting.sample.bands import measurement_band
from fitting.sample.campaign import CampaignPosterior

from ..figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    axis_label,
    legend_over,
    measured_marks,
    only_first,
    panel_grid,
    residual_label,
    thinned,
)
from ..report import Picture

ENSEMBLE_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY)
MOST_IN_CORNER = 12
MOST_CURVES = 6
MOST_POINTS = 20000  # Maximum number of draws in a histogram
MOST_STEPS = 400  # Maximum number of drawn points of a walk
MOST_MARKS = 400  # Maximum number of marks of a recording
BAND = (0.05, 0.95)
GRID = 201


def pictures(result: CampaignPosterior) -> dict[str, Picture]:
    """Every figure by name."""
    drawn = [
        Picture(
            "corner",
            "Every pair of parameters. Filled: the draws, one and two sigma. Dashed: the Laplace "
            "approximation, which the fit's standard errors stand for. Where they part, believe the draws."
            + only_first(MOST_IN_CORNER, len(result.posterior.names), "parameters"),
            lambda: corner_figure(result),
        ),
        Picture(
            "predictive",
            "Measured values, with two bands: 90 % of the curves that the draws predict, and 90 % of new "
            "measurements with their noise. It has zeros of instruments that drift where the fit found such. "
            "Below: measured less the median."
            + only_first(MOST_CURVES, len(result.problem.curves), "curves"),
            lambda: predictive_figure(result),
        ),
        Picture(
            "prior",
            "What was known of each parameter before the data, and after. A posterior as wide as its prior "
            "was not learnt from these data.",
            lambda: prior_figure(result),
        ),
        Picture(
            "trace",
            "Mean and 5 to 95 % of the walkers of each ensemble at every step. Ensembles that lie on each "
            "other and do not drift have forgotten where they began.",
            lambda: trace_figure(result),
        ),
    ]
    return {picture.name: picture for picture in drawn}


def label(result: CampaignPosterior, name: str) -> str:
    """A parameter with its unit."""
    return f"{name} [{result.problem.unit(name)}]"


def in_lines(text: str, letters: int = 16) -> str:
    """A label in lines of at most so many letters, broken after underscores and spaces where it can be."""
    lines = [""]
    for part in re.findall(r"[^_ ]*[_ ]?", text):
        if lines[-1] and len(lines[-1]) + len(part.rstrip()) > letters:
            lines.append("")
        lines[-1] += part
    return "\n".join(line.rstrip(" ") for line in lines)


def corner_figure(result: CampaignPosterior) -> Figure:
    """Figure of every pair of parameters, with the Laplace approximation's one- and two-sigma ellipses over
    the draws."""
    posterior, problem = result.posterior, result.problem
    names = posterior.names[:MOST_IN_CORNER]
    flat = {name: np.moveaxis(posterior.draws[name], 1, 0).ravel() for name in names}
    table = np.stack([problem.shown(name, flat[name]) for name in names], axis=1)
    table = table[np.linspace(0, len(table) - 1, min(len(table), MOST_POINTS)).astype(int)]
    labels = [in_lines(label(result, name)) for name in names]
    margin = 0.75 + 0.2 * max(text.count("\n") + 1 for text in labels)  # inches, of ticks and lines of labels
    size = 0.65 + margin + 1.75 * len(names)
    figure = Figure(figsize=(size, size))
    logging.getLogger("root").addFilter(_quiet)  # corner warns through it that its contours have few points
    try:
        corner.corner(
            table, labels=labels, fig=figure, color=BLUE, bins=30,
            smooth=1.0, smooth1d=1.0, levels=(0.393, 0.865), plot_datapoints=False, fill_contours=True,
            plot_density=False, labelpad=0.08, max_n_ticks=3, hist_kwargs={"linewidth": 1.4},
        )  # fmt: skip
    finally:
        logging.getLogger("root").removeFilter(_quiet)
    figure.subplots_adjust(left=margin / size, bottom=margin / size)
    grid = np.array(figure.axes).reshape(len(names), len(names))
    for i, row in enumerate(names):
        for j, column in enumerate(names[: i + 1]):
            _approximation(grid[i, j], result, column, row)
    handles = [
        Line2D([], [], color=BLUE, lw=1.6, label="draws: one and two sigma"),
        Line2D([], [], color=VERMILION, lw=1.4, ls="--", label="Laplace approximation"),
    ]
    if len(names) > 1:  # above the diagonal there is room
        grid[0, -1].legend(handles=handles, loc="upper right", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    else:
        figure.subplots_adjust(top=0.8)
        figure.legend(handles=handles, loc="upper center", fontsize=9)
    return figure


def _quiet(record: logging.LogRecord) -> bool:
    return "Too few points" not in record.getMessage()


def _approximation(axes: Axes, result: CampaignPosterior, column: str, row: str) -> None:
    """Draw Laplace's marginal on the diagonal, and its ellipses below; nothing for undetermined
    parameters."""
    laplace, problem = result.posterior.laplace, result.problem
    pair = [result.posterior.names.index(name) for name in (column, row)]
    if not np.all(laplace.known[pair]):
        return
    centre = [float(problem.shown(name, laplace.value[name])) for name in (column, row)]
    sd = [float(problem.shown(name, laplace.sd[name], spread=True)) for name in (column, row)]
    if column == row:
        low, high = axes.get_xlim()
        x = np.linspace(low, high, GRID)
        density = np.exp(-0.5 * ((x - centre[0]) / sd[0]) ** 2)
        axes.plot(x, density * 0.95 * _height(axes), color=VERMILION, lw=1.4, ls="--")
        return
    block = laplace.covariance[np.ix_(pair, pair)]
    correlation = block / np.sqrt(np.outer(np.diag(block), np.diag(block)))
    root = np.linalg.cholesky(correlation + 1e-12 * np.eye(2))
    angle = np.linspace(0.0, 2.0 * np.pi, GRID)
    for sigma in (1.0, 2.0):
        x, y = sigma * root @ np.stack([np.cos(angle), np.sin(angle)])
        axes.plot(centre[0] + sd[0] * x, centre[1] + sd[1] * y, color=VERMILION, lw=1.1, ls="--")


def _height(axes: Axes) -> float:
    """Maximum of the histogram that is drawn there."""
    tops = [np.max(line.get_ydata()) for line in axes.lines if len(line.get_ydata())]
    tops += [np.max(patch.get_xy()[:, 1]) for patch in axes.patches if hasattr(patch, "get_xy")]
    return float(max(tops, default=axes.get_ylim()[1]))


def trace_figure(result: CampaignPosterior) -> Figure:
    """Positions of the walkers of each ensemble at every step: mean and 5 to 95 %; the burn-in is shaded."""
    posterior, names = result.posterior, result.posterior.names
    steps = posterior.chains.shape[1]
    shown = np.unique(np.linspace(0, steps - 1, min(steps, MOST_STEPS)).astype(int))
    values = posterior.target.all_values(posterior.chains[:, shown])
    figure = Figure(figsize=(9.6, 0.9 + 1.35 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for name, axes in zip(names, panels, strict=True):
        chains = result.problem.shown(name, values[name])
        for k, chain in enumerate(chains):
            colour = ENSEMBLE_COLOURS[k % len(ENSEMBLE_COLOURS)]
            low, high = np.quantile(chain, BAND, axis=1)
            axes.fill_between(shown, low, high, color=colour, alpha=0.13, linewidth=0)
            axes.plot(shown, chain.mean(axis=1), color=colour, lw=1.0, label=f"ensemble {k + 1}")
        axes.axvspan(0, posterior.convergence.burn_in, color=GREY, alpha=0.25, linewidth=0)
        axes.set_ylabel(label(result, name), fontsize=9)
        axes.margins(x=0.0)
    panels[-1].set_xlabel("step (grey: burn-in, left out)")
    handles, labels = panels[0].get_legend_handles_labels()
    legend_over(figure, handles, labels, 6)
    figure.align_ylabels()
    return figure


def predictive_figure(result: CampaignPosterior) -> Figure:
    """Measured values with the 90 % bands of the model and of new measurements; below, the residuals."""
    curves = result.problem.curves[:MOST_CURVES]
    columns = 2 if len(curves) == 4 else min(len(curves), 3)
    rows = -(-len(curves) // columns)
    figure = Figure(figsize=(1.2 + 4.2 * columns, 0.7 + 4.6 * rows), layout="constrained")
    panels = figure.subplots(
        2 * rows, columns, squeeze=False, gridspec_kw={"height_ratios": (2.2, 1.0) * rows}
    )
    for k, curve in enumerate(curves):
        above, below = panels[2 * (k // columns), k % columns], panels[2 * (k // columns) + 1, k % columns]
        _bands(above, below, curve, result.predictive[k])
    for k in range(len(curves), rows * columns):
        for axes in (panels[2 * (k // columns), k % columns], panels[2 * (k // columns) + 1, k % columns]):
            axes.set_visible(False)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    legend_over(figure, handles, labels, 4)
    return figure


def _bands(above: Axes, below: Axes, curve, predicted: np.ndarray) -> None:
    order = np.argsort(curve.x, kind="stable")
    x = curve.x[order]
    low, middle, high = np.quantile(predicted[:, order], (BAND[0], 0.5, BAND[1]), axis=0)
    lowest, highest = measurement_band(predicted[:, order], curve.sigma[order], BAND)
    marks = thinned(order, MOST_MARKS)
    above.plot(curve.x[marks], curve.measured[marks], label="measured", **measured_marks(len(marks)))
    above.fill_between(
        x, lowest, highest, color=SKY, alpha=0.3, lw=0, label="90 % of new measurements"
    )
    above.fill_between(x, low, high, color=VERMILION, alpha=0.35, lw=0, label="90 % of the model")
    above.plot(x, middle, color=VERMILION, lw=1.3, label="median")
    below.fill_between(x, lowest - middle, highest - middle, color=SKY, alpha=0.3, lw=0)
    below.fill_between(x, low - middle, high - middle, color=VERMILION, alpha=0.35, lw=0)
    below.plot(x, curve.measured[order] - middle, ".", color=BLACK, ms=3)
    below.axhline(0.0, color=BLACK, lw=0.8)
    above.set_title(curve.recording + (" (validation, not fitted)" if curve.role == "validation" else ""))
    above.set_ylabel(axis_label(curve.y_column))
    below.set_ylabel(residual_label(curve.y_column))
    below.set_xlabel(axis_label(curve.x_column))


def prior_figure(result: CampaignPosterior) -> Figure:
    """Prior and posterior of each parameter, with the Laplace approximation."""
    names = result.posterior.names
    figure, panels = panel_grid(len(names), 2.7, 2.2, (0.8, 0.8))
    for name, axes in zip(names, panels, strict=True):
        _before_and_after(axes, result, name)
    handles = [
        Line2D([], [], color=BLUE, lw=5, alpha=0.4, label="posterior"),
        Line2D([], [], color=GREEN, lw=1.8, label="prior"),
        Line2D([], [], color=VERMILION, lw=1.4, ls="--", label="Laplace approximation"),
    ]
    legend_over(figure, handles)
    return figure


def _before_and_after(axes: Axes, result: CampaignPosterior, name: str) -> None:
    posterior, problem = result.posterior, result.problem
    parameter = problem.parameters[name]
    draws = problem.shown(name, posterior.draws[name].ravel())
    axes.hist(draws, bins=40, density=True, color=BLUE, alpha=0.4)
    middle, reach = float(np.median(draws)), 3.2 * float(np.std(draws))
    low, high = middle - reach, middle + reach
    if parameter.prior is not None:
        mean = float(problem.shown(name, parameter.prior.mean))
        sd = float(problem.shown(name, parameter.prior.sd, spread=True))
        low, high = min(low, mean - 3.2 * sd), max(high, mean + 3.2 * sd)
    ends = problem.shown(name, np.array([parameter.min, parameter.max]))
    low, high = max(low, ends[0]), min(high, ends[1])
    x = np.linspace(low, high, GRID)
    if parameter.prior is not None:
        density = np.exp(-0.5 * ((x - mean) / sd) ** 2)
        axes.plot(x, density / np.trapezoid(density, x), color=GREEN)
    laplace_sd = float(problem.shown(name, posterior.laplace.sd[name], spread=True))
    if laplace_sd > 0.0:
        mode = float(problem.shown(name, posterior.laplace.value[name]))
        density = np.exp(-0.5 * ((x - mode) / laplace_sd) ** 2) / (laplace_sd * np.sqrt(2.0 * np.pi))
        axes.plot(x, density, color=VERMILION, lw=1.4, ls="--")
    if parameter.prior is None:
        axes.text(0.98, 0.95, "flat prior", transform=axes.transAxes, ha="right", va="top", fontsize=8)
    axes.set_xlim(low, high)
    axes.set_yticks([])
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(label(result, name), fontsize=9)
