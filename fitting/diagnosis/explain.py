"""Which effects explain a campaign: one effect after the other, and what none explains.

Recordings of role `validation` let no effect in: it must help fitted recordings that are left out in turn.
They keep one out that predicts them worse. Only where the fitted ones name nothing, or something that leaves
most of the misfit of those for validation, all are fitted, and every score is of recordings left out in turn.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .choose import BEHIND, CERTAIN, CLOSE, PREDICTS, choice, much_left
from .exchange import exchanged, polished, pruned, retold
from .folds import left_out
from .program import Program
from .refit import Fit, Refitter
from .screen import Screen, screen
from .stages import Explanation, Stage
from .trials import (
    Trial,
    fair,
    floor,
    foretold,
    inflation_of,
    reduced,
    settled_fit,
    spread,
    surprise,
    trials_of,
)

MOST_EFFECTS = 3
DETOURS = 1, 2
"""Rivals of the first effect from which a second one is looked for, too, where what was found leaves more
than noise: alone, an effect may have stood for two; with hidden courses, whose fits are slow, and without."""
NOISE = 0.05, 2.0
"""Excess of a reduced chi-square over 1 up to which it is noise: this much, and as many of its standard
deviations."""
LEVEL = 0.01
"""P-value below which something is missing."""
SECOND_LOOK = 0.005
"""The same where the fitted recordings agreed and all are looked at together."""
KEPT = 0.5
"""Share of the misfit of validation recordings from which they contradict an explanation."""


def explain(
    program: Program,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda _: None,
    effort: int = 1,
) -> Explanation:
    """Search for up to three effects.

    Args:
        program: of the campaign.
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many candidates.
    """
    search = _Search(rng, progress, effort)
    progress("refitting the base model within its tolerances")
    started, base = settled_fit(program)
    progress(f"screening {len(program.unknowns.slugs)} effects")
    found = screen(Refitter(started), base, program.unknowns.slugs, rng)
    untried = not program.fitted.all()  # recordings for validation have not been fitted
    if untried and found.p_value > LEVEL:
        explanation = _together(started, base, SECOND_LOOK, search)
        if explanation is not None:
            return explanation
        untried = False
    explanation = search.whole(started, base, found)
    if untried and _contradicted(explanation):
        again = _together(started, base, LEVEL, search)
        if again is not None and _score(again, ~program.fitted) < _score(explanation, ~program.fitted):
            return again
    return explanation


def _together(program: Program, base: Fit, level: float, search: "_Search") -> Explanation | None:
    """A search on all recordings, those for validation too; None where it finds nothing."""
    search.progress("looking at the recordings for validation as well")
    whole, fit = settled_fit(replace(program, fitted=np.ones_like(program.fitted)), base.u)
    found = screen(Refitter(whole), fit, program.unknowns.slugs, search.rng)
    if found.p_value > level:
        return None
    explanation = search.whole(whole, fit, found)
    explanation.together = True
    return explanation if explanation.final.slugs else None


def _score(explanation: Explanation, chosen: np.ndarray) -> float:
    return reduced(explanation.program, explanation.final, chosen)


def _contradicted(explanation: Explanation) -> bool:
    """Whether recordings for validation keep most of a misfit that is more than chance."""
    program, fit = explanation.program, explanation.final
    noise = floor(program, fit, program.unseen)
    before = reduced(program, explanation.base, program.unseen) - noise
    after = reduced(program, fit, program.unseen) - noise
    certain = 0.5 * program.observations(program.unseen) * after > CERTAIN
    return certain and after > KEPT * before


@dataclass
class _Search:
    """How effects are looked for.

    Attributes:
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many candidates.
    """

    rng: np.random.Generator
    progress: Callable[[str], None]
    effort: int

    def whole(self, program: Program, base: Fit, found: Screen) -> Explanation:
        """One effect after the other, from a screened base model; then from rivals of the first one."""
        explanation = Explanation(program, base, base, [], found.p_value, found.p_is_bound)
        tried = self._grown(explanation, Stage(base, found, []))
        self._detoured(explanation, tried)
        return explanation

    def _grown(self, explanation: Explanation, stage: Stage) -> list[Trial]:
        """Add effects until no further one may enter; the trials of the first stage, as they were there."""
        program, current, original, tried = explanation.program, stage.base, np.nan, []
        while True:
            explanation.stages.append(stage)
            if stage.screen.p_value > LEVEL:
                break
            best = self._step(program, stage, original)
            current = stage.base
            if not current.slugs:
                explanation.base, tried = current, list(stage.trials)
            original = stage.left_out if np.isnan(original) else original
            if best is None:
                break
            current = self._settled(program, stage, best, explanation.stages)
            if len(current.slugs) >= MOST_EFFECTS or not much_left(program, current, explanation.base):
                break
            stage = self._stage(program, current)
        explanation.final = current
        return tried

    def _stage(self, program: Program, current: Fit) -> Stage:
        """A screen of the effects that a model does not have."""
        self.progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        return Stage(current, screen(Refitter(program), current, program.unknowns.slugs, self.rng), [])

    def _try(self, program: Program, stage: Stage) -> None:
        """Fit the candidates of a screened stage, and weigh them against a fair model without them."""
        stage.trials = trials_of(program, stage.base, stage.screen, self.progress, self.effort)
        stage.base = fair(program, stage.base, stage.trials)

    def _step(self, program: Program, stage: Stage, original: float) -> Trial | None:
        """The effect of a screened stage that may enter, if one may; the stage gets its trials."""
        self._try(program, stage)
        self.progress("predicting recordings left out in turn")
        best = choice(program, stage.base, stage, original)
        stage.chosen = best.slug if best else None
        return best

    def _settled(self, program: Program, stage: Stage, best: Trial, stages: list[Stage]) -> Fit:
        """The model with an effect that entered, and without those that it makes idle."""
        current = best.fit
        if len(current.slugs) > 1:
            current = pruned(program, polished(program, current))
            self.progress("trying rivals of what was found before")
            current = pruned(program, exchanged(program, current, stages))
        return current

    def _detoured(self, explanation: Explanation, tried: list[Trial]) -> None:
        """Where what was found leaves more than noise: two effects of which the first is a rival of the first
        one found, if they explain clearly more and predict better.

        Args:
            explanation: of the search so far.
            tried: trials of its first stage, best first, each alone.
        """
        program, final = explanation.program, explanation.final
        if not final.slugs or not _noticed(program, final):
            return
        behind = max(CLOSE, BEHIND[0] * tried[0].bayes)
        first = explanation.stages[0]
        rivals = [t for t in tried if t.slug not in final.slugs and tried[0].bayes - t.bayes < behind]
        rivals = [t for t in rivals if t.bayes > CERTAIN and not t.stopped]
        rivals = rivals[: self.effort * DETOURS[not program.hidden]]
        incumbents = [(_worth(explanation), final)]
        for rival in rivals:
            self.progress(f"looking for a second effect beside {rival.slug}")
            stage = self._seconded(program, rival.fit)
            best = _second(stage)
            if best is None or rival.bayes + best.bayes < incumbents[0][0] + CERTAIN:
                continue
            if len(incumbents) == 1:
                incumbents += self._with_its_second(explanation)
            if rival.bayes + best.bayes < max(worth for worth, _ in incumbents) + CERTAIN:
                continue
            stage.chosen, stage.left_out = best.slug, first.left_out
            begun = replace(first, trials=[replace(t) for t in tried], chosen=rival.slug)
            found = self._settled(program, stage, best, [begun, stage])
            left = _surpassing(program, [fit for _, fit in incumbents], found)
            if left is not None and len(found.slugs) > 1:
                begun.entered.left_out = stage.entered.left_out = left
                retold(program, found, begun)
                explanation.stages, explanation.final = [begun, stage], found
                incumbents = [(rival.bayes + best.bayes, found)]

    def _seconded(self, program: Program, fit: Fit) -> Stage:
        """A further stage and its trials, whatever may enter."""
        stage = self._stage(program, fit)
        if stage.screen.p_value <= LEVEL:
            self._try(program, stage)
        return stage

    def _with_its_second(self, explanation: Explanation) -> list[tuple[float, Fit]]:
        """One effect that was found alone with its best second one, as rivals have it: log Bayes factor and
        fit; none where two were found, or there is no second one."""
        program, final = explanation.program, explanation.final
        if len(final.slugs) > 1:
            return []
        last = explanation.stages[-1]
        second = _second(last if last.base.slugs == final.slugs else self._seconded(program, final))
        if second is None:
            return []
        return [(_worth(explanation) + second.bayes, polished(program, second.fit))]


def _worth(explanation: Explanation) -> float:
    """Log Bayes factor of what was found."""
    return sum(s.entered.bayes for s in explanation.stages if s.chosen in explanation.final.slugs)


def _second(stage: Stage) -> Trial | None:
    """The trial of largest evidence, if that is certain and within physical bounds."""
    return next((t for t in stage.trials if t.bayes > CERTAIN and not t.stopped), None)


def _noticed(program: Program, fit: Fit) -> bool:
    """Whether a model leaves more than noise of what was fitted or of what was not."""
    return any(
        foretold(program, fit, mask) > 1.0 + max(NOISE[0], NOISE[1] * spread(program, mask))
        for mask in (program.fitted, program.unseen)
    )


def _surpassing(program: Program, others: list[Fit], new: Fit) -> float | None:
    """Reduced chi-square of recordings left out in turn by an explanation, if it is clearly better than each
    of others: it fits better, predicts those recordings better, and those never fitted not worse.

    It must not owe that to a single fold, in which another one may have gone astray.
    """
    inflation, count = inflation_of(program, new), program.observations(program.fitted)
    if any((old.objective - new.objective) / inflation < CERTAIN for old in others):
        return None
    surprised = surprise(program, new, program.unseen)
    if any(surprised > surprise(program, old, program.unseen) for old in others):
        return None
    mine = left_out(program, new)  # many fits: asked for last
    for old in others:
        gains = left_out(program, old) - mine
        if 0.5 * count * gains.sum() / inflation < PREDICTS or gains.sum() - gains.max() < 0.0:
            return None
    return float(mine.sum())
