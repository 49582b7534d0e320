"""Which effects explain a campaign: one effect after the other, and what none explains.

Recordings of role `validation` let no effect in: it must help fitted recordings that are left out in turn.
They keep one out that predicts them worse. Only where the fitted ones name nothing, or something that leaves
most of the misfit of those for validation, all are fitted, and every score is of recordings left out in turn.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .drift import explained_by_drift
from .folds import gain, left_out
from .program import Program
from .refit import Fit, Refitter
from .screen import Screen, screen
from .side_by_side import FITS, side_by_side
from .trials import Trial, fair, floor, inflation_of, reduced, settled_fit, surprise, trials_of

MOST_EFFECTS = 3
POLISHING = 40
"""Most trial steps of a model that was chosen."""
RIVALS = 3
"""Rivals of an effect that are tried in its place once another one is there."""
LEVEL = 0.01
"""P-value below which something is missing."""
SECOND_LOOK = 0.005
"""The same where the fitted recordings agreed and all are looked at together."""
CERTAIN = 8.0
"""Log Bayes factor from which an effect enters the model; the number of candidates is already counted."""
FIRST_SHARE = 0.1
"""Of the misfit of recordings left out in turn, what the first effect must take away."""
SHARE = 0.45
"""The same for a further effect: the imperfect form of a true effect leaves a remainder that something else
fits."""
OF_ALL = 0.025
"""Of the base model's own misfit, what a further effect must take away."""
PREDICTS = 5.0
"""Log-likelihood of recordings left out in turn that every effect must gain, deflated as log Bayes factors
are."""
WORSE = 3.0
"""Log-likelihood of recordings that were not fitted, deflated, that an effect may cost."""
DEARER = 0.05
"""The same as a share of what recordings left out in turn gain: the imperfect form of a strong effect drags
constants along that a recording without it shows."""
KEPT = 0.5
"""Share of the misfit of validation recordings from which they contradict an explanation."""
FAINT = 1.2
"""Reduced chi-square of left-out recordings up to which no effect is believed that ends at a bound."""
LESS = 0.75
"""Reduced chi-square of left-out recordings up to which none is: the base model predicts them better than the
noise would let it."""
CLOSE = 4.0
"""Log Bayes factor within which two explanations are not told apart."""
BEHIND = 0.2, 0.1
"""Share of the best log Bayes factor by which the first and a further effect may be behind: if left-out
recordings refute what explains the fitted ones best, what explains them much worse is no better a guess."""
ENOUGH = 1.25
"""Reduced chi-square at which nothing is left to explain."""


@dataclass
class Stage:
    """One round of the search: the model so far, the screen, and the trials of a further effect.

    Attributes:
        base: the model so far.
        screen: of every effect that it does not have.
        trials: of further effects, strongest evidence first.
        left_out: reduced chi-square of the model so far on fitted recordings left out in turn; NaN if not
            asked.
        chosen: the effect that entered, if one did.
    """

    base: Fit
    screen: Screen
    trials: list[Trial]
    left_out: float = np.nan
    chosen: str | None = None

    @property
    def entered(self) -> Trial | None:
        """The trial of the effect that entered."""
        return next((t for t in self.trials if t.slug == self.chosen), None)


@dataclass
class Explanation:
    """What a campaign says.

    Attributes:
        program: of the final model.
        base: the base model refitted.
        final: the model with the effects that were found.
        stages: of the search.
        p_value, p_is_bound: of the base's misfit by chance.
        tries: models that were fitted to the campaign, those of a first look included.
        together: recordings for validation were fitted, too, because the others name nothing, or something
            that they contradict.
    """

    program: Program
    base: Fit
    final: Fit
    stages: list[Stage]
    p_value: float
    p_is_bound: bool
    together: bool = False

    @property
    def tries(self) -> int:
        """See the class."""
        return self.program.tally[FITS]

    @property
    def leading(self) -> Stage | None:
        """The stage that let the model's first effect in; the first of all where it has none."""
        return next((s for s in self.stages if s.chosen in self.final.slugs), next(iter(self.stages), None))


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
    progress("refitting the base model within its tolerances")
    started, base = settled_fit(program)
    progress(f"screening {len(program.unknowns.slugs)} effects")
    found = screen(Refitter(started), base, program.unknowns.slugs, rng)
    untried = not program.fitted.all()  # recordings for validation have not been fitted
    if untried and found.p_value > LEVEL:
        explanation = _together(started, base, SECOND_LOOK, rng, progress, effort)
        if explanation is not None:
            return explanation
        untried = False
    explanation = _search(started, base, found, rng, progress, effort)
    if untried and _contradicted(explanation):
        again = _together(started, base, LEVEL, rng, progress, effort)
        if again is not None and _score(again, ~program.fitted) < _score(explanation, ~program.fitted):
            return again
    return explanation


def _together(
    program: Program,
    base: Fit,
    level: float,
    rng: np.random.Generator,
    progress: Callable[[str], None],
    effort: int,
) -> Explanation | None:
    """A search on all recordings, those for validation too; None where it finds nothing."""
    progress("looking at the recordings for validation as well")
    whole, fit = settled_fit(replace(program, fitted=np.ones_like(program.fitted)), base.u)
    found = screen(Refitter(whole), fit, program.unknowns.slugs, rng)
    if found.p_value > level:
        return None
    explanation = _search(whole, fit, found, rng, progress, effort)
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


