"""Shared style of all figures: colours that colour-blind readers can distinguish, every axis with its unit.

Figures are made from results and never fit anything. No global state of matplotlib is touched. It takes a
fifth of a second to load, so it is loaded at the first figure: a report as text draws none.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneusma_jax.files import write_whole
from pneusma_jax.late import Late
from pneusma_jax.units import UNITS, written

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

matplotlib, agg = Late("matplotlib"), Late("matplotlib.backends.backend_agg")
matplotlib_text, new = Late("matplotlib.text"), Late("matplotlib.figure")
"""Makes figures: `new.Figure(...)`."""

# Okabe and Ito's palette, in an order that also differs in lightness
BLACK, BLUE, ORANGE, GREEN, SKY, PURPLE, VERMILION = (
    "#000000", "#0072B2", "#E69F00", "#009E73", "#56B4E9", "#CC79A7", "#D55E00",
)  # fmt: skip
GREY = "#8a8f98"
SERIES = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
"""Colours of series that are alike, such as springs, in their order. Yellow is too faint on white."""
LINES, MARKS = ("-", "--", ":", "-."), ("o", "s", "^", "D")
"""Line styles and markers of series: those of the second seven have the second, and so on."""
RESIDUAL = "measured - model"
"""Sign of every residual: positive where the model is low."""
FEW_MARKS = 60
"""Maximum number of measured rows that are open circles above the model's line. More would hide it.

So they are dots below it, three times as wide as the line."""
MOST_COLUMNS = 4
"""Maximum number of panels beside each other."""
STYLE = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 10.0,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e6eb",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "lines.linewidth": 1.8,
    "figure.dpi": 150,
    "savefig.dpi": 150,
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
}
QUANTITIES = {
    "time_s": "time [s]",
    "pressure_kPa": "gauge pressure [kPa]",
    "curvature_1pm": "curvature [1/m]",
    "bend_angle_deg": "bend angle [deg]",
    "bend_direction_deg": "bend direction [deg]",
    "length_mm": "length [mm]",
    "force_N": "force [N]",
    "resistance_ohm": "resistance [ohm]",
    "elongation_mm": "elongation [mm]",
    "strain": "engineering strain [1]",
    "stress_kPa": "engineering stress [kPa]",
    "stress_MPa": "stress [MPa]",
    "temperature_degC": "temperature [deg C]",
}


def style() -> AbstractContextManager:
    """Context in which figures are made and saved."""
    return matplotlib.rc_context(STYLE)


def series(k: int, points: bool = False) -> dict[str, str]:
    """Look of the k-th of many series, from 0, as arguments of `plot`; the first 28 all differ.

    Args:
        k: index of the series.
        points: markers without lines, where rows do not follow each other.
    """
    turn = k // len(SERIES) % len(LINES)
    look = {"linestyle": "none", "marker": MARKS[turn]} if points else {"linestyle": LINES[turn]}
    return {"color": SERIES[k % len(SERIES)], **look}


def measured_marks(count: int) -> dict[str, Any]:
    """Look of measured rows beside the model's line, as arguments of `plot`: both are seen where they agree.

    Args:
        count: number of rows of the recording.
    """
    look = {"linestyle": "none", "marker": "o", "color": BLACK}
    if count <= FEW_MARKS:
        return look | {"markerfacecolor": "none", "markersize": 5.5, "markeredgewidth": 1.0, "zorder": 3}
    return look | {"markersize": 4.2, "markeredgewidth": 0.0, "zorder": 1.5}


def residual_label(column: str) -> str:
    """Words, sign and unit of a residual of a canonical column, such as `measured - model [kPa]`."""
    return f"{RESIDUAL} {unit_of(column)}".strip()


def residual_over_noise(words: str = "") -> str:
    """Label of a residual over the noise, under the name of the quantity if there is one."""
    return "\n".join(filter(None, (words, f"({RESIDUAL})", "/ noise [1]")))


def thinned(values: np.ndarray, most: int) -> np.ndarray:
    """Evenly chosen values from the first on, `most` of them or fewer."""
    return values[:: max(-(-len(values) // most), 1)]


def only_first(most: int, count: int, things: str) -> str:
    """End of the caption of a figure that draws the first `most` of `count` things; empty if it draws all."""
    return f" Only the first {most} of {count} {things} are drawn." if count > most else ""


def axis_label(column: str) -> str:
    """Words and unit for a canonical column, such as `curvature [1/m]`."""
    if column in QUANTITIES:
        return QUANTITIES[column]
    quantity, _, unit = literal(column).rpartition("_")
    if not quantity or unit.isdigit() or unit not in UNITS:  # `tip_angle` and `xi0_2` state no unit
        return literal(column).replace("_", " ")
    return f"{quantity.replace('_', ' ')} [{written(unit)}]"


def literal(name: str) -> str:
    """A user's name for a figure, where matplotlib takes text between dollar signs for a formula.

    Only labels of ticks need it: `as_written` treats every other text of a figure.
    """
    return re.sub(r"(?<!\\)\$", r"\\$", name)


def as_written(figure: Figure) -> Figure:
    """The same figure, with dollar signs in its titles, labels and legends as they are: no formulas."""
    for text in figure.findobj(matplotlib_text.Text):
        text.set_text(literal(text.get_text()))
    return figure


def laid_out(figure: Figure) -> Figure:
    """The same figure, whose panels and labels have found their places and keep them.

    Otherwise they are looked for twice at each saving, and every saving draws the figure once more for it.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)
    return figure


