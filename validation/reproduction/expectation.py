"""Criteria of agreement with the source: a number with a tolerance, or bounds."""

import enum
import math
from dataclasses import dataclass
from typing import Protocol


class Verdict(enum.Enum):
    """Relation of our number to the source's; the value is the word for it."""

    agrees = "agrees"
    partly = "in part"
    disagrees = "disagrees"


class Expectation(Protocol):
    """The interface of a criterion of agreement with the source.

    Attributes:
        quoted: true if the text gives the number or bound. Otherwise the text states an order, a trend or a
            quality, and the bound is ours.
    """

    quoted: bool

    def judge(self, value: float) -> Verdict:
        """Verdict on a number of ours."""

    @property
    def source(self) -> str:
        """The source's number or bound, without unit."""

    @property
    def tolerance(self) -> str:
        """Conditions of agreement and of partial agreement, in words."""


def number_text(value: float) -> str:
    """A number with the digits that matter here: four significant ones, none for what rounds to zero."""
    if abs(value) < 1e-9:
        return "0"
    if abs(value) >= 9999.5:
        return f"{value:.0f}"
    return f"{value:.4g}" if abs(value) >= 1e-4 else f"{value:.1e}"


@dataclass(frozen=True)
class Near:
    """A number that the source gives.

    Attributes:
        value: number of the source, not zero.
        within: largest relative deviation that agrees [1].
        partly: largest relative deviation that agrees in part [1].
        quoted: true if the text gives the number, see `Expectation`.
    """

    value: float
    within: float
    partly: float
    quoted: bool = True

    def __post_init__(self) -> None:
        if self.value == 0.0 or not 0.0 < self.within <= self.partly:
            raise ValueError("Near must have a value other than 0 and 0 < within <= partly, but it has not.")

    def judge(self, value: float) -> Verdict:
        """Verdict on a number of ours."""
        off = abs(value / self.value - 1.0)
        if not math.isfinite(off) or off > self.partly:
            return Verdict.disagrees
        return Verdict.agrees if off <= self.within else Verdict.partly

    @property
    def source(self) -> str:
        """The quoted number."""
        return number_text(self.value)

    @property
    def tolerance(self) -> str:
        """Relative deviations, in words."""
        return f"within {100.0 * self.within:g} % (in part: {100.0 * self.partly:g} %)"


@dataclass(frozen=True)
class Interval:
    """A bound, an interval, an order or a trend that the source gives.

    Attributes:
        low, high: bounds of agreement; one of them may be infinite.
        loose_low, loose_high: bounds of partial agreement, which enclose the other.
        quoted: true if the text gives the bound, see `Expectation`.
    """

    low: float
    high: float
    loose_low: float
    loose_high: float
    quoted: bool = False

    def __post_init__(self) -> None:
        if not self.loose_low <= self.low <= self.high <= self.loose_high:
            raise ValueError("An interval must lie within its loose one, but it does not.")

    def judge(self, value: float) -> Verdict:
        """Verdict on a number of ours."""
        if self.low <= value <= self.high:
            return Verdict.agrees
        return Verdict.partly if self.loose_low <= value <= self.loose_high else Verdict.disagrees

    @property
    def source(self) -> str:
        """The bound or bounds."""
        return _bounds(self.low, self.high)

    @property
    def tolerance(self) -> str:
        """Bounds of partial agreement, in words; those of agreement are in `source`."""
        if (self.low, self.high) == (self.loose_low, self.loose_high):
            return "a strict bound"
        return f"in part: {_bounds(self.loose_low, self.loose_high)}"


def at_least(limit: float, partly: float | None = None, quoted: bool = False) -> Interval:
    """A lower bound; `partly` is the loose one."""
    return Interval(limit, math.inf, limit if partly is None else partly, math.inf, quoted)


def at_most(limit: float, partly: float | None = None, quoted: bool = False) -> Interval:
    """An upper bound; `partly` is the loose one."""
    return Interval(-math.inf, limit, -math.inf, limit if partly is None else partly, quoted)


def _bounds(low: float, high: float) -> str:
    if math.isinf(high):
        return f"at least {number_text(low)}"
    if math.isinf(low):
        return f"at most {number_text(high)}"
    return f"{number_text(low)} to {number_text(high)}"
