"""Figures 3.4 to 3.7: residual strain after pre-strain, its recovery by heating, and its persistence on
cooling."""

import jax
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLACK, BLUE, GREY, ORANGE, VERMILION, style
from pneusma_jax.nitinol.residual_strain import residual_strain_limit
from pneusma_jax.numerics.safe import as_numpy
from pneusma_jax.program_cache import stored_jit

from .bench import PRESTRAIN, Bench
from .entry import Entry
from .expectation import Near, at_least, at_most
from .statement import Found, Statement

HEATED = 0.4  # Martensite fraction after heating in the source's example (Section 3.4.1)
PRESTRAINS = np.asarray([0.04, 0.08, 0.12, 0.16, PRESTRAIN])
STRAINS = np.linspace(0.0, PRESTRAIN, 400)


def fresh(prestrain: float = PRESTRAIN) -> pj.SpringState:
    """A spring stretched cold to a shear strain and not heated since."""
    return as_numpy(pj.SpringState.fresh(prestrain))


def heated_and_cooled(alloy: pj.Alloy, heated: float = HEATED) -> pj.SpringState:
    """Memory of the actuators' spring after heating and cooling, unloaded."""
    course = np.concatenate([np.linspace(1.0, heated, 7), np.linspace(heated, 1.0, 7)])
    return as_numpy(_through(alloy, fresh(), course))


@stored_jit(pj.SpringState)
def _through(alloy: pj.Alloy, state: pj.SpringState, course: jax.Array) -> pj.SpringState:
    """Memory after a course of martensite fractions, each at the residual strain that it leaves."""

    def step(state: pj.SpringState, xi0: jax.Array) -> tuple[pj.SpringState, None]:
        return alloy.remember(state, alloy.residual_strain(state, xi0), xi0), None

    return jax.lax.scan(step, state, course)[0]


def stress_curve(alloy: pj.Alloy, xi0: float, state: pj.SpringState) -> np.ndarray:
    """Shear stress at `STRAINS` after pre-strain [MPa], Eq. 3.3; NaN below no stress."""
    stress = 1e-6 * np.asarray(alloy.shear_stress(STRAINS, xi0, alloy.residual_strain(state, xi0)))
    return np.where(stress >= 0.0, stress, np.nan)


def equation_3_1(alloy: pj.Alloy, prestrain: np.ndarray, sign: float = 1.0) -> np.ndarray:
    """Eq. 3.1 alone [1], with the printed sign for -1; an alloy is limited to what detwinning can leave."""
    shift = sign * alloy.gR_shift
    return np.asarray(residual_strain_limit(prestrain, alloy.gR_amplitude, alloy.gR_slope, shift, np.inf))


def _measured(bench: Bench) -> Found:
    alloy = bench.alloys["krl35"]
    return Found(
        float(equation_3_1(alloy, PRESTRAIN)),
        f"with the printed sign {equation_3_1(alloy, PRESTRAIN, -1.0):.3f}",
    )


def _unstrained(bench: Bench) -> Found:
    alloy = bench.alloys["krl35"]
    return Found(
        float(equation_3_1(alloy, 0.0)), f"with the printed sign {equation_3_1(alloy, 0.0, -1.0):.3f}"
    )


def _limit(bench: Bench) -> float:
    return float(bench.alloys["krl35"].residual_strain_limit(PRESTRAIN))


def _after_heating(bench: Bench, xi0: float) -> float:
    return float(bench.alloys["krl35"].residual_strain(fresh(), xi0))


def _after_cooling(bench: Bench) -> Found:
    alloy = bench.alloys["krl35"]
    remaining = float(alloy.residual_strain(heated_and_cooled(alloy), 1.0))
    return Found(remaining, f"hot it was {_after_heating(bench, HEATED):.5f}")


def _elastic_unloading(bench: Bench) -> float:
    """Shear strain at which an elastic line from the loading curve at 0.1924 reaches no stress [1]."""
    alloy = bench.alloys["krl35"]
    return float(PRESTRAIN - alloy.shear_stress(PRESTRAIN, 1.0, 0.0) / alloy.modulus(1.0))


def _unloading_slope(bench: Bench) -> float:
    """Mean slope of the unloading path over the shear modulus [1].

    It is taken between 20 and 80 % of the way from the residual strain to the pre-strain.
    """
    alloy = bench.alloys["krl35"]
    gamma_R = alloy.residual_strain(fresh(), 1.0)
    gamma = float(gamma_R) + (PRESTRAIN - float(gamma_R)) * np.asarray([0.2, 0.8])
    stress = np.asarray(alloy.shear_stress(gamma, 1.0, gamma_R))
    return float(np.diff(stress)[0] / np.diff(gamma)[0] / float(alloy.modulus(1.0)))


