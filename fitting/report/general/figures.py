"""Figures of characterised wires, tubes and actuators: data and model, residuals, gain of information."""

from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import Score
from pneusma_jax.units import to_si

from .. import figures as house
from .. import profile_likelihood
from ..report import Picture

MOST_PANELS = 24
"""Maximum number of recordings that are drawn."""


def pictures(result: GeneralCharacterisation) -> dict[str, Picture]:
    """Every figure by name."""
    shown = result.scores[:MOST_PANELS]
    first = house.only_first(MOST_PANELS, len(result.scores), "outputs")
    drawn = [
        Picture(
            "fit",
            f"Every measured output (dots) and its prediction (lines).{first}",
            lambda: _panels(shown, _compared),
        ),
        Picture(
            "residuals",
            f"Recording less model. Noise would scatter around zero; slow waves are what it lacks.{first}",
            lambda: _panels(shown, _left),
        ),
        Picture(
            "parameters",
            "What was known before (grey, one sd of the prior) and what is known now (blue), in standard "
            "deviations of the prior from its mean.",
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
    panel.plot(score.x, score.measured, ".", color=house.GREY, markersize=3, label="recording")
    panel.plot(score.x, score.predicted, "-", color=house.VERMILION, linewidth=1.2, label="model")
    panel.set_ylabel(house.axis_label(score.column))


def _left(panel: Axes, score: Score) -> None:
    panel.axhline(0.0, color=house.BLACK, linewidth=0.8)
    panel.plot(score.x, score.measured - score.predicted, ".", color=house.BLUE, markersize=3)
    panel.set_ylabel(f"difference {house.unit_of(score.column)}".strip())


def _parameters(result: GeneralCharacterisation) -> Figure:
    entries = [e for e in result.fitted.values() if e.prior is not None]
    figure = Figure(figsize=(7.0, 0.9 + 0.3 * len(entries)), layout="constrained")
    panel = figure.subplots()
    for k, entry in enumerate(entries):
        away = (entry.value - entry.prior.mean) / entry.prior.sd
        quoted = result.parameters[entry.name]
        error = to_si(quoted.sd, quoted.unit, difference=True) / entry.prior.sd
        panel.plot([-1.0, 1.0], [k, k], color=house.GREY, linewidth=5, alpha=0.4, solid_capstyle="butt")
        panel.errorbar(away, k, xerr=error, fmt="o", color=house.BLUE, markersize=4)
    panel.set_yticks(range(len(entries)), [entry.name for entry in entries])
    panel.set_ylim(len(entries) - 0.4, -0.6)
    panel.set_xlabel("distance from the prior's mean [prior standard deviations]")
    return figure
