"""Two effects of which the first is a rival of the first one found: alone, that may have stood for both.

Every rival is looked at with what a second effect would add to it, to second order; only the most promising
are fitted. Two effects take the place of what was found if they explain clearly more and predict better; if
drift of the instruments makes up for that, they contend with it. Where no effect was believed alone, two are
that also leave nothing.
"""

from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.parallel import run_parallel

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.cross_validation import gain
from ..fit.evidence import evidence, inflation_of, log_likelihood
from ..fit.instrument_drift import drift_evidence
from ..fit.misfit import negative_log_predictive_density, predictive_chi_square, spread
from ..fit.refit import Fit, Refitter, at_its_bound
from ..settings import DEFAULT
from .backward_elimination import eliminated, polished
from .steps import Explanation, Step
from .stepwise import StepwiseSearch, screened

SCORE_TEST = DEFAULT.score_test
CANDIDATES = DEFAULT.candidates
EVIDENCE = DEFAULT.evidence
ENTRY = DEFAULT.entry
SEARCH = DEFAULT.search


@dataclass
class _Ahead:
    """A rival of the first effect, and what a second one promises beside it.

    Attributes:
        rival: alone.
        stage: of second effects, screened.
        promised: objective with the best of them, to second order.
    """

    rival: CandidateFit
    stage: Step
    promised: float


def pair_search(growth: StepwiseSearch, explanation: Explanation) -> None:
    """Look for such a pair where what was found leaves more than noise.

    Args:
        growth: how effects are looked for.
        explanation: of the search so far; told anew where a pair takes its place.
    """
    program = explanation.program
    if not explanation.stages[0].trials or not _noticed(explanation):
        return
    incumbents, complete = [explanation.final], False
    for ahead in _foreseen(growth, explanation):
        rival, stage = ahead.rival, ahead.stage
        growth.progress(f"looking for a second effect beside {rival.slug}")
        growth.fill(program, stage, CANDIDATES.tried_beside)
        best = _second(stage, explanation.final.slugs)
        if best is None or not _worth_more(explanation, best.fit, incumbents):
            continue
        if not complete:
            incumbents, complete = incumbents + _with_its_second(growth, explanation), True
            if not _worth_more(explanation, best.fit, incumbents):
                continue
        found = eliminated(program, polished(program, best.fit))
        if len(found.slugs) < 2 or not _surpassing(explanation, incumbents, found):
            continue
        if _drift_does(explanation, incumbents, found):
            _contend(explanation, found)
        elif _took_over(growth, explanation, ahead, incumbents, found):
            stage.chosen, incumbents = best.slug, [explanation.final]


def _contend(explanation: Explanation, pair: Fit) -> None:
    """Note a pair that drift alone keeps from taking the place of what was found, once."""
    if explanation.final.slugs and all(set(pair.slugs) != set(other) for other in explanation.contending):
        explanation.contending.append(pair.slugs)


def _took_over(
    growth: StepwiseSearch,
    explanation: Explanation,
    ahead: _Ahead,
    incumbents: list[Fit],
    pair: Fit,
) -> bool:
    """Whether a pair that surpasses incumbents took the place of what was found, or another one did that its
    effects gave way to."""
    alone, scores = not explanation.final.slugs, explanation.scores
    first, *others = explanation.stages
    if alone:
        first.left_out = float(scores(explanation.final).sum())
        if not _believable(explanation, pair):
            return False
    left = scores.gained(explanation.base, pair)
    named = growth.stood(explanation, pair, left, [first, ahead.stage, *others])
    if set(named.fit.slugs) != set(pair.slugs):
        if len(named.fit.slugs) < 2 or not _surpassing(explanation, incumbents, named.fit):
            return False
        if alone and not _believable(explanation, named.fit):
            return False
    explanation.named, explanation.contending = named, []
    explanation.stages = [replace(first, chosen=ahead.rival.slug), ahead.stage]
    return True


def _believable(explanation: Explanation, pair: Fit) -> bool:
    """Whether a pair may be named where no effect was believed alone: the base model leaves more than noise,
    the pair does not, and takes away a part of what is left out, with no effect at a bound."""
    program, base = explanation.program, explanation.final
    before, left = explanation.scores(base), explanation.scores(pair)
    if before.sum() < ENTRY.minimum_left or not _leaves_more(program, base, float(before.sum())):
        return False
    if any(at_its_bound(pair, slug) for slug in pair.slugs):
        return False
    return gain(before, left)[1] >= ENTRY.minimum_share and not _leaves_more(program, pair, float(left.sum()))


