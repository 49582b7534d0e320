"""One effect after the other, until no further one may enter."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .choose import choice
from .program import Program
from .pruning import polished, pruned, without
from .refit import Fit, Refitter
from .screen import Screen, screen
from .stages import Explanation, Stage
from .trials import TRIED, Trial, fair, trials_of, weigh

MOST_EFFECTS = 3
RIVALS = 5
"""Rivals of an effect that are fitted in its place once another one is there."""
LEVEL = 0.01
"""P-value below which something is missing."""


@dataclass
class Growth:
    """How effects are looked for.

    Attributes:
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many candidates.
    """

    rng: np.random.Generator
    progress: Callable[[str], None]
    effort: int

    def grown(self, explanation: Explanation, stage: Stage) -> list[Trial]:
        """Add effects until no further one may enter; the trials of the first stage, as they were there."""
        program, current, original, tried = explanation.program, stage.base, np.nan, []
        while True:
            explanation.stages.append(stage)
            if stage.screen.p_value > LEVEL:
                break
            best = self._step(explanation, stage, original)
            current = stage.base
            if not current.slugs:
                explanation.base, tried = current, list(stage.trials)
            original = stage.left_out if np.isnan(original) else original
            if best is None:
                break
            current = self.exchanged(program, self.settled(program, best), explanation.stages)
            if len(current.slugs) >= MOST_EFFECTS or _been(explanation, current):
                break
            stage = self.stage(program, current)
        explanation.final = current
        return tried

    def stage(self, program: Program, current: Fit) -> Stage:
        """A screen of the effects that a model does not have."""
        self.progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        return Stage(current, screened(program, current, self.rng), [])

    def fill(self, program: Program, stage: Stage, most: int = TRIED) -> None:
        """Fit the candidates of a screened stage, and weigh them against a fair model without them."""
        stage.trials = trials_of(program, stage.base, stage.screen, self.progress, self.effort, most)
        stage.base = fair(program, stage.base, stage.trials)

    def _step(self, explanation: Explanation, stage: Stage, original: float) -> Trial | None:
        """The effect of a screened stage that may enter, if one may; the stage gets its trials."""
        program = explanation.program
        self.fill(program, stage)
        self.progress("predicting recordings left out in turn")
        best = choice(program, stage.base, stage, explanation.base, original)
        stage.chosen = best.slug if best else None
        return best

    def settled(self, program: Program, best: Trial) -> Fit:
        """The model with an effect that entered, and without those that it makes idle."""
        current = best.fit
        return pruned(program, polished(program, current)) if len(current.slugs) > 1 else current

    def exchanged(self, program: Program, current: Fit, stages: list[Stage]) -> Fit:
        """The model with its earlier effects looked for again beside those that came later."""
        for slug in current.slugs[:-1]:
            self.progress(f"trying rivals of {slug} beside what was found later")
            current = self._exchanged(program, current, next(s for s in stages if s.chosen == slug))
        return pruned(program, current)

    def _exchanged(self, program: Program, current: Fit, stage: Stage) -> Fit:
        """The model with an earlier effect, that of a stage, exchanged for one of more evidence beside the
        others: alone, it may have stood for two.

        The stage is told anew: what its effect and rivals, some of which alone explain nothing, are worth
        beside the others. What enters inherits the score on recordings left out.
        """
        slug, left_out = stage.chosen, stage.entered.left_out
        again = self.stage(program, without(program, current, slug))
        self.fill(program, again, RIVALS)
        own = next((t for t in again.trials if t.slug == slug), None)
        if own is None:
            own = replace(stage.entered, fit=current)
            again.trials.append(own)
        own.fit = min(own.fit, current, key=lambda fit: fit.objective)
        weigh(program, again.base, again.trials)
        best = next(t for t in again.trials if t is own or not t.stopped)
        best.left_out = left_out
        stage.beside, stage.trials, stage.chosen = again.base, again.trials, best.slug
        slugs = tuple(best.slug if s == slug else s for s in current.slugs)  # as they entered
        best.fit = replace(best.fit, slugs=slugs)
        return best.fit


def _been(explanation: Explanation, current: Fit) -> bool:
    """Whether a search is back at a model that it came from: what entered had made the rest idle."""
    return any(set(stage.base.slugs) == set(current.slugs) for stage in explanation.stages)


def screened(program: Program, current: Fit, rng: np.random.Generator) -> Screen:
    """Scores of the effects that a model does not have."""
    return screen(Refitter(program), current, program.unknowns.slugs, rng)
