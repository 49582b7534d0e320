"""Figure 3.25: reachable bends of three designs."""

import numpy as np
from matplotlib.figure import Figure

from fitting.report.figures.workspace import workspace_figure
from fitting.simulate.workspace import DESIGNS

from .bench import Bench
from .entry import Entry
from .expectation import Near, at_least
from .statement import Found, Statement


def _largest(bench: Bench, design: str) -> float:
    return float(np.nanmax(bench.workspace(design).curvature))


def _least(bench: Bench, design: str) -> float:
    return float(np.nanmin(bench.workspace(design).curvature))


def _above_pneuflex(bench: Bench, design: str) -> Found:
    ours, flex = (bench.workspace(d) for d in (design, "pneuflex_s"))
    middle = int(np.argmin(np.abs(ours.pressure - 30e3)))
    at_middle = [float(np.nanmax(s.curvature[..., middle])) for s in (ours, flex)]
    largest = [float(np.nanmax(s.curvature)) for s in (ours, flex)]
    words = [f"{mine:.1f} against {other:.1f} 1/m" for mine, other in (largest, at_middle)]
    detail = f"{words[0]}; at 30 kPa {words[1]}"
    return Found(largest[0] / largest[1], detail)


def _tightest(bench: Bench) -> Found:
    each = {d: _largest(bench, d) for d in DESIGNS}
    others = max(v for d, v in each.items() if d != "pneusma1")
    return Found(each["pneusma1"] / others, ", ".join(f"{d} {v:.1f} 1/m" for d, v in each.items()))


def _both_ways(bench: Bench) -> Found:
    """Ratio of the largest curvatures to both sides, 1 where they are the same [1]."""
    low, high = _least(bench, "pneusma2"), _largest(bench, "pneusma2")
    return Found(-low / high, f"{low:.1f} to {high:.1f} 1/m")


def _range_at_one_pressure(bench: Bench) -> Found:
    """Least width of the reachable curvatures at a pressure, both PneuSMA designs [1/m]."""
    widths = {
        d: float(np.ptp(bench.workspace(d).curvature, axis=(0, 1)).min()) for d in ("pneusma1", "pneusma2")
    }
    return Found(min(widths.values()), ", ".join(f"{d} {v:.1f} 1/m" for d, v in widths.items()))


def _bend_range(bench: Bench) -> Found:
    """Largest bend angle of the better PneuSMA design over PneuFLEX's [1]."""
    each = {d: np.degrees(float(np.nanmax(bench.workspace(d).bend))) for d in DESIGNS}
    best = max(v for d, v in each.items() if d != "pneuflex_s")
    return Found(best / each["pneuflex_s"], ", ".join(f"{d} {v:.0f} deg" for d, v in each.items()))


def _printed_radius(bench: Bench) -> Found:
    """Radius by Eq. 3.20 over the one that fulfils Eqs. 3.17 and 3.18, at PneuSMA1's tightest bend [1]."""
    space = bench.workspace("pneusma1")
    index = space.extreme(largest=True)
    bend, length = float(space.bend[index]), float(space.length[index])
    printed = (
        length - 0.5 * space.outer_diameter * bend
    ) / bend  # Eq. 3.20: d_o (L0 + delta_2) / (delta_1 - delta_2)
    return Found(printed * bend / length, f"{1e3 * printed:.1f} against {1e3 * length / bend:.1f} mm")


def draw(bench: Bench) -> Figure:
    """Reachable curvature and bend angle, and the extreme shapes."""
    return workspace_figure([bench.workspace(design) for design in DESIGNS])


_ABOUT = "Section 3.8.1"
ENTRIES = (
    Entry(
        "3.25", "Workspace of three designs", _ABOUT, draw,
        "Curvature and bend angle over 0 to 60 kPa and all activations between cold and xi0 = 0.1, and the "
        "least and most curved states.",
        "The drawn regions are lost, and with them the activations that the source allowed.",
        (
            Statement(
                "3.25-1", _ABOUT, "PneuSMA1 reaches the tightest bend: its largest curvature over the "
                "next", "1",
                at_least(1.05, 1.0), _tightest,
            ),
            Statement(
                "3.25-2", _ABOUT, "PneuSMA1 reaches much higher curvatures than PneuFLEX: ratio of the "
                "largest", "1",
                at_least(1.25, 1.0), lambda bench: _above_pneuflex(bench, "pneusma1"),
            ),
            Statement(
                "3.25-3", _ABOUT, "PneuSMA2 reaches much higher curvatures than PneuFLEX: ratio of the "
                "largest", "1",
                at_least(1.25, 1.0), lambda bench: _above_pneuflex(bench, "pneusma2"),
                "near 60 kPa our PneuFLEX bends as tightly as hot PneuSMA2 does at low pressure; at equal "
                "moderate pressures the statement holds",
            ),
            Statement(
                "3.25-4", _ABOUT, "PneuSMA2 bends both ways: largest curvature to one side over the "
                "other", "1",
                Near(1.0, 0.01, 0.10, quoted=False), _both_ways,
            ),
            Statement(
                "3.25-5", _ABOUT, "at one pressure a PneuSMA actuator reaches a range of curvatures: least "
                "width", "1/m",
                at_least(10.0, 1.0), _range_at_one_pressure,
            ),
            Statement(
                "3.25-6", _ABOUT, "PneuSMA actuators outperform PneuFLEX in bend angle too: ratio of the "
                "largest", "1",
                at_least(1.0, 0.9), _bend_range,
            ),
            Statement(
                "3.25-7", "Eqs. 3.17-3.21", "the printed radius of curvature fulfils the arcs from which it "
                "is derived: printed radius over the arcs'", "1",
                Near(1.0, 0.01, 0.10, quoted=False), _printed_radius,
                "Eq. 3.20 lacks d_o/2 and is the inner edge's radius; curvatures here are the centre line's "
                "(correction 7)",
                contradicted=True,
            ),
        ),
    ),
)  # fmt: skip
