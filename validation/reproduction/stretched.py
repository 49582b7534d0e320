"""Figures 2.11 and 2.14: springs stretched in growing cycles, cold and at a controlled resistance."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLACK, BLUE, GREY, ORANGE, style
from pneusma_jax.numerics.safe import as_numpy

from .bench import PRESTRAIN, Bench, listed
from .entry import Entry
from .expectation import at_least, at_most
from .isoresistive import SETPOINTS, SHADES, controlled, setpoints
from .resistivity import NAMES
from .spring_strain import COILS, LONGEST, MANDREL, PITCH, WIRE
from .statement import Found, Statement

PEAKS = np.linspace(0.0, LONGEST, 6)[
    1:
]  # spring strains at which the cycles turn; the source's are lost but the last
ROWS = 24  # Number of rows from one end of a cycle to the other
TENTH = 0.1 * PRESTRAIN


def cycles() -> np.ndarray:
    """Spring strain of growing cycles from rest [1]: to each of `PEAKS` and back."""
    legs = [np.zeros(1)]
    for peak in PEAKS:
        legs += [np.linspace(0.0, peak, ROWS + 1)[1:], np.linspace(peak, 0.0, ROWS + 1)[1:]]
    return np.concatenate(legs)


def on_stand(alloy: pj.Alloy) -> pj.Spring:
    """A test spring with as many coils as the actuators' springs have; no strain depends on their number."""
    dimensions = pj.SpringGeometry(WIRE, MANDREL, PITCH, COILS, COILS * PITCH)
    return as_numpy(pj.Spring(dimensions, alloy, dimensions.free_length))


def stretched(bench: Bench, name: str, setpoint: float | None) -> tuple[pj.SpringHistory, np.ndarray]:
    """A spring through the cycles, and its resistivity [ohm/m].

    Args:
        bench: bench with the alloys.
        name: name of the alloy.
        setpoint: resistivity that a controller holds as far as it can [ohm/m], or None for a cold spring.
    """

    def run() -> tuple[pj.SpringHistory, np.ndarray]:
        spring = on_stand(bench.alloys[name])
        elongation = cycles() * float(spring.geometry.free_length)
        xi0 = np.ones(elongation.size)
        if setpoint is not None:
            xi0 = controlled(spring.alloy, setpoint, np.asarray(spring.shear_strain(elongation)))[1]
        history = pj.simulate_spring(spring, elongation, pj.MartensiteFraction(xi0))
        return history, np.asarray(history.rows.resistance) / float(spring.geometry.wire_length)

    return bench.keep(("stretched", name, setpoint), run)


def _falling(bench: Bench) -> Found:
    """Share of the steps of stretching in which the cold resistivity falls, less of both alloys [%]."""
    each, words = {}, []
    for name in bench.alloys:
        history, rho = stretched(bench, name, None)
        up = np.diff(cycles()) > 0.0
        each[name] = 100.0 * float(np.mean(np.diff(rho)[up] < 0.0))
        words.append(f"{NAMES[name]}: from {rho[0]:.2f} to {rho.min():.2f} ohm/m")
    return Found(min(each.values()), "; ".join(words))


def _gradual(bench: Bench) -> Found:
    """Largest share of the drop within a tenth of the strains, larger of both alloys [%]."""
    each = {}
    for name, alloy in bench.alloys.items():
        gamma = np.linspace(0.0, PRESTRAIN, 201)
        rho = np.asarray(alloy.rho_m(gamma))
        ahead = np.interp(np.minimum(gamma + TENTH, PRESTRAIN), gamma, rho)
        each[name] = 100.0 * float((rho - ahead).max() / (rho[0] - rho[-1]))
    return Found(max(each.values()), ", ".join(f"{NAMES[n]} {v:.0f} %" for n, v in each.items()))


def _left_to_fall(bench: Bench) -> Found:
    """Remaining drop at the largest stretch, to the resistivity of detwinned martensite [%]."""
    each = {}
    for name, alloy in bench.alloys.items():
        rest, last, detwinned = (
            float(x) for x in (alloy.rho_m(0.0), alloy.rho_m(PRESTRAIN), alloy.rho_m_of(1.0))
        )
        each[name] = 100.0 * (last - detwinned) / (rest - detwinned)
    return Found(max(each.values()), ", ".join(f"{NAMES[n]} {v:.1f} %" for n, v in each.items()))


def _residual(bench: Bench, name: str) -> np.ndarray:
    """Residual strain after the last cycle, at each setpoint from cold to hot [1]."""
    return np.asarray(
        [np.asarray(stretched(bench, name, s)[0].rows.gamma_R)[-1] for s in setpoints(bench.alloys[name])]
    )


def _less_when_warmer(bench: Bench) -> Found:
    """Share of neighbouring setpoints of which the warmer one keeps less residual strain [%]."""
    falls, words = [], []
    for name in bench.alloys:
        residual_strains = _residual(bench, name)
        falls += list(np.diff(residual_strains) < 0.0)
        words.append(f"{NAMES[name]}: {listed(residual_strains, 3)} from cold to hot")
    return Found(100.0 * float(np.mean(falls)), "; ".join(words))


def _coldest_keeps_most(bench: Bench) -> Found:
    """Number of the two alloys with the most residual strain in their coldest test."""
    most = [bool(np.argmax(_residual(bench, name)) == 0) for name in bench.alloys]
    return Found(float(np.sum(most)))


