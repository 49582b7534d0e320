"""One effect after the other, until no further one may enter."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..evaluate.program import Program
from ..fit.base_fit import clearly_better
from ..fit.candidates import CandidateFit, candidate_fits, refitted_baseline
from ..fit.refit import Fit, Refitter
from ..fit.score_test import Screen, score_effects
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
    """How effects are looked for.

    Attributes:
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many candidates.
    """

    rng: np.random.Generator
    progress: Callable[[str], None]
    effort: int

    def grown(self, explanation: Explanation, stage: Step, again: bool = False) -> Fit | None:
        """Add effects until no further one may enter.

        Args:
            explanation: of the search; told what was found.
            stage: screened.
            again: stop where candidates come upon a clearly better fit of the base model.

        Returns:
            That fit; None where there is none, or it was not asked for.
        """
        program, named, base = explanation.program, Named(stage.base), stage.base
        while True:
            explanation.stages.append(stage)
            if stage.screen.p_value > SCORE_TEST.level:
                break
            self.fill(program, stage)
            if again and not stage.base.slugs and clearly_better(program, base, stage.base):
                return stage.base
            best = self._step(explanation, stage)
            if not stage.base.slugs:
                explanation.base = stage.base
            named.fit = stage.base
            if best is None:
                break
            fit = polished(program, best.fit) if stage.base.slugs else best.fit
            named = self.stood(explanation, fit, best.left_out, explanation.stages)
            if len(named.fit.slugs) >= SEARCH.maximum_effects or _been(explanation, named.fit):
                break
            stage = self.stage(program, named.fit)
        explanation.named = named
        return None

    def stage(self, program: Program, current: Fit) -> Step:
        """A screen of the effects that a model does not have."""
        self.progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        return Step(current, screened(program, current, self.rng), [])

    def fill(self, program: Program, stage: Step, most: int = CANDIDATES.tried) -> None:
        """Fit the candidates of a screened stage, and weigh them against a fair model without them."""
        stage.trials = candidate_fits(program, stage.base, stage.screen, self.progress, self.effort, most)
        stage.base = refitted_baseline(program, stage.base, stage.trials)

    def stood(self, explanation: Explanation, fit: Fit, left: float, stages: list[Step]) -> Named:
        """See `standings.stood`."""
        program = explanation.program

        def fill(rest: Fit) -> Step:
            self.progress(f"trying what else there is beside {' and '.join(rest.slugs)}")
            stage = self.stage(program, rest)
            self.fill(program, stage, CANDIDATES.tried_beside)
            return stage

        return leave_each_out(program, fit, left, stages, fill, explanation.scores)

    def _step(self, explanation: Explanation, stage: Step) -> CandidateFit | None:
        """The effect of a stage with trials that may enter, if one may."""
        program = explanation.program
        self.progress("predicting recordings left out in turn")
        best = choice(
            program, stage.base, stage, explanation.base, explanation.left_out[0], explanation.scores
        )
        stage.chosen = best.slug if best else None
        return best


def _been(explanation: Explanation, current: Fit) -> bool:
    """Whether a search is back at a model that it came from: what entered had made the rest idle."""
    return any(set(stage.base.slugs) == set(current.slugs) for stage in explanation.stages)


def screened(program: Program, current: Fit, rng: np.random.Generator) -> Screen:
    """Scores of the effects that a model does not have."""
    return score_effects(Refitter(program), current, program.unknowns.slugs, rng)
