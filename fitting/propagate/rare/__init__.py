"""Small probabilities of failure: by subset simulation, and by FORM with importance sampling.

Both know the limit only by a margin that is negative where it fails. Subset simulation needs no gradient and
no single design point. FORM and importance sampling need both, and far fewer rows. Where both can be had, one
checks the other.
"""

from dataclasses import dataclass

import numpy as np

from ..problem import Problem
from ..quantities import Limit
from ..sampling import stream
from .form import FormResult, form
from .limit_state import LimitState
from .subset import SubsetResult, subset_simulation

__all__ = [
    "FormResult",
    "LimitState",
    "RareResult",
    "SubsetResult",
    "estimate_rare",
    "form",
    "subset_simulation",
]

SUBSET, FORM = 10, 11
"""Purposes of random streams, beside those of chunks."""


@dataclass(frozen=True)
class RareResult:
    """Estimates of a small probability.

    Attributes:
        limit: the limit in words.
        subset: or None where it was not asked for.
        form: or None, likewise.
        no_gradient: why FORM could not be used, in words; empty otherwise.
        rows: spent, gradients included.
        without_result: number of these rows without a result; they count as not failed.
    """

    limit: str
    subset: SubsetResult | None
    form: FormResult | None
    no_gradient: str
    rows: int
    without_result: int

    @property
    def agree(self) -> bool | None:
        """True if both intervals have something in common; None if there are not two."""
        if self.subset is None or self.form is None:
            return None
        first, second = self.subset.interval, self.form.interval
        return bool(first[0] <= second[1] and second[0] <= first[1])


def estimate_rare(problem: Problem, limit: Limit) -> RareResult:
    """The probability of one limit by all methods that the study asks for."""
    state, wanted = LimitState(problem, limit), problem.study.rare
    seed = problem.study.sampling.seed
    number = problem.study.limits.index(limit)
    subset = found = None
    reason = ""
    if "subset" in wanted.methods:
        subset = subset_simulation(
            state.margins, state.dimension, wanted.samples, wanted.runs, stream(seed, number, SUBSET)
        )
    if "form" in wanted.methods:
        random = stream(seed, number, FORM)
        if problem.inputs.draws is not None:
            reason = "picking draws of a posterior has no gradient: set posterior_as = 'copula'"
        else:
            starts = np.concatenate([
                np.zeros((1, state.dimension)),
                1.5 * random.standard_normal((wanted.starts - 1, state.dimension)),
                *([] if subset is None else [subset.failed_points]),
            ])  # fmt: skip
            found = form(state.margins, state.with_gradient, starts, 10 * wanted.samples, random)
    return RareResult(limit.words, subset, found, reason, state.rows, state.without_result)
