"""Sentences and tables of a choice of filters."""

import numpy as np

from fitting.wiring.choose import Wiring
from fitting.wiring.circuit import heating, sensing
from pneusma_jax.numerics.safe import as_numpy

from ..table import Table


def verdict(result: Wiring) -> list[str]:
    """Sentences on the number of springs, on the crosstalk and its limit."""
    limit = f"the limit of {100.0 * result.allowed:.3g} %"
    said = f"keeps {limit}" if result.kept else f"does not keep {limit}"
    sold = [x > result.allowed for x in (result.made_crosstalk, result.spread_crosstalk)]
    which = {(True, True): "Neither keeps", (False, True): "The latter does not keep",
             (True, False): "The former does not keep"}  # fmt: skip
    over = [f"{which[sold[0], sold[1]]} {limit}."] if any(sold) and result.kept else []
    return [
        f"{len(result.circuit.resistance)} springs on one pair of wires; worst crosstalk: "
        f"{100.0 * result.crosstalk:.3g} % of the heat. That {said}.",
        f"Evenly spaced, with the largest coils, it would be {100.0 * result.even:.3g} %.",
        f"With capacitors that are sold, {100.0 * result.made_crosstalk:.3g} % if the coils are trimmed, "
        f"{100.0 * result.spread_crosstalk:.3g} % if not.",
        *over,
    ]


def filter_table(result: Wiring) -> Table:
    """Table of the filters, the springs that they heat, and the sensing of resistances."""
    circuit, made = as_numpy(result.circuit), as_numpy(result.made)  # numbers are picked without compiling
    power = np.diagonal(np.asarray(heating(circuit, circuit.resonance)))
    errors = np.linalg.norm(np.asarray(sensing(circuit, circuit.resonance)), axis=1)
    rows = [
        [
            str(k + 1),
            f"{float(circuit.resonance[k]) / 1e3:.4g}",
            f"{1e6 * float(circuit.inductance[k]):.1f}",
            f"{1e9 * float(circuit.capacitance[k]):.3g}",
            f"{1e9 * float(made.capacitance[k]):.3g}",
            f"{1e6 * float(made.inductance[k]):.1f}",
            f"{float(circuit.quality[k]):.3g}",
            f"{power[k]:.3f}",
            f"{errors[k]:.3g}",
        ]
        for k in range(len(power))
    ]
    header = [
        "spring", "selected at [kHz]", "coil [uH]", "capacitor [nF]", "sold [nF]", "coil trimmed [uH]",
        "quality", "heat [W]", "sensing",
    ]  # fmt: skip
    note = (
        "Heat: at the supply's voltage, in the selected spring. Sensing: relative error of a resistance "
        "for one of the admittances' real parts, each measured at the resonance of one branch."
    )
    return Table(header, rows, note)
