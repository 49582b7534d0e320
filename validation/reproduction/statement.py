"""A statement of the source as data: what it says, what counts as agreement, and how our number is computed.

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
    """What we compute for a statement: the number that is judged, and others that explain it."""

    value: float
    detail: str = ""


@dataclass(frozen=True)
class Statement:
    """One thing that the source says and that can be checked.

    Attributes:
        number: figure and running number, such as `"3.24-2"`.
        where: section, equation or table of the source.
        says: what it says, in our words.
        unit: of both numbers; `"1"` for a pure one.
        expected: what counts as agreement.
        ours: computes our number in that unit.
        reason: why ours differs, where that is known.
        rests_on: the constant that was reconstructed or assumed with this very statement in view, so that
            agreement proves nothing; empty for an independent check.
        contradicted: whether the source says or computes otherwise elsewhere, so that both cannot be met.
        stated: whether the text says so; False for an expectation that we add, for example where only a lost
            drawing could have shown it. Such ones are counted apart.
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
        """Why ours differs; empty where it agrees."""
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
