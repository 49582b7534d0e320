"""Effects of a model exchanged for others, or dropped, once further ones are there."""

from dataclasses import replace
from functools import partial

import numpy as np

from .choose import CERTAIN
from .evidence import inflation_of
from .program import Program
from .refit import Fit, Refitter
from .side_by_side import side_by_side
from .stages import Stage
from .trials import Trial

POLISHING = 40
"""Most trial steps of a model that was chosen."""
RIVALS = 3
"""Rivals of an effect that are tried in its place once another one is there."""


def polished(program: Program, fit: Fit) -> Fit:
    """A chosen model fitted once more: from nominal base constants, too, in case the others held it back."""
    home = fit.u.copy()
    home[program.unknowns.base] = 0.0
    again = lambda start: Refitter(program).fit(fit.slugs, start, POLISHING)  # noqa: E731
    options = side_by_side(again, (fit, home))
    return min([fit, *options], key=lambda f: f.objective)


def exchanged(program: Program, fit: Fit, stages: list[Stage]) -> Fit:
    """The model with an earlier effect exchanged for a rival that fits clearly better beside the others:
    alone, an effect may have stood for two.

    The stage in which the effect was found is told anew: what it and its rivals are worth beside the others.
    """
    for slug in fit.slugs[:-1]:
        stage = next(s for s in stages if s.chosen == slug)
        found = _beside(program, fit, stage)
        best = min(found, key=lambda name: found[name].objective)
        inflation = inflation_of(program, found[best])
        if (fit.objective - found[best].objective) / inflation > CERTAIN:
            _retold(stage, found, inflation, best)
            stage.chosen, fit = best, found[best]
    return fit


def retold(program: Program, fit: Fit, stage: Stage) -> None:
    """Tell a stage anew: what its effect and the effect's rivals are worth beside the others of a model."""
    _retold(stage, _beside(program, fit, stage), inflation_of(program, fit), stage.chosen)


def _beside(program: Program, fit: Fit, stage: Stage) -> dict[str, Fit]:
    """A model, and those with a rival in the place of the effect of a stage, by that effect."""
    rivals = [t for t in stage.trials if t.slug not in fit.slugs and t.bayes > CERTAIN][:RIVALS]
    others = side_by_side(partial(_instead, program, fit, stage.chosen), rivals)
    return {stage.chosen: fit} | {t.slug: other for t, other in zip(rivals, others, strict=True)}


def _retold(stage: Stage, found: dict[str, Fit], inflation: float, chosen: str) -> None:
    """Trials beside the others, best first; `chosen` inherits the score on recordings left out."""
    entered = stage.entered
    stage.trials = [
        replace(
            trial,
            fit=found[trial.slug],
            bayes=entered.bayes + (found[entered.slug].objective - found[trial.slug].objective) / inflation,
            left_out=entered.left_out if trial.slug == chosen else np.nan,
        )
        for trial in stage.trials
        if trial.slug in found
    ]
    stage.trials.sort(key=lambda trial: -trial.bayes)


def _instead(program: Program, fit: Fit, slug: str, rival: Trial) -> Fit:
    """A model with a rival in the place of one of its effects."""
    start, old, new = fit.u.copy(), program.unknowns.of([slug]), program.unknowns.of([rival.slug])
    start[old], start[new] = program.unknowns.neutral[old], rival.fit.u[new]
    slugs = tuple(rival.slug if s == slug else s for s in fit.slugs)
    return Refitter(program).fit(slugs, start, POLISHING, fit.evaluation)


def pruned(program: Program, fit: Fit) -> Fit:
    """Drop effects whose absence costs nothing once the others are there."""
    for slug in fit.slugs[:-1]:
        rest = without(program, fit, slug)
        if (rest.objective - fit.objective) / inflation_of(program, fit) < CERTAIN:
            return rest
    return fit


def without(program: Program, fit: Fit, slug: str) -> Fit:
    """A model refitted without one of its effects."""
    start, own = fit.u.copy(), program.unknowns.of([slug])
    start[own] = program.unknowns.neutral[own]
    rest = tuple(s for s in fit.slugs if s != slug)
    return Refitter(program).fit(rest, start, near=fit.evaluation)
