"""The model as a study sees it: a function of numbers that may vary."""

from .response import (
    NOISE,
    NOT_FINITE,
    Answer,
    Driver,
    Known,
    Response,
    not_finite,
    reason,
    undefined_output,
)

__all__ = [
    "NOISE", "NOT_FINITE", "Answer", "Driver", "Known", "Response", "not_finite", "reason",
    "undefined_output",
]  # fmt: skip
