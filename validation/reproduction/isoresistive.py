"""Figures 2.15 and 2.16: a spring stretched while a controller holds its resistance, and its phases."""

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLACK, BLUE, GREEN, ORANGE, style
from pneusma_jax.nitinol import fractions

from .bench import PRESTRAIN, Bench
from .entry import Entry
from .expectation import at_least, at_most
from .resistivity import NAMES
from .statement import Found, Statement

SETPOINTS = 7  # Number of setpoints, as in the source (Section 2.4.5)
STRAINS = np.linspace(0.0, PRESTRAIN, 241)
ALIKE = 0.1  # Minimum contrast of the phases for drawing a fraction read from resistivity [ohm/m]
SHADES = ListedColormap(colormaps["plasma_r"](np.linspace(0.15, 1.0, 256)))  # Orange: low resistivity, hot


def setpoints(alloy: pj.Alloy) -> np.ndarray:
    """Resistivities from cold to hot martensite fraction at rest, in equal steps [ohm/m]."""
    return np.linspace(float(alloy.rho_m(0.0)), float(alloy.rho_a(0.0)), SETPOINTS)


def controlled(
    alloy: pj.Alloy, setpoint: float, gamma: np.ndarray = STRAINS
) -> tuple[np.ndarray, np.ndarray]:
    """Resistivity [ohm/m] and onset fraction [1] under a controller that heats or cools as far as it can.

    At some strains no phase mixture has the setpoint's resistivity. Then a resistance that is too low stops
    the heating (all martensite), and one that is too high calls for full heating (all austenite).
    """
    cold, hot = np.asarray(alloy.rho_m(gamma)), np.asarray(alloy.rho_a(gamma))
    too_low, too_high = setpoint >= np.maximum(cold, hot), setpoint <= np.minimum(cold, hot)
    rho = np.where(too_low, cold, np.where(too_high, hot, setpoint))
    read = np.asarray(alloy.martensite_fraction(rho, gamma).xi0)
    return rho, np.where(too_low, 1.0, np.where(too_high, 0.0, read))


def phase_fractions(alloy: pj.Alloy, xi0: np.ndarray, gamma: np.ndarray = STRAINS) -> dict[str, np.ndarray]:
    """Detwinned and twinned martensite and austenite of the whole wire [1], Eqs. 2.25 to 2.28."""
    found = fractions.phase_fractions(alloy, xi0, gamma)
    return {name: np.asarray(getattr(found, name)) for name in ("detwinned", "twinned", "austenite")}


def _gathering(bench: Bench, name: str) -> Found:
    """Spread of the seven resistivities at the largest strain over that at rest [%]."""
    alloy = bench.alloys[name]
    ends = [controlled(alloy, s)[0][-1] for s in setpoints(alloy)]
    detail = f"{min(ends):.2f} to {max(ends):.2f} ohm/m at gamma = {PRESTRAIN:g}"
    return Found(100.0 * float(np.ptp(ends) / np.ptp(setpoints(alloy))), detail)


def _lost(bench: Bench) -> float:
    """Number of the fourteen setpoints that cannot be held up to the largest strain."""
    lost = 0
    for alloy in bench.alloys.values():
        lost += sum(abs(controlled(alloy, s)[0] - s).max() > 1e-6 for s in setpoints(alloy))
    return float(lost)


def _sum_of_fractions(bench: Bench) -> float:
    """Largest deviation of the sum of the phases from one."""
    worst = 0.0
    for alloy in bench.alloys.values():
        for s in setpoints(alloy):
            worst = max(
                worst, float(abs(sum(phase_fractions(alloy, controlled(alloy, s)[1]).values()) - 1.0).max())
            )
    return worst


def _detwinned_at_end(bench: Bench) -> Found:
    """Least detwinned fraction at the largest strain, over setpoints and alloys [1]."""
    ends = {
        n: min(float(phase_fractions(a, controlled(a, s)[1])["detwinned"][-1]) for s in setpoints(a))
        for n, a in bench.alloys.items()
    }
    return Found(min(ends.values()), ", ".join(f"{NAMES[n]} {v:.3f}" for n, v in ends.items()))


def _cooling_while_stretched(bench: Bench) -> Found:
    """Share of the intermediate tests in which the controller lets the wire cool on the whole [%]."""
    words, cooling, tests = [], 0, 0
    for name, alloy in bench.alloys.items():
        change = [float(np.diff(controlled(alloy, s)[1][[0, -1]])[0]) for s in setpoints(alloy)[1:-1]]
        cooling, tests = cooling + sum(c > 0.0 for c in change), tests + len(change)
        words.append(f"{NAMES[name]}: xi0 changes by " + ", ".join(f"{c:+.2f}" for c in change))
    return Found(100.0 * cooling / tests, "; ".join(words) + " (from the coldest setpoint on)")


def _panels(bench: Bench) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    return figure, figure.subplots(2, SETPOINTS, sharex=True, sharey="row", squeeze=False)