def _phase_swing(bench: Bench) -> Found:
    """Largest change of the onset fraction along an intermediate test, over setpoints and alloys [1]."""
    swings = {}
    for name, alloy in bench.alloys.items():
        each = [
            float(np.ptp(np.asarray(stretched(bench, name, s)[0].rows.xi0))) for s in setpoints(alloy)[1:-1]
        ]
        swings[name] = each
    words = "; ".join(f"{NAMES[n]}: {listed(np.asarray(v), 2)}" for n, v in swings.items())
    return Found(max(max(v) for v in swings.values()), words + " (from the coldest intermediate setpoint on)")


def draw_cold(bench: Bench) -> Figure:
    """Cold resistivity over shear strain in growing cycles."""
    with style():
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        for axes, (name, alloy) in zip(figure.subplots(1, 2, sharey=True), bench.alloys.items(), strict=True):
            history, rho = stretched(bench, name, None)
            gamma = np.asarray(history.rows.gamma)
            axes.plot(gamma, rho, color=BLUE)
            turns = (2 * np.arange(len(PEAKS)) + 1) * ROWS
            axes.plot(gamma[turns], rho[turns], "o", color=ORANGE, label="where a cycle turns")
            axes.axhline(float(alloy.rho_m_of(1.0)), color=BLACK, linestyle=":", linewidth=1.2,
                         label="detwinned martensite")  # fmt: skip
            axes.set(title=NAMES[name], xlabel="shear strain [1]")
        figure.axes[0].set_ylabel("resistivity [ohm/m]")
        figure.axes[0].legend(loc="upper right")
    return figure


def draw_isoresistive(bench: Bench) -> Figure:
    """Stress over strain in growing cycles at seven setpoints, coloured by resistivity."""
    with style():
        figure = Figure(figsize=(12.0, 5.6), layout="constrained")
        panels = figure.subplots(2, SETPOINTS, sharex=True, sharey=True)
        for row, (name, alloy) in zip(panels, bench.alloys.items(), strict=True):
            ends = setpoints(alloy)
            shades = Normalize(float(ends[-1]), float(ends[0]))
            for axes, s in zip(row, ends, strict=True):
                history, rho = stretched(bench, name, s)
                gamma, stress = np.asarray(history.rows.gamma), 1e-6 * np.asarray(history.rows.stress)
                pulled = stress >= 0.0  # a stand does not push a spring together
                axes.plot(gamma, np.where(pulled, stress, np.nan), color=GREY, linewidth=0.7)
                axes.scatter(
                    gamma[pulled], stress[pulled], c=rho[pulled], cmap=SHADES, norm=shades, s=6, zorder=3
                )
                axes.set_title(f"{s:.2f} ohm/m", fontsize=9)
            row[0].set_ylabel(f"{NAMES[name]}\nshear stress [MPa]")
            figure.colorbar(ScalarMappable(shades, SHADES), ax=row, label="resistivity [ohm/m]")
        for axes in panels[-1]:
            axes.set_xlabel("shear strain [1]")
    return figure


_WHERE = "Section 2.4.4"
ENTRIES = (
    Entry(
        "2.11", "Resistivity of cold springs under growing cycles", _WHERE, draw_cold,
        "Resistivity over shear strain of springs that are stretched in five cycles, the last to 575 % of "
        "their length. In this model it depends on the strain alone, so the way back is the way out.",
        "The measured curves are lost, and with them whether the ways out and back differ.",
        (
            Statement(
                "2.11-1", _WHERE, "as the twinned martensite detwins, the resistivity falls off: share of "
                "the steps of stretching", "%", at_least(100.0, 90.0), _falling,
            ),
            Statement(
                "2.11-2", _WHERE, "it falls gradually: most of the drop that falls into one tenth of the "
                "strains",
                "%", at_most(35.0, 60.0), _gradual,
            ),
            Statement(
                "2.11-3", "Section 2.4.5", "at high strain it approaches that of detwinned martensite: what "
                "is left of the drop at 0.1924", "%", at_most(10.0, 25.0), _left_to_fall,
                "the printed sigmoid of the 35 degC alloy is not yet at its end there",
            ),
        ),
    ),
    Entry(
        "2.14", "Isoresistive tests in growing cycles", "Section 2.4.5", draw_isoresistive,
        "Shear stress over shear strain at seven setpoints from cold (left) to hot (right), coloured by the "
        "resistivity that can be held. The scale of stress is ours: the moduli are not published "
        "(correction 5).",
        "The measured curves and the strains at which the cycles turned are lost, but for the last.",
        (
            Statement(
                "2.14-1", "Section 3.4.1", "of these tests the first, at room temperature, leaves the "
                "largest residual strain: alloys, of 2, of which that holds", "1",
                at_least(2.0, 1.0), _coldest_keeps_most,
            ),
            Statement(
                "2.14-2", "Section 3.4.1", "warmer tests leave less residual strain: share of neighbouring "
                "setpoints",
                "%", at_least(100.0, 75.0), _less_when_warmer,
                "a controller that lets the wire cool while it is stretched lets it detwin as cold wire does",
            ),
            Statement(
                "2.14-3", "Section 2.4.5", "a constant resistance does not mean a constant temperature, "
                "which may vary substantially: largest change of xi0 along an intermediate test", "1",
                at_least(0.2, 0.1), _phase_swing,
            ),
        ),
    ),
)  # fmt: skip
