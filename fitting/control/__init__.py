"""Closed loops: an actuator driven to a curvature by the resistance of its springs. See docs/control.md."""

from .loop import Converter, Gains, Loop, Run
from .sweep import CONCEALED, Case, Sweep, run_sweep

__all__ = ["CONCEALED", "Case", "Converter", "Gains", "Loop", "Run", "Sweep", "run_sweep"]