def unit_of(column: str) -> str:
    """Unit of a canonical column in brackets, such as `[1/m]`; empty where its name has none."""
    label = axis_label(column)
    return label[label.rindex("[") :] if "[" in label else ""


def shown(figure: Figure) -> Figure:
    """The same figure, which a notebook draws as the value of a cell.

    IPython draws figures of its own accord only after `matplotlib.pyplot` was imported. No report needs that.
    """
    figure._repr_png_ = lambda: png(figure)
    return figure


def png(figure: Figure, written: bool = False) -> bytes:
    """The figure as PNG.

    Args:
        figure: figure whose layout is found for it alone, if it is not `laid_out`.
        written: true if the figure is `as_written` already.
    """
    with style():
        return _saved(figure, written, "png")


def svg(figure: Figure, written: bool = False) -> bytes:
    """The figure as SVG, the same bytes for the same figure; arguments as those of `png`."""
    with style(), matplotlib.rc_context({"svg.hashsalt": "pneusma"}):
        return _saved(figure, written, "svg", metadata={"Date": None})


def _saved(figure: Figure, written: bool, form: str, **options: Any) -> bytes:
    stream, engine = io.BytesIO(), figure.get_layout_engine()
    laid_out(figure if written else as_written(figure)).savefig(stream, format=form, **options)
    figure.set_layout_engine(engine)
    return stream.getvalue()


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, whole or not at all.

    Raises:
        InputError: if the place cannot be written.
    """
    return write_whole(path, png(figure))


def panel_grid(
    count: int, width: float, height: float, margin: tuple[float, float] = (0.0, 0.0)
) -> tuple[Figure, list[Axes]]:
    """A figure of equal panels, at most four in a row. Surplus places stay empty.

    Args:
        count: number of panels.
        width, height: width and height of one panel [inch].
        margin: additional width and height of the figure beside the panels [inch].
    """
    columns = min(count, MOST_COLUMNS)
    lines = -(-count // columns)
    size = (margin[0] + width * columns, margin[1] + height * lines)
    figure = new.Figure(figsize=size, layout="constrained")
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for panel in panels[count:]:
        panel.set_visible(False)
    return figure, list(panels[:count])


def legend_above(axes: Axes, columns: int = 3) -> None:
    """A legend in a row of its own above the axes, so that it cannot cover data."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)


