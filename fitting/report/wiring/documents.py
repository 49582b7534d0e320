"""A choice of filters as text, figure and files."""

import json

import numpy as np
from matplotlib.figure import Figure

from fitting.report.figures import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, png, style
from fitting.report.render import plain
from fitting.report.table import Table, table_text
from fitting.wiring.choose import Wiring
from fitting.wiring.circuit import Circuit, crosstalk, heating, sensing

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


def text(result: Wiring) -> str:
    """Sentences on the filters, the springs that they heat, and the sensing of resistances."""
    circuit, made = result.circuit, result.made
    power = np.diagonal(np.asarray(heating(circuit, circuit.resonance)))
    errors = np.linalg.norm(np.asarray(sensing(circuit, circuit.resonance)), axis=1)
    rows = [
        [
            str(k + 1),
            f"{float(circuit.resonance[k]) / 1e3:.2f}",
            f"{1e6 * float(circuit.inductance[k]):.1f}",
            f"{1e9 * float(circuit.capacitance[k]):.3g}",
            f"{1e9 * float(made.capacitance[k]):.3g}",
            f"{1e6 * float(made.inductance[k]):.1f}",
            f"{float(circuit.quality[k]):.0f}",
            f"{power[k]:.3f}",
            f"{errors[k]:.2f}",
        ]
        for k in range(len(power))
    ]
    header = (
        "segment", "selected at [kHz]", "coil [uH]", "capacitor [nF]", "sold [nF]", "coil trimmed [uH]",
        "quality", "heat [W]", "sensing",
    )  # fmt: skip
    return "\n".join([
        f"{len(power)} springs on one pair of wires; "
        f"worst crosstalk: {100.0 * result.crosstalk:.3g} % of the heat.",
        f"Evenly spaced, with the largest coils, it would be {100.0 * result.even:.3g} %.",
        f"With capacitors that are sold, {100.0 * result.made_crosstalk:.3g} % if the coils are trimmed,",
        f"{100.0 * result.spread_crosstalk:.3g} % if not.",
        "",
        table_text(Table(header, rows), indent=0),
        "",
        "Heat: at the supply's voltage, in the selected spring. Sensing: relative error of a resistance",
        "for one of the admittances' real parts, each measured at the resonance of one branch.",
    ])  # fmt: skip


def wiring_figure(circuit: Circuit) -> Figure:
    """Figure of the heating of every spring over frequency, and the crosstalk of every pair."""
    ends = np.log10([float(circuit.resonance.min()) * 0.7, float(circuit.resonance.max()) * 1.4])
    frequency = np.unique(np.concatenate([np.logspace(*ends, 1500), np.asarray(circuit.resonance)]))
    power, table = np.asarray(heating(circuit, frequency)), np.asarray(crosstalk(circuit))
    with style():
        figure = Figure(figsize=(11.0, 4.4), layout="constrained")
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
            left.legend(
                title="segment", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2
            )
        shown = right.imshow(np.log10(np.maximum(table, 1e-8)), cmap="viridis", vmin=-6.0, vmax=0.0)
        right.grid(False)
        right.set(xlabel="heated segment", ylabel="selected segment")
        for axis in (right.xaxis, right.yaxis):
            axis.set_ticks(range(len(table)), [str(k + 1) for k in range(len(table))])
        figure.colorbar(shown, ax=right, label="log10 of heating over that of the selected one")
    return figure


def documents(result: Wiring) -> dict[str, str | bytes]:
    """Files of a choice of filters."""
    summary = {
        "schema": "pneusma-wiring/1",
        "springs": len(result.circuit.resistance),
        "crosstalk": result.crosstalk,
        "crosstalk_even": result.even,
        "crosstalk_sold_trimmed": result.made_crosstalk,
        "crosstalk_sold": result.spread_crosstalk,
        "frequency_Hz": np.asarray(result.circuit.resonance).tolist(),
        "inductance_H": np.asarray(result.circuit.inductance).tolist(),
        "capacitance_F": np.asarray(result.circuit.capacitance).tolist(),
        "capacitance_sold_F": np.asarray(result.made.capacitance).tolist(),
        "crosstalk_matrix": np.asarray(crosstalk(result.circuit)).tolist(),
    }
    return {
        "wiring.png": png(wiring_figure(result.circuit)),
        "wiring.txt": text(result) + "\n",
        "report.json": json.dumps(plain(summary), indent=1) + "\n",
    }
