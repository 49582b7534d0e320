"""Figures 2.12 and 2.13: detwinning of martensite and transformation of austenite by strain, and the
resistivity with them."""

import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLUE, VERMILION, style

from .bench import PRESTRAIN, Bench
from .entry import Entry
from .expectation import at_least, at_most
from .resistivity import NAMES
from .spring_strain import wire_strain
from .statement import Found, Statement

HOT_LIMIT = 3.45  # Maximum spring strain of hot springs (Section 2.4.2)
STRAINS = np.linspace(0.0, PRESTRAIN, 200)


def _least(values: dict[str, float]) -> Found:
    """The smallest, both named."""
    return Found(min(values.values()), ", ".join(f"{NAMES[n]} {v:.3g}" for n, v in values.items()))


def _most(values: dict[str, float]) -> Found:
    return Found(max(values.values()), _least(values).detail)


def _fall(bench: Bench) -> Found:
    """Share of the tested strain over which the cold spring's resistivity falls [%]."""
    shares = {
        n: 100.0 * float(np.mean(np.diff(np.asarray(alloy.rho_m(STRAINS))) < 0.0))
        for n, alloy in bench.alloys.items()
    }
    return _least(shares)


def _at_gamma_max(bench: Bench) -> Found:
    """Least detwinned fraction at gamma_max over both alloys and both phases [1]."""
    each = {
        f"{NAMES[n]} from {phase}": float(getattr(alloy, law)(alloy.gamma_max))
        for n, alloy in bench.alloys.items()
        for phase, law in (("martensite", "xi_sm"), ("austenite", "xi_sa"))
    }
    return Found(min(each.values()), ", ".join(f"{name} {value:.3f}" for name, value in each.items()))


def _draw(bench: Bench, fraction: str, resistivity: str, axis: str, tested: float) -> Figure:
    """Fraction over shear strain (left) and resistivity over fraction (right), dashed where extrapolated."""
    with style():
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        tested_strains = np.linspace(0.0, tested, 150)
        beyond = np.linspace(tested, PRESTRAIN, 60)
        for colour, (name, alloy) in zip((BLUE, VERMILION), bench.alloys.items(), strict=True):
            for gamma, line in ((tested_strains, "-"), (beyond, ":")):
                if np.ptp(gamma) == 0.0:
                    continue
                xi, rho = (
                    np.asarray(getattr(alloy, fraction)(gamma)),
                    np.asarray(getattr(alloy, resistivity)(gamma)),
                )
                label = NAMES[name] if line == "-" else f"{NAMES[name]}, beyond the test"
                left.plot(gamma, xi, line, color=colour, label=label)
                right.plot(xi, rho, line, color=colour)
        left.set(xlabel="shear strain [1]", ylabel=axis, ylim=(-0.03, 1.03))
        right.set(xlabel=axis, ylabel="resistivity [ohm/m]", xlim=(-0.03, 1.03))
        left.legend(loc="upper left")
    return figure


def draw_martensite(bench: Bench) -> Figure:
    """Cold springs."""
    return _draw(bench, "xi_sm", "rho_m", "detwinned fraction of martensite [1]", PRESTRAIN)


def draw_austenite(bench: Bench) -> Figure:
    """Hot springs, which were stretched to 345 % only."""
    return _draw(
        bench, "xi_sa", "rho_a", "transformed fraction of austenite [1]", float(wire_strain(HOT_LIMIT))
    )


def _each(bench: Bench, law: str, gamma: float) -> dict[str, float]:
    call = lambda alloy: float(getattr(alloy, law)(gamma))  # noqa: E731
    return {name: call(alloy) for name, alloy in bench.alloys.items()}


def _slope_of_hot_stress(bench: Bench) -> Found:
    """Slope of the hot stress at the end of the hot test over that at rest, larger of both alloys [%]."""
    end = float(wire_strain(HOT_LIMIT))

    def ratio(alloy: pj.Alloy) -> float:
        gamma = np.asarray([0.0, 1e-4, end - 1e-4, end])
        stress = np.asarray(alloy.shear_stress(gamma, 0.0, 0.0))
        return 100.0 * float((stress[3] - stress[2]) / (stress[1] - stress[0]))

    return _most({name: ratio(alloy) for name, alloy in bench.alloys.items()})


_MARTENSITE = (
    Statement(
        "2.12-1", "Section 2.4.4, Table 2.2", "at rest the martensite is twinned: largest detwinned "
        "fraction", "1",
        at_most(0.05, 0.10), lambda bench: _most(_each(bench, "xi_sm", 0.0)),
    ),
    Statement(
        "2.12-2", "Section 2.4.4, Table 2.2", "at the largest test strain nearly all of it is detwinned: "
        "least fraction", "1",
        at_least(0.90, 0.80), lambda bench: _least(_each(bench, "xi_sm", PRESTRAIN)),
    ),
    Statement(
        "2.12-3", "Section 2.4.4", "the resistivity of a cold spring falls as it is stretched: share of the "
        "strain over which it does", "%", at_least(100.0, 95.0), _fall,
    ),
)  # fmt: skip
_AUSTENITE = (
    Statement(
        "2.13-1", "Section 2.4.4", "at rest the hot spring is all austenite: largest transformed "
        "fraction", "1",
        at_most(0.01, 0.05), lambda bench: _most(_each(bench, "xi_sa", 0.0)),
    ),
    Statement(
        "2.13-2", "Section 3.3.1", "stretched hot, the stress begins to plateau: slope at 345 % over that at "
        "rest", "%",
        at_most(50.0, 80.0), _slope_of_hot_stress,
    ),
    Statement(
        "2.13-3", "Section 2.3.4, Table 2.2", "gamma_max = 0.195 is the strain at which all is detwinned: "
        "least fraction there", "1", at_least(0.98, 0.85), _at_gamma_max,
        "the sigmoids of Table 2.2 have not levelled off at the largest tested strain",
    ),
)  # fmt: skip

ENTRIES = (
    Entry(
        "2.12", "Detwinning of martensite", "Section 2.4.4", draw_martensite,
        "Detwinned fraction over shear strain (left) and resistivity over detwinned fraction (right), cold.",
        "The measured points are lost; the fitted laws of Table 2.2 remain.", _MARTENSITE,
    ),
    Entry(
        "2.13", "Stress-induced martensite from austenite", "Section 2.4.4", draw_austenite,
        "Transformed fraction over shear strain (left) and resistivity over that fraction (right), hot; "
        "dotted where the test did not reach, beyond 345 % of spring strain.",
        "The measured points are lost; the fitted laws of Table 2.2 remain.", _AUSTENITE,
    ),
)  # fmt: skip
