"""A statement of the source as data: its text, the criterion of agreement, and the computation of our number.

A statement never holds a number of ours. `judge` computes it from a `Bench`, so that other constants give
other verdicts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from .bench import Bench
from .expectation import Expectation, Verdict


@dataclass(frozen=True)
class Found:
    """Our numbers for a statement: the judged one, and others that explain it."""

    value: float
    detail: str = ""


@dataclass(frozen=True)
class Statement:
    """One checkable statement of the source.

    Attributes:
        number: figure and running number, such as `"3.24-2"`.
        where: section, equation or table of the source.
        says: content of the statement, in our words.
        unit: unit of both numbers; `"1"` for a pure one.
        expected: criterion of agreement.
        ours: function that computes our number in that unit.
        reason: reason of a difference, where known.
        rests_on: constant that was reconstructed or assumed with this very statement in view, so that
            agreement proves nothing; empty for an independent check.
        contradicted: true if the source says or computes otherwise elsewhere, so that both cannot be met.
        stated: true if the text says so; false for an expectation that we add, for example where only a lost
            drawing could have shown it. Those are counted separately.
    """

    number: str
    where: str
    says: str
    unit: str
    expected: Expectation
    ours: Callable[[Bench], Found | float]
    reason: str = ""
    rests_on: str = ""
    contradicted: bool = False
    stated: bool = True


@dataclass(frozen=True)
class Judged:
    """A statement with our number and the verdict."""

    statement: Statement
    found: Found
    verdict: Verdict

    @property
    def reason(self) -> str:
        """Reason of a difference; empty for agreement."""
        if self.verdict is Verdict.agrees:
            return ""
        return self.statement.reason or "the reason is not known"


def judge(statement: Statement, bench: Bench) -> Judged:
    """Compute our number for a statement and compare it.

    Raises:
        RuntimeError: if our number is not finite.
    """
    found = statement.ours(bench)
    found = found if isinstance(found, Found) else Found(float(found))
    if not math.isfinite(found.value):
        raise RuntimeError(
            f"Statement {statement.number} must give a finite number, but it gives {found.value}."
        )
    return Judged(statement, found, statement.expected.judge(found.value))
