"""Which candidate enters a model, if any may: evidence, and what recordings that are left out say."""

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.cross_validation import HeldOutScores, gain
from ..fit.evidence import inflation_of, log_likelihood
from ..fit.instrument_drift import drift_evidence
from ..fit.misfit import negative_log_predictive_density, reduced, spread
from ..fit.refit import Fit
from .steps import Step

CERTAIN = 8.0
"""Log Bayes factor from which the first effect enters; the number of candidates is already counted."""
FURTHER = 5.0
"""The same for a further one: something is missing for sure there."""
SETTLED = 12.0
"""Log Bayes factor, less what instruments explain, below which what is found is said to be tentative: one
null in a hundred reached 9."""
FIRST_SHARE = 0.1
"""Of the misfit of recordings left out in turn, what the first effect must take away."""
SHARE = 0.45
"""The same for a further effect, if it does not take away `LARGE`: the imperfect form of a true effect leaves
a remainder that something else fits."""
LARGE = 0.2
"""Of the base model's misfit of what was fitted, more than the imperfect form of a true effect leaves."""
CHANCE = 3.0
"""Standard deviations of a reduced chi-square over 1 up to which no share of it is told."""
OF_ALL = 0.025
"""Of the base model's own misfit, what a further effect must take away."""
OF_FITTED = 0.1
"""Or, of its misfit of what was fitted: a base model that is wrong may go astray without some recordings, and
its misfit of those be many times as large."""
PREDICTS = 5.0
"""Log-likelihood of recordings left out in turn that every effect must gain, deflated as log Bayes factors
are."""
WORSE = 3.0
"""Log-likelihood of recordings that were not fitted, deflated, that an effect may cost."""
DEARER = 0.05
"""The same as a share of what recordings left out in turn gain: the imperfect form of a strong effect drags
constants along that a recording without it shows."""
FAINT = 1.2
"""Reduced chi-square of left-out recordings up to which no effect is believed that ends at a bound."""
LESS = 0.75
"""Reduced chi-square of left-out recordings up to which none is: the base model predicts them better than the
noise would let it."""
CLOSE = 4.0
"""Log Bayes factor within which two explanations are not told apart."""
BEHIND = 0.2, 0.1
"""Share of the best log Bayes factor by which the first and a further effect may be behind: if left-out
recordings refute what explains the fitted ones best, what explains them much worse is no better a guess."""


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
    enough = CERTAIN if first else FURTHER
    best = None
    for trial in stage.trials:
        best = trial.bayes if best is None else best
        if trial.bayes < enough or (not first and trial.stopped):
            continue
        if best - trial.bayes > max(CLOSE, BEHIND[0 if first else 1] * best):
            break
        if before is None:
            before = scores(current)
            stage.left_out = float(before.sum())
        if stage.left_out < (FAINT if trial.stopped else LESS):
            continue
        trial.adrift = drift_evidence(program, current, trial.fit)
        if trial.bayes - trial.adrift < enough:
            best = best if best > trial.bayes else None  # what instruments explain is no better guess
            continue
        gained, share = gain(before, scores(trial.fit))
        trial.left_out = stage.left_out - gained
        inflation = inflation_of(program, trial.fit)
        if log_likelihood(program, gained, inflation) < PREDICTS:
            continue
        taken = _taken(program, current, trial.fit, base)
        if share < (FIRST_SHARE if first or taken >= LARGE else SHARE):
            continue
        if not first and gained < OF_ALL * (original - 1.0) and taken < OF_FITTED:
            continue
        lost = negative_log_predictive_density(
            program, trial.fit, program.unseen
        ) - negative_log_predictive_density(program, current, program.unseen)
        if lost / inflation > WORSE and lost > DEARER * log_likelihood(program, gained):
            continue
        return trial
    return None


def _taken(program: Program, current: Fit, further: Fit, base: Fit) -> float:
    """Share of the base model's misfit of what was fitted that a further effect takes away; 0 where that is
    no more than chance."""
    before, after, whole = (reduced(program, fit, program.fitted) for fit in (current, further, base))
    by_chance = whole - 1.0 < CHANCE * spread(program, program.fitted)
    return 0.0 if by_chance else (before - after) / (whole - 1.0)
