"""Figures of a characterised alloy: stress over strain, resistance, laws, profiles."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.scores import Score

from .. import figures as house
from .. import profile_likelihood
from ..report import Picture


def pictures(result: SpringCharacterisation) -> dict[str, Picture]:
    """Every figure by name."""
    drawn = [
        Picture(
            "fit",
            "Shear stress of every test (dots or circles) and the model from resistance alone (lines).",
            lambda: _panels(result, _stress),
        ),
        Picture(
            "phase",
            "Martensite fraction read from resistance over the test, with one standard deviation, whose "
            "median each panel has. Where the band is wide, resistance says little. It may be thinner than "
            "the line.",
            lambda: _panels(result, _phase),
        ),
        Picture(
            "laws",
            "The laws found: detwinned fraction of martensite, stress-induced fraction of austenite, and "
            "resistivity of the two phases over shear strain.",
            lambda: _laws(result),
        ),
        *profile_likelihood.pictures(result),
    ]
    return {picture.name: picture for picture in drawn}


def _panels(result: SpringCharacterisation, draw: Callable[[Axes, Score], None]) -> Figure:
    figure, panels = house.panel_grid(len(result.scores), 3.4, 2.9, (0.0, 0.3))
    for panel, score in zip(panels, result.scores, strict=True):
        draw(panel, score)
        role = "" if score.role == "fit" else " (held out)"
        panel.set_title(f"{score.name}{role}", loc="left", fontsize=9)
    house.shared_legend(figure)
    return figure


def _stress(panel: Axes, score: Score) -> None:
    panel.plot(score.gamma, score.stress / 1e6, label="measured", **house.measured_marks(len(score.gamma)))
    panel.plot(score.gamma, score.predicted / 1e6, "-", color=house.VERMILION, linewidth=1.3, label="model")
    panel.set_xlabel("shear strain [1]")
    panel.set_ylabel("shear stress [MPa]")


def _phase(panel: Axes, score: Score) -> None:
    low, high = np.clip(score.xi0 - score.xi0_sd, 0, 1), np.clip(score.xi0 + score.xi0_sd, 0, 1)
    panel.fill_between(score.time, low, high, color=house.SKY, alpha=0.7, linewidth=0, label="± 1 sd")
    panel.plot(score.time, score.xi0, "-", color=house.BLUE, linewidth=0.8, label="from resistance")
    sd = float(np.median(score.xi0_sd))
    if sd > 0.0:  # it is 0 where the phase was taken as known
        foot = float(np.median(score.xi0)) > 0.5  # the text stands where the line is not
        place = {"transform": panel.transAxes, "ha": "right", "va": "center", "fontsize": 8}
        size = np.format_float_positional(sd, precision=2, fractional=False, trim="-")
        panel.text(0.98, 0.06 if foot else 0.94, f"± {size}", **place)
    panel.set_ylim(-0.03, 1.03)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("martensite fraction [1]")


def _laws(result: SpringCharacterisation) -> Figure:
    alloy = result.alloy
    gamma = np.linspace(0.0, max(test.gamma for test in result.tests), 120)
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(gamma, np.asarray(alloy.xi_sm(gamma)), color=house.BLUE, label="detwinned martensite")
    left.plot(gamma, np.asarray(alloy.xi_sa(gamma)), color=house.VERMILION, label="stress-induced")
    left.set_ylabel("fraction [1]")
    right.plot(gamma, np.asarray(alloy.rho_m(gamma)), color=house.BLUE, label="martensite")
    right.plot(gamma, np.asarray(alloy.rho_a(gamma)), color=house.VERMILION, label="austenite")
    right.set_ylabel("resistivity [ohm/m]")
    for panel in (left, right):
        panel.set_xlabel("shear strain [1]")
        panel.locator_params(axis="x", nbins=5)
        house.legend_above(panel)
    return figure
