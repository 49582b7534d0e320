"""Which effects explain a campaign: one effect after the other, and what none explains.

Recordings of role `validation` let no effect in: it must help fitted recordings that are left out in turn.
They keep one out that predicts them worse. Only where the fitted ones name nothing, or something that leaves
most of the misfit of those for validation, all are fitted, and every score is of recordings left out in turn.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..evaluate.program import Program
from ..fit.base_fit import base_fit, settle
from ..fit.misfit import floor, reduced
from ..fit.refit import Fit
from ..fit.score_test import Screen
from ..settings import DEFAULT
from .pair_search import pair_search
from .steps import Explanation, Named, Step
from .stepwise import StepwiseSearch, screened

BASE_FIT = DEFAULT.base_fit
SCORE_TEST = DEFAULT.score_test
EVIDENCE = DEFAULT.evidence
VERDICT = DEFAULT.verdict


def explain(
    program: Program,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda _: None,
    effort: int = 1,
    further: Callable[[], Sequence[np.ndarray]] = tuple,
) -> Explanation:
    """Search for up to three effects.

    Args:
        program: of the campaign.
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many candidates.
        further: makes more starts of the base model, scaled; asked where its fit leaves much.
    """
    growth = StepwiseSearch(rng, progress, effort)
    progress("refitting the base model within its tolerances")
    started, base = base_fit(program, further=further)
    progress(f"screening {len(program.unknowns.slugs)} effects")
    found = screened(started, base, rng)
    untried = not program.fitted.all()  # recordings for validation have not been fitted
    if untried and found.p_value > SCORE_TEST.level:
        explanation = _together(started, base, SCORE_TEST.level_together, growth)
        if explanation is not None:
            return explanation
        untried = False
    explanation = _whole(growth, started, base, found)
    if untried and _contradicted(explanation):
        again = _together(started, base, SCORE_TEST.level, growth)
        if again is not None and _score(again, ~program.fitted) < _score(explanation, ~program.fitted):
            return again
    return explanation


def _together(program: Program, base: Fit, level: float, growth: StepwiseSearch) -> Explanation | None:
    """A search on all recordings, those for validation too; None where it finds nothing."""
    growth.progress("looking at the recordings for validation as well")
    whole, fit = base_fit(replace(program, fitted=np.ones_like(program.fitted)), base.u)
    found = screened(whole, fit, growth.rng)
    if found.p_value > level:
        return None
    explanation = _whole(growth, whole, fit, found)
    explanation.together = True
    return explanation if explanation.final.slugs else None


def _whole(growth: StepwiseSearch, program: Program, base: Fit, found: Screen) -> Explanation:
    """One effect after the other, from a screened base model; then from rivals of the first one."""
    for again in reversed(range(BASE_FIT.maximum_searches)):
        explanation = Explanation(program, base, Named(base), [], found.p_value, found.p_is_bound)
        better = growth.grown(explanation, Step(base, found, []), again > 0)
        if better is None:
            break
        growth.progress("beginning again from a better fit of the base model")
        program, base = settle(program, better)
        found = screened(program, base, growth.rng)
    pair_search(growth, explanation)
    explanation.stood = growth.stood
    return explanation


def _score(explanation: Explanation, chosen: np.ndarray) -> float:
    return reduced(explanation.program, explanation.final, chosen)


def _contradicted(explanation: Explanation) -> bool:
    """Whether recordings for validation keep most of a misfit that is more than chance."""
    program, fit = explanation.program, explanation.final
    noise = floor(program, fit, program.unseen)
    before = reduced(program, explanation.base, program.unseen) - noise
    after = reduced(program, fit, program.unseen) - noise
    certain = 0.5 * program.observations(program.unseen) * after > EVIDENCE.minimum_first
    return certain and after > VERDICT.maximum_kept * before
