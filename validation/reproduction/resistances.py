"""Figures 3.20 and 3.23: resistance of the actuators' springs under heat, and under pressure."""

from collections.abc import Callable

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from fitting.report.figures import BLUE, GREEN, VERMILION, style

from .bench import HOT, SETPOINTS, SWEEP_ROWS, Bench, listed, pressure_sweep, thermal_cycle
from .entry import Entry
from .expectation import Interval, at_least, at_most
from .pressure_sweeps import DESIGNS, LEVELS
from .statement import Found, Statement

COLOURS = (BLUE, GREEN, VERMILION)
DEGREE = 6  # Degree of our polynomials; the source does not state its own


def along_cycle(bench: Bench, design: str, pressure: float, spring: int = -1) -> np.ndarray:
    """Resistance along the thermal cycle [ohm], of the heated spring by default."""
    return np.asarray(bench.cycle(design, pressure).rows.springs[spring].resistance)


def along_sweep(bench: Bench, design: str, heated: float) -> np.ndarray:
    """Resistance of the heated spring along the pressure sweep [ohm]."""
    return np.asarray(bench.sweep(design, heated).rows.springs[-1].resistance)


def _heating_lowers(bench: Bench) -> Found:
    """Share of the steps of heating in which the heated spring's resistance falls [%]."""
    heating = np.diff(thermal_cycle()) < 0.0
    falls, words = [], []
    for design, name in DESIGNS.items():
        paths = [along_cycle(bench, design, p) for p in SETPOINTS]
        falls += [np.mean(np.diff(path)[heating] < 0.0) for path in paths]
        words.append(
            f"{name}: {listed([path[0] for path in paths], 2)} to "
            f"{listed([path.min() for path in paths], 2)} ohm"
        )
    return Found(100.0 * float(np.mean(falls)), "; ".join(words))


def _cold_one(bench: Bench) -> Found:
    """Range of the spring that is not heated over that of the heated one, largest over the setpoints [%]."""
    shares = [
        100.0
        * float(np.ptp(along_cycle(bench, "pneusma2", p, 0)) / np.ptp(along_cycle(bench, "pneusma2", p)))
        for p in SETPOINTS
    ]
    return Found(max(shares), f"{listed(shares)} % at {listed(1e-3 * np.asarray(SETPOINTS), 0)} kPa")


def _off_fit(paths: list[np.ndarray], over: np.ndarray, degree: int) -> np.ndarray:
    """Largest deviation of each path from its polynomial, over its mean [%]."""
    fits = [np.polynomial.Polynomial.fit(over, path, degree)(over) for path in paths]
    return np.asarray([100.0 * np.abs(p - f).max() / p.mean() for p, f in zip(paths, fits, strict=True)])


def _smooth(bench: Bench) -> Found:
    off = _off_fit(
        [along_cycle(bench, d, p) for d in DESIGNS for p in SETPOINTS], np.arange(SWEEP_ROWS), DEGREE
    )
    return Found(
        float(off.max()), f"degree {DEGREE}; {listed(off)} % from PneuSMA1 at 10 kPa to PneuSMA2 at 50 kPa"
    )


def _straight(bench: Bench) -> Found:
    off = {
        name: _off_fit([along_sweep(bench, d, x) for x in LEVELS], pressure_sweep(), 1)
        for d, name in DESIGNS.items()
    }
    return Found(
        max(float(v.max()) for v in off.values()),
        "; ".join(f"{n}: {listed(v)} % from cold to hot" for n, v in off.items()),
    )


def _by_pressure(bench: Bench) -> Found:
    """Range over the pressures over that over heat, larger of both designs [%]."""
    shares = {}
    for design, name in DESIGNS.items():
        paths = np.stack([along_sweep(bench, design, x) for x in LEVELS])
        shares[name] = 100.0 * float(np.ptp(paths, axis=1).max() / np.ptp(paths.mean(axis=1)))
    return Found(max(shares.values()), ", ".join(f"{n} {v:.0f} %" for n, v in shares.items()))


def _returns(bench: Bench) -> float:
    """Largest difference between pressurising and venting [ohm]."""
    paths = [along_sweep(bench, d, x) for d in DESIGNS for x in LEVELS]
    return max(float(np.abs(path - path[::-1]).max()) for path in paths)


