"""Judgement of the remaining misfit: chance, drift, a model discrepancy, held-out recordings."""

import math

from fitting.inference.chance import chi_square_tail

from ..evaluate.program import Program
from ..fit.evidence import inflation_of, log_likelihood
from ..fit.instrument_drift import drifted_chi_square
from ..fit.misfit import limit_of, spread
from ..fit.prediction import predictive_chi_square
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy_evidence import DiscrepancyEvidence

CHANCE = DEFAULT.chance
DRIFT = DEFAULT.drift
EVIDENCE = DEFAULT.evidence
EXCESS = DEFAULT.excess
PROBABILITY = DEFAULT.probability


def contradicted(
    explanation: Explanation, base: list[float], discrepancy: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """True if recordings contradict the base model although no effect explains it.

    Args:
        explanation: result of the search.
        base: predictive reduced chi-square of the base model, of fitted and of scored recordings.
        discrepancy: discrepancy of largest evidence.
        floors: chi-square of noise of both, see `misfit.floor`.
    """
    return by_discrepancy(discrepancy) or _by_signature(explanation, base, discrepancy, floors)


def by_discrepancy(discrepancy: DiscrepancyEvidence | None) -> bool:
    """True if the evidence of a model discrepancy says that something is missing."""
    return discrepancy is not None and discrepancy.bayes > EVIDENCE.minimum_first


def discrepancy_probability(
    explanation: Explanation,
    base: list[float],
    discrepancy: DiscrepancyEvidence | None,
    floors: list[float],
) -> float:
    """Probability of something unknown where recordings contradict the base model without a named effect.

    It is tentative where only a discrepancy of little evidence says so. The arguments are those of
    `contradicted`.
    """
    certain = discrepancy is not None and discrepancy.bayes > EVIDENCE.minimum_settled
    certain = certain or _by_signature(explanation, base, discrepancy, floors)
    return PROBABILITY.sure if certain else PROBABILITY.tentative


def _by_signature(
    explanation: Explanation, base: list[float], discrepancy: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """True if a score stands out, and the whole misfit, too.

    Fitted recordings decide alone where their noise is stated and no simulated null has so large a score.
    For what is missing need not act in validation recordings. A faint misfit must show there, too.
    Validation recordings decide alone where they are missed by more than chance, the open numbers and drift
    explain.
    """
    program = explanation.program
    if explanation.p_value > CHANCE.level:
        return False
    seen = [score - (noise - 1.0) for score, noise in zip(base, floors, strict=True)]
    left = steady(seen[0], discrepancy)
    chance = 1.0 + CHANCE.deviations * spread(program, program.fitted)
    sure = explanation.p_is_bound and program.noise_stated and left > chance
    shown = seen[1] > 1.0 or left > 1.0 + EXCESS.little
    if min(left, seen[1]) > 1.0 + EXCESS.little or max(seen) > 1.0 + EXCESS.clear or (sure and shown):
        return True
    return program.noise_stated and missed_beyond_drift(program, explanation.base)


def missed_beyond_drift(program: Program, fit: Fit) -> bool:
    """True if recordings that were not fitted are missed by more than chance, open numbers and drift explain.

    The uncertainty of the numbers is asked twice: by a fit to these recordings, and to first order beside
    drift. It is false where every recording is fitted.
    """
    if program.fitted.all():
        return False
    limit = limit_of(program, program.unseen)
    if predictive_chi_square(program, fit, program.unseen) <= limit:
        return False
    return drifted_chi_square(program, fit, program.unseen) > limit


def steady(left: float, discrepancy: DiscrepancyEvidence | None) -> float:
    """Reduced chi-square less what drift explains, of a size within the noise."""
    return (
        left
        if discrepancy is None
        else min(left, max(discrepancy.left_by_drift, left - DRIFT.maximum_explained))
    )


def tail(program: Program, reduced_chi2: float) -> float:
    """Probability of a chi-square of the fitted recordings as large as this by chance."""
    count = program.observations(program.fitted)
    return float(chi_square_tail(reduced_chi2 * count, count))


def chance_without_a_name(
    explanation: Explanation, base: float, discrepancy: DiscrepancyEvidence | None
) -> tuple[float, bool]:
    """P-value of a mismatch without a named effect, and whether it is a bound.

    The least of three, times their number: that of the strongest score, of the whole misfit, and of the
    discrepancy that decides. Noise gives a Bayes factor of k with a probability of at most 1/k (Markov's
    inequality, for one prior). Of 272 simulated nulls 1.5 % had a log Bayes factor of 1, none of 3.

    Args:
        explanation: result of the search.
        base: reduced chi-square of the base model, of fitted recordings.
        discrepancy: discrepancy of largest evidence.
    """
    found = [(explanation.p_value, explanation.p_is_bound), (tail(explanation.program, base), False)]
    if discrepancy is not None and by_discrepancy(discrepancy):
        found.append((math.exp(-discrepancy.bayes), True))
    least, is_bound = min(found)
    return min(1.0, len(found) * least), is_bound


def outdone(explanation: Explanation, discrepancy: DiscrepancyEvidence | None) -> float:
    """Held-out log-likelihood, deflated, by which a discrepancy predicts better than named effects.

    It is 0 where it is less than an effect must gain.
    """
    if discrepancy is None:
        return 0.0
    program = explanation.program
    better = explanation.left_out[1] - discrepancy.left_out  # NaN, which gains nothing, if unasked
    gain = log_likelihood(program, better, inflation_of(program, explanation.final))
    return float(gain) if gain > EVIDENCE.minimum_difference else 0.0
