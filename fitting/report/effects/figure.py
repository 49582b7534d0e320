"""The figure of a signature: every output without the effect and with it, over time and over its drive."""

import numpy as np
from matplotlib.figure import Figure

from fitting.report.figures import BLACK, BLUE, GREY, VERMILION, axis_label, legend_above, style
from fitting.simulate.effect_signature import Signature


def signature_figure(found: Signature) -> Figure:
    """Figure with one column per output; rows are the time history, the change, and the loop over the
    drive."""
    driver = next(iter(found.drive))
    driver = "pressure_kPa" if driver == "time_s" else driver
    time, outputs = found.drive["time_s"], list(found.without)
    with style():
        figure = Figure(figsize=(2.0 + 4.4 * len(outputs), 8.6), layout="constrained")
        numbers = ", ".join(f"{name} = {value:g}" for name, value in found.parameters.items())
        figure.suptitle(f"{found.slug} on a recording of kind {found.kind}\n{numbers}", fontsize=11)
        panels = figure.subplots(3, len(outputs), squeeze=False, gridspec_kw={"height_ratios": (2, 1, 2)})
        for output, (course, change, loop) in zip(outputs, panels.T, strict=True):
            without, present = found.without[output], found.present[output]
            _pair(course, time, without, present)
            course.set_ylabel(axis_label(output))
            legend_above(course)
            change.axhline(0.0, color=BLACK, linewidth=0.8)
            change.plot(time, present - without, color=BLUE)
            change.set_ylabel(f"change of {axis_label(output)}", fontsize=8)
            change.set_xlabel(axis_label("time_s"))
            _pair(loop, found.drive[driver], without, present)
            loop.set_ylabel(axis_label(output))
            loop.set_xlabel(axis_label(driver))
        figure.align_ylabels()
    return figure


def _pair(axes: object, x: np.ndarray, without: np.ndarray, present: np.ndarray) -> None:
    axes.plot(x, without, color=GREY, label="without")
    axes.plot(x, present, "--", color=VERMILION, label="with")