def _search(
    program: Program,
    base: Fit,
    found: Screen,
    rng: np.random.Generator,
    progress: Callable[[str], None],
    effort: int,
) -> Explanation:
    """One effect after the other, from a screened base model."""
    first = Explanation(program, base, base, [], found.p_value, found.p_is_bound)
    current = base
    stage = Stage(base, found, [])
    original = np.nan
    while True:
        first.stages.append(stage)
        if stage.screen.p_value > LEVEL:
            break
        stage.trials = trials_of(program, current, stage.screen, progress, effort)
        current = stage.base = fair(program, current, stage.trials)
        if not current.slugs:
            first.base = first.final = current
        progress("predicting recordings left out in turn")
        best = _choice(program, current, stage, original)
        original = stage.left_out if np.isnan(original) else original
        if best is None:
            break
        stage.chosen = best.slug
        current = best.fit
        if len(current.slugs) > 1:
            current = _pruned(program, _polished(program, current))
            progress("trying rivals of what was found before")
            current = _pruned(program, _exchanged(program, current, first.stages))
        if len(current.slugs) >= MOST_EFFECTS or not _much_left(program, current, base):
            break
        progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        stage = Stage(current, screen(Refitter(program), current, program.unknowns.slugs, rng), [])
    first.final = current
    return first


def _much_left(program: Program, current: Fit, base: Fit) -> bool:
    """Whether a further effect could take away enough to be believed."""
    left = reduced(program, current, program.fitted)
    original = reduced(program, base, program.fitted)
    return left >= ENOUGH and left - 1.0 >= OF_ALL * (original - 1.0)


def _choice(program: Program, current: Fit, stage: Stage, original: float) -> Trial | None:
    """The trial that enters the model, if any may.

    Args:
        program: of the campaign.
        current: model so far.
        stage: with the trials, best first; what is left out is scored as far as it is asked for.
        original: the base model's score on recordings left out; NaN for the first effect.
    """
    first, before = not current.slugs, None
    behind = max(CLOSE, BEHIND[0 if first else 1] * stage.trials[0].bayes) if stage.trials else 0.0
    for trial in stage.trials:
        if trial.bayes < CERTAIN or (not first and trial.stopped):
            continue
        if stage.trials[0].bayes - trial.bayes > behind:
            break
        if before is None:
            before = left_out(program, current)
            stage.left_out = float(before.sum())
        if first and stage.left_out < (FAINT if trial.stopped else LESS):
            continue
        drifting = explained_by_drift(program, current, trial.fit) / inflation_of(program, trial.fit)
        if trial.bayes - drifting < CERTAIN:
            continue
        gained, share = gain(before, left_out(program, trial.fit))
        trial.left_out = stage.left_out - gained
        count = program.observations(program.fitted)
        if 0.5 * count * gained / inflation_of(program, trial.fit) < PREDICTS:
            continue
        if share < (FIRST_SHARE if first else SHARE):
            continue
        if not first and gained < OF_ALL * (original - 1.0):
            continue
        lost = surprise(program, trial.fit, program.unseen) - surprise(program, current, program.unseen)
        if lost / inflation_of(program, trial.fit) > WORSE and lost > DEARER * 0.5 * count * gained:
            continue
        return trial
    return None


def _polished(program: Program, fit: Fit) -> Fit:
    """A chosen model fitted once more: from nominal base constants, too, in case the others held it back."""
    home = fit.u.copy()
    home[program.unknowns.base] = 0.0
    again = lambda start: Refitter(program).fit(fit.slugs, start, POLISHING)  # noqa: E731
    options = side_by_side(again, (fit, home))
    return min([fit, *options], key=lambda f: f.objective)


def _exchanged(program: Program, fit: Fit, stages: list[Stage]) -> Fit:
    """The model with an earlier effect exchanged for a rival that fits clearly better beside the others:
    alone, an effect may have stood for two.

    The stage in which the effect was found is told anew: what it and its rivals are worth beside the others.
    """
    for slug in fit.slugs[:-1]:
        stage = next(s for s in stages if s.chosen == slug)
        rivals = [t for t in stage.trials if t.slug not in fit.slugs and t.bayes > CERTAIN][:RIVALS]
        others = side_by_side(partial(_instead, program, fit, slug), rivals)
        found = {slug: fit} | {rival.slug: other for rival, other in zip(rivals, others, strict=True)}
        best = min(found, key=lambda name: found[name].objective)
        inflation = inflation_of(program, found[best])
        if (fit.objective - found[best].objective) / inflation > CERTAIN:
            entered = stage.entered
            stage.trials = [
                replace(
                    trial,
                    fit=found[trial.slug],
                    bayes=entered.bayes + (fit.objective - found[trial.slug].objective) / inflation,
                    left_out=entered.left_out,
                )
                for trial in stage.trials
                if trial.slug in found
            ]
            stage.trials.sort(key=lambda trial: -trial.bayes)
            stage.chosen, fit = best, found[best]
    return fit


def _instead(program: Program, fit: Fit, slug: str, rival: Trial) -> Fit:
    """A model with a rival in the place of one of its effects."""
    start, old, new = fit.u.copy(), program.unknowns.of([slug]), program.unknowns.of([rival.slug])
    start[old], start[new] = program.unknowns.neutral[old], rival.fit.u[new]
    slugs = tuple(rival.slug if s == slug else s for s in fit.slugs)
    return Refitter(program).fit(slugs, start, POLISHING, fit.evaluation)


def _pruned(program: Program, fit: Fit) -> Fit:
    """Drop effects whose absence costs nothing once the others are there."""
    for slug in fit.slugs[:-1]:
        rest = tuple(s for s in fit.slugs if s != slug)
        start = fit.u.copy()
        own = program.unknowns.of([slug])
        start[own] = program.unknowns.neutral[own]
        without = Refitter(program).fit(rest, start, near=fit.evaluation)
        if (without.objective - fit.objective) / inflation_of(program, fit) < CERTAIN:
            return without
    return fit
