"""A claim of the self-check, and its outcome."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """A number that the model must reproduce.

    Attributes:
        group: part of the model.
        name: description of the comparison.
        evaluate: function that returns the model's value and the expected one.
        limit: maximum error; relative to the expected value unless that is zero.
    """

    group: str
    name: str
    evaluate: Callable[[], tuple[float, float]]
    limit: float = 1e-12


@dataclass(frozen=True)
class Outcome:
    """A checked claim; `problem` gives the reason why it could not be computed."""

    claim: Claim
    value: float
    expected: float
    problem: str = ""

    @property
    def error(self) -> float:
        """Relative error; absolute where the expected value is zero."""
        return abs(self.value - self.expected) / (abs(self.expected) or 1.0)

    @property
    def passed(self) -> bool:
        """True if the error is within the limit; false for NaN."""
        return math.isfinite(self.error) and self.error <= self.claim.limit
