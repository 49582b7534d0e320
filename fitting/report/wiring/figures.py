"""The figure of a choice of filters: heating over frequency, and crosstalk of all pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fitting.wiring.circuit import Circuit, crosstalk, heating

from ..figures import legend_over, new, series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IN_A_ROW = 10
"""Maximum of springs in a row of the legend."""


def wiring_figure(circuit: Circuit) -> Figure:
    """Figure of the heating of every spring over frequency, and the crosstalk of every pair."""
    ends = np.log10([float(circuit.resonance.min()) * 0.7, float(circuit.resonance.max()) * 1.4])
    frequency = np.unique(np.concatenate([np.logspace(*ends, 1500), np.asarray(circuit.resonance)]))
    power, table = np.asarray(heating(circuit, frequency)), np.asarray(crosstalk(circuit))
    figure = new.Figure(figsize=(11.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.7, 1.0)})
    for k in range(power.shape[1]):
        left.plot(frequency / 1e3, power[:, k], linewidth=1.2, label=f"spring {k + 1}", **series(k))
    left.set(
        xscale="log",
        yscale="log",
        xlabel="frequency of the supply [kHz]",
        ylabel="heating of a spring [W]",
    )
    left.set_ylim(power.max() * 1e-6, power.max() * 3.0)
    shown = right.imshow(np.log10(np.maximum(table, 1e-8)), cmap="viridis", vmin=-6.0, vmax=0.0)
    right.grid(False)
    right.set(xlabel="heated spring", ylabel="selected spring")
    for axis in (right.xaxis, right.yaxis):
        axis.set_ticks(range(len(table)), [str(k + 1) for k in range(len(table))])
    figure.colorbar(shown, ax=right, label="heating over that of the selected one, log10 [1]")
    legend_over(figure, left.get_lines(), columns=IN_A_ROW)
    return figure
