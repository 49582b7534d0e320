"""How what is left is judged: by chance, by drift, by a nameless correction, by what was not fitted."""

import numpy as np
from scipy.stats import chi2

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
    explanation: Explanation, base: list[float], generic: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """Whether recordings contradict the base model although no effect explains it.

    Args:
        explanation: of the campaign.
        base: reduced chi-square of the base model, of what was fitted and, as `foretold`, of what scores.
        generic: the best nameless correction.
        floors: what noise leaves of both: misfit that changes from row to row is none of a model's.
    """
    return by_discrepancy(generic) or _by_signature(explanation, base, generic, floors)


def by_discrepancy(generic: DiscrepancyEvidence | None) -> bool:
    """Whether a nameless correction says that something is missing."""
    return generic is not None and generic.bayes > EVIDENCE.minimum_first


def discrepancy_probability(
    explanation: Explanation,
    base: list[float],
    generic: DiscrepancyEvidence | None,
    floors: list[float],
    left: float,
) -> float:
    """Probability of something unknown where recordings contradict the base model and no effect explains it:
    tentative where only a nameless correction of little evidence says so.

    Args:
        explanation, base, generic, floors: as for `contradicted`.
        left: probability of it from how much is left.
    """
    settled = generic is not None and generic.bayes > EVIDENCE.minimum_settled
    settled = settled or _by_signature(explanation, base, generic, floors)
    return max(left, VERDICT.nothing_named_unknown) if settled else VERDICT.tentative


def _by_signature(
    explanation: Explanation, base: list[float], generic: DiscrepancyEvidence | None, floors: list[float]
) -> bool:
    """Whether a signature stands out, and so does what is left as a whole."""
    program = explanation.program
    if explanation.p_value > SCORE_TEST.level:
        return False
    base = [score - (noise - 1.0) for score, noise in zip(base, floors, strict=True)]
    sure = explanation.p_is_bound and program.noise_stated and base[1] > 1.0
    chance = 1.0 + VERDICT.sure_deviations * spread(program, program.fitted)
    left = steady(base[0], generic)
    return min(left, base[1]) > VERDICT.faint or max(base) > VERDICT.gross or (sure and left > chance)


def steady(left: float, generic: DiscrepancyEvidence | None) -> float:
    """What is left of a reduced chi-square less what slow drift of the instruments explains, of a size that
    passes for noise."""
    return left if generic is None else min(left, max(generic.adrift, left - DRIFT.maximum_explained))


def tail(program: Program, reduced_chi2: float) -> float:
    """Probability of a chi-square of the fitted recordings as large as this by chance."""
    count = program.observations(program.fitted)
    return float(chi2.sf(reduced_chi2 * count, count))


def limit_of(program: Program, chosen: np.ndarray) -> float:
    """Reduced chi-square of some recordings up to which nothing counts as left over."""
    return 1.0 + max(VERDICT.minimum_excess, VERDICT.minimum_deviations * spread(program, chosen))


def refuted(
    explanation: Explanation,
    generic: DiscrepancyEvidence | None,
    limits: list[float],
    base: list[float],
    last: list[float],
) -> float:
    """Probability of something unknown, from what speaks against the effects that were found.

    A nameless correction that predicts left-out recordings better does, where the effects leave more than
    noise, of fitted ones, too. Recordings that were not fitted do where they are missed, and by more than
    without the effects. (Of 39 mismatches that were scored one was like that, a null.)

    Args:
        explanation, generic: as for `contradicted`.
        limits: reduced chi-square, of what was fitted and of what scores, up to which nothing is left.
        base, last: `foretold` of both, without and with the effects: what extrapolates badly may be right.
    """
    program, fit = explanation.program, explanation.final
    doubt = 0.0
    if largest_deviation(program.unknowns, fit) > VERDICT.astray:
        doubt = VERDICT.astray_unknown
    before, after = explanation.left_out
    worse = after >= before or (not program.fitted.all() and last[1] > max(base[1], limits[1]))
    left = min(after, reduced(program, fit, program.fitted)) > limits[0]
    if generic is not None and left and after - 1.0 > VERDICT.imperfect_share * (before - 1.0):
        worse |= generic.left_out - 1.0 < VERDICT.maximum_kept * (after - 1.0)
    return VERDICT.refuted_unknown if worse else doubt


def unexplained(base: list[float], last: list[float], floors: list[float], limits: list[float]) -> float:
    """Probability that what is left is none of the candidates, from how much is left over noise."""
    worst = 0.0
    for before, after, noise, limit in zip(base, last, floors, limits, strict=True):
        if after > limit and before > noise:
            share = (after - noise) / max(before - noise, 1e-6)
            worst = max(
                worst, (share - VERDICT.imperfect_share) / (VERDICT.unknown_share - VERDICT.imperfect_share)
            )
    return float(np.clip(worst, 0.01, 0.97))


def leaves_more(base: list[float], last: list[float], floors: list[float]) -> bool:
    """Whether named effects leave more than noise and than a right form may: their model does not hold.

    Args:
        base, last: reduced chi-square of the base model and with the effects, of what was fitted and of what
            scores.
        floors: what noise leaves of both.
    """
    return any(
        _keeps(before, after, noise, VERDICT.imperfect_share)
        for before, after, noise in zip(base, last, floors, strict=True)
    )


def helps_nobody(
    base: list[float], last: list[float], floors: list[float], left_out: tuple[float, float]
) -> bool:
    """Whether named effects leave recordings that were not fitted, or those left out in turn, more than half
    of what they are missed by, whatever the uncertainty of the constants could excuse: the names help nobody
    there. Those left out in turn say so only where others are missed, too: what extrapolates badly may be
    right. Arguments as for `leaves_more`, and scores of recordings left out in turn, NaN if not asked."""
    over = any(after > noise + VERDICT.minimum_over for after, noise in zip(last, floors, strict=True))
    return _keeps(base[1], last[1], floors[1], VERDICT.maximum_kept) or (
        over and _keeps(*left_out, floors[0], VERDICT.maximum_kept)
    )


def outdone(explanation: Explanation, generic: DiscrepancyEvidence | None) -> float:
    """Log-likelihood of recordings left out in turn, deflated, by which a nameless correction predicts them
    better than named effects do, where that is as much as an effect must gain there; else 0."""
    if generic is None:
        return 0.0
    program = explanation.program
    better = explanation.left_out[1] - generic.left_out  # NaN, which gains nothing, if unasked
    gain = log_likelihood(program, better, inflation_of(program, explanation.final))
    return float(gain) if gain > ENTRY.minimum_gain else 0.0


def _keeps(before: float, after: float, noise: float, share: float) -> bool:
    """Whether more than noise is left, and more than a share of the misfit."""
    return after > noise + VERDICT.minimum_over and after - noise > share * (before - noise)
