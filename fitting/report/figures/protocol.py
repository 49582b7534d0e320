"""The figure of a protocol: inputs and responses over time, and each output over an input."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.simulate.protocol import ProtocolResponse

from . import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, axis_label, legend_above, style

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)
WORDS = {"xi0": "martensite fraction [1]", "duty": "duty cycle [1]"}
"""Labels of columns that have no unit in their name."""
MOST_PANELS = 3  # Maximum number of panels of outputs


def protocol_figure(response: ProtocolResponse) -> Figure:
    """Inputs and outputs over time on the left. On the right, each output over the input that changes most.

    Args:
        response: response with one row or more.
    """
    time = response.inputs["time_s"]
    driven = _moving({name: v for name, v in response.inputs.items() if name != "time_s"})
    outputs = dict(list(response.outputs.items())[:MOST_PANELS])
    groups = _grouped(driven)
    with style():
        rows = len(groups) + len(outputs)
        figure = Figure(figsize=(11.0, 0.8 + 1.9 * rows), layout="constrained")
        figure.suptitle(response.title, fontsize=12)
        left, right = figure.subfigures(1, 2, width_ratios=(1.5, 1.0))
        panels = left.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
        for axes, (label, members) in zip(panels, groups.items(), strict=False):
            _lines(axes, time, members, label)
        for axes, (name, values) in zip(panels[len(groups) :], outputs.items(), strict=True):
            axes.plot(time, values, color=VERMILION)
            axes.set_ylabel(_label(name))
        panels[-1].set_xlabel("time [s]")
        left.align_ylabels()
        across = next(iter(driven)) if driven else "time_s"
        loops = right.subplots(len(outputs), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, values) in zip(loops, outputs.items(), strict=True):
            _loop(axes, response.inputs[across], values)
            axes.set_ylabel(_label(name))
        loops[-1].set_xlabel(_label(across))
        loops[-1].set_title("open circle: start; filled: end", fontsize=9, loc="left", color="#444444")
        right.align_ylabels()
    return figure


def _moving(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Inputs that change; all if none does."""
    moving = {name: values for name, values in columns.items() if np.ptp(values) > 0.0}
    return moving or dict(columns)


def _grouped(columns: Mapping[str, np.ndarray]) -> dict[str, dict[str, np.ndarray]]:
    """Columns by panel: inputs of one kind share one."""
    groups: dict[str, dict[str, np.ndarray]] = {}
    for name, values in columns.items():
        groups.setdefault(_label(name, plain=True), {})[name] = values
    return groups


def _label(name: str, plain: bool = False) -> str:
    """Words and unit of a column; `plain` leaves out the number of spring or segment."""
    bare, before = name.removeprefix("model_"), ""
    if bare.startswith("segment_"):
        _, number, bare = bare.split("_", 2)
        before, bare = f"segment {number}: ", bare.removeprefix("model_")
    stem, _, rest = bare.partition("_")
    number = rest.partition("_")[0]
    if number.isdigit():
        before += f"spring {number}: "
        words = WORDS.get(stem) or axis_label(f"{stem}_{rest.partition('_')[2]}")
    else:
        words = WORDS.get(bare) or axis_label(bare)
    return words if plain else before + words


def _lines(axes: Axes, time: np.ndarray, members: Mapping[str, np.ndarray], label: str) -> None:
    """Draw columns of one kind over time, with a legend where each has a colour of its own."""
    few = len(members) <= len(COLOURS)
    for k, (name, values) in enumerate(members.items()):
        named = _label(name).removesuffix(label).rstrip(": ")
        axes.plot(time, values, color=COLOURS[k] if few else BLUE, label=named or None)
    axes.set_ylabel(label)
    if len(members) > 1 and few:
        legend_above(axes, columns=2)


def _loop(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """Draw an output over an input, with both ends marked."""
    axes.plot(x, y, color=BLUE, linewidth=1.4)
    finite = np.flatnonzero(np.isfinite(y))
    if finite.size:
        first, last = finite[0], finite[-1]
        axes.plot(x[first], y[first], "o", color=BLUE, markerfacecolor="white", markersize=7)
        axes.plot(x[last], y[last], "o", color=BLUE, markersize=5)
