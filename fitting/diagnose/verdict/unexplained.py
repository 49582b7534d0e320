"""Judgement of the remaining misfit: chance, drift, a model discrepancy, held-out recordings."""

import numpy as np

from fitting.inference.chance import chi_square_tail

from ..evaluate.program import Program
from ..fit.evidence import inflation_of, log_likelihood
from ..fit.misfit import reduced, spread
from ..fit.refit import largest_deviation
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy_evidence import DiscrepancyEvidence

SCORE_TEST = DEFAULT.score_test
EVIDENCE = DEFAULT.evidence
ENTRY = DEFAULT.entry
DRIFT = DEFAULT.drift
VERDICT = DEFAULT.verdict


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
    left: float,
) -> float:
    """Probability of something unknown where recordings contradict the base model without a named effect.

    It is tentative where only a discrepancy of little evidence says so.

    Args:
        explanation, base, discrepancy, floors: same as for `contradicted`.
        left: probability of it from the remaining misfit.
    """
    certain = discrepancy is not None and discrepancy.bayes > EVIDENCE.minimum_settled
    certain = certain or _by_signature(explanation, base, discrepancy, floors)
    return max(left, VERDICT.nothing_named_unknown) if certain else VERDICT.tentative


def _by_signature(
    explanation: Explanation, base: list[float], discrepancy: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """True if a score stands out, and the whole misfit, too."""
    program = explanation.program
    if explanation.p_value > SCORE_TEST.level:
        return False
    base = [score - (noise - 1.0) for score, noise in zip(base, floors, strict=True)]
    sure = explanation.p_is_bound and program.noise_stated and base[1] > 1.0
    chance = 1.0 + VERDICT.sure_deviations * spread(program, program.fitted)
    left = steady(base[0], discrepancy)
    return min(left, base[1]) > VERDICT.faint or max(base) > VERDICT.gross or (sure and left > chance)


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


def refuted(
    explanation: Explanation,
    discrepancy: DiscrepancyEvidence | None,
    limits: list[float],
    base: list[float],
    last: list[float],
) -> float:
    """Probability of something unknown, from evidence against the named effects.

    A discrepancy counts that predicts left-out recordings better, where the effects leave more than noise. So
    do validation recordings that are missed by more than without the effects.

    Args:
        explanation, discrepancy: same as for `contradicted`.
        limits: reduced chi-square up to which nothing is left, of fitted and of scored recordings.
        base, last: predictive reduced chi-squares of both, without and with the effects.
    """
    program, fit = explanation.program, explanation.final
    doubt = 0.0
    if largest_deviation(program.unknowns, fit) > VERDICT.astray:
        doubt = VERDICT.astray_unknown
    before, after = explanation.left_out
    worse = after >= before or (not program.fitted.all() and last[1] > max(base[1], limits[1]))
    left = min(after, reduced(program, fit, program.fitted)) > limits[0]
    if discrepancy is not None and left and after - 1.0 > VERDICT.imperfect_share * (before - 1.0):
        worse |= discrepancy.left_out - 1.0 < VERDICT.maximum_kept * (after - 1.0)
    return VERDICT.refuted_unknown if worse else doubt


def unexplained(base: list[float], last: list[float], floors: list[float], limits: list[float]) -> float:
    """Probability that none of the candidates is right, from the share of the misfit that remains."""
    worst = 0.0
    for before, after, noise, limit in zip(base, last, floors, limits, strict=True):
        if after > limit and before > noise:
            share = (after - noise) / max(before - noise, 1e-6)
            worst = max(
                worst, (share - VERDICT.imperfect_share) / (VERDICT.unknown_share - VERDICT.imperfect_share)
            )
    return float(np.clip(worst, 0.01, 0.97))


def leaves_more(base: list[float], last: list[float], floors: list[float]) -> bool:
    """True if named effects leave more than noise and more than a right form may.

    Args:
        base, last: reduced chi-square without and with the effects, of fitted and of scored recordings.
        floors: chi-square of noise of both.
    """
    return any(
        _keeps(before, after, noise, VERDICT.imperfect_share)
        for before, after, noise in zip(base, last, floors, strict=True)
    )


def helps_nobody(
    base: list[float], last: list[float], floors: list[float], left_out: tuple[float, float]
) -> bool:
    """True if named effects leave held-out recordings more than half of their misfit.

    Recordings left out in turn count only where others are missed, too, because a right model may extrapolate
    badly.

    Args:
        base, last, floors: same as for `leaves_more`.
        left_out: cross-validated reduced chi-squares, NaN if not computed.
    """
    over = any(after > noise + VERDICT.minimum_over for after, noise in zip(last, floors, strict=True))
    return _keeps(base[1], last[1], floors[1], VERDICT.maximum_kept) or (
        over and _keeps(*left_out, floors[0], VERDICT.maximum_kept)
    )


def outdone(explanation: Explanation, discrepancy: DiscrepancyEvidence | None) -> float:
    """Held-out log-likelihood, deflated, by which a discrepancy predicts better than named effects.

    It is 0 where it is less than an effect must gain.
    """
    if discrepancy is None:
        return 0.0
    program = explanation.program
    better = explanation.left_out[1] - discrepancy.left_out  # NaN, which gains nothing, if unasked
    gain = log_likelihood(program, better, inflation_of(program, explanation.final))
    return float(gain) if gain > ENTRY.minimum_gain else 0.0


def _keeps(before: float, after: float, noise: float, share: float) -> bool:
    """True if more than noise is left, and more than a share of the misfit."""
    return after > noise + VERDICT.minimum_over and after - noise > share * (before - noise)
