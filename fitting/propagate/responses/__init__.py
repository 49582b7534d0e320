"""The model as a study sees it: a function of numbers that may vary."""

from .response import NOISE, NOT_FINITE, SENTENCES, Answer, Driver, Known, Response

__all__ = ["NOISE", "NOT_FINITE", "SENTENCES", "Answer", "Driver", "Known", "Response"]
