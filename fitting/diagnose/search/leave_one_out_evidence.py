"""What every effect of a model is worth beside the others, and which of its rivals takes its place there.

An effect that entered alone may have stood for two. So each is looked for again, from a screen on, wherever
the others are not those beside which it entered: an idle one goes, and one that a rival surpasses gives way.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit, weigh
from ..fit.cross_validation import HeldOutScores
from ..fit.evidence import inflation_of, log_likelihood
from ..fit.instrument_drift import drift_evidence, instrument_parts
from ..fit.misfit import negative_log_predictive_density
from ..fit.refit import Fit, largest_deviation
from ..settings import DEFAULT
from .backward_elimination import redundant, without
from .steps import LeaveOneOutEvidence, Named, Step

EVIDENCE = DEFAULT.evidence
ENTRY = DEFAULT.entry
SEARCH = DEFAULT.search

Fill = Callable[[Fit], Step]
"""Screens the effects that a model does not have and fits the most promising."""


def leave_each_out(
    program: Program, fit: Fit, left: float, stages: list[Step], fill: Fill, scores: HeldOutScores
) -> Named:
    """A model whose effects hold their places beside each other, with what each is worth there.

    Args:
        program: of the campaign.
        fit: the model.
        left: what it leaves of fitted recordings left out in turn, see `Named`.
        stages: rounds of a search, that on the base model first; their trials are used again where they stand
            beside the same effects.
        fill: makes another one.
        scores: of recordings left out in turn.
    """
    named, known, exchanges = Named(fit, left), list(stages), SEARCH.exchanges * len(fit.slugs)
    base = stages[0].base
    while True:
        slug = next((s for s in named.fit.slugs if s not in named.standings), None)
        if slug is None:
            return named
        stage = _beside(known, [s for s in named.fit.slugs if s != slug])
        rest = stage.base if stage else without(program, named.fit, slug)
        if rest.slugs and redundant(program, rest, named.fit):
            named = Named(rest, scores.gained(base, rest))
            continue
        if stage is None:
            stage = fill(rest)
            known.append(stage)
        standing = _standing(program, named, slug, stage)
        own = standing.own
        if (named.fit.objective - own.fit.objective) / inflation_of(
            program, own.fit
        ) > EVIDENCE.minimum_better:
            named = Named(replace(own.fit, slugs=named.fit.slugs), named.left_out)  # as they entered
            continue
        entered = stage.chosen == slug  # `choice` weighed it against its rivals there
        rival = None if entered or not exchanges else _successor(program, standing, scores)
        if rival is not None:
            exchanges -= 1
            slugs = tuple(rival.slug if s == slug else s for s in named.fit.slugs)
            named = Named(replace(rival.fit, slugs=slugs), scores.gained(base, rival.fit))
            rival.left_out = named.left_out
            named.standings[rival.slug] = replace(standing, slug=rival.slug)
        elif stage.base.slugs and own.bayes < EVIDENCE.minimum_further:  # beside a fair fit of the others
            named = Named(stage.base, scores.gained(base, stage.base))
        else:
            named.standings[slug] = standing


def _beside(known: list[Step], slugs: list[str]) -> Step | None:
    """The round that tried effects beside some others."""
    return next((s for s in known if s.trials and set(s.base.slugs) == set(slugs)), None)


def _standing(program: Program, named: Named, slug: str, stage: Step) -> LeaveOneOutEvidence:
    """What an effect of a model and the trials of a round are worth."""
    standing = LeaveOneOutEvidence(slug, stage.base, [replace(trial) for trial in stage.trials])
    if all(trial.slug != slug for trial in standing.trials):
        standing.trials.append(CandidateFit(slug, named.fit, 0.0, np.nan))
    own = standing.own
    own.fit = min(own.fit, named.fit, key=lambda fit: fit.objective)
    own.returned = largest_deviation(program.unknowns, own.fit)
    own.left_out = named.left_out
    weigh(program, stage.base, standing.trials)
    drifting, own.averaged = instrument_parts(program, stage.base, own.fit)
    own.adrift = drifting + own.averaged
    return standing


def _successor(program: Program, standing: LeaveOneOutEvidence, scores: HeldOutScores) -> CandidateFit | None:
    """The rival that takes the place of an effect: one within its bounds that has more evidence, also less
    what drift explains, and predicts recordings no worse."""
    own = standing.own
    for rival in standing.trials:
        if rival is own:
            return None
        rival.adrift = 0.0 if rival.stopped else drift_evidence(program, standing.base, rival.fit)
        enough = max(EVIDENCE.minimum_further, own.bayes - own.adrift)
        if rival.stopped or rival.bayes - rival.adrift < enough or not _surpassed(program, own, rival):
            continue
        before, after = scores(own.fit), scores(rival.fit)
        if _no_worse(program, before, after, inflation_of(program, rival.fit)):
            return rival
    return None


def _surpassed(program: Program, trial: CandidateFit, rival: CandidateFit) -> bool:
    """Whether a rival has more evidence than a trial, by more than it predicts those never fitted worse."""
    lost = negative_log_predictive_density(
        program, rival.fit, program.unseen
    ) - negative_log_predictive_density(program, trial.fit, program.unseen)
    return rival.bayes - trial.bayes > max(lost, 0.0) / inflation_of(program, rival.fit)


def _no_worse(program: Program, before: np.ndarray, after: np.ndarray, inflation: float) -> bool:
    """Whether a model predicts recordings left out in turn no worse than another one, by fold: but for one in
    which it goes astray, if it predicts the rest clearly better."""
    worst = int(np.argmin(before - after))
    rest = np.delete(before - after, worst)
    clearly = log_likelihood(program, rest.sum(), inflation) >= ENTRY.minimum_gain
    return bool(
        after.sum() <= before.sum() or (clearly and after[worst] > ENTRY.astray_factor * before[worst])
    )
