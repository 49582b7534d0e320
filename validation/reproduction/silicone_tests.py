"""Figure 3.10: five mechanical tests of the silicone, and the law of the actuators made from two of them."""

import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLACK, BLUE, GREEN, ORANGE, SKY, VERMILION, style
from pneusma_jax.numerics.safe import as_numpy

from .bench import Bench
from .entry import Entry
from .expectation import Near, at_most
from .statement import Found, Statement

TESTS = {
    "standard_tension": ("uniaxial tension", BLUE),
    "bulk_compression": ("bulk compression", VERMILION),
    "tube_tension": ("tension of the wrapped tube", SKY),
    "tube_buckling": ("buckling inside a tube", ORANGE),
    "needle_buckling": ("buckling between needles", GREEN),
}


def stress_in(name: str, strain: np.ndarray) -> np.ndarray:
    """A fit of Table 3.1 as printed [kPa]."""
    return 1e-3 * np.asarray(as_numpy(pj.load_silicone_test(name))(np.asarray(strain)))


def _tube_against_coupon(bench: Bench) -> Found:
    """Root-mean-square difference of tube and coupon tension over the tube's range [% of the coupon's]."""
    strain = np.linspace(0.0, 0.75, 151)
    coupon, tube = stress_in("standard_tension", strain), stress_in("tube_tension", strain)
    off = 100.0 * float(np.sqrt(np.mean((tube - coupon) ** 2) / np.mean(coupon**2)))
    worst = float(np.max(tube - coupon))
    return Found(
        off, f"the tube is up to {worst:.1f} kPa stiffer, {tube[20] / coupon[20] - 1.0:.0%} at 10 % strain"
    )


def _buckled_share(bench: Bench) -> Found:
    """Larger of the buckling stresses over the bulk one at half the length [%]."""
    bulk, *buckled = (
        float(stress_in(t, -0.5)) for t in ("bulk_compression", "tube_buckling", "needle_buckling")
    )
    return Found(
        100.0 * min(buckled) / bulk,
        f"{bulk:.0f} kPa in bulk, {buckled[0]:.0f} and {buckled[1]:.0f} kPa buckled",
    )


def _plateau(bench: Bench) -> float:
    """Least slope of the needle-buckling curve over its slope at rest [%]."""
    strain = np.linspace(-0.5, 0.0, 501)
    slope = np.gradient(stress_in("needle_buckling", strain), strain)
    return 100.0 * float(slope[5:-5].min() / slope[-1])


def _jump(bench: Bench) -> Found:
    """Step of our law through zero strain, and of Eqs. 3.22 to 3.25 as printed [kPa]."""
    before, after = (float(stress_in(t, 0.0)) for t in ("needle_buckling", "standard_tension"))
    ours = 1e-3 * np.asarray(bench.silicone(np.asarray([-1e-15, 1e-15])))
    return Found(float(abs(ours[1] - ours[0])), f"as printed, from {before:+.2f} to {after:+.2f} kPa")


def _departure(bench: Bench) -> Found:
    """Largest difference of our law from Eqs. 3.22 to 3.25 in the tested strains, outside the blend [kPa]."""
    strain = np.concatenate([np.linspace(-0.54, -0.0201, 300), np.linspace(0.0201, 1.5, 300)])
    printed = np.where(
        strain > 0.0, stress_in("standard_tension", strain), stress_in("needle_buckling", strain)
    )
    off = np.abs(1e-3 * np.asarray(bench.silicone(strain)) - printed)
    return Found(float(off.max()), f"in tension {float(off[strain > 0].max()):.2f} kPa")


def draw_tests(bench: Bench) -> Figure:
    """The five tests, and the law of the actuators made from two of them."""
    with style():
        figure = Figure(figsize=(11.0, 4.8), layout="constrained")
        whole, near = figure.subplots(1, 2)
        for name, (words, colour) in TESTS.items():
            test = pj.load_silicone_test(name)
            strain = np.linspace(float(test.strain_min), float(test.strain_max), 200)
            whole.plot(strain, stress_in(name, strain), color=colour, label=words)
            near.plot(strain, stress_in(name, strain), color=colour)
        strain = np.linspace(-0.6, 1.5, 600)
        for axes in (whole, near):
            axes.plot(strain, 1e-3 * np.asarray(bench.silicone(strain)), "--", color=BLACK, linewidth=1.2,
                      label="law of the actuators")  # fmt: skip
            axes.set(xlabel="engineering strain [1]", ylabel="engineering stress [kPa]")
        whole.legend(loc="lower right")
        near.set(xlim=(-0.1, 0.1), ylim=(-45.0, 30.0), title="around zero strain")
    return figure


ENTRIES = (
    Entry(
        "3.10", "Five mechanical tests of the silicone", "Section 3.4.2", draw_tests,
        "The fits of Table 3.1 in the strains that were tested, and the law that our actuators use.",
        "The measured points are lost; their fits remain.",
        (
            Statement(
                "3.10-1", "Section 3.4.2", "the wrapped tube in tension follows almost exactly the path of "
                "the coupon: root-mean-square difference", "%", at_most(5.0, 15.0), _tube_against_coupon,
                "the printed fits differ most below 20 % of strain", contradicted=True,
            ),
            Statement(
                "3.10-2", "Section 3.4.2", "allowed to buckle, the silicone is far weaker than in bulk: "
                "stress at half the length (of the bulk one)", "%", at_most(50.0, 75.0), _buckled_share,
            ),
            Statement(
                "3.10-3", "Section 3.4.2", "the buckling force plateaus: least slope (of that at rest)", "%",
                at_most(20.0, 40.0), _plateau,
            ),
            Statement(
                "3.10-4", "Eqs. 3.22-3.25, Table 3.1", "the printed stress of the wall jumps at zero "
                "strain, from 5.7573 to -0.3729 kPa; ours jumps by", "kPa", Near(6.1302, 0.01, 0.10), _jump,
                "on purpose: no equilibrium can be found across a jump, so ours passes through zero "
                "(correction 10)", contradicted=True,
            ),
            Statement(
                "3.10-5", "Eqs. 3.22-3.25", "elsewhere our law is the printed one: largest difference in the "
                "tested strains, more than 2 % from zero", "kPa", at_most(6.0, 12.0), _departure,
                stated=False,
            ),
        ),
    ),
)  # fmt: skip
