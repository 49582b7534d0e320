"""Stepwise search: one effect after the other, until no further one may enter."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..evaluate.program import Program
from ..fit.base_fit import clearly_better
from ..fit.candidates import CandidateFit, candidate_fits, refitted_baseline
from ..fit.refit import Fit, Refitter
from ..fit.score_test import ScoreTest, score_effects
from ..settings import DEFAULT
from .backward_elimination import polished
from .choose import choice
from .leave_one_out_evidence import leave_each_out
from .steps import Explanation, Named, Step

SCORE_TEST = DEFAULT.score_test
CANDIDATES = DEFAULT.candidates
SEARCH = DEFAULT.search


@dataclass
class StepwiseSearch:
    """A stepwise search.

    Attributes:
        rng: of simulated nulls.
        progress: receives a line of text at every step.
        effort: 1; 2 follows twice as many candidates.
    """

    rng: np.random.Generator
    progress: Callable[[str], None]
    effort: int

    def run(self, explanation: Explanation, step: Step, again: bool = False) -> Fit | None:
        """Add effects until no further one may enter.

        Args:
            explanation: of the search; its effects are set here.
            step: with a score test.
            again: stop where candidates find a clearly better base fit.

        Returns:
            That base fit; None where there is none, or `again` is False.
        """
        program, named, base = explanation.program, Named(step.base), step.base
        while True:
            explanation.steps.append(step)
            if step.score_test.p_value > SCORE_TEST.level:
                break
            self.fill(program, step)
            if again and not step.base.slugs and clearly_better(program, base, step.base):
                return step.base
            best = self._step(explanation, step)
            if not step.base.slugs:
                explanation.base = step.base
            named.fit = step.base
            if best is None:
                break
            fit = polished(program, best.fit) if step.base.slugs else best.fit
            named = self.weigh_effects(explanation, fit, best.left_out, explanation.steps)
            if len(named.fit.slugs) >= SEARCH.maximum_effects or _been(explanation, named.fit):
                break
            step = self.step(program, named.fit)
        explanation.named = named
        return None

    def step(self, program: Program, current: Fit) -> Step:
        """A step with the scores of all effects that a model does not have."""
        self.progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        return Step(current, scored(program, current, self.rng), [])

    def fill(self, program: Program, step: Step, most: int = CANDIDATES.tried) -> None:
        """Fit the candidates of a step, and weigh them against the refitted baseline."""
        step.candidates = candidate_fits(
            program, step.base, step.score_test, self.progress, self.effort, most
        )
        step.base = refitted_baseline(program, step.base, step.candidates)

    def weigh_effects(self, explanation: Explanation, fit: Fit, left: float, steps: list[Step]) -> Named:
        """See `leave_each_out`."""
        program = explanation.program

        def fill(rest: Fit) -> Step:
            self.progress(f"trying what else there is beside {' and '.join(rest.slugs)}")
            step = self.step(program, rest)
            self.fill(program, step, CANDIDATES.tried_beside)
            return step

        return leave_each_out(program, fit, left, steps, fill, explanation.scores)

    def _step(self, explanation: Explanation, step: Step) -> CandidateFit | None:
        """The candidate of a step that may enter, if any."""
        program = explanation.program
        self.progress("predicting recordings left out in turn")
        best = choice(program, step.base, step, explanation.base, explanation.left_out[0], explanation.scores)
        step.chosen = best.slug if best else None
        return best


def _been(explanation: Explanation, current: Fit) -> bool:
    """Whether a search is back at an earlier model, because what entered made the rest redundant."""
    return any(set(step.base.slugs) == set(current.slugs) for step in explanation.steps)


def scored(program: Program, current: Fit, rng: np.random.Generator) -> ScoreTest:
    """Scores of the effects that a model does not have."""
    return score_effects(Refitter(program), current, program.unknowns.slugs, rng)