def draw_cycle(bench: Bench) -> Figure:
    """Resistance of both springs over the thermal cycle at each setpoint."""
    with style():
        figure = Figure(figsize=(11.0, 4.6), layout="constrained")
        share = np.linspace(0.0, 100.0, SWEEP_ROWS)
        for axes, (design, name) in zip(figure.subplots(1, 2, sharey=True), DESIGNS.items(), strict=True):
            for colour, pressure in zip(COLOURS, SETPOINTS, strict=True):
                axes.plot(
                    share,
                    along_cycle(bench, design, pressure),
                    color=colour,
                    label=f"{1e-3 * pressure:g} kPa",
                )
                if design == "pneusma2":
                    axes.plot(
                        share, along_cycle(bench, design, pressure, 0), "--", color=colour, linewidth=1.2
                    )
            axes.set(title=name, xlabel="share of the cycle [%]")
        figure.axes[0].set_ylabel("resistance [ohm]")
        figure.axes[1].plot([], [], "--", color="black", linewidth=1.2, label="the spring that stays cold")
        figure.legend(*figure.axes[1].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def draw_sweep(bench: Bench) -> Figure:
    """Resistance of the heated spring over pressure, with straight lines."""
    with style():
        figure = Figure(figsize=(11.0, 4.8), layout="constrained")
        shades = colormaps["plasma_r"](np.linspace(0.95, 0.2, len(LEVELS)))
        pressure = 1e-3 * pressure_sweep()
        for axes, (design, name) in zip(figure.subplots(1, 2, sharey=True), DESIGNS.items(), strict=True):
            for level, colour in zip(LEVELS, shades, strict=True):
                path = along_sweep(bench, design, level)
                line = np.polynomial.Polynomial.fit(pressure, path, 1)(pressure)
                axes.plot(pressure, path, color=colour, label=f"xi0 = {level:g}")
                axes.plot(pressure, line, ":", color=colour, linewidth=1.2)
                axes.plot(pressure[0], path[0], "o", color=colour, markersize=5)
            axes.set(title=name, xlabel="gauge pressure [kPa]")
        figure.axes[0].set_ylabel("resistance of the heated spring [ohm]")
        handles = figure.axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper center", ncols=len(LEVELS))
    return figure


def _statement(
    number: str, where: str, says: str, unit: str, expected: Interval, ours: Callable[[Bench], Found | float],
    reason: str = "", stated: bool = True, rests_on: str = "",
) -> Statement:  # fmt: skip
    return Statement(number, where, says, unit, expected, ours, reason, rests_on, stated=stated)


_ALPHA = "alpha_1 (correction 4)"
ENTRIES = (
    Entry(
        "3.20", "Resistance during heating and cooling at constant pressure", "Section 3.7.4", draw_cycle,
        f"Solid: the spring that is heated from xi0 = 1 to {HOT:g} and cooled again. Both change with the "
        "strain, too, as the actuator bends.",
        "Measured resistances, currents and pressures are lost, and with them the phases that were reached; "
        "ours are prescribed.",
        (
            _statement(
                "3.20-1", "Sections 2.4.3 and 3.7.4", "resistance tells temperature: share of the steps of "
                "heating in which it falls", "%", at_least(100.0, 90.0), _heating_lowers,
                "near full heat the resistance hardly tells the phase, and the strain shows instead",
                rests_on=_ALPHA,
            ),
            _statement(
                "3.20-2", "Section 3.7.4", "polynomials smooth it: largest deviation from one of degree 6 "
                "(of the mean)",
                "%", at_most(2.0, 5.0), _smooth,
                "the prescribed heating has corners, and near full heat the resistance is flat", stated=False,
            ),
            _statement(
                "3.20-3", "Section 3.7.4", "the opposing spring remains at room temperature: range of its "
                "resistance over that of the heated one", "%", at_most(50.0, 100.0), _cold_one, stated=False,
            ),
        ),
    ),
    Entry(
        "3.23", "Resistance at constant heat while pressure changes", "Section 3.7.5", draw_sweep,
        "Heated spring at six phases, pressurised to 60 kPa and vented; both ways lie on each other. "
        "Dotted: straight lines over pressure. The dots are where the tests start.",
        "Measured resistances are lost, and with them the phases that belong to the source's duty cycles. "
        "So is the axis: the source marks starting points with arrows, which it need not over time, so we "
        "take pressure.",
        (
            _statement(
                "3.23-1", "Section 3.7.5", "straight lines smooth it: largest deviation from one (of the "
                "mean)",
                "%", at_most(2.0, 5.0), _straight,
                "detwinning makes it curve",
            ),
            _statement(
                "3.23-2", "Section 3.7.5", "pressing and venting follow one path: largest difference of the "
                "resistance",
                "ohm", at_most(1e-3, 0.05), _returns,
            ),
            _statement(
                "3.23-3", "Section 3.7.5", "the temperature stays nearly constant, so that what changes the "
                "resistance is heat, not pressure: range over pressure over that over heat", "%",
                at_most(33.0, 66.0), _by_pressure,
                "pressure stretches a cold spring of PneuSMA2, and detwinning lowers its resistance, too",
                stated=False,
            ),
        ),
    ),
)  # fmt: skip
