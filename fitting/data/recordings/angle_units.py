"""Questions about bend angles that are rather in radian, or in degrees."""

import math

import numpy as np

from pneusma_jax.errors import counted

from .recording import Recording
from .unit_question import Question, largest

RADIANS = (math.radians(20.0), 2.0 * math.pi)
"""Largest angles of an actuator that are rather radian than degree [deg]: 20 to 360 degrees in radian."""
TURNS_DEG = 1080.0
"""Maximum bend angle [deg]: three turns. More are rather degrees than radian."""
FAR_BENT_DEG = 540.0
"""Maximum bend angle that is usual [deg]: one and a half turns. Of 50 actuators here none bends by more than
310, as curvature times length."""
TURN_DEG = 360.0
"""A full turn [deg]."""
DEGREES = 180.0 / math.pi
ANGLE_APART = 2.0
"""Maximum factor between an angle and the curvature times the length, in a unit that fits [1]."""


def angle_questions(recording: Recording, unit: str | None) -> list[Question]:
    """Ask about bend angles that are rather radian, degrees under a heading of radian, or beyond a turn.

    Args:
        recording: recording of an actuator.
        unit: unit that the file states; None where that is no longer known.
    """
    if "bend_angle_deg" not in recording.columns:
        return []
    angle = recording.columns["bend_angle_deg"]
    most, made = largest(angle), _made_angle(recording)
    turned = f"{DEGREES * most:.3g} degrees"
    radian = f"Are these radian? Then they reach {turned} (on import: --unit bend_angle=rad)"
    degree = "Are these degrees under a heading of radian? (on import: --unit bend_angle=deg)"
    reaches = f"bend_angle_deg reaches {most:.4g}"
    if made > 0.0 and most > 0.0:
        for factor, asked in ((DEGREES, radian), (1.0 / DEGREES, degree)):
            if abs(math.log(factor * most / made)) < math.log(ANGLE_APART):
                return [Question("bend_angle", f"{reaches}, and curvature times length {made:.3g}. {asked}")]
    elif most > TURNS_DEG and unit != "deg":
        return [Question("bend_angle", f"{reaches}, more than three turns. {degree}")]
    elif RADIANS[0] <= most <= RADIANS[1]:
        return [Question("bend_angle", f"{reaches}, and few actuators bend so little. {radian}")]
    if most > FAR_BENT_DEG:
        rows = counted(int(np.sum(np.abs(angle) > FAR_BENT_DEG)), "row")
        said = f"{reaches}, {most / TURN_DEG:.3g} turns, with more than {FAR_BENT_DEG:g} in {rows}"
        asked = "are these readings right, and their unit (on import: --unit bend_angle=...)?"
        return [Question("", f"{said}. Few actuators bend so far: {asked}")]
    return []


def _made_angle(recording: Recording) -> float:
    """Largest angle that curvature times length makes [deg]; 0 where no curvature was recorded."""
    if "curvature_1pm" not in recording.columns:
        return 0.0
    length = recording.columns.get("length_mm", recording.full_geometry()["length_mm"])
    angle = np.degrees(1e-3 * recording.columns["curvature_1pm"] * length)
    return largest(angle) if np.isfinite(angle).any() else 0.0
