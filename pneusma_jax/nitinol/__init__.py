"""Nitinol springs and wires: geometry, phases, resistivity, stress, residual strain."""

from .alloy import Alloy, load_alloy
from .geometry import SpringGeometry
from .residual_strain import SpringState
from .resistivity import PhaseReading
from .spring import MartensiteFraction, Resistance, Spring, SpringResponse, Temperature
from .wire import WireAlloy, WireResponse, WireStatus, load_wire
from .wire_history import WireHistory, WireResistance, simulate_wire

__all__ = [
    "Alloy",
    "MartensiteFraction",
    "PhaseReading",
    "Resistance",
    "Spring",
    "SpringGeometry",
    "SpringResponse",
    "SpringState",
    "Temperature",
    "WireAlloy",
    "WireHistory",
    "WireResistance",
    "WireResponse",
    "WireStatus",
    "load_alloy",
    "load_wire",
    "simulate_wire",
]
