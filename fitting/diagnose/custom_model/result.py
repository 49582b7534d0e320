"""Results of a search for missing terms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.parameters import format_estimate
from fitting.inference.results import Result

from ..settings import DEFAULT
from .fits import OwnFit, Problem

EVIDENCE = DEFAULT.evidence


@dataclass(frozen=True)
class Candidate:
    """A term that was fitted together with what was there.

    Attributes:
        name: name of the term.
        log_bayes_factor: log Bayes factor over the model without it, deflated, less the logarithm of the
            number of candidates.
        gain: decrease of chi-square along its sensitivity alone, before anything was fitted.
        at_bound: its parameters that ended on a physical bound.
        left_out: chi-square per value of recordings left out in turn; NaN where it was not asked for.
    """

    name: str
    log_bayes_factor: float
    gain: float
    at_bound: tuple[str, ...] = ()
    left_out: float = float("nan")

    def scored(self, value: float) -> "Candidate":
        """The same with its score on recordings left out."""
        return replace(self, left_out=value)


@dataclass
class Stage:
    """One round.

    Attributes:
        present: terms that were there before.
        candidates: tried, best first.
        chosen: the one that entered, or None.
        before: chi-square per value of recordings left out, without it.
    """

    present: tuple[str, ...]
    candidates: list[Candidate]
    chosen: str | None
    before: float

    @property
    def close(self) -> list[str]:
        """Candidates that these recordings do not tell from the chosen one."""
        best = next((c.log_bayes_factor for c in self.candidates if c.name == self.chosen), np.inf)
        return [
            c.name
            for c in self.candidates
            if c.name != self.chosen and best - c.log_bayes_factor < EVIDENCE.minimum_difference
        ]


@dataclass(frozen=True)
class Explained(Result):
    """A base model, and what it missed.

    Attributes:
        problem: model and recordings.
        base: refitted alone; `final`: with the terms that entered.
        stages: steps of the search.
        before, after: chi-square per value of fitted recordings left out in turn.
        inflation: variance of the final misfit over that of independent errors of the stated size [1];
            `estimate` widens standard errors by its square root.
    """

    problem: Problem
    base: OwnFit
    final: OwnFit
    stages: list[Stage]
    before: float
    after: float
    inflation: float

    @property
    def named(self) -> tuple[str, ...]:
        """Terms that entered, in order."""
        return self.final.present

    def errors(self) -> tuple[dict[str, float], dict[str, float]]:
        """RMSE of every output, refitted base and augmented model, on recordings for validation."""
        chosen = np.array([float(r.role == "validation") for r in self.problem.recordings])
        return tuple(self.problem.rmse(fit.result.values, chosen) for fit in (self.base, self.final))

    def errors_of(self, name: str) -> tuple[dict[str, float], dict[str, float]]:
        """The same on one recording."""
        chosen = np.array([float(r.name == name) for r in self.problem.recordings])
        return tuple(self.problem.rmse(fit.result.values, chosen) for fit in (self.base, self.final))

    def predict(
        self, columns: Mapping[str, np.ndarray], facts: Mapping[str, np.ndarray], augmented: bool = True
    ) -> dict[str, np.ndarray]:
        """Outputs of a test that need not have been measured."""
        values = (self.final if augmented else self.base).result.values
        return {k: np.asarray(v) for k, v in self.problem.model.predict(values, columns, facts).items()}

    def estimate(self, name: str) -> str:
        """A parameter of base or term with its error, widened by what the model leaves."""
        parameter = self.final.result.parameters[name]
        error = parameter.standard_error
        return format_estimate(parameter.value, None if error is None else error * np.sqrt(self.inflation))
