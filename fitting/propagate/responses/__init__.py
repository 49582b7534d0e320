"""The model as a study sees it: a function of numbers that may vary."""

from .response import (
    FIRST_OUTPUT,
    MOST_TOLD_APART,
    NOISE,
    NOT_FINITE,
    Answer,
    Driver,
    Known,
    Response,
    reason,
)

__all__ = [
    "FIRST_OUTPUT", "MOST_TOLD_APART", "NOISE", "NOT_FINITE", "Answer", "Driver", "Known", "Response",
    "reason",
]  # fmt: skip
