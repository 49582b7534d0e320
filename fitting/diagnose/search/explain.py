"""The search for effects that explain a campaign.

Validation recordings let no effect in: it must help fitted recordings that are left out in turn. They keep
out an effect that predicts them worse. All recordings are fitted together in two cases only. Either the
fitted ones name nothing, or the model leaves most of the misfit of the validation recordings. In the second
case both sets are compared by their evidence on all recordings. Every score is cross-validated then. Where
they name nothing together, either, both searches are kept: the verdict may still find that only all
recordings together contradict the base model. Where no set comes near the noise of the fitted ones, there is
no such second search.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import counted

from ..evaluate.program import Program
from ..fit.base_fit import base_fit, fit_with_noise, quieter_beside
from ..fit.evidence import evidence, inflation_of
from ..fit.misfit import floor, limit_of
from ..fit.prediction import predictive_chi_square
from ..fit.refit import Fit, Refitter
from ..fit.score_test import ScoreTest
from ..settings import DEFAULT
from .set_search import SetSearch, base_scored
from .steps import Explanation, Named, Step

BASE_FIT = DEFAULT.base_fit
CHANCE = DEFAULT.chance
EXCESS = DEFAULT.excess
SHARE = DEFAULT.share


def explain(
    program: Program,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda _: None,
    effort: int = 1,
    further: Callable[[Program], Iterable[np.ndarray]] = lambda _: (),
) -> Explanation:
    """Search for up to three effects.

    Args:
        program: program of the campaign.
        rng: random numbers of the simulated nulls.
        progress: receives a line of text at every step.
        effort: 1; 2 follows twice as many candidates.
        further: more starts of the base model of a program, see `base_fit`.
    """
    search = SetSearch(rng, progress, effort)
    progress("refitting the base model within its tolerances")
    started, base = base_fit(program, further=further)
    progress(f"screening {counted(len(program.unknowns.slugs), 'effect')}")
    found = base_scored(started, base, rng)
    untried = not program.fitted.all()  # recordings for validation have not been fitted
    whole = None
    if untried and found.p_value > CHANCE.level:
        whole = _together(started, base, CHANCE.level / 2.0, search)
        if whole is not None and whole.final.slugs:
            return whole
        untried = False
    explanation = _whole(search, started, base, found)
    if untried and _contradicted(explanation) and not far_from_noise(explanation):
        whole = _together(started, base, CHANCE.level, search)
        if whole is not None and whole.final.slugs and _better(whole, explanation):
            return whole
    explanation.second_look = None if whole is None or whole.final.slugs else whole
    return explanation


def _together(program: Program, base: Fit, level: float, search: SetSearch) -> Explanation | None:
    """A search on all recordings, validation included; None where no score stands out."""
    search.progress("looking at the recordings for validation as well")
    whole, fit = base_fit(replace(program, fitted=np.ones_like(program.fitted)), base.u)
    found = base_scored(whole, fit, search.rng)
    if found.p_value > level:
        return None
    explanation = _whole(search, whole, fit, found)
    explanation.together = True
    return explanation


def _whole(search: SetSearch, program: Program, base: Fit, found: ScoreTest) -> Explanation:
    """The whole search from a scored base fit, begun again where candidates find a better one.

    It is begun again, too, where an unstated noise is clearly less beside what was named. That noise stays.
    """
    quiet = False
    for again in reversed(range(BASE_FIT.maximum_searches)):
        explanation = Explanation(program, base, Named(base), [], found.p_value, found.p_is_bound)
        better = search.run(explanation, Step(base, found, []), again > 0)
        if better is not None:
            search.progress("beginning again from a better fit of the base model")
            program, base = (program, better) if quiet else fit_with_noise(program, better)
        else:
            quieter = quieter_beside(program, explanation.final) if again and not quiet else None
            if quieter is None:
                break
            search.progress("beginning again with the noise that the named effects leave")
            program, base, quiet = quieter, Refitter(quieter).fit((), explanation.base.u), True
        found = base_scored(program, base, search.rng)
    return explanation


def _better(whole: Explanation, explanation: Explanation) -> bool:
    """True if the set that all recordings name has more evidence on them than the set of the fitted ones.

    Both are fitted to all recordings, with the same noise.
    """
    program, named = whole.program, whole.final
    other = Refitter(program).fit(explanation.final.slugs, explanation.final)
    inflation = inflation_of(program, min(named, other, key=lambda fit: fit.objective))
    worth = [evidence(program, whole.base, fit, inflation) for fit in (named, other)]
    return set(named.slugs) != set(other.slugs) and worth[0] > worth[1]


def far_from_noise(explanation: Explanation) -> bool:
    """True if every set leaves so much of the fitted recordings that no name is to be trusted.

    Further recordings would not change that, and a search on all of them costs as much as the first.
    """
    program, fit = explanation.program, explanation.nearest
    if fit is None or not program.noise_stated:
        return False
    left = predictive_chi_square(program, fit, program.fitted) - floor(program, fit, program.fitted)
    return left > EXCESS.clear


def _contradicted(explanation: Explanation) -> bool:
    """True if validation recordings keep most of a misfit that is more than chance and than open numbers."""
    program, fit = explanation.program, explanation.final
    noise = floor(program, fit, program.unseen)
    before, after = (
        predictive_chi_square(program, one, program.unseen) for one in (explanation.base, fit)
    )
    certain = after - noise > limit_of(program, program.unseen) - 1.0
    return certain and after - noise > SHARE.most * (before - noise)
