"""Leave-one-effect-out evidence: every effect of a model against its rivals, beside the other effects.

An effect that entered alone may have stood for two. So each is searched for again, from the score test on,
beside the others. A redundant effect is removed, and one that a rival surpasses gives way to it.
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
    program: Program, fit: Fit, left: float, steps: list[Step], fill: Fill, scores: HeldOutScores
) -> Named:
    """A model whose effects keep their places beside each other, with the evidence of each.

    Args:
        program: of the campaign.
        fit: the model.
        left: its cross-validated reduced chi-square, see `Named`.
        steps: of a search, the first on the base model; candidates beside the same effects are used again.
        fill: makes another step.
        scores: cross-validation of models.
    """
    named, known, exchanges = Named(fit, left), list(steps), SEARCH.exchanges * len(fit.slugs)
    base = steps[0].base
    while True:
        slug = next((s for s in named.fit.slugs if s not in named.leave_one_out), None)
        if slug is None:
            return named
        step = _beside(known, [s for s in named.fit.slugs if s != slug])
        rest = step.base if step else without(program, named.fit, slug)
        if rest.slugs and redundant(program, rest, named.fit):
            named = Named(rest, scores.gained(base, rest))
            continue
        if step is None:
            step = fill(rest)
            known.append(step)
        one_out = _one_out(program, named, slug, step)
        own = one_out.own
        if (named.fit.objective - own.fit.objective) / inflation_of(
            program, own.fit
        ) > EVIDENCE.minimum_better:
            named = Named(replace(own.fit, slugs=named.fit.slugs), named.left_out)  # as they entered
            continue
        entered = step.chosen == slug  # `choice` weighed it against its rivals there
        rival = None if entered or not exchanges else _successor(program, one_out, scores)
        if rival is not None:
            exchanges -= 1
            slugs = tuple(rival.slug if s == slug else s for s in named.fit.slugs)
            named = Named(replace(rival.fit, slugs=slugs), scores.gained(base, rival.fit))
            rival.left_out = named.left_out
            named.leave_one_out[rival.slug] = replace(one_out, slug=rival.slug)
        elif step.base.slugs and own.bayes < EVIDENCE.minimum_further:  # beside a fair fit of the others
            named = Named(step.base, scores.gained(base, step.base))
        else:
            named.leave_one_out[slug] = one_out


def _beside(known: list[Step], slugs: list[str]) -> Step | None:
    """The step whose candidates stand beside some effects."""
    return next((s for s in known if s.candidates and set(s.base.slugs) == set(slugs)), None)


def _one_out(program: Program, named: Named, slug: str, step: Step) -> LeaveOneOutEvidence:
    """Evidence of an effect of a model, and of the candidates of a step."""
    one_out = LeaveOneOutEvidence(slug, step.base, [replace(candidate) for candidate in step.candidates])
    if all(candidate.slug != slug for candidate in one_out.candidates):
        one_out.candidates.append(CandidateFit(slug, named.fit, 0.0, np.nan))
    own = one_out.own
    own.fit = min(own.fit, named.fit, key=lambda fit: fit.objective)
    own.largest_deviation_sd = largest_deviation(program.unknowns, own.fit)
    own.left_out = named.left_out
    weigh(program, step.base, one_out.candidates)
    drifting, own.explained_by_inputs = instrument_parts(program, step.base, own.fit)
    own.explained_by_instruments = drifting + own.explained_by_inputs
    return one_out


def _successor(program: Program, one_out: LeaveOneOutEvidence, scores: HeldOutScores) -> CandidateFit | None:
    """The rival that takes the place of an effect, if any.

    It ends within its bounds, has more evidence, also less drift, and predicts recordings no worse.
    """
    own = one_out.own
    for rival in one_out.candidates:
        if rival is own:
            return None
        rival.explained_by_instruments = (
            0.0 if rival.at_a_bound else drift_evidence(program, one_out.base, rival.fit)
        )
        enough = max(EVIDENCE.minimum_further, own.bayes - own.explained_by_instruments)
        if (
            rival.at_a_bound
            or rival.bayes - rival.explained_by_instruments < enough
            or not _surpassed(program, own, rival)
        ):
            continue
        before, after = scores(own.fit), scores(rival.fit)
        if _no_worse(program, before, after, inflation_of(program, rival.fit)):
            return rival
    return None


def _surpassed(program: Program, candidate: CandidateFit, rival: CandidateFit) -> bool:
    """Whether a rival gains more evidence than it loses on validation recordings."""
    lost = negative_log_predictive_density(
        program, rival.fit, program.unseen
    ) - negative_log_predictive_density(program, candidate.fit, program.unseen)
    return rival.bayes - candidate.bayes > max(lost, 0.0) / inflation_of(program, rival.fit)


def _no_worse(program: Program, before: np.ndarray, after: np.ndarray, inflation: float) -> bool:
    """Whether a model predicts recordings left out in turn no worse than another one.

    One fold in which the model extrapolates badly is forgiven if it predicts the rest clearly better.
    """
    worst = int(np.argmin(before - after))
    rest = np.delete(before - after, worst)
    clearly = log_likelihood(program, rest.sum(), inflation) >= ENTRY.minimum_gain
    return bool(
        after.sum() <= before.sum() or (clearly and after[worst] > ENTRY.astray_factor * before[worst])
    )
