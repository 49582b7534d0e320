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
        base: predictive reduced chi-square of the base model, of fitted and of scored recordings. Scored ones
            are those for validation, or the fitted ones again where there are none.
        discrepancy: discrepancy of largest evidence; None where no driver varies.
        floors: chi-square of noise of both, see `misfit.floor`.
    """
    return by_discrepancy(discrepancy) or _by_score_and_misfit(explanation, base, discrepancy, floors)


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
    certain = certain or _by_score_and_misfit(explanation, base, discrepancy, floors)
    return PROBABILITY.sure if certain else PROBABILITY.tentative


def _by_score_and_misfit(
    explanation: Explanation, base: list[float], discrepancy: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """True if the score test finds a misfit of some form, and the whole misfit is larger than noise.

    The misfit is a reduced chi-square less what noise explains. That of fitted recordings is less what drift
    explains, too. It is large enough in four cases:

    - Fitted and scored recordings both have at least a little of it.
    - Fitted or scored recordings have clearly much, drift included.
    - Fitted recordings have more than chance makes, the noise is stated, and no simulated null has so large
      a score. Missing physics need not act in scored recordings. Only a faint misfit must show there, too.
    - The noise is stated, and recordings that were not fitted are missed by more than drift explains.

    The arguments are those of `contradicted`.
    """
    program = explanation.program
    if explanation.p_value > CHANCE.level:
        return False
    fitted, scored = (chi2 - (noise - 1.0) for chi2, noise in zip(base, floors, strict=True))
    steady = without_drift(fitted, discrepancy)
    if min(steady, scored) > 1.0 + EXCESS.little or max(fitted, scored) > 1.0 + EXCESS.clear:
        return True
    by_chance = 1.0 + CHANCE.deviations * spread(program, program.fitted)
    beyond_chance = explanation.p_is_bound and program.noise_stated and steady > by_chance
    if beyond_chance and (scored > 1.0 or steady > 1.0 + EXCESS.little):
        return True
    return program.noise_stated and missed_beyond_drift(program, explanation.base)


def missed_beyond_drift(program: Program, fit: Fit) -> bool:
    """True if recordings that were not fitted are missed by more than chance, open numbers and drift explain.

    What the uncertainty of the fitted numbers explains is computed twice: by a fit to these recordings, and
    to first order beside drift. It is false where every recording is fitted.

    Args:
        program: program of the campaign.
        fit: fit of the base model to the other recordings.
    """
    if program.fitted.all():
        return False
    limit = limit_of(program, program.unseen)
    if predictive_chi_square(program, fit, program.unseen) <= limit:
        return False
    return drifted_chi_square(program, fit, program.unseen) > limit


def without_drift(reduced_chi2: float, discrepancy: DiscrepancyEvidence | None) -> float:
    """Reduced chi-square of fitted recordings, less what drift within the noise explains of it.

    Args:
        reduced_chi2: reduced chi-square of the base model.
        discrepancy: discrepancy of largest evidence, which knows what drift leaves; None for no drift.
    """
    if discrepancy is None:
        return reduced_chi2
    return min(reduced_chi2, max(discrepancy.left_by_drift, reduced_chi2 - DRIFT.maximum_explained))


def chance_of_misfit(program: Program, reduced_chi2: float) -> float:
    """Probability that noise alone gives fitted recordings so large a reduced chi-square."""
    count = program.observations(program.fitted)
    return float(chi_square_tail(reduced_chi2 * count, count))


def chance_without_a_name(
    explanation: Explanation, base: float, discrepancy: DiscrepancyEvidence | None
) -> tuple[float, bool]:
    """P-value of a mismatch without a named effect, and whether it is only an upper bound.

    It is the smallest of two or three p-values, times their number. They are those of the strongest score, of
    the whole misfit, and of the discrepancy where it decides. Noise gives a Bayes factor of k with a
    probability of at most 1/k (Markov's inequality, for one prior). Of 272 simulated nulls 1.5 % had a log
    Bayes factor of 1, none of 3.

    Args:
        explanation: result of the search.
        base: reduced chi-square of the base model, of fitted recordings.
        discrepancy: discrepancy of largest evidence.
    """
    whole = chance_of_misfit(explanation.program, base)
    found = [(explanation.p_value, explanation.p_is_bound), (whole, False)]
    if discrepancy is not None and by_discrepancy(discrepancy):
        found.append((math.exp(-discrepancy.bayes), True))
    least, is_bound = min(found)
    return min(1.0, len(found) * least), is_bound


def gain_over_named(explanation: Explanation, discrepancy: DiscrepancyEvidence | None) -> float:
    """Log-likelihood of left-out recordings by which a discrepancy predicts better than the named effects.

    It is 0 where it is less than an effect must gain.

    Args:
        explanation: result of a search that named effects.
        discrepancy: discrepancy of largest evidence beside the base model; None where no driver varies.
    """
    gain = -lead_of_named(explanation, discrepancy)
    return gain if gain > EVIDENCE.minimum_difference else 0.0


def equalled(explanation: Explanation, discrepancy: DiscrepancyEvidence | None) -> bool:
    """True if a discrepancy predicts left-out recordings about as well as the named effects, or better.

    Then the recordings do not tell the names from a function without a name. One that drift explains as well
    is no rival: what predicts beside it is drift. The arguments are those of `gain_over_named`.
    """
    if discrepancy is None or discrepancy.bayes < EVIDENCE.minimum_difference:
        return False
    return lead_of_named(explanation, discrepancy) < EVIDENCE.minimum_difference


def lead_of_named(explanation: Explanation, discrepancy: DiscrepancyEvidence | None) -> float:
    """Log-likelihood of left-out recordings by which the named effects predict better than a discrepancy.

    It is deflated by the noise's inflation. It is infinite where there is no race: without a discrepancy, or
    without cross-validation. The arguments are those of `gain_over_named`.
    """
    program, named = explanation.program, explanation.left_out[1]
    if discrepancy is None or math.isnan(named):
        return math.inf
    inflation = inflation_of(program, explanation.final)
    return float(log_likelihood(program, discrepancy.left_out - named, inflation))
