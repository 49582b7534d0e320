"""Nitinol springs and wires: geometry, phases, resistivity, stress, residual strain."""

from .alloy import Alloy, load_alloy
from .fractions import PhaseFractions, phase_fractions
from .geometry import SpringGeometry, spring_strain
from .residual_strain import Decided, SpringState
from .resistivity import PhaseReading
from .spring import MartensiteFraction, Resistance, Spring, SpringResponse, Temperature
from .wire import WireAlloy, WireResponse, WireStatus, load_wire
from .wire_history import WireHistory, WireResistance, simulate_wire

__all__ = [
    "Alloy",
    "Decided",
    "MartensiteFraction",
    "PhaseFractions",
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
    "phase_fractions",
    "simulate_wire",
    "spring_strain",
]
