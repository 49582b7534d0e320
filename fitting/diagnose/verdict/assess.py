"""What speaks for and against a search's explanation: the misfit before and after, and what is left."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..evaluate.program import Program
from ..fit.misfit import floor, limit_of, predictive_chi_square, reduced
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy import Discrepancy, beside
from .discrepancy_evidence import DiscrepancyEvidence, best_discrepancy
from .left import left_of
from .unexplained import (
    contradicted,
    discrepancy_probability,
    helps_nobody,
    leaves_more,
    outdone,
    refuted,
    steady,
    tail,
    unexplained,
)

SCORE_TEST = DEFAULT.score_test
VERDICT = DEFAULT.verdict


@dataclass(frozen=True)
class Assessment:
    """What speaks for and against an explanation.

    Attributes:
        named: true if it has effects.
        mismatch: true if recordings contradict the base model.
        unknown: probability of something unknown, before candidates share the rest.
        beyond: true if something is said to be unmodelled beside effects that are believed.
        last: predictive reduced chi-square with the effects, of fitted and of scored recordings.
        more: true if effects leave more than noise.
        lost: held-out log-likelihood by which a discrepancy predicts better than the effects.
        discrepancy: discrepancy of largest evidence about the base model.
        rest: discrepancy beside the effects.
    """

    named: bool
    mismatch: bool
    unknown: float
    beyond: bool
    last: list[float]
    more: bool
    lost: float
    discrepancy: DiscrepancyEvidence | None
    rest: Discrepancy | None

    @property
    def rival(self) -> DiscrepancyEvidence | None:
        """The discrepancy that predicts better, where the effects leave no more than noise."""
        return None if self.more else self.discrepancy


def assess(explanation: Explanation) -> Assessment:
    """What speaks for and against an explanation.

    The probability that chance makes the base's misfit is told anew in the explanation where the whole misfit
    decides, and not a score.
    """
    program, named = explanation.program, bool(explanation.final.slugs)
    masks = program.fitted, program.unseen
    base, alone = (_of_both(f, program, explanation.base) for f in (predictive_chi_square, reduced))
    last, kept = (_of_both(f, program, explanation.final) for f in (predictive_chi_square, reduced))
    floors = [floor(program, explanation.final, mask) for mask in masks]
    limits = [limit_of(program, mask) for mask in masks]
    if min(base) > VERDICT.gross and explanation.p_value > SCORE_TEST.level:
        explanation.p_value = tail(program, base[0])
    discrepancy = best_discrepancy(program, explanation.base)
    mismatch = named or contradicted(explanation, base, discrepancy, floors)
    unknown = unexplained(alone, last, floors, limits) if mismatch else 0.0
    if named:
        unknown = max(unknown, refuted(explanation, discrepancy, limits, base, last))
    if mismatch and not named:
        unknown = discrepancy_probability(explanation, base, discrepancy, floors, unknown)
    if not mismatch:  # no candidate survived being fitted; what is left is judged as a whole
        explanation.p_value = max(explanation.p_value, tail(program, steady(base[0], discrepancy)))
        explanation.p_is_bound = False
    more = leaves_more(alone, last, floors) or helps_nobody(alone, kept, floors, explanation.left_out)
    lost = outdone(explanation, discrepancy) if named else 0.0
    over = left_of(program, explanation.final) if named else None
    beyond = named and unknown <= 0.5 and (more or lost > 0.0 or (over is not None and over.stated))
    unknown = max(unknown, VERDICT.beside_unknown) if beyond else unknown
    rest = beside(program, explanation.final) if beyond or (named and last[0] > limits[0]) else None
    left = over if rest is None else left_of(program, explanation.final, rest)
    if left is not None and not left.trusted:
        unknown = max(unknown, VERDICT.refuted_unknown)
    return Assessment(named, mismatch, unknown, beyond, last, more, lost, discrepancy, rest)


def _of_both(score: Callable[[Program, Fit, np.ndarray], float], program: Program, fit: Fit) -> list[float]:
    """A score of a model for fitted and for scored recordings."""
    return [score(program, fit, mask) for mask in (program.fitted, program.unseen)]
