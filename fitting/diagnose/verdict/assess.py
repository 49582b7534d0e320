"""What speaks for and against a search's explanation: the misfit before and after, and what is left."""

from dataclasses import dataclass

from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import mimicked_in

from ..fit.misfit import accurate, floor, limit_of, scored
from ..fit.prediction import predictive_chi_square
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy import Discrepancy, beside
from .discrepancy_evidence import DiscrepancyEvidence, best_discrepancy
from .left import left_of
from .unexplained import (
    chance_without_a_name,
    contradicted,
    discrepancy_probability,
    outdone,
    steady,
    tail,
)
from .unknown import Signs, probability_of_unknown, signs_of

SCORE_TEST = DEFAULT.score_test
VERDICT = DEFAULT.verdict


@dataclass(frozen=True)
class Assessment:
    """What speaks for and against an explanation.

    Attributes:
        named: true if it has effects.
        mismatch: true if recordings contradict the base model.
        unknown: probability of something unknown, before candidates share the rest.
        beyond: true if the recordings speak for something unmodelled beside effects that are believed.
        mimicked: effects that are believed, but which something outside the catalogue is known to look like.
        last: predictive reduced chi-square with the effects, of fitted and of scored recordings.
        signs: what speaks for something unknown beside effects; None where none is named.
        lost: held-out log-likelihood by which a discrepancy predicts better than the effects.
        discrepancy: discrepancy of largest evidence about the base model.
        further: the one beside the effects; None where none is named.
        rest: discrepancy beside the effects.
    """

    named: bool
    mismatch: bool
    unknown: float
    beyond: bool
    mimicked: tuple[str, ...]
    last: list[float]
    signs: Signs | None
    lost: float
    discrepancy: DiscrepancyEvidence | None
    further: DiscrepancyEvidence | None
    rest: Discrepancy | None

    @property
    def rival(self) -> DiscrepancyEvidence | None:
        """The discrepancy that predicts better, where that is a larger share than what the effects leave."""
        better = self.signs is not None and self.lost > 0.0 and self.signs.outdone > self.signs.kept
        return self.discrepancy if better else None


def assess(explanation: Explanation) -> Assessment:
    """What speaks for and against an explanation.

    The probability that chance makes the base's misfit is told anew in the explanation where the whole misfit
    decides, and not a score.
    """
    program, named = explanation.program, bool(explanation.final.slugs)
    masks = scored(program)
    base, last = (
        [predictive_chi_square(program, fit, mask) for mask in masks]
        for fit in (explanation.base, explanation.final)
    )
    floors = [floor(program, explanation.final, mask) for mask in masks]
    limits = [limit_of(program, mask) for mask in masks]
    if min(base) > VERDICT.gross and explanation.p_value > SCORE_TEST.level:
        explanation.p_value = tail(program, base[0])
    discrepancy = best_discrepancy(program, explanation.base)
    contradiction = named or contradicted(explanation, base, discrepancy, floors)
    mismatch = named or (contradiction and not accurate(program, explanation.base))
    further = best_discrepancy(program, explanation.final) if named else None
    signs = signs_of(explanation, discrepancy, further, base, last, floors) if named else None
    unknown, lost, over, beyond, mimicked = 0.0, 0.0, None, False, ()
    if signs is not None:
        unknown, lost = probability_of_unknown(signs), outdone(explanation, discrepancy)
        beyond_chance = any(after > limit for after, limit in zip(last, limits, strict=True))
        if signs.kept >= 1.0 and beyond_chance:  # names that help nothing
            unknown = max(unknown, VERDICT.refuted_unknown)
        over = left_of(program, explanation.final)
        told = unknown >= VERDICT.beside_unknown or (over is not None and over.stated)
        beyond = told and unknown <= 0.5
        if unknown <= 0.5:
            letter = program.specimen.letter
            mimicked = tuple(slug for slug in explanation.final.slugs if mimicked_in(CATALOGUE[slug], letter))
        unknown = max(unknown, VERDICT.beside_unknown) if beyond else unknown
    elif mismatch:
        unknown = discrepancy_probability(explanation, base, discrepancy, floors, limits)
        found = chance_without_a_name(explanation, base[0], discrepancy)
        explanation.p_value, explanation.p_is_bound = found
    elif not contradiction:  # no candidate survived being fitted; what is left is judged as a whole
        explanation.p_value = max(explanation.p_value, tail(program, steady(base[0], discrepancy)))
        explanation.p_is_bound = False
    rest = beside(program, explanation.final) if beyond or (named and last[0] > limits[0]) else None
    left = over if rest is None else left_of(program, explanation.final, rest)
    if left is not None and not left.trusted:
        unknown = max(unknown, VERDICT.refuted_unknown)
    return Assessment(
        named, mismatch, unknown, beyond, mimicked, last, signs, lost, discrepancy, further, rest
    )
