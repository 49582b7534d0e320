"""One effect after the other, until no further one may enter."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .choose import choice, much_left
from .exchange import exchanged, polished, pruned
from .program import Program
from .refit import Fit, Refitter
from .screen import Screen, screen
from .stages import Explanation, Stage
from .trials import TRIED, Trial, fair, trials_of

MOST_EFFECTS = 3
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
            current = self.settled(program, best, explanation.stages)
            if len(current.slugs) >= MOST_EFFECTS or not much_left(program, current, explanation.base):
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

    def settled(self, program: Program, best: Trial, stages: list[Stage]) -> Fit:
        """The model with an effect that entered, and without those that it makes idle."""
        current = best.fit
        if len(current.slugs) > 1:
            current = pruned(program, polished(program, current))
            self.progress("trying rivals of what was found before")
            current = pruned(program, exchanged(program, current, stages))
        return current


def screened(program: Program, current: Fit, rng: np.random.Generator) -> Screen:
    """Scores of the effects that a model does not have."""
    return screen(Refitter(program), current, program.unknowns.slugs, rng)
