"""One search over sets of effects: a beam of the best sets is fitted together and extended.

Single effects are fitted first. Pairs then come from two sources. The Gram matrix about the base model,
refitted and nominal, scores every pair at once, whatever its members look like alone. And each of the best
single effects is linearised anew where it ended, with every other effect beside it. The best sets are fitted
together by successive halving, and so on for triples, as long as evidence grows and more than noise is left.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import zip_longest

import numpy as np

from fitting.inference.parallel import run_parallel
from pneusma_jax.errors import counted

from ..evaluate.program import Program
from ..fit.base_fit import clearly_better
from ..fit.candidates import (
    CandidateFit,
    Proposal,
    candidate_fits,
    fitted_sets,
    from_elsewhere,
    refitted_baseline,
    starts_of,
    weigh,
)
from ..fit.instrument_drift import instrument_parts
from ..fit.refit import Fit, Refitter, largest_deviation
from ..fit.score_test import ScoreTest, score_effects
from ..fit.sensitivities import sensitivities_about
from ..fit.set_scores import SetScore, best_sets, pairs_p_value
from ..settings import DEFAULT
from .decision import FORM, INSTRUMENTS, OF_ALL, Judge, leaves_more
from .pool import Pool
from .steps import Explanation, LeaveOneOutEvidence, Named, Step

CANDIDATES = DEFAULT.candidates
CHANCE = DEFAULT.chance
EVIDENCE = DEFAULT.evidence
OPTIMISER = DEFAULT.optimiser
SEARCH = DEFAULT.search
SHARE = DEFAULT.share


@dataclass
class SetSearch:
    """A search over sets of effects.

    Attributes:
        rng: random numbers of the simulated nulls.
        progress: receives a line of text at every step.
        effort: 1; 2 follows twice as many candidates.
    """

    rng: np.random.Generator
    progress: Callable[[str], None]
    effort: int
    _beside: dict[frozenset, Step] = field(default_factory=dict)

    def run(self, explanation: Explanation, step: Step, again: bool = False) -> Fit | None:
        """Find the set of effects that explains a campaign.

        Args:
            explanation: result of the search; its effects are set here.
            step: step with the score test of the base model.
            again: stop where candidates find a clearly better base fit.

        Returns:
            That base fit; None where there is none, or `again` is False.
        """
        program, base = explanation.program, step.base
        explanation.steps.append(step)
        if step.score_test.p_value > CHANCE.level:
            return None
        self.fill(program, step)
        if again and clearly_better(program, base, step.base):
            return step.base
        explanation.base, explanation.named = step.base, Named(step.base)
        self._beside = {frozenset(): step}
        pool = Pool(program, step.base)
        pool.add(candidate.fit for candidate in step.candidates)
        self._grow(program, pool)
        self._settle(explanation, pool)
        explanation.nearest = pool.nearest
        return None

    def step(self, program: Program, current: Fit, rng: np.random.Generator | None = None) -> Step:
        """A step with the scores of all effects that a model does not have."""
        self.progress(f"screening {counted(len(program.unknowns.slugs) - len(current.slugs), 'effect')}")
        return Step(current, scored(program, current, rng or self.rng), [])

    def fill(
        self, program: Program, step: Step, most: int = CANDIDATES.tried, known: Iterable[Fit] = ()
    ) -> None:
        """Fit the candidates of a step, and weigh them against the refitted baseline.

        Args:
            program: program of the campaign.
            step: scored step; its candidates and base are set here.
            most: number of candidates at effort 1.
            known: fits of sets that were fitted before.
        """
        step.candidates = candidate_fits(
            program, step.base, step.score_test, self.progress, self.effort, most, known
        )
        step.base = refitted_baseline(program, step.base, step.candidates)

    def _grow(self, program: Program, pool: Pool) -> None:
        """Add pairs, then triples, while evidence grows and more than noise is left.

        Where the best single effect leaves noise, it is only fitted together with its rivals.
        """
        for size in range(2, SEARCH.maximum_effects + 1):
            leader = next((fit for fit, _ in pool.ranked()), pool.base)
            if self._goes_on(program, leader):
                proposals = self._proposals(program, pool, size)
            else:
                proposals = _rival_pairs(program, pool) if size == 2 else []
            if not proposals:
                return
            self.progress(f"fitting {counted(len(proposals), 'set')} of {size} effects")
            pool.add(fitted_sets(program, proposals, pool.base, self.progress, self.effort))
            ranked = pool.ranked()  # anew: what better fits leave deflates the evidence of all sets less
            worth = {frozenset(): 0.0} | {frozenset(fit.slugs): evidence for fit, evidence in ranked}
            if ranked[0][1] - worth[frozenset(leader.slugs)] < EVIDENCE.minimum_difference:
                return
            pool.add([polished(program, ranked[0][0])])

    def _goes_on(self, program: Program, fit: Fit) -> bool:
        """True if a set leaves a significant score, or more than noise."""
        return (
            leaves_more(program, fit)
            or self._scores_beside(program, fit).score_test.p_value <= CHANCE.level
        )

    def _scores_beside(self, program: Program, fit: Fit, rng: np.random.Generator | None = None) -> Step:
        """The step of scores beside a set, made once for every fit."""
        known = self._beside.get(frozenset(fit.slugs))
        if known is None or (known.base is not fit and not known.candidates):
            known = self._beside[frozenset(fit.slugs)] = self.step(program, fit, rng)
        return known

    def _proposals(self, program: Program, pool: Pool, size: int) -> list[Proposal]:
        """Sets of a size that promise most: from Gram matrices about the base, and beside the sets before."""
        refitter, most = Refitter(program), self.effort * SEARCH.beam
        parents = pool.of_size(size - 1)[: most // size]
        self.progress(f"screening every set of {size} effects")
        jobs = zip(parents, self.rng.spawn(len(parents)), strict=True)
        extended = run_parallel(lambda job: self._extended(program, refitter, *job), jobs)
        lists = [sorted((p for found in extended for p in found), key=lambda p: p[0])]
        points = (False, True) if size == 2 else (False,)
        lists += [self._from_gram(program, refitter, pool.base, at, size, most) for at in points]
        chosen: dict[frozenset, Proposal] = {}
        known = {frozenset(fit.slugs) for fit in pool.of_size(size)}
        for row in zip_longest(*lists):
            for one in row:
                if one is not None and frozenset(one[1].slugs) not in known:
                    chosen.setdefault(frozenset(one[1].slugs), one[1])
        return list(chosen.values())[: 2 * most // size]

    def _extended(
        self, program: Program, refitter: Refitter, fit: Fit, rng: np.random.Generator
    ) -> list[tuple[float, Proposal]]:
        """Sets of one more effect than a fitted one, with the objective that each promises."""
        found = self._scores_beside(program, fit, rng).score_test
        after = refitter.promised(fit)
        return [
            (
                after - 0.5 * s.gain * found.scale**2,
                Proposal(
                    (*fit.slugs, s.slug), starts_of(program.unknowns, (s.slug,), s.start), fit.evaluation
                ),
            )
            for s in found.scores[: SEARCH.beam]
            if s.p_value < CHANCE.level
        ]

    def _from_gram(
        self, program: Program, refitter: Refitter, base: Fit, nominal: bool, size: int, most: int
    ) -> list[tuple[float, Proposal]]:
        """Sets of a size that the Gram matrix about the base model promises most of."""
        unknowns = program.unknowns
        at = replace(base, u=unknowns.at_nominal(base.u)) if nominal else base
        look = self._beside[frozenset()].score_test.look
        if look is None or np.any(look.here.u != at.u):
            look = sensitivities_about(refitter, at, unknowns.slugs)
        found: list[SetScore] = best_sets(look, program, unknowns.neutral, most)
        return [
            (s.promised, Proposal(s.slugs, starts_of(unknowns, s.slugs, s.start), base.evaluation))
            for s in found
            if len(s.slugs) == size
        ]

    def _settle(self, explanation: Explanation, pool: Pool) -> None:
        """Decide, weigh every effect against its rivals, and decide again if these bring a better set."""
        program = explanation.program
        judge, seen = Judge(pool, explanation.scores), set()
        self.progress("predicting recordings left out in turn")
        while True:
            decision = judge.decide()
            chosen = frozenset(decision.fit.slugs)
            if chosen in seen:
                break
            seen.add(chosen)
            self._rivals(program, pool, decision.fit)
        fit = pool.get(chosen)
        explanation.base = pool.base
        explanation.steps[0].base = pool.base
        self._note(explanation, pool, judge, fit)
        drifting = [slugs for slugs, why in decision.refused if why == INSTRUMENTS]
        beside = [slugs for slugs in drifting if len(slugs) > 1 and not set(slugs) <= set(fit.slugs)]
        explanation.contending = beside if fit.slugs else drifting[:1]
        further = [
            (slug, why)
            for slugs, why in decision.refused
            if set(fit.slugs) < set(slugs)
            for slug in slugs
            if slug not in fit.slugs
        ]
        explanation.beyond_form = [slug for slug, why in further if why == FORM]
        explanation.of_all = [slug for slug, why in further if why == OF_ALL]
        explanation.named = self._weighed(explanation, pool, fit)
        explanation.weigh_effects = partial(self._weighed_again, self._beside)
        explanation.steps[0].chosen = next(iter(explanation.named.fit.slugs), None)

    def _note(self, explanation: Explanation, pool: Pool, judge: Judge, fit: Fit) -> None:
        """Keep with the candidates of the first step what decided about them."""
        first, scores = explanation.steps[0], explanation.scores
        if fit.slugs or scores.known(pool.base):  # a pair may be named without a question that needs it
            first.left_out = float(scores(pool.base).sum())
        for candidate in first.candidates:
            candidate.explained_by_instruments = judge.explained.get(candidate.slug, 0.0)
            if scores.known(candidate.fit):
                candidate.left_out = scores.gained(pool.base, candidate.fit)

    def _rivals(self, program: Program, pool: Pool, fit: Fit) -> None:
        """Fit rivals of every effect of a set, beside the others."""
        refitter = Refitter(program)
        for slug in fit.slugs if len(fit.slugs) > 1 else ():
            rest = pool.without(fit, slug)
            step = self._beside.get(frozenset(rest.slugs))
            if step is None or not step.candidates:
                self.progress(f"trying what else there is beside {' and '.join(rest.slugs)}")
                step = self._scores_beside(program, rest)
                step.base = rest
                known = [one for one in pool.of_size(len(fit.slugs)) if refitter.ended(one)]
                self.fill(program, step, CANDIDATES.second_count, known)
                pool.add([step.base, *(candidate.fit for candidate in step.candidates)])

    def _weighed(self, explanation: Explanation, pool: Pool, fit: Fit) -> Named:
        """A model with the evidence of each of its effects against its rivals, the strongest effect first."""
        program, scores = explanation.program, explanation.scores
        left = scores.gained(pool.base, fit) if fit.slugs else explanation.steps[0].left_out
        worth = {slug: pool.without(fit, slug).objective for slug in fit.slugs}
        order = tuple(sorted(fit.slugs, key=lambda slug: -worth[slug]))
        named = Named(replace(fit, slugs=order), left)
        for slug in order:
            rest = pool.without(fit, slug)
            sets = [f for f in pool.of_size(len(fit.slugs)) if set(rest.slugs) < set(f.slugs)]
            rivals = [CandidateFit(next(iter(set(f.slugs) - set(rest.slugs))), f, 0.0, np.nan) for f in sets]
            one = LeaveOneOutEvidence(slug, rest, rivals)
            for rival in rivals:
                rival.largest_deviation_sd = largest_deviation(program.unknowns, rival.fit)
            weigh(program, rest, rivals)
            drifting, one.own.explained_by_inputs = instrument_parts(program, rest, one.own.fit)
            one.own.explained_by_instruments = drifting + one.own.explained_by_inputs
            one.own.left_out = left
            named.leave_one_out[slug] = one
        return named

    def _weighed_again(self, beside: dict[frozenset, Step], explanation: Explanation, fit: Fit) -> Named:
        """Leave-one-effect-out evidence of another model of the recordings that a search was about."""
        self._beside = beside
        pool = Pool(explanation.program, explanation.base)
        pool.add([fit, *(c.fit for step in beside.values() for c in step.candidates)])
        self._rivals(explanation.program, pool, fit)
        return self._weighed(explanation, pool, pool.get(fit.slugs))


def _rival_pairs(program: Program, pool: Pool) -> list[Proposal]:
    """The best single effect with each rival that alone has most of its evidence, begun where both ended.

    Of two such effects that act together, one alone may explain all but noise. It has taken up what the other
    one does, often up to its bounds, so that no score beside it stands out.
    """
    ranked = [(fit, worth) for fit, worth in pool.ranked() if len(fit.slugs) == 1]
    if not ranked or ranked[0][1] < EVIDENCE.minimum_first:
        return []
    (leader, most), unknowns, found = ranked[0], program.unknowns, []
    for rival, worth in ranked[1 : 1 + SEARCH.beam // 2]:
        if worth >= SHARE.most * most:
            at, own = leader.u.copy(), unknowns.of(rival.slugs)
            at[own] = rival.u[own]
            starts = starts_of(unknowns, rival.slugs, at)
            found.append(Proposal((*leader.slugs, *rival.slugs), starts, leader.evaluation))
    return found


def polished(program: Program, fit: Fit) -> Fit:
    """A set fitted once more, from its own numbers and from nominal base constants."""
    again = Refitter(program).fit(fit.slugs, fit, OPTIMISER.maximum_steps)
    best = min(fit, again, key=lambda one: one.objective)
    return from_elsewhere(program, best, program.unknowns.at_nominal(fit.u))


def scored(program: Program, current: Fit, rng: np.random.Generator) -> ScoreTest:
    """Scores of the effects that a model does not have."""
    return score_effects(Refitter(program), current, program.unknowns.slugs, rng)


def base_scored(program: Program, base: Fit, rng: np.random.Generator) -> ScoreTest:
    """Scores of all effects about the base model; where none stands out, pairs have a second look."""
    found = scored(program, base, rng)
    if found.p_value <= CHANCE.level:
        return found
    together = 2.0 * pairs_p_value(found.look, program.unknowns, rng)
    return replace(found, p_value=min(found.p_value, together))