def _foreseen(growth: StepwiseSearch, explanation: Explanation) -> list[_Ahead]:
    """The rivals of the first effect that promise most with a second one, if that is more than was found."""
    program, final = explanation.program, explanation.final
    count = SEARCH.rivals_hidden if program.hidden else SEARCH.rivals
    pairs = SEARCH.pairs_hidden if program.hidden else SEARCH.pairs
    rivals = [t for t in explanation.stages[0].trials if t.slug not in final.slugs[:1] and not t.stopped]
    rivals = sorted(rivals, key=lambda t: t.fit.objective)[: growth.effort * count]
    if rivals:
        growth.progress(f"screening second effects beside {', '.join(t.slug for t in rivals)}")

    most, refitter = final.objective, Refitter(program)
    if not final.slugs:
        most = min(most, log_likelihood(program, CANDIDATES.explained, 1.0))

    def look(rival: CandidateFit, fit: Fit, rng: np.random.Generator) -> _Ahead:
        stage = Step(fit, screened(program, fit, rng), [])
        gains = [s.gain for s in stage.screen.scores if {rival.slug, s.slug} != set(final.slugs)]
        gained = 0.5 * max(gains, default=0.0) * stage.screen.scale**2
        return _Ahead(rival, stage, refitter.promised(fit) - gained)

    def ahead(job: tuple[CandidateFit, np.random.Generator]) -> _Ahead:
        rival, rng = job
        found = look(rival, rival.fit, rng)
        if found.promised > CANDIDATES.hopeless_factor * most:  # by more than a fit to the end changes it
            return found
        fit = refitter.fit(rival.fit.slugs, rival.fit)  # most ended after a few steps
        return look(rival, fit, rng)

    found = run_parallel(ahead, list(zip(rivals, growth.rng.spawn(len(rivals)), strict=True)))
    found = [a for a in found if a.stage.screen.p_value <= SCORE_TEST.level and a.promised < most]
    return sorted(found, key=lambda a: a.promised)[: growth.effort * pairs]


def _with_its_second(growth: StepwiseSearch, explanation: Explanation) -> list[Fit]:
    """One effect that was found alone with its best second one, as rivals have it; none where two were found,
    or there is no second one."""
    program, final = explanation.program, explanation.final
    if len(final.slugs) != 1:
        return []
    last = explanation.stages[-1]
    if last.base.slugs != final.slugs:
        last = growth.stage(program, final)
        if last.screen.p_value <= SCORE_TEST.level:
            growth.fill(program, last)
    second = _second(last, ())
    return [] if second is None else [polished(program, second.fit)]


def _gained(explanation: Explanation, new: Fit, others: list[Fit]) -> list[float]:
    """Log evidence of an explanation over each of others, all deflated as its own is."""
    program, base = explanation.program, explanation.base
    inflation = inflation_of(program, new)
    mine = evidence(program, base, new, inflation)
    return [mine - evidence(program, base, old, inflation) for old in others]


def _worth_more(explanation: Explanation, new: Fit, others: list[Fit]) -> bool:
    """Whether an explanation has clearly more evidence than each of others."""
    return all(gained >= EVIDENCE.minimum_first for gained in _gained(explanation, new, others))


def _second(stage: Step, found: tuple[str, ...]) -> CandidateFit | None:
    """The trial of largest evidence, if that is certain and within physical bounds, and makes another model
    than was found."""
    fresh = [t for t in stage.trials if set(t.fit.slugs) != set(found)]
    return next((t for t in fresh if t.bayes > EVIDENCE.minimum_first and not t.stopped), None)


def _noticed(explanation: Explanation) -> bool:
    """Whether what was found leaves a signature, or more than noise of what was fitted, never fitted or left
    out in turn."""
    program, fit, last = explanation.program, explanation.final, explanation.stages[-1]
    if last.base.slugs == fit.slugs and last.screen.p_value <= SCORE_TEST.level:
        return True
    return _leaves_more(program, fit, explanation.left_out[1])


def _leaves_more(program: Program, fit: Fit, left_out: float) -> bool:
    """Whether a model leaves more than noise of recordings; `left_out` is what it leaves in turn."""
    left = [(predictive_chi_square(program, fit, mask), mask) for mask in (program.fitted, program.unseen)]
    left.append((left_out, program.fitted))
    return any(
        score > 1.0 + max(SEARCH.noise_excess, SEARCH.noise_deviations * spread(program, mask))
        for score, mask in left
    )


def _surpassing(explanation: Explanation, others: list[Fit], new: Fit) -> bool:
    """Whether an explanation is clearly better than each of others: it has more evidence, by more than it
    predicts those never fitted worse, and it predicts those left out in turn better.

    It must not owe that to a single fold, in which another one may have gone astray.
    """
    program = explanation.program
    inflation = inflation_of(program, new)
    surprised = negative_log_predictive_density(program, new, program.unseen)
    for old, gained in zip(others, _gained(explanation, new, others), strict=True):
        lost = max(surprised - negative_log_predictive_density(program, old, program.unseen), 0.0)
        if gained - lost / inflation < EVIDENCE.minimum_first:
            return False
    mine = explanation.scores(new)  # many fits: asked for last
    for old in others:
        gains = explanation.scores(old) - mine
        enough = log_likelihood(program, gains.sum(), inflation) >= ENTRY.minimum_gain
        if not enough or gains.sum() - gains.max() < 0.0:
            return False
    return True


def _drift_does(explanation: Explanation, others: list[Fit], new: Fit) -> bool:
    """Whether another explanation and drift of the instruments explain about as much as an explanation."""
    return any(
        gained - drift_evidence(explanation.program, old, new)
        < EVIDENCE.minimum_first  # that is never negative
        for old, gained in zip(others, _gained(explanation, new, others), strict=True)
    )
