"""The model as a study sees it: a function of numbers that may vary."""

from .response import (
    NOISE,
    NOT_FINITE,
    Answer,
    Driver,
    Response,
    Variable,
    reason,
    status_of_output,
    undefined_output,
)

__all__ = [
    "NOISE", "NOT_FINITE", "Answer", "Driver", "Variable", "Response", "status_of_output", "reason",
    "undefined_output",
]  # fmt: skip
