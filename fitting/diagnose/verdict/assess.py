"""What speaks for and against a search's explanation: the misfit before and after, and what is left."""

from dataclasses import dataclass

from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import mimicked_in

from ..fit.misfit import floor, limit_of, scored
from ..fit.prediction import predictive_chi_square
from ..search.decision import clear
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy import Discrepancy, beside
from .discrepancy_evidence import DiscrepancyEvidence, best_discrepancy
from .held_out import Scores
from .instrument_accuracy import excused
from .left import left_of
from .unexplained import (
    by_discrepancy,
    chance_of_misfit,
    chance_without_a_name,
    contradicted,
    discrepancy_probability,
    equalled,
    gain_over_named,
    without_drift,
)
from .unknown import Signs, probability_of_unknown, signs_of

CHANCE = DEFAULT.chance
EXCESS = DEFAULT.excess
PROBABILITY = DEFAULT.probability


@dataclass(frozen=True)
class Assessment:
    """What speaks for and against an explanation.

    Attributes:
        named: true if it has effects.
        mismatch: true if recordings contradict the base model.
        chance: probability that chance makes the base's misfit, and whether it is only a bound.
        unknown: probability of something unknown, before candidates share the rest.
        beyond: true if the recordings speak for something unmodelled beside effects that are believed.
        mimicked: effects that are believed, but which something outside the catalogue is known to look like.
        last: predictive reduced chi-square with the effects, of fitted and of scored recordings.
        signs: what speaks for something unknown beside effects; None where none is named.
        lost: held-out log-likelihood by which a discrepancy predicts better than the effects.
        discrepancy: discrepancy of largest evidence about the base model.
        further: the one beside the effects; None where none is named.
        rest: discrepancy beside the effects.
        unsupported: true if values that were not fitted are missed clearly more with the effects.
        acts_beside: probability that something unknown acts beside effects that it does not replace; 0 where
            nothing says so.
        equalled: true if a discrepancy predicts left-out recordings about as well as the effects, or better.
    """

    named: bool
    mismatch: bool
    chance: tuple[float, bool]
    unknown: float
    beyond: bool
    mimicked: tuple[str, ...]
    last: list[float]
    signs: Signs | None
    lost: float
    discrepancy: DiscrepancyEvidence | None
    further: DiscrepancyEvidence | None
    rest: Discrepancy | None
    unsupported: bool = False
    acts_beside: float = 0.0
    equalled: bool = False

    @property
    def moving(self) -> DiscrepancyEvidence | None:
        """The discrepancy beside the effects, where it has evidence: errors count how it moves numbers."""
        return self.further if by_discrepancy(self.further) else None

    @property
    def rival(self) -> DiscrepancyEvidence | None:
        """The discrepancy that predicts as well or better, unless the effects leave a larger share."""
        if self.signs is None or self.signs.outdone < self.signs.kept:
            return None
        return self.discrepancy if self.equalled or self.lost > 0.0 else None


def assess(explanation: Explanation, scores: Scores) -> Assessment:
    """What speaks for and against an explanation, which is not changed.

    Effects are tentative that nothing outside the fit supports, and something unknown has the rest. Either
    they miss values outside the fit clearly more than the base model does. Numbers that the fit leaves open
    may excuse that, so no effect is refused for it. Or a discrepancy predicts left-out recordings as well.

    Args:
        explanation: result of a search.
        scores: scores of recordings that were not fitted.
    """
    program, named = explanation.program, bool(explanation.final.slugs)
    masks = scored(program)
    base, last = (
        [predictive_chi_square(program, fit, mask) for mask in masks]
        for fit in (explanation.base, explanation.final)
    )
    floors = [floor(program, explanation.final, mask) for mask in masks]
    limits = [limit_of(program, mask) for mask in masks]
    if min(base) > 1.0 + EXCESS.clear and explanation.p_value > CHANCE.level:
        explanation = explanation.with_chance(chance_of_misfit(program, base[0]), explanation.p_is_bound)
    chance = explanation.p_value, explanation.p_is_bound
    discrepancy = best_discrepancy(program, explanation.base)
    contradiction = named or contradicted(explanation, base, discrepancy, floors)
    mismatch = named or (contradiction and not excused(program, explanation.base))
    further = best_discrepancy(program, explanation.final) if named else None
    signs = signs_of(explanation, discrepancy, further, base, last, floors) if named else None
    over = left_of(program, explanation.final, base=explanation.base) if named else None
    unknown, lost, beyond, mimicked, acts_beside = 0.0, 0.0, False, (), 0.0
    unsupported = named and clear(program, explanation.final, scores.rise(explanation))
    alike = named and equalled(explanation, discrepancy)
    if signs is not None:
        helpless = signs.kept >= 1.0 and any(left > limit for left, limit in zip(last, limits, strict=True))
        likely = max(probability_of_unknown(signs), PROBABILITY.tentative if helpless else 0.0)
        likely = max(likely, 1.0 - PROBABILITY.tentative if unsupported or alike else 0.0)
        if signs.only_beside and not unsupported and not alike and likely > PROBABILITY.beside:
            acts_beside, likely = min(likely, PROBABILITY.doubtful), PROBABILITY.beside
        unknown, beyond, mimicked = _doubt_of_names(explanation, likely, over is not None and over.stated)
        lost = gain_over_named(explanation, discrepancy)
    elif mismatch:
        unknown = discrepancy_probability(explanation, base, discrepancy, floors)
        chance = chance_without_a_name(explanation, base[0], discrepancy)
    elif not contradiction:  # no candidate survived being fitted; what is left is judged as a whole
        by_noise = chance_of_misfit(program, without_drift(base[0], discrepancy))
        chance = max(explanation.p_value, by_noise), False
    rest = beside(program, explanation.final) if beyond or (named and last[0] > limits[0]) else None
    left = over if rest is None else left_of(program, explanation.final, rest, base=explanation.base)
    if explanation.misread is not None or (left is not None and not left.trusted):
        unknown = max(unknown, PROBABILITY.tentative)
    return Assessment(
        named, mismatch, chance, unknown, beyond, mimicked, last, signs, lost, discrepancy, further, rest,
        unsupported, acts_beside, alike,
    )  # fmt: skip


def _doubt_of_names(
    explanation: Explanation, unknown: float, more_than_noise: bool
) -> tuple[float, bool, tuple[str, ...]]:
    """Probability of something unknown beside or for names, and how far that is told.

    Args:
        explanation: result of the search, with names.
        unknown: probability of something unknown by the signs.
        more_than_noise: true if the names leave more than noise whose size is stated.

    Returns:
        The probability, whether it is told beside the names, and names that something else may look like.
    """
    if unknown > PROBABILITY.doubtful:  # told before the names
        return unknown, False, ()
    letter, slugs = explanation.program.specimen.letter, explanation.final.slugs
    mimicked = tuple(slug for slug in slugs if mimicked_in(CATALOGUE[slug], letter))
    beyond = unknown >= PROBABILITY.beside or more_than_noise
    return max(unknown, PROBABILITY.beside) if beyond else unknown, beyond, mimicked