def _jump(bench: Bench) -> float:
    """Largest step of the stress between near strains, beyond what its slopes explain [% of the top]."""
    alloy, worst = bench.alloys["krl35"], 0.0
    for prestrain in PRESTRAINS:
        for xi0 in (1.0, 0.8, HEATED):
            gamma = np.linspace(0.0, PRESTRAIN, 20001)
            stress = np.asarray(alloy.shear_stress(gamma, xi0, alloy.residual_strain(fresh(prestrain), xi0)))
            step = np.abs(np.diff(stress)) - 1.01 * float(alloy.modulus(xi0)) * float(gamma[1])
            worst = max(worst, 100.0 * float(step.max()) / float(stress.max()))
    return max(worst, 0.0)


def draw_limit(bench: Bench) -> Figure:
    """Residual strain of a cold spring over its pre-strain, corrected and as printed."""
    alloy = bench.alloys["krl35"]
    with style():
        figure = Figure(figsize=(7.0, 4.4), layout="constrained")
        axes = figure.subplots()
        gamma = np.linspace(0.0, 0.22, 200)
        own = np.asarray(alloy.residual_strain_limit(gamma))
        axes.plot(gamma, own, color=BLUE, label="used here: at most what detwinning leaves")
        axes.plot(gamma, equation_3_1(alloy, gamma), "--", color=ORANGE, label="Eq. 3.1, sign corrected")
        axes.plot(gamma, equation_3_1(alloy, gamma, -1.0), ":", color=GREY, label="Eq. 3.1 as printed")
        axes.plot(PRESTRAIN, 0.089, "o", color=BLACK, label="measured, quoted in the text", zorder=4)
        axes.set(xlabel="pre-strain in shear [1]", ylabel="residual shear strain [1]", ylim=(0.0, 0.18))
        axes.legend(loc="upper left")
    return figure


def draw_surface(bench: Bench) -> Figure:
    """Residual strain over pre-strain and martensite fraction."""
    alloy = bench.alloys["krl35"]
    with style():
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        axes = figure.subplots()
        prestrain, xi0 = np.linspace(0.0, 0.2, 81), np.linspace(0.0, 1.0, 81)
        grid = np.stack([np.asarray(alloy.residual_strain(fresh(prestrain), np.full(81, x))) for x in xi0])
        drawn = axes.contourf(prestrain, xi0, grid, levels=12, cmap="viridis")
        axes.plot([PRESTRAIN] * 2, [1.0, HEATED], "o-", color=VERMILION, markersize=5, clip_on=False,
                  label="heating of an actuator's spring")  # fmt: skip
        axes.set(xlabel="pre-strain in shear [1]", ylabel="martensite fraction xi0 [1]")
        axes.legend(loc="lower left", labelcolor="white")
        figure.colorbar(drawn, ax=axes, label="residual shear strain [1]")
    return figure


def draw_unloading(bench: Bench) -> Figure:
    """Stress after several pre-strains at several martensite fractions."""
    alloy = bench.alloys["krl35"]
    with style():
        figure = Figure(figsize=(12.0, 4.2), layout="constrained")
        panels = figure.subplots(1, 4, sharey=True)
        shades = colormaps["viridis"](np.linspace(0.15, 0.85, len(PRESTRAINS) - 1))
        for axes, xi0 in zip(panels, (1.0, 0.9, 0.7, HEATED), strict=True):
            axes.plot(STRAINS, stress_curve(alloy, xi0, fresh(0.0)), ":", color=GREY, label="no pre-strain")
            for prestrain, colour in zip(PRESTRAINS[:-1], shades, strict=True):
                axes.plot(
                    STRAINS, stress_curve(alloy, xi0, fresh(prestrain)), color=colour, label=f"{prestrain:g}"
                )
            axes.plot(
                STRAINS, stress_curve(alloy, xi0, fresh()), color=BLACK, linewidth=2.6, label=f"{PRESTRAIN:g}"
            )
            axes.set(title=f"xi0 = {xi0:g}", xlabel="shear strain [1]")
        panels[0].set_ylabel("shear stress [MPa]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside upper center", ncols=len(labels), title="pre-strain in shear [1]"
        )
    return figure


def _family(axes: Axes, alloy: pj.Alloy, levels: np.ndarray, state: pj.SpringState) -> None:
    shades = colormaps["plasma_r"](np.linspace(0.25, 0.95, len(levels)))
    order = np.sort(levels)
    for xi0 in levels:
        colour = shades[int(np.searchsorted(order, xi0))]
        axes.plot(STRAINS, stress_curve(alloy, float(xi0), state), color=colour, label=f"xi0 = {xi0:g}")
        gamma_R = float(alloy.residual_strain(state, float(xi0)))
        axes.plot(gamma_R, 0.0, "o", color=colour, markersize=5, clip_on=False)
    axes.set(xlabel="shear strain [1]", xlim=(0.0, PRESTRAIN))


