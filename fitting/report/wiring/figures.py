"""The figure of a choice of filters: heating over frequency, and crosstalk of all pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fitting.wiring.circuit import Circuit, crosstalk, heating

from ..figures import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, new

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


def wiring_figure(circuit: Circuit) -> Figure:
    """Figure of the heating of every spring over frequency, and the crosstalk of every pair."""
    ends = np.log10([float(circuit.resonance.min()) * 0.7, float(circuit.resonance.max()) * 1.4])
    frequency = np.unique(np.concatenate([np.logspace(*ends, 1500), np.asarray(circuit.resonance)]))
    power, table = np.asarray(heating(circuit, frequency)), np.asarray(crosstalk(circuit))
    figure = new.Figure(figsize=(11.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.7, 1.0)})
    for k in range(power.shape[1]):
        left.plot(
            frequency / 1e3, power[:, k], color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=str(k + 1)
        )
    left.set(
        xscale="log",
        yscale="log",
        xlabel="frequency of the supply [kHz]",
        ylabel="heating of a spring [W]",
    )
    left.set_ylim(power.max() * 1e-6, power.max() * 3.0)
    if power.shape[1] <= len(COLOURS):
        left.legend(title="segment", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)
    shown = right.imshow(np.log10(np.maximum(table, 1e-8)), cmap="viridis", vmin=-6.0, vmax=0.0)
    right.grid(False)
    right.set(xlabel="heated segment", ylabel="selected segment")
    for axis in (right.xaxis, right.yaxis):
        axis.set_ticks(range(len(table)), [str(k + 1) for k in range(len(table))])
    figure.colorbar(shown, ax=right, label="heating over that of the selected one, log10 [1]")
    return figure
