"""Figure 3.21: PneuSMA actuators at constant pressure, heated and cooled."""

import numpy as np
from matplotlib.figure import Figure

from fitting.report.figures import BLUE, GREEN, VERMILION, style

from .bench import SETPOINTS, Bench, listed, thermal_cycle
from .entry import Entry
from .expectation import at_least, at_most
from .statement import Found, Statement

DESIGNS = {"pneusma1": "PneuSMA1", "pneusma2": "PneuSMA2"}
COLOURS = (BLUE, GREEN, VERMILION)


def curvatures(bench: Bench, design: str) -> np.ndarray:
    """Curvature along the thermal cycle at each setpoint [1/m], shape (setpoints, rows)."""
    return np.stack([np.asarray(bench.cycle(design, p).rows.curvature) for p in SETPOINTS])


def heated_resistance(bench: Bench, design: str) -> np.ndarray:
    """Resistance of the heated spring along the cycle [ohm], shape (setpoints, rows)."""
    return np.stack([np.asarray(bench.cycle(design, p).rows.springs[-1].resistance) for p in SETPOINTS])


def _cold_start(bench: Bench, design: str) -> Found:
    start = curvatures(bench, design)[:, 0]
    return Found(float(np.abs(start).min() if design == "pneusma1" else np.abs(start).max()), _at(start))


def _at(values: np.ndarray) -> str:
    return f"{listed(values)} 1/m at {listed(1e-3 * np.asarray(SETPOINTS), 0)} kPa"


def _change(bench: Bench, design: str) -> Found:
    """Least change of the cold curvature by a heat-cool cycle, over the setpoints [1/m]."""
    path = curvatures(bench, design)
    return Found(float((path[:, -1] - path[:, 0]).min()), f"from {listed(path[:, 0])} to {_at(path[:, -1])}")


def _recovered(bench: Bench) -> Found:
    """Share of the initial residual strain that heating recovers, least of setpoints and designs [%]."""
    hot, after = [], []
    for design in DESIGNS:
        for pressure in SETPOINTS:
            strain = np.asarray(bench.cycle(design, pressure).rows.springs[-1].gamma_R)
            hot.append(100.0 * (1.0 - strain.min() / strain[0]))
            after.append(100.0 * (1.0 - strain[-1] / strain[0]))
    detail = (
        f"cooling under the load detwins anew and leaves {min(after):.0f} to {max(after):.0f} % recovered"
    )
    return Found(float(min(hot)), detail)


def _heating_bends(bench: Bench) -> float:
    """Share of the steps of heating in which the curvature grows, both designs, all setpoints [%]."""
    hottest = int(np.argmin(thermal_cycle()))
    steps = np.concatenate([np.diff(curvatures(bench, d)[:, : hottest + 1], axis=1) for d in DESIGNS])
    moving = np.diff(thermal_cycle()[: hottest + 1]) < 0.0
    return float(100.0 * np.mean(steps[:, moving] > 0.0))


def draw(bench: Bench) -> Figure:
    """Curvature over the cycle and over the heated spring's resistance."""
    with style():
        figure = Figure(figsize=(12.0, 7.0), layout="constrained")
        panels = figure.subplots(2, 3, sharex="col", width_ratios=(1.0, 1.0, 1.1))
        share = np.linspace(0.0, 100.0, len(thermal_cycle()))
        for row, (design, name) in zip(panels, DESIGNS.items(), strict=True):
            row[0].plot(share, thermal_cycle(), color="black")
            for colour, pressure, path, ohm in zip(
                COLOURS, SETPOINTS, curvatures(bench, design), heated_resistance(bench, design), strict=True
            ):
                row[1].plot(share, path, color=colour, label=f"{1e-3 * pressure:g} kPa")
                row[1].plot([0.0, 100.0], [path[0]] * 2, ":", color=colour, linewidth=1.0)
                row[2].plot(ohm, path, color=colour)
                row[2].plot(ohm[0], path[0], "o", color=colour, markersize=6)
                row[2].plot(ohm[-1], path[-1], "s", color=colour, markersize=6)
            row[0].set_ylabel(f"{name}\nxi0 of the heated spring [1]")
            for axes in row[1:]:
                axes.set_ylabel("curvature [1/m]")
        for axes, label in zip(panels[-1], ("share of the cycle [%]", "share of the cycle [%]",
                                            "resistance of the heated spring "
                                            "[ohm]"), strict=True):  # fmt: skip
            axes.set_xlabel(label)
        panels[0, 2].plot([], [], "o", color="black", label="start, cold")
        panels[0, 2].plot([], [], "s", color="black", label="end, cold again")
        handles = [a.get_legend_handles_labels() for a in (panels[0, 1], panels[0, 2])]
        figure.legend(sum((h for h, _ in handles), []), sum((n for _, n in handles), []),
                      loc="outside upper center", ncols=5)  # fmt: skip
    return figure


_ABOUT = "Section 3.7.4"
ENTRIES = (
    Entry(
        "3.21", "Curvature during heating and cooling at constant pressure", _ABOUT, draw,
        "One spring is heated from xi0 = 1 to 0.1 and cooled again at 10, 30 and 50 kPa. Dotted: where it "
        "started.",
        "Measured curvatures, resistances and pressures are lost, and with them the phases that were "
        "reached; ours are prescribed.",
        (
            Statement(
                "3.21-1", _ABOUT, "PneuSMA1 has some curvature before it is heated: least over the "
                "setpoints", "1/m",
                at_least(0.5, 0.1), lambda bench: _cold_start(bench, "pneusma1"),
            ),
            Statement(
                "3.21-2", _ABOUT, "PneuSMA2 starts with zero curvature, its springs being equal: "
                "largest", "1/m",
                at_most(1e-6, 0.1), lambda bench: _cold_start(bench, "pneusma2"),
            ),
            Statement(
                "3.21-3", "Sections 3.2.3 and 3.7.4", "heating a spring bends the actuator towards it: share "
                "of the steps",
                "%", at_least(100.0, 95.0), _heating_bends, rests_on="G_m and G_a (correction 5)",
            ),
            Statement(
                "3.21-4", _ABOUT, "PneuSMA1 does not return after heating and cooling: least change", "1/m",
                at_least(1.0, 0.1), lambda bench: _change(bench, "pneusma1"),
            ),
            Statement(
                "3.21-5", _ABOUT, "PneuSMA2 does not return after heating and cooling: least change", "1/m",
                at_least(1.0, 0.1), lambda bench: _change(bench, "pneusma2"),
            ),
            Statement(
                "3.21-6", _ABOUT, "because heating recovers most of the initial residual strain: least "
                "share", "%",
                at_least(80.0, 50.0), _recovered,
            ),
        ),
    ),
)  # fmt: skip
