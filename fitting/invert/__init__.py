"""Inverse problems: which pressure and phases make an actuator or a chain do what is wanted. See
docs/invert.md."""

from .goals import GOALS, Goal
from .result import Inversion
from .run import Inverse, Limits

__all__ = ["GOALS", "Goal", "Inverse", "Inversion", "Limits"]
