"""Pair search: two effects, of which one is a rival of the first effect found, which may have stood for both.

Every rival is scored with the gain of a second effect beside it, to second order. Only the most promising
pairs are fitted. A pair replaces the explanation so far if it explains clearly more and predicts better. If
drift makes up for the difference, the pair is noted as contending. If no single effect was accepted, a pair
is accepted only if it also reduces the residual to the noise level.
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
from .stepwise import StepwiseSearch, scored

SCORE_TEST = DEFAULT.score_test
CANDIDATES = DEFAULT.candidates
EVIDENCE = DEFAULT.evidence
ENTRY = DEFAULT.entry
SEARCH = DEFAULT.search


@dataclass
class _Ahead:
    """A rival of the first effect, with the predicted gain of a second effect beside it.

    Attributes:
        rival: alone.
        step: of second effects, scored.
        promised: predicted objective with the best of them, to second order.
    """

    rival: CandidateFit
    step: Step
    promised: float


def pair_search(search: StepwiseSearch, explanation: Explanation) -> None:
    """Look for a pair where the explanation so far leaves more than noise.

    Args:
        search: its random stream, progress and effort.
        explanation: of the search so far; changed where a pair takes its place.
    """
    program = explanation.program
    if not explanation.steps[0].candidates or not _noticed(explanation):
        return
    incumbents, complete = [explanation.final], False
    for ahead in _foreseen(search, explanation):
        rival, step = ahead.rival, ahead.step
        search.progress(f"looking for a second effect beside {rival.slug}")
        search.fill(program, step, CANDIDATES.tried_beside)
        best = _second(step, explanation.final.slugs)
        if best is None or not _worth_more(explanation, best.fit, incumbents):
            continue
        if not complete:
            incumbents, complete = incumbents + _with_its_second(search, explanation), True
            if not _worth_more(explanation, best.fit, incumbents):
                continue
        found = eliminated(program, polished(program, best.fit))
        if len(found.slugs) < 2 or not _surpassing(explanation, incumbents, found):
            continue
        if _drift_does(explanation, incumbents, found):
            _contend(explanation, found)
        elif _took_over(search, explanation, ahead, incumbents, found):
            step.chosen, incumbents = best.slug, [explanation.final]


def _contend(explanation: Explanation, pair: Fit) -> None:
    """Note a pair that only drift keeps from replacing the explanation, once."""
    if explanation.final.slugs and all(set(pair.slugs) != set(other) for other in explanation.contending):
        explanation.contending.append(pair.slugs)


def _took_over(
    search: StepwiseSearch,
    explanation: Explanation,
    ahead: _Ahead,
    incumbents: list[Fit],
    pair: Fit,
) -> bool:
    """Whether a pair, or another one that its effects gave way to, replaced the explanation."""
    alone, scores = not explanation.final.slugs, explanation.scores
    first, *others = explanation.steps
    if alone:
        first.left_out = float(scores(explanation.final).sum())
        if not _believable(explanation, pair):
            return False
    left = scores.gained(explanation.base, pair)
    named = search.weigh_effects(explanation, pair, left, [first, ahead.step, *others])
    if set(named.fit.slugs) != set(pair.slugs):
        if len(named.fit.slugs) < 2 or not _surpassing(explanation, incumbents, named.fit):
            return False
        if alone and not _believable(explanation, named.fit):
            return False
    explanation.named, explanation.contending = named, []
    explanation.steps = [replace(first, chosen=ahead.rival.slug), ahead.step]
    return True


def _believable(explanation: Explanation, pair: Fit) -> bool:
    """Whether a pair may be named although no single effect was accepted.

    The base model must leave more than noise, and the pair must not. It must remove a part of the held-out
    misfit, with no effect at a bound.
    """
    program, base = explanation.program, explanation.final
    before, left = explanation.scores(base), explanation.scores(pair)
    if not _leaves_more(program, base, float(before.sum())):
        return False
    if any(at_its_bound(pair, slug) for slug in pair.slugs):
        return False
    return gain(before, left)[1] > 0.0 and not _leaves_more(program, pair, float(left.sum()))


def _foreseen(search: StepwiseSearch, explanation: Explanation) -> list[_Ahead]:
    """The rivals of the first effect with the best predicted pairs, if these beat the explanation so far."""
    program, final = explanation.program, explanation.final
    count = SEARCH.rivals_hidden if program.hidden else SEARCH.rivals
    pairs = SEARCH.pairs_hidden if program.hidden else SEARCH.pairs
    rivals = [
        t for t in explanation.steps[0].candidates if t.slug not in final.slugs[:1] and not t.at_a_bound
    ]
    rivals = sorted(rivals, key=lambda t: t.fit.objective)[: search.effort * count]
    if rivals:
        search.progress(f"screening second effects beside {', '.join(t.slug for t in rivals)}")

    most, refitter = final.objective, Refitter(program)
    if not final.slugs:
        most = min(most, log_likelihood(program, CANDIDATES.explained, 1.0))

    def look(rival: CandidateFit, fit: Fit, rng: np.random.Generator) -> _Ahead:
        step = Step(fit, scored(program, fit, rng), [])
        gains = [s.gain for s in step.score_test.scores if {rival.slug, s.slug} != set(final.slugs)]
        gained = 0.5 * max(gains, default=0.0) * step.score_test.scale**2
        return _Ahead(rival, step, refitter.promised(fit) - gained)

    def ahead(job: tuple[CandidateFit, np.random.Generator]) -> _Ahead:
        rival, rng = job
        found = look(rival, rival.fit, rng)
        if found.promised > CANDIDATES.hopeless_factor * most:  # by more than a fit to the end changes it
            return found
        fit = refitter.fit(rival.fit.slugs, rival.fit)  # most ended after a few steps
        return look(rival, fit, rng)

    found = run_parallel(ahead, list(zip(rivals, search.rng.spawn(len(rivals)), strict=True)))
    found = [a for a in found if a.step.score_test.p_value <= SCORE_TEST.level and a.promised < most]
    return sorted(found, key=lambda a: a.promised)[: search.effort * pairs]


def _with_its_second(search: StepwiseSearch, explanation: Explanation) -> list[Fit]:
    """The model of one effect with its best second effect, as rivals have it.

    Empty where two effects were found, or there is no second one.
    """
    program, final = explanation.program, explanation.final
    if len(final.slugs) != 1:
        return []
    last = explanation.steps[-1]
    if last.base.slugs != final.slugs:
        last = search.step(program, final)
        if last.score_test.p_value <= SCORE_TEST.level:
            search.fill(program, last)
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


def _second(step: Step, found: tuple[str, ...]) -> CandidateFit | None:
    """The candidate of most evidence that makes a new model, if it is certain and within bounds."""
    fresh = [t for t in step.candidates if set(t.fit.slugs) != set(found)]
    return next((t for t in fresh if t.bayes > EVIDENCE.minimum_first and not t.at_a_bound), None)


def _noticed(explanation: Explanation) -> bool:
    """Whether the explanation so far leaves a significant score, or more than noise."""
    program, fit, last = explanation.program, explanation.final, explanation.steps[-1]
    if last.base.slugs == fit.slugs and last.score_test.p_value <= SCORE_TEST.level:
        return True
    return _leaves_more(program, fit, explanation.left_out[1])


def _leaves_more(program: Program, fit: Fit, left_out: float) -> bool:
    """Whether a model leaves more than noise; `left_out` is its cross-validated reduced chi-square."""
    left = [(predictive_chi_square(program, fit, mask), mask) for mask in (program.fitted, program.unseen)]
    left.append((left_out, program.fitted))
    return any(
        score > 1.0 + max(SEARCH.noise_excess, SEARCH.noise_deviations * spread(program, mask))
        for score, mask in left
    )


def _surpassing(explanation: Explanation, others: list[Fit], new: Fit) -> bool:
    """Whether an explanation is clearly better than each of others.

    Its evidence must exceed theirs by more than it loses on validation recordings, and it must predict
    recordings left out in turn better. It must not owe that to a single fold, in which another one
    extrapolates badly.
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
    """Whether drift and another explanation explain about as much as an explanation."""
    return any(
        gained - drift_evidence(explanation.program, old, new)
        < EVIDENCE.minimum_first  # that is never negative
        for old, gained in zip(others, _gained(explanation, new, others), strict=True)
    )