def _label(panels: np.ndarray, words: str) -> None:
    for row, name in zip(panels, NAMES.values(), strict=True):
        row[0].set_ylabel(f"{name}\n{words}")
    for axes in panels[-1]:
        axes.set_xlabel("shear strain [1]")


def draw_resistivity(bench: Bench) -> Figure:
    """Resistivity over strain, one panel per setpoint, with the bounding curves."""
    with style():
        figure, panels = _panels(bench)
        for row, alloy in zip(panels, bench.alloys.values(), strict=True):
            for axes, s, colour in zip(row, setpoints(alloy), _colours(), strict=True):
                _bounds(axes, alloy)
                axes.plot(STRAINS, controlled(alloy, s)[0], color=colour)
                axes.set_title(f"{s:.2f} ohm/m", fontsize=9)
        _label(panels, "resistivity [ohm/m]")
    return figure


def _colours() -> np.ndarray:
    return SHADES(np.linspace(1.0, 0.0, SETPOINTS))


def _bounds(axes: Axes, alloy: pj.Alloy) -> None:
    for law in (alloy.rho_m, alloy.rho_a):
        axes.plot(STRAINS, np.asarray(law(STRAINS)), ":", color=BLACK, linewidth=0.8)


def draw_fractions(bench: Bench) -> Figure:
    """Phase fractions over strain, one panel per setpoint."""
    with style():
        figure, panels = _panels(bench)
        for row, alloy in zip(panels, bench.alloys.values(), strict=True):
            for axes, s in zip(row, setpoints(alloy), strict=True):
                distinct = np.abs(np.asarray(alloy.rho_m(STRAINS) - alloy.rho_a(STRAINS))) > ALIKE
                xi0 = np.where(distinct, controlled(alloy, s)[1], np.nan)
                for (name, values), colour in zip(
                    phase_fractions(alloy, xi0).items(), (ORANGE, BLUE, GREEN), strict=True
                ):
                    axes.plot(STRAINS, values, color=colour, label=name)
                axes.plot(STRAINS, xi0, ":", color=BLACK, label="onset martensite xi0", linewidth=1.2)
                axes.set_title(f"{s:.2f} ohm/m", fontsize=9)
        _label(panels, "phase fraction [1]")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


_HOT_SIDE = "the printed alpha_2 is negative here: under strain the austenite falls away from the martensite"
_RISING = (
    "near the hot end the power law of Eq. 2.41, which turns linear with strain, and in the 35 degC alloy "
    "the printed alpha_2 > 0 make a low setpoint need more heat under strain, not less"
)
_RESISTIVITY = (
    Statement(
        "2.15-1", "Section 2.4.5", "whatever the setpoint, the resistivity approaches that of detwinned "
        "martensite at high strain; 35 degC alloy: spread left at 0.1924 (of that at rest)",
        "%", at_most(10.0, 50.0),
        lambda bench: _gathering(bench, "krl35"),
    ),
    Statement(
        "2.15-2", "Section 2.4.5", "the same for the 45 degC alloy", "%", at_most(10.0, 50.0),
        lambda bench: _gathering(bench, "krl45"), _HOT_SIDE,
    ),
    Statement(
        "2.15-3", "Section 2.4.5", "constant resistance cannot always be held: setpoints, of 14, that are "
        "lost on the way",
        "1", at_least(1.0), _lost,
    ),
)  # fmt: skip
_FRACTIONS = (
    Statement(
        "2.16-1", "Eqs. 2.25-2.28", "the phases account for the whole wire: largest deviation of their sum "
        "from one", "1",
        at_most(1e-9, 1e-6), _sum_of_fractions,
    ),
    Statement(
        "2.16-2", "Section 2.4.5", "at high strain nearly everything is detwinned, whatever the setpoint: "
        "least fraction",
        "1", at_least(0.90, 0.80), _detwinned_at_end,
        "the hot sigmoid of the 35 degC alloy reaches 0.88 at 0.1924, far beyond its test",
    ),
    Statement(
        "2.16-3", "Section 2.4.5", "as an intermediate spring is stretched, detwinning lowers its resistance "
        "and the controller lets it cool: share of the intermediate setpoints", "%", at_least(100.0, 50.0),
        _cooling_while_stretched, _RISING,
    ),
)  # fmt: skip

ENTRIES = (
    Entry(
        "2.15", "Resistivity while a controller holds it", "Section 2.4.5", draw_resistivity,
        "Seven setpoints from cold (left) to hot (right). Dotted: the resistivities of pure martensite and "
        "pure austenite, which no heating or cooling can leave.",
        "The measured curves are lost.", _RESISTIVITY,
    ),
    Entry(
        "2.16", "Phases during isoresistive loading", "Section 2.4.5", draw_fractions,
        "Phases of the whole wire at the seven setpoints, 35 degC alloy above, 45 degC alloy below. The "
        "kinks are where the setpoint cannot be held any longer; curves end where both phases conduct alike.",
        "The source's fractions came from measured resistances, which are lost.", _FRACTIONS,
    ),
)  # fmt: skip
