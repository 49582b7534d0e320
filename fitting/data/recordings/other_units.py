"""Questions about columns whose numbers fit another unit of their dimension far better than the stated one.

Physics decides: the stiffness of wires, rubbers and tubes, how far a coupon is strained, how long a test
lasts, and how angle and curvature go together. So do the stiffness and the resistance of a coil. Each
question names the unit that fits. Nothing is asked about a unit that fits as well as another.
"""

from collections.abc import Mapping

from pneusma_jax.calibration import Calibration

from .angle_units import angle_questions
from .clock_units import clock_questions
from .pressure_units import pressure_questions, tube_questions
from .recording import Recording
from .spring_units import spring_questions
from .strain_units import strain_questions
from .unit_question import Question


def other_units(
    recording: Recording, material: Calibration | None, written: Mapping[str, str]
) -> list[Question]:
    """Questions about units, each with the unit that fits far better.

    Args:
        recording: recording with columns in canonical units.
        material: table of its silicone; None where it has none, or one that is to be identified.
        written: units in which the file states its columns, by canonical name, as far as they are known.
    """
    if recording.kind in ("wire", "elastomer"):
        asked = strain_questions(recording, written)
    elif recording.kind == "tube":
        asked = tube_questions(recording, material, written.get("pressure_kPa"))
    elif recording.kind == "actuator":
        asked = pressure_questions(recording, material, written.get("pressure_kPa"))
        asked += angle_questions(recording, written.get("bend_angle_deg"))
    else:
        asked = spring_questions(recording) if recording.kind == "spring" else []
    return [*asked, *clock_questions(recording, written.get("time_s"))]
