"""Closed loops: an actuator driven to a curvature by the resistance of its springs. See docs/control.md."""

from .loop import Converter, Gains, Loop, Run, check_plane
from .plant import Plant
from .sweep import CONCEALED, Case, Sweep, run_sweep, usual_loop

__all__ = [
    "CONCEALED", "Case", "Converter", "Gains", "Loop", "Plant", "Run", "Sweep", "check_plane", "run_sweep",
    "usual_loop",
]  # fmt: skip
