"""Figures of characterised wires, tubes and actuators: data and model, residuals, gain of information."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import Score
from fitting.calibrate.result import Estimate
from fitting.inference.notes import joined
from fitting.inference.parameters import Parameter
from pneusma_jax.units import constant_to_si, to_si

from .. import figures as house
from .. import profile_likelihood
from ..instrument_zeros import not_drawn
from ..report import Picture

MOST_PANELS = 24
"""Maximum number of recordings that are drawn."""


def pictures(result: GeneralCharacterisation) -> dict[str, Picture]:
    """Every figure by name."""
    shown = result.scores[:MOST_PANELS]
    first = house.only_first(MOST_PANELS, len(result.scores), "outputs")
    beside = not_drawn(result.lasting)
    drawn = [
        Picture(
            "fit",
            f"Every measured output (dots or circles) and its prediction (lines).{beside}{first}",
            lambda: _panels(shown, _compared),
        ),
        Picture(
            "residuals",
            "Measured less model. Noise would scatter around zero; slow waves are what it lacks."
            f"{beside}{first}",
            lambda: _panels(shown, _left),
        ),
        Picture(
            "parameters",
            _parameters_caption(result),
            lambda: _parameters(result),
        ),
        *profile_likelihood.pictures(result),
    ]
    return {picture.name: picture for picture in drawn}


def _panels(found: Sequence[Score], draw: Callable[[Axes, Score], None]) -> Figure:
    figure, panels = house.panel_grid(len(found), 3.5, 2.9, (0.0, 0.3))
    for panel, score in zip(panels, found, strict=True):
        draw(panel, score)
        role = "" if score.role == "fit" else " (held out)"
        panel.set_title(f"{score.name}{role}", loc="left", fontsize=9)
        panel.set_xlabel(house.axis_label(score.x_column))
    if draw is _compared:
        house.shared_legend(figure)
    return figure


def _compared(panel: Axes, score: Score) -> None:
    panel.plot(score.x, score.measured, label="measured", **house.measured_marks(len(score.x)))
    panel.plot(score.x, score.predicted, "-", color=house.VERMILION, linewidth=1.3, label="model")
    panel.set_ylabel(house.axis_label(score.column))


def _left(panel: Axes, score: Score) -> None:
    panel.axhline(0.0, color=house.BLACK, linewidth=0.8)
    panel.plot(score.x, score.measured - score.predicted, ".", color=house.BLUE, markersize=3)
    panel.set_ylabel(house.residual_label(score.column))


def _flat(entry: Parameter) -> bool:
    """True for a constant without a prior, between finite bounds."""
    return entry.prior is None and bool(np.all(np.isfinite([entry.min, entry.max])))


def _parameters_caption(result: GeneralCharacterisation) -> str:
    """Caption that says what the bars and marks of the constants are, and which constants have no place."""
    entries = result.fitted.values()
    said = (
        "Distance of each constant from the mean of its prior, in standard deviations of the prior. Grey: "
        "one standard deviation of the prior. Blue: what is known now, with one standard error."
    )
    if any(entry.at_bound for entry in entries):
        said += " An arrow marks a constant that stopped at its bound, and points to where the data pull it."
    if any(_flat(entry) for entry in entries):
        said += " A pale bar is a flat prior, from one bound to the other; its standard deviation counts."
    if placeless := [entry.name for entry in entries if entry.prior is None and not _flat(entry)]:
        said += f" Not drawn, because there is no prior to compare with: {joined(placeless)}."
    return said


def _before(entry: Parameter) -> tuple[float, float, float]:
    """Mean, standard deviation and drawn half-width of a prior [SI]; a flat one lies between two bounds."""
    if entry.prior is not None:
        return entry.prior.mean, entry.prior.sd, entry.prior.sd
    half = 0.5 * (entry.max - entry.min)
    return entry.min + half, half / np.sqrt(3.0), half


def _error(entry: Parameter, quoted: Estimate) -> np.ndarray:
    """Standard error, or errors to either side where the misfit is no parabola [SI]; shape (2, 1)."""
    if quoted.curved and 68 in quoted.interval:
        low, high = (constant_to_si(end, quoted.unit) for end in quoted.interval[68])
        return np.maximum([[entry.value - low], [high - entry.value]], 0.0)
    return np.full((2, 1), to_si(quoted.sd, quoted.unit, difference=True))


def _parameters(result: GeneralCharacterisation) -> Figure:
    entries = [e for e in result.fitted.values() if e.prior is not None or _flat(e)]
    figure = Figure(figsize=(7.0, 1.3 + 0.3 * len(entries)), layout="constrained")
    panel = figure.subplots()
    marks: dict[str, Artist] = {}
    for k, entry in enumerate(entries):
        mean, sd, half = _before(entry)
        quoted = result.parameters[entry.name]
        look = {"color": house.GREY, "linewidth": 5, "solid_capstyle": "butt"}
        faint = 0.2 if _flat(entry) else 0.4
        (bar,) = panel.plot([-half / sd, half / sd], [k, k], alpha=faint, **look)
        marks.setdefault("flat prior, bound to bound" if _flat(entry) else "prior", bar)
        at, error = (entry.value - mean) / sd, _error(entry, quoted) / sd
        if entry.at_bound:
            upper = entry.max - entry.value < entry.value - entry.min
            (mark,) = panel.plot(at, k, ">" if upper else "<", color=house.VERMILION, markersize=8, zorder=3)
            marks["stopped at its bound"] = mark
        if not entry.at_bound or np.all(np.isfinite(error)):
            found = panel.errorbar(
                at, k, xerr=error, fmt="" if entry.at_bound else "o", color=house.BLUE, markersize=4
            )
            marks.setdefault("found, with its standard error", found)
    panel.set_yticks(range(len(entries)), [entry.name for entry in entries])
    panel.set_ylim(len(entries) - 0.4, -0.6)
    panel.set_xlabel("distance from the prior's mean [prior standard deviations]")
    house.legend_over(figure, marks.values(), marks, 2)
    return figure
