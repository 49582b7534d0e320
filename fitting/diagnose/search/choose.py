"""Entry of a candidate into a model, by evidence and by cross-validation."""

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.cross_validation import HeldOutScores, gain
from ..fit.evidence import inflation_of, log_likelihood
from ..fit.instrument_drift import drift_evidence
from ..fit.misfit import negative_log_predictive_density, reduced, spread
from ..fit.refit import Fit
from ..settings import DEFAULT
from .steps import Step

EVIDENCE = DEFAULT.evidence
ENTRY = DEFAULT.entry
VERDICT = DEFAULT.verdict


def choice(
    program: Program, current: Fit, step: Step, base: Fit, original: float, scores: HeldOutScores
) -> CandidateFit | None:
    """The candidate that enters the model, or None.

    Args:
        program: of the campaign.
        current: model so far.
        step: with the candidates, best first; its cross-validated score is set here.
        base: model without effects.
        original: cross-validated reduced chi-square of the base model; NaN for the first effect.
        scores: cross-validation of models.
    """
    first, before = not current.slugs, None
    enough = EVIDENCE.minimum_first if first else EVIDENCE.minimum_further
    best = None
    for candidate in step.candidates:
        best = candidate.bayes if best is None else best
        if candidate.bayes < enough or (not first and candidate.at_a_bound):
            continue
        if best - candidate.bayes > max(EVIDENCE.minimum_difference, EVIDENCE.behind * best):
            break
        if before is None:
            before = scores(current)
            step.left_out = float(before.sum())
        if candidate.at_a_bound and step.left_out < ENTRY.minimum_at_bound:
            continue
        candidate.explained_by_instruments = drift_evidence(program, current, candidate.fit)
        if candidate.bayes - candidate.explained_by_instruments < enough:
            best = best if best > candidate.bayes else None  # what instruments explain is no better guess
            continue
        gained, share = gain(before, scores(candidate.fit))
        candidate.left_out = step.left_out - gained
        inflation = inflation_of(program, candidate.fit)
        if log_likelihood(program, gained, inflation) < ENTRY.minimum_gain:
            continue
        taken = _taken(program, current, candidate.fit, base)
        if not first and taken < ENTRY.large_share and share < ENTRY.minimum_further_share:
            continue
        if (
            not first
            and gained < ENTRY.minimum_of_base * (original - 1.0)
            and taken < ENTRY.minimum_of_fitted
        ):
            continue
        lost = negative_log_predictive_density(
            program, candidate.fit, program.unseen
        ) - negative_log_predictive_density(program, current, program.unseen)
        if lost / inflation > ENTRY.maximum_loss and lost > ENTRY.maximum_loss_share * log_likelihood(
            program, gained
        ):
            continue
        return candidate
    return None


def _taken(program: Program, current: Fit, further: Fit, base: Fit) -> float:
    """Share of the base misfit of fitted recordings that an effect removes; 0 within chance."""
    before, after, whole = (reduced(program, fit, program.fitted) for fit in (current, further, base))
    by_chance = whole - 1.0 < VERDICT.minimum_deviations * spread(program, program.fitted)
    return 0.0 if by_chance else (before - after) / (whole - 1.0)
