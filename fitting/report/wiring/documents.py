"""Files of a choice of filters: the content of `report.json`."""

from typing import Any

import numpy as np

from fitting.wiring.choose import Wiring
from fitting.wiring.circuit import crosstalk

from .words import verdict


def summary(result: Wiring) -> dict[str, Any]:
    """The content of `report.json`."""
    circuit = result.circuit
    return {
        "schema": "pneusma-wiring/1",
        "verdict": verdict(result),
        "springs": len(circuit.resistance),
        "crosstalk": result.crosstalk,
        "crosstalk_allowed": result.allowed,
        "kept": result.kept,
        "crosstalk_even": result.even,
        "crosstalk_sold_trimmed": result.made_crosstalk,
        "crosstalk_sold": result.spread_crosstalk,
        "frequency_Hz": np.asarray(circuit.resonance).tolist(),
        "inductance_H": np.asarray(circuit.inductance).tolist(),
        "capacitance_F": np.asarray(circuit.capacitance).tolist(),
        "capacitance_sold_F": np.asarray(result.made.capacitance).tolist(),
        "crosstalk_matrix": np.asarray(crosstalk(circuit)).tolist(),
    }
