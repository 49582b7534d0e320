"""Figures of a characterised alloy: stress over strain, resistance, laws, profiles."""

import numpy as np
from matplotlib.figure import Figure

from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.scores import Score

from .. import figures as house
from .. import profile_likelihood

CAPTIONS = {
    "fit": "Shear stress of every test (dots) and the model from resistance alone (lines).",
    "phase": "Martensite fraction read from resistance over the test, with one standard deviation: where the "
    "band is wide, resistance says little.",
    "laws": "The laws found: detwinned fraction of martensite, stress-induced fraction of austenite, and "
    "resistivity of the two phases over shear strain.",
    "profiles": profile_likelihood.CAPTION,
}


def captioned(result: SpringCharacterisation) -> dict[str, tuple[Figure, str]]:
    """Every figure with its caption, by name."""
    drawn = {"fit": _panels(result, _stress), "phase": _panels(result, _phase), "laws": _laws(result)}
    if result.profiles:
        drawn["profiles"] = profile_likelihood.figure(result)
    return {name: (figure, CAPTIONS[name]) for name, figure in drawn.items()}


def _panels(result: SpringCharacterisation, draw) -> Figure:
    count = len(result.scores)
    columns = min(count, 4)
    lines = -(-count // columns)
    with house.style():
        figure = Figure(figsize=(3.4 * columns, 2.9 * lines + 0.3), layout="constrained")
        axes = figure.subplots(lines, columns, squeeze=False).ravel()
        for panel, score in zip(axes, result.scores, strict=False):
            draw(panel, score)
            role = "" if score.role == "fit" else " (held out)"
            panel.set_title(f"{score.name}{role}", loc="left", fontsize=9)
        for panel in axes[count:]:
            panel.set_visible(False)
    return figure


def _stress(panel, score: Score) -> None:
    panel.plot(score.gamma, score.stress / 1e6, ".", color=house.GREY, markersize=3)
    panel.plot(score.gamma, score.predicted / 1e6, "-", color=house.VERMILION, linewidth=1.2)
    panel.set_xlabel("shear strain [1]")
    panel.set_ylabel("shear stress [MPa]")


def _phase(panel, score: Score) -> None:
    low, high = np.clip(score.xi0 - score.xi0_sd, 0, 1), np.clip(score.xi0 + score.xi0_sd, 0, 1)
    panel.fill_between(score.time, low, high, color=house.SKY, alpha=0.5, linewidth=0)
    panel.plot(score.time, score.xi0, "-", color=house.BLUE, linewidth=1.2)
    panel.set_ylim(-0.03, 1.03)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("martensite fraction [1]")


def _laws(result: SpringCharacterisation) -> Figure:
    alloy = result.alloy
    gamma = np.linspace(0.0, max(test.gamma for test in result.tests), 120)
    with house.style():
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
