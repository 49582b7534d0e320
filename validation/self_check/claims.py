"""What a check says, and how it came out."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """A number that the model must reproduce.

    Attributes:
        group: part of the model.
        name: what is compared, in words.
        evaluate: returns the model's value and the expected one.
        limit: largest error; relative to the expected value unless that is zero.
    """

    group: str
    name: str
    evaluate: Callable[[], tuple[float, float]]
    limit: float = 1e-12


@dataclass(frozen=True)
class Outcome:
    """A claim that was checked; `problem` says why it could not be computed."""

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
        """Whether the error is within the limit; what is not a number is not."""
        return math.isfinite(self.error) and self.error <= self.claim.limit