def legend_over(
    figure: Figure, handles: Iterable[Artist], labels: Iterable[str] | None = None, columns: int = 3,
    place: str = "outside upper center",
) -> None:  # fmt: skip
    """One legend above all panels, in as many columns as fit into the width of the figure.

    Args:
        handles: lines and patches.
        labels: their texts; the handles' own by default.
        columns: largest number of columns.
        place: `loc` of matplotlib.
    """
    handles = list(handles)
    own = (str(handle.get_label()) for handle in handles)
    texts = [literal(text) for text in (own if labels is None else labels)]  # before it is measured
    renderer = agg.FigureCanvasAgg(figure).get_renderer()
    for count in range(max(1, min(columns, len(handles))), 0, -1):
        legend = figure.legend(handles, texts, loc=place, ncols=count)
        if count == 1 or legend.get_window_extent(renderer).width < 0.97 * figure.bbox.width:
            return
        legend.remove()


def shared_legend(figure: Figure) -> None:
    """One legend above all panels, with every label once."""
    known = {}
    for axes in figure.axes:
        known |= {text: line for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    legend_over(figure, known.values(), known, len(known), "outside upper left")


def recording_figure(
    title: str,
    x: tuple[str, np.ndarray],
    outputs: Mapping[str, tuple[np.ndarray, np.ndarray]],
    noise: Mapping[str, float],
) -> Figure:
    """Figure of measured and predicted outputs of a recording over its driving quantity, with residuals.

    Args:
        title: name of the recording.
        x: canonical column and values of the horizontal axis.
        outputs: measurement and prediction by canonical column, in that column's unit, shape (rows,).
        noise: standard deviation of the instrument's noise by canonical column, where it is known.
    """
    name, values = x
    with style():
        figure = new.Figure(figsize=(2.0 + 5.4 * len(outputs), 5.6), layout="constrained")
        figure.suptitle(title, fontsize=12)
        panels = figure.subplots(
            2, len(outputs), sharex=True, squeeze=False, gridspec_kw={"height_ratios": (2.2, 1.0)}
        )
        for (column, (measured, predicted)), (above, below) in zip(outputs.items(), panels.T, strict=True):
            _compared(above, name, values, measured, predicted)
            above.set_ylabel(axis_label(column))
            _residuals(below, values, measured - predicted, noise.get(column))
            below.set_xlabel(axis_label(name))
            below.set_ylabel(residual_label(column))
        figure.align_ylabels()
    return figure


def _compared(axes: Axes, name: str, x: np.ndarray, measured: np.ndarray, predicted: np.ndarray) -> None:
    axes.plot(x, measured, label="measured", **measured_marks(len(x)))
    single = name == "time_s" or np.all(np.diff(x[np.isfinite(x)]) >= 0.0)
    order = np.arange(len(x)) if single else np.argsort(x, kind="stable")
    axes.plot(x[order], predicted[order], "-", color=VERMILION, linewidth=1.3, label="model")
    legend_above(axes)


def _residuals(axes: Axes, x: np.ndarray, residual: np.ndarray, noise: float | None) -> None:
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.plot(x, residual, ".", color=BLUE, markersize=4)
    if noise:
        axes.axhspan(-2.0 * noise, 2.0 * noise, color=SKY, alpha=0.35, linewidth=0)
        axes.set_title("band: twice the stated noise", fontsize=9, loc="left", color="#444444")


def draw_tube(
    axes: Axes, line: np.ndarray, radius: float | np.ndarray, colour: str, label: str, alpha: float = 0.25
) -> None:
    """Draw a tube in a projection: its outline about a centre line, shape (points, 2).

    The radius is one number, or one of every point, in the unit of the line.
    """
    slope = np.gradient(line, axis=0)
    size = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)
    aside = np.reshape(radius, (-1, 1)) * np.stack([-slope[:, 1], slope[:, 0]], axis=1) / size
    outline = np.concatenate([line + aside, (line - aside)[::-1]])
    axes.fill(*outline.T, color=colour, alpha=alpha, linewidth=0)
    axes.plot(*line.T, color=colour, linewidth=1.2, label=label)
