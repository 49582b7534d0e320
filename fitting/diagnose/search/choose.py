"""Which candidate enters a model, if any may: evidence, and what recordings that are left out say."""

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
    program: Program, current: Fit, stage: Step, base: Fit, original: float, scores: HeldOutScores
) -> CandidateFit | None:
    """The trial that enters the model, if any may.

    Args:
        program: of the campaign.
        current: model so far.
        stage: with the trials, best first; what is left out is scored as far as it is asked for.
        base: model without effects.
        original: its score on recordings left out; NaN for the first effect.
        scores: of recordings left out in turn.
    """
    first, before = not current.slugs, None
    enough = EVIDENCE.minimum_first if first else EVIDENCE.minimum_further
    behind = EVIDENCE.behind_first if first else EVIDENCE.behind_further
    best = None
    for trial in stage.trials:
        best = trial.bayes if best is None else best
        if trial.bayes < enough or (not first and trial.stopped):
            continue
        if best - trial.bayes > max(EVIDENCE.minimum_difference, behind * best):
            break
        if before is None:
            before = scores(current)
            stage.left_out = float(before.sum())
        if stage.left_out < (ENTRY.minimum_at_bound if trial.stopped else ENTRY.minimum_left):
            continue
        trial.adrift = drift_evidence(program, current, trial.fit)
        if trial.bayes - trial.adrift < enough:
            best = best if best > trial.bayes else None  # what instruments explain is no better guess
            continue
        gained, share = gain(before, scores(trial.fit))
        trial.left_out = stage.left_out - gained
        inflation = inflation_of(program, trial.fit)
        if log_likelihood(program, gained, inflation) < ENTRY.minimum_gain:
            continue
        taken = _taken(program, current, trial.fit, base)
        if share < (
            ENTRY.minimum_share if first or taken >= ENTRY.large_share else ENTRY.minimum_further_share
        ):
            continue
        if (
            not first
            and gained < ENTRY.minimum_of_base * (original - 1.0)
            and taken < ENTRY.minimum_of_fitted
        ):
            continue
        lost = negative_log_predictive_density(
            program, trial.fit, program.unseen
        ) - negative_log_predictive_density(program, current, program.unseen)
        if lost / inflation > ENTRY.maximum_loss and lost > ENTRY.maximum_loss_share * log_likelihood(
            program, gained
        ):
            continue
        return trial
    return None


def _taken(program: Program, current: Fit, further: Fit, base: Fit) -> float:
    """Share of the base model's misfit of what was fitted that a further effect takes away; 0 where that is
    no more than chance."""
    before, after, whole = (reduced(program, fit, program.fitted) for fit in (current, further, base))
    by_chance = whole - 1.0 < VERDICT.minimum_deviations * spread(program, program.fitted)
    return 0.0 if by_chance else (before - after) / (whole - 1.0)
