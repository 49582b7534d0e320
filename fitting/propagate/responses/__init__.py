"""The model as a study sees it: a function of numbers that may vary."""

from .response import NOT_FINITE, SENTENCES, Answer, Driver, Known, Response

__all__ = ["NOT_FINITE", "SENTENCES", "Answer", "Driver", "Known", "Response"]