def draw_cycle(bench: Bench) -> Figure:
    """Loading curves of the actuators' spring while it heats (left) and while it cools (right)."""
    alloy = bench.alloys["krl35"]
    levels = np.asarray([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4])
    with style():
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        _family(left, alloy, levels, fresh())
        _family(right, alloy, levels[::-1], heated_and_cooled(alloy))
        left.set(title="heating: residual strain is recovered", ylabel="shear stress [MPa]")
        right.set(title="cooling: the residual strain stays")
        left.legend(loc="upper left")
        right.axvline(
            float(alloy.residual_strain(heated_and_cooled(alloy), 1.0)), color=ORANGE, linewidth=0.8
        )
    return figure


_SIGN = "Eq. 3.1 with its sign corrected (correction 2) stays above the measured value to which it was fitted"
ENTRIES = (
    Entry(
        "3.4", "Residual strain over pre-strain", "Section 3.4.1", draw_limit,
        "Residual strain of the cold 35 degC spring.",
        "The measured points are lost, save the one that the text quotes.",
        (
            Statement(
                "3.4-1", "Section 3.4.1, Eq. 3.1", "stretched cold to 0.1924 and released, the spring keeps "
                "a shear strain of",
                "1", Near(0.089, 0.06, 0.20), _measured, _SIGN,
            ),
            Statement(
                "3.4-2", "Section 3.4.1, Eq. 3.1", "without pre-strain there is no residual strain", "1",
                at_most(0.002, 0.01), _unstrained,
            ),
        ),
    ),
    Entry(
        "3.5", "Residual strain over pre-strain and martensite fraction", "Section 3.4.1", draw_surface,
        "Eq. 3.2; marked: an actuator's spring that is heated to xi0 = 0.4.", "",
        (
            Statement(
                "3.5-1", "Section 3.4.1, Eq. 3.2", "any slight presence of austenite decreases it sharply: "
                "lost with 10 % of austenite", "%", at_least(20.0, 10.0),
                lambda bench: 100.0 * (1.0 - _after_heating(bench, 0.9) / _limit(bench)),
            ),
            Statement(
                "3.5-2", "Section 3.4.1", "at high temperature there is none: what is left at xi0 = 0 of "
                "the model's own residual strain at xi0 = 1", "%",
                at_most(1.0, 5.0), lambda bench: 100.0 * _after_heating(bench, 0.0) / _limit(bench),
            ),
        ),
    ),
    Entry(
        "3.6", "Unloading and reloading after pre-strain", "Section 3.4.1", draw_unloading,
        "Eq. 3.3 after several pre-strains. Bold: the actuators' springs. The scale of stress is ours "
        "(correction 5).", "",
        (
            Statement(
                "3.6-1", "Section 3.4.1", "unloading is parallel to the elastic line: its slope over the "
                "modulus", "1",
                Near(1.0, 0.02, 0.10, quoted=False), _unloading_slope,
            ),
            Statement(
                "3.6-2", "Section 3.4.1, Eq. 3.3", "that line ends where it meets the loading curve: largest "
                "jump of the stress", "%", at_most(0.01, 1.0), _jump,
            ),
            Statement(
                "3.6-3", "Section 3.4.1", "elastic unloading from 0.1924 reaches no stress at", "1",
                Near(0.089, 0.06, 0.20), _elastic_unloading, _SIGN, rests_on="gamma_L (correction 5)",
            ),
        ),
    ),
    Entry(
        "3.7", "Recovery of residual strain by heating, and that cooling keeps it",
        "Section 3.4.1", draw_cycle,
        "Loading curves of the actuators' spring; dots: where it carries no stress.", "",
        (
            Statement(
                "3.7-1", "Section 3.4.1, Eq. 3.2", "heated to xi0 = 0.4, the spring keeps only", "1",
                Near(0.0049, 0.06, 0.20), lambda bench: _after_heating(bench, HEATED),
            ),
            Statement(
                "3.7-2", "Section 3.4.1", "cooled again, it does not return but still has", "1",
                Near(0.0049, 0.06, 0.20), _after_cooling,
            ),
            Statement(
                "3.7-3", "Section 3.4.1", "most of the initial residual strain is recovered: share", "%",
                at_least(80.0, 50.0),
                lambda bench: 100.0 * (1.0 - _after_heating(bench, HEATED) / _limit(bench)),
            ),
        ),
    ),
)  # fmt: skip
